/* Sequences of FMI calls, right and wrong, drawn from bytes: by libFuzzer (-DLIBFUZZER), else from seeds.

   usage: fuzz FIRST_SEED SEQUENCES        prints counts, and one line for each broken law; exit code 1 if there is one

   Laws, besides those of the sanitizers: every call ends, within LIMIT seconds; a status is one of FMI; a step that fails
   leaves the serialised state as it was, unless it says how far it came; a restored state repeats a step bit for bit;
   damaged bytes of a state are refused. */

#include <float.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "faces.h"

#define M (&hfsa_model)
enum { LIMIT = 60, INSTANCES = 3, LONGEST = 48 };

static const unsigned char* input;
static size_t left;
static unsigned long long seed_now, calls, steps, steps_ok, restored, damaged, broken;

/* Bytes */

static unsigned byte(void) {
  if (!left) return 0;
  left--;
  return *input++;
}
static unsigned pick(unsigned n) { return n ? ((byte() << 8) | byte()) % n : 0; }
static int rarely(unsigned n) { return pick(n) == 1; }
static double unit(void) { return pick(65536) / 65536.0; }

static void law(int holds, const char* words) {
  if (holds) return;
  printf("BROKEN seed %llu: %s\n", seed_now, words);
  broken++;
}
static int called(int status) {
  calls++;
  law(status >= 0 && status <= ERROR, "a status is OK, WARNING, DISCARD or ERROR");
  return status;
}
static void endless(int signal_number) {
  (void)signal_number;
  printf("BROKEN seed %llu: a sequence takes more than %d s\n", seed_now, LIMIT);
  fflush(stdout);
  _exit(77);
}

/* Values, from the usual to the absurd */

static double value(void) {
  static const double odd[] = {NAN,     INFINITY, -INFINITY, 0.0,   -0.0, DBL_MAX, -DBL_MAX, DBL_MIN,
                               4.9e-324, 1e308,    -1e300,    1e-300, 1e15, 1e-9,    -1e9,     1.0};
  if (pick(4) == 0) return odd[pick(16)];
  if (pick(8) == 0) return (rarely(2) ? -1 : 1) * pow(10, 600 * (unit() - 0.5));
  return 2 * unit() - 1;
}
static unsigned any_reference(void) {
  if (rarely(40)) return rarely(2) ? (unsigned)M->variable_count + pick(3) : 0xffffffffu - pick(9);
  return pick((unsigned)M->variable_count + 2);
}
static unsigned reference_of(Role role) {
  if (!M->size[role] || rarely(30)) return any_reference();
  int index = (int)pick((unsigned)M->size[role]), first = FIRST_REFERENCE;
  for (int k = 0; k < M->variable_count; k++)
    if (M->variables[k].role == role && M->variables[k].index == index) return (unsigned)(k + first);
  return any_reference();
}

/* Instances */

typedef struct {
  const Api* api;
  Instance* c;
  void* state;
  double start;
} One;
static One ones[INSTANCES];
static Instance* stepping; /* the one in the present DoStep */

static double sample_time(const One* o) { return M->sample_time < 0 ? INFINITY : o->c->p[M->sample_time]; }

/* Few steps per communication step, but for one instance in 200: what is bounded need not be waited for. */
static void limit_work(const One* o) {
  for (int k = 0; k < M->variable_count; k++) {
    if (strcmp(M->variables[k].name, "solver.maximum_steps") != 0 || rarely(200)) continue;
    unsigned reference = (unsigned)(k + FIRST_REFERENCE);
    double most = 1 + pick(rarely(10) ? 3000 : 60);
    called(o->api->set(o->c, &reference, 1, &most));
  }
}
static void set_some(const One* o, Role role, int tame) {
  unsigned n = pick(8), references[8];
  double values[8];
  for (unsigned k = 0; k < n; k++) {
    references[k] = reference_of(role);
    unsigned at = references[k] - FIRST_REFERENCE;
    values[k] = !tame || rarely(12) || at >= (unsigned)M->variable_count ? value()
                                                                         : M->variables[at].start * (0.5 + unit());
  }
  called(o->api->set(o->c, references, n, values));
}
static void begin(One* o) {
  static const double starts[] = {0.0, 0.0, 0.0, -5.0, 1e6, 1e300};
  o->start = rarely(30) ? value() : starts[pick(6)];
  if (!rarely(30)) limit_work(o);
  if (rarely(3)) set_some(o, ROLE_PARAMETER, 1);
  called(o->api->initialize(o->c, o->start));
}

/* An importer of FMI 3 that is told of points inside a step: it reads, tries what it must not, and may end the step. */
static void told(fmi3InstanceEnvironment e, fmi3Float64 t, fmi3Boolean set, fmi3Boolean get, fmi3Boolean finished,
                 fmi3Boolean can_end, fmi3Boolean* end, fmi3Float64* end_time) {
  unsigned references[2] = {any_reference(), reference_of(ROLE_OUTPUT)};
  double values[2] = {0.0, 1.0};
  (void)e, (void)set, (void)get, (void)finished, (void)can_end;
  called(fmi3GetFloat64(stepping, references, 2, values, 2));
  if (rarely(9)) called(fmi3SetFloat64(stepping, references, 2, values, 2));
  *end = rarely(4);
  *end_time = t;
}
static void create(One* o) {
  o->api = &apis[pick(2)];
  if (o->api != apis && rarely(4))
    o->c = fmi3InstantiateCoSimulation("it", M->token, "", 0, 1, 0, rarely(2), NULL, 0, NULL, log3, told);
  else
    o->c = o->api->create((Interface)pick(2), rarely(60) ? "another" : M->token);
  if (o->c && !rarely(20)) begin(o);
}
static void destroy(One* o) {
  if (o->c && o->state) called(o->api->free_state(o->c, &o->state));
  if (o->c) o->api->destroy(o->c);
  memset(o, 0, sizeof *o);
}

/* States */

static size_t bytes_of(const One* o, char** bytes) {
  void* state = NULL;
  size_t size = 0;
  *bytes = NULL;
  if (o->api->get_state(o->c, &state) || o->api->size(o->c, state, &size)) return 0;
  *bytes = malloc(size);
  law(*bytes && o->api->serialize(o->c, state, *bytes, size) == OK, "a state is serialised");
  o->api->free_state(o->c, &state);
  return size;
}
static void damage(const One* o) {
  char *bytes, *whole;
  void* state = NULL;
  size_t size = bytes_of(o, &bytes), same = bytes_of(o, &whole), cut = rarely(8) ? pick((unsigned)size) : size;
  unsigned flips = 1 + pick(3), at = pick((unsigned)size);
  for (unsigned k = 0; k < flips; k++) bytes[(at + k * 7) % size] ^= (char)(1 + pick(255));
  if (pick(4) == 0 && size > 8) {
    double forged = value();
    memcpy(bytes + 8 * pick((unsigned)size / 8), &forged, 8);
  }
  /* a forged number may be the old one */
  int is_as_before = cut == size && same == size && memcmp(bytes, whole, size) == 0;
  int status = called(o->api->deserialize(o->c, bytes, cut, &state));
  law(is_as_before || (status == ERROR && !state), "damaged bytes of a state are refused");
  if (state) o->api->free_state(o->c, &state);
  damaged++;
  free(bytes);
  free(whole);
}
static void carry(One* from, One* to) {
  char* bytes;
  size_t size = bytes_of(from, &bytes);
  if (!called(to->api->deserialize(to->c, bytes, size, &to->state))) called(to->api->set_state(to->c, to->state));
  free(bytes);
}

/* Steps */

static double step_size(const One* o) {
  double h = rarely(25) ? value() : pow(10, -5 + 3 * unit());
  if (rarely(20)) h = 1e3 * unit();
  double ticks = h / sample_time(o);
  return ticks > 2e3 && pick(20000) ? 2e3 * sample_time(o) * unit() : h;
}
static void step(One* o) {
  char *before = NULL, *after = NULL, *again = NULL;
  double t = rarely(40) ? value() : o->c->state->time, h = step_size(o);
  size_t size = rarely(8) ? bytes_of(o, &before) : 0;
  stepping = o->c;
  int status = called(o->api->step(o->c, t, h));
  steps++;
  steps_ok += status == OK;
  if (size && o->c->state->time == t && status) {
    bytes_of(o, &after);
    law(memcmp(before, after, size) == 0, "a failed step leaves the state");
  } else if (size && !status && !o->c->listener.tell) {
    void* state = NULL;
    bytes_of(o, &after);
    if (o->api->deserialize(o->c, before, size, &state) == OK && o->api->set_state(o->c, state) == OK) {
      law(o->api->step(o->c, t, h) == OK, "a restored step repeats its status");
      law(bytes_of(o, &again) == size && memcmp(after, again, size) == 0, "a restored state repeats bit for bit");
      restored++;
    }
    if (state) o->api->free_state(o->c, &state);
  }
  free(before);
  free(after);
  free(again);
}

/* Calls of one version that the table of both lacks */

static void others2(Instance* c) {
  unsigned r[3] = {any_reference(), any_reference(), reference_of(ROLE_INPUT)};
  int whole[3], orders[3] = {1, 2, (int)byte() - 3};
  double v[3] = {value(), value(), value()};
  const char *text[3] = {"", "", ""}, *kinds[2] = {"logStatusError", rarely(2) ? "logStatusDiscard" : "nothing"};
  fmi2Status status;
  switch (pick(6)) {
    case 0: called(fmi2GetString(c, r, 3, text)); called(fmi2SetString(c, r, 3, text)); break;
    case 1: called(fmi2GetInteger(c, r, 3, whole)); called(fmi2SetBoolean(c, r, 0, whole)); break;
    case 2: r[0] = r[1] = r[2]; called(fmi2SetRealInputDerivatives(c, r, 3, orders, v)); break;
    case 3: called(fmi2SetDebugLogging(c, (int)pick(2), pick(3), kinds)); break;
    case 4: called(fmi2GetRealStatus(c, (fmi2StatusKind)pick(4), v)); called(fmi2GetStatus(c, fmi2DoStepStatus, &status)); break;
    default: called(fmi2CancelStep(c)); called(fmi2GetIntegerStatus(c, fmi2Terminated, whole));
  }
}
static void others3(Instance* c) {
  unsigned r[3] = {any_reference(), any_reference(), reference_of(ROLE_INPUT_DERIVATIVE)};
  double v[6] = {value(), value(), value()}, out[3] = {0};
  const char *text[3] = {"", "", ""}, *kinds[2] = {"logStatusError", rarely(2) ? "logStatusDiscard" : "nothing"};
  bool flags[4];
  size_t n = 0;
  switch (pick(6)) {
    case 0: called(fmi3GetString(c, r, 3, text, 3)); called(fmi3SetString(c, r, 3, text, pick(4))); break;
    case 1: called(fmi3GetBoolean(c, r, 3, flags, 3)); called(fmi3GetNumberOfVariableDependencies(c, r[0], &n)); break;
    case 2: called(fmi3SetFloat64(c, r + 2, 1, v, 1 + rarely(9))); break;
    case 3: called(fmi3SetDebugLogging(c, rarely(2), pick(3), kinds)); break;
    case 4: r[0] = reference_of(ROLE_OUTPUT); r[1] = reference_of(ROLE_STATE);
      called(fmi3GetAdjointDerivative(c, r, 1, r + 1, 1, v, 1, out, 1)); break;
    default: c->may_return_early = (int)pick(2); called(fmi3EnterConfigurationMode(c)); called(fmi3EnterStepMode(c));
  }
}

static void evaluate(One* o) {
  unsigned n = pick(6), unknowns[6], knowns[6];
  double seed[6], result[6];
  int orders[6];
  for (unsigned k = 0; k < n; k++) {
    unknowns[k] = reference_of(rarely(3) ? ROLE_DERIVATIVE : ROLE_OUTPUT);
    knowns[k] = reference_of(rarely(2) ? ROLE_STATE : ROLE_INPUT);
    seed[k] = value();
    orders[k] = rarely(9) ? (int)byte() : 1;
  }
  if (rarely(2)) called(o->api->directional(o->c, unknowns, n, knowns, n, seed, result));
  else called(o->api->output_derivatives(o->c, unknowns, n, orders, result));
}
static void exchange_model(One* o) {
  size_t n = (size_t)M->size[ROLE_STATE];
  double* x = malloc((n + 1) * sizeof *x);
  double now = o->c->state->time, t = rarely(9) ? value() : now + 1e-3 * unit();
  for (size_t k = 0; k < n + 1; k++) x[k] = value();
  if (!(fabs(t - now) / sample_time(o) < 2e3) && pick(20000)) t = now;
  switch (pick(6)) {
    case 0: called(o->api->update(o->c)); break;
    case 1: called(o->api->continuous(o->c)); break;
    case 2: called(o->api->event(o->c)); break;
    case 3: called(o->api->set_time(o->c, t)); break;
    case 4: called(o->api->set_states(o->c, x, n + rarely(9))); break;
    default: called(o->api->derivatives(o->c, x, n)); called(o->api->nominals(o->c, x, n));
  }
  free(x);
}

static void call_one(void) {
  One *o = &ones[pick(INSTANCES)], *other = &ones[pick(INSTANCES)];
  unsigned references[4] = {any_reference(), reference_of(ROLE_OUTPUT), reference_of(ROLE_NEXT), any_reference()};
  double values[4];
  if (!o->c) { create(o); return; }
  switch (pick(18)) {
    case 0: case 1: case 2: case 3: case 4: step(o); break;
    case 5: case 6: called(o->api->get(o->c, references, pick(5), values)); break;
    case 7: set_some(o, ROLE_INPUT, 0); break;
    case 8: set_some(o, ROLE_PARAMETER, 1); break;
    case 9: called(o->api->get_state(o->c, &o->state)); break;
    case 10: if (o->state) called(o->api->set_state(o->c, o->state)); break;
    case 11: damage(o); break;
    case 12: if (other->c) carry(o, other); break;
    case 13: evaluate(o); break;
    case 14: exchange_model(o); break;
    case 15: (o->api == apis ? others2 : others3)(o->c); break;
    case 16: if (rarely(3)) called(o->api->terminate(o->c)); else if (rarely(2)) { called(o->api->reset(o->c)); begin(o); } break;
    default: if (rarely(3)) destroy(o);
  }
}

int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  input = data;
  left = size;
  while (left) call_one();
  for (int k = 0; k < INSTANCES; k++) destroy(&ones[k]);
  return broken != 0 ? -1 : 0;
}

#ifndef LIBFUZZER
static unsigned long long random_state;
static unsigned char next_random(void) {
  random_state += 0x9e3779b97f4a7c15u;
  unsigned long long z = random_state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return (unsigned char)(z >> 56);
}

int main(int count, char** words) {
  unsigned long long first = count > 1 ? strtoull(words[1], NULL, 10) : 0, n = count > 2 ? strtoull(words[2], NULL, 10) : 1;
  unsigned char data[64 * LONGEST];
  signal(SIGALRM, endless);
  for (seed_now = first; seed_now < first + n; seed_now++) {
    random_state = seed_now;
    size_t size = 16u * (4u + next_random() % (4 * LONGEST - 4));
    for (size_t k = 0; k < size; k++) data[k] = next_random();
    alarm(LIMIT);
    LLVMFuzzerTestOneInput(data, size);
  }
  alarm(0);
  printf("%s: %llu sequences, %llu calls, %llu steps (%llu ok), %llu repeated, %llu damaged states, %llu broken laws\n",
         M->name, n, calls, steps, steps_ok, restored, damaged, broken);
  return broken != 0;
}
#endif
