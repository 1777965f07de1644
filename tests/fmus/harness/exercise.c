/* Every function of both versions, linked with one model's sources, so that sanitizers see all of it.

   Usage: exercise. Prints what failed and returns 1, or prints the number of checks. The model's own table tells which
   variables there are, so the same program serves every model. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "faces.h"

#define M (&hfsa_model)
#define MAX 256
#define CHECK(condition)                                            \
  do {                                                              \
    checks++;                                                       \
    if (!(condition)) {                                             \
      printf("%s, line %d: %s\n", api->name, __LINE__, #condition); \
      failures++;                                                   \
    }                                                               \
  } while (0)

static int checks, failures;

/* Value references by role */

static unsigned references[ROLES][MAX];

static void find_references(void) {
  for (int i = 0; i < M->variable_count; i++) references[M->variables[i].role][M->variables[i].index] = (unsigned)i + 1;
}

static size_t count_of(Role role) { return (size_t)M->size[role]; }

/* All that can be seen of an instance, inputs driven to be different at each step. */
static size_t see(const Api* api, void* c, double* seen) {
  static const Role roles[] = {ROLE_TIME,   ROLE_STATE,    ROLE_DERIVATIVE,     ROLE_SAMPLED_STATE,
                               ROLE_NEXT,   ROLE_OUTPUT,   ROLE_SAMPLED_OUTPUT, ROLE_PARAMETER,
                               ROLE_SOLVER, ROLE_CONSTANT, ROLE_INPUT};
  size_t n = 0;
  for (size_t r = 0; r < sizeof roles / sizeof *roles; r++) {
    CHECK(api->get(c, references[roles[r]], count_of(roles[r]), seen + n) == 0);
    n += count_of(roles[r]);
  }
  return n;
}

static void drive(const Api* api, void* c, int first, int last, double phase) {
  double u[MAX];
  for (int k = first; k < last; k++) {
    for (size_t i = 0; i < count_of(ROLE_INPUT); i++) u[i] = 2.0 + sin(0.3 * k + phase + (double)i);
    CHECK(api->set(c, references[ROLE_INPUT], count_of(ROLE_INPUT), u) == 0);
    CHECK(api->step(c, k * 7e-4, 7e-4) == 0);
  }
}

/* Several instances, rollback, serialisation into another, reset: each must give the same numbers bit for bit. */
static void exercise_states(const Api* api) {
  void* c[3];
  double first[MAX], again[MAX];
  for (int i = 0; i < 3; i++) {
    c[i] = api->create(BY_CO_SIMULATION, M->token);
    CHECK(c[i] && api->initialize(c[i], 0.0) == 0);
  }
  for (int k = 0; k < 10; k++)
    for (int i = 0; i < 2; i++) drive(api, c[i], k, k + 1, i);
  void* state = NULL;
  CHECK(api->get_state(c[0], &state) == 0);
  drive(api, c[0], 10, 30, 0.0);
  size_t n = see(api, c[0], first);
  CHECK(api->set_state(c[0], state) == 0);
  drive(api, c[0], 10, 30, 0.0);
  CHECK(see(api, c[0], again) == n && memcmp(first, again, n * sizeof(double)) == 0);

  size_t size = 0;
  CHECK(api->size(c[0], state, &size) == 0 && size > 0);
  char* bytes = malloc(size);
  CHECK(api->serialize(c[0], state, bytes, size) == 0);
  CHECK(api->serialize(c[0], state, bytes, size - 1) == ERROR);
  void* received = NULL;
  CHECK(api->deserialize(c[1], bytes, size - 1, &received) == ERROR && received == NULL);
  CHECK(api->deserialize(c[1], bytes, size, &received) == 0);
  CHECK(api->deserialize(c[1], bytes, size, &received) == 0);
  CHECK(api->set_state(c[1], received) == 0);
  drive(api, c[1], 10, 30, 0.0);
  CHECK(see(api, c[1], again) == n && memcmp(first, again, n * sizeof(double)) == 0);
  bytes[0] ^= 1;
  CHECK(api->deserialize(c[1], bytes, size, &received) == ERROR);
  CHECK(api->get_state(c[1], &received) == 0);
  CHECK(api->free_state(c[1], &received) == 0 && received == NULL);
  CHECK(api->free_state(c[1], &received) == 0 && api->free_state(c[1], NULL) == 0);
  CHECK(api->set_state(c[1], NULL) == ERROR && api->get_state(c[1], NULL) == ERROR);
  free(bytes);

  CHECK(api->terminate(c[0]) == 0 && api->reset(c[0]) == 0 && api->initialize(c[0], 0.0) == 0);
  drive(api, c[0], 0, 30, 0.0);
  CHECK(see(api, c[0], again) == n && memcmp(first, again, n * sizeof(double)) == 0);
  CHECK(api->free_state(c[0], &state) == 0);
  for (int i = 0; i < 3; i++) api->destroy(c[i]);
}

static const Role known_roles[] = {ROLE_TIME, ROLE_STATE, ROLE_SAMPLED_STATE, ROLE_INPUT, ROLE_PARAMETER};
static const Role unknown_roles[] = {ROLE_DERIVATIVE, ROLE_OUTPUT, ROLE_NEXT, ROLE_SAMPLED_OUTPUT};

static size_t gather(const Role* roles, size_t n_roles, unsigned* found) {
  size_t n = 0;
  for (size_t r = 0; r < n_roles; r++)
    for (size_t i = 0; i < count_of(roles[r]); i++) found[n++] = references[roles[r]][i];
  return n;
}

/* An instance at a point: start time, then every other known. */
static void* at_point(const Api* api, Interface interface, const unsigned* knowns, size_t nk, const double* point) {
  void* c = api->create(interface, M->token);
  CHECK(api->set(c, knowns + 1, nk - 1, point + 1) == 0 && api->initialize(c, point[0]) == 0);
  return c;
}

/* Every unknown at a point; sampled outputs as the tick there gives them. */
static void values_at(const Api* api, Interface interface, const unsigned* knowns, size_t nk, const double* point,
                      const unsigned* unknowns, size_t nu, double* values) {
  size_t held = count_of(ROLE_SAMPLED_OUTPUT);
  void* c = at_point(api, interface, knowns, nk, point);
  CHECK(api->get(c, unknowns, nu - held, values) == 0);
  CHECK((interface == BY_CO_SIMULATION ? api->step(c, point[0], 1e-9) : api->update(c)) == 0);
  CHECK(api->get(c, unknowns + nu - held, held, values + nu - held) == 0);
  api->destroy(c);
}

/* Forward derivatives equal central differences, known by known; in FMI 3 the adjoint is the transpose. */
static void exercise_derivatives(const Api* api, Interface interface) {
  unsigned knowns[MAX], unknowns[MAX], outside = (unsigned)M->variable_count + 1;
  size_t nk = gather(known_roles, 5, knowns), nu = gather(unknown_roles, 4, unknowns);
  double point[MAX], forward[MAX], backward[MAX], ahead[MAX], behind[MAX], one = 1.0;
  for (size_t k = 0; k < nk; k++) {
    const Variable* v = &M->variables[knowns[k] - 1];
    point[k] = v->role == ROLE_TIME ? 0.6 : v->role == ROLE_INPUT ? 1.5 + (double)k : v->start + 0.1 * v->nominal;
  }
  void* c = at_point(api, interface, knowns, nk, point);
  for (size_t k = 0; k < nk; k++) {
    CHECK(api->directional(c, unknowns, nu, knowns + k, 1, &one, forward) == 0);
    double value = point[k], h = 1e-5 * fabs(value) + (value == 0.0) * 1e-5;
    point[k] = value + h;
    values_at(api, interface, knowns, nk, point, unknowns, nu, ahead);
    point[k] = value - h;
    values_at(api, interface, knowns, nk, point, unknowns, nu, behind);
    point[k] = value;
    for (size_t i = 0; i < nu; i++)
      CHECK(fabs(forward[i] - (ahead[i] - behind[i]) / (2.0 * h)) <= 1e-5 * (1.0 + fabs(forward[i]) + fabs(ahead[i])));
    for (size_t i = 0; i < nu && api == &apis[1]; i++) {
      CHECK(fmi3GetAdjointDerivative(c, unknowns + i, 1, knowns, nk, &one, 1, backward, nk) == fmi3OK);
      CHECK(fabs(backward[k] - forward[i]) <= 1e-12 * (1.0 + fabs(forward[i])));
    }
  }
  CHECK(api->directional(c, &outside, 1, knowns, 1, &one, forward) == ERROR);
  CHECK(api->directional(c, unknowns, nu, &outside, 1, &one, forward) == ERROR);
  if (api == &apis[1])
    CHECK(fmi3GetAdjointDerivative(c, unknowns, nu, knowns, nk, &one, nu + 1, backward, nk) == fmi3Error);
  api->destroy(c);
}

/* Set derivatives of all inputs as they are `time` behind the point where they were 3, 2 ...; the second is 500. */
static void move(const Api* api, void* c, double time) {
  int orders[MAX];
  unsigned inputs[MAX];
  double rates[MAX];
  size_t n = count_of(ROLE_INPUT);
  for (size_t i = 0; i < 2 * n; i++) {
    inputs[i] = references[ROLE_INPUT][i % n];
    orders[i] = i < n ? 1 : 2;
    rates[i] = i < n ? 3.0 - (double)i + 500.0 * time : 500.0;
  }
  if (api == &apis[0])
    CHECK(fmi2SetRealInputDerivatives(c, inputs, 2 * n, orders, rates) == fmi2OK);
  else
    CHECK(api->set(c, references[ROLE_INPUT_DERIVATIVE], 2 * n, rates) == 0);
}

/* Steps of different sizes, with moving inputs: one step equals its parts. */
static void exercise_steps(const Api* api) {
  static const double parts[3][3] = {{5.3e-3, 0.0, 0.0}, {1.1e-3, 4.2e-3, 0.0}, {2e-3, 2.5e-3, 8e-4}};
  double seen[3][MAX];
  size_t n = 0;
  for (int trial = 0; trial < 3; trial++) {
    void* c = api->create(BY_CO_SIMULATION, M->token);
    CHECK(api->initialize(c, 0.0) == 0);
    drive(api, c, 0, 1, 0.0);
    double time = 7e-4;
    for (int k = 0; k < 3 && parts[trial][k] > 0.0; k++) {
      move(api, c, time - 7e-4);
      CHECK(api->step(c, time, parts[trial][k]) == 0);
      time += parts[trial][k];
    }
    n = see(api, c, seen[trial]);
    api->destroy(c);
  }
  for (size_t i = 0; i < n; i++)
    for (int trial = 1; trial < 3; trial++) CHECK(fabs(seen[trial][i] - seen[0][i]) <= 1e-6 * (1.0 + fabs(seen[0][i])));
}

/* An importer that listens: it reads all at each point inside a step, can do nothing else, and may end each step. */
typedef struct {
  void* c;
  int calls, may_end, ends;
} Listening;

static void listen(fmi3InstanceEnvironment environment, fmi3Float64 time, fmi3Boolean can_set, fmi3Boolean can_get,
                   fmi3Boolean finished, fmi3Boolean may_end, fmi3Boolean* end, fmi3Float64* end_time) {
  const Api* api = &apis[1];
  Listening* l = environment;
  double seen[MAX], now = -1.0;
  fmi3Boolean event, terminate, early;
  l->calls++;
  CHECK(can_get && finished && !can_set && may_end == (l->may_end != 0) && *end_time == time);
  CHECK(fmi3GetFloat64(l->c, references[ROLE_TIME], 1, &now, 1) == fmi3OK && now == time);
  see(api, l->c, seen);
  CHECK(fmi3DoStep(l->c, time, 1e-4, 0, &event, &terminate, &early, &now) == fmi3Error);
  if (count_of(ROLE_INPUT)) CHECK(fmi3SetFloat64(l->c, references[ROLE_INPUT], 1, seen, 1) == fmi3Error);
  *end = l->ends != 0;
}

/* A step that is ended at each point inside of it leads to where it leads as a whole. */
static void exercise_intermediate_update(void) {
  const Api* api = &apis[1];
  double seen[3][MAX];
  int calls[3] = {0, 0, 0};
  size_t n = 0;
  for (int trial = 0; trial < 3; trial++) {
    Listening l = {NULL, 0, trial == 2, 0};
    l.c = fmi3InstantiateCoSimulation("it", M->token, "", 0, 1, 0, trial == 2, NULL, 0, &l, log3, trial ? listen : NULL);
    CHECK(api->initialize(l.c, 0.0) == 0);
    drive(api, l.c, 0, 1, 0.0);
    double time = 7e-4, end = 7e-4 + 5.3e-3;
    l.ends = l.may_end;
    for (int k = 0; k < 100000 && time < end * (1.0 - 1e-12); k++) {
      fmi3Boolean event, terminate, early;
      int before = l.calls;
      move(api, l.c, time - 7e-4);
      CHECK(fmi3DoStep(l.c, time, end - time, 0, &event, &terminate, &early, &time) == fmi3OK);
      CHECK(early == (trial == 2 && l.calls > before));
    }
    n = see(api, l.c, seen[trial]);
    calls[trial] = l.calls;
    api->destroy(l.c);
  }
  CHECK(calls[0] == 0 && (calls[1] > 0) == (calls[2] > 0));
  for (size_t i = 0; i < n; i++) {
    CHECK(seen[1][i] == seen[0][i]);
    CHECK(fabs(seen[2][i] - seen[0][i]) <= 1e-6 * (1.0 + fabs(seen[0][i])));
  }
}

/* The time derivative of each output equals its difference quotient; what has none is refused. */
static void exercise_output_derivatives(const Api* api) {
  const double step = 1e-8;
  double rates[MAX], before[MAX], after[MAX], one = 1.0;
  int orders[MAX], two = 2, three = 3;
  size_t n = count_of(ROLE_OUTPUT), n_held = count_of(ROLE_SAMPLED_OUTPUT);
  for (int i = 0; i < MAX; i++) orders[i] = 1;
  void* c = api->create(BY_CO_SIMULATION, M->token);
  CHECK(api->initialize(c, 0.0) == 0);
  drive(api, c, 0, 5, 0.0);
  move(api, c, 0.0);
  CHECK(api->output_derivatives(c, references[ROLE_OUTPUT], n, orders, rates) == 0);
  CHECK(api->get(c, references[ROLE_OUTPUT], n, before) == 0 && api->step(c, 5 * 7e-4, step) == 0);
  CHECK(api->get(c, references[ROLE_OUTPUT], n, after) == 0);
  for (size_t i = 0; i < n; i++)
    CHECK(fabs(rates[i] - (after[i] - before[i]) / step) <= 1e-3 * (1.0 + fabs(rates[i]) + fabs(after[i])));
  CHECK(api->output_derivatives(c, references[ROLE_SAMPLED_OUTPUT], n_held, orders, rates) == 0);
  for (size_t i = 0; i < n_held; i++) CHECK(rates[i] == 0.0);
  CHECK(api->output_derivatives(c, references[ROLE_OUTPUT], 1, &two, rates) == ERROR);
  CHECK(api->output_derivatives(c, references[ROLE_TIME], 1, orders, rates) == ERROR);
  if (api == &apis[0]) CHECK(fmi2SetRealInputDerivatives(c, references[ROLE_TIME], 1, orders, &one) == fmi2Error);
  if (api == &apis[0]) CHECK(fmi2SetRealInputDerivatives(c, references[ROLE_INPUT], 1, &three, &one) == fmi2Error);
  api->destroy(c);
}

/* Model Exchange: continuous time, events, and Euler steps of ours. */
static void exercise_model_exchange(const Api* api) {
  double x[MAX], der[MAX], u[MAX], seen[MAX];
  size_t n = count_of(ROLE_STATE);
  void* c = api->create(BY_MODEL_EXCHANGE, M->token);
  for (size_t i = 0; i < count_of(ROLE_INPUT); i++) u[i] = 1.0;
  CHECK(api->set(c, references[ROLE_INPUT], count_of(ROLE_INPUT), u) == 0);
  CHECK(api->initialize(c, 0.0) == 0 && api->step(c, 0.0, 1e-3) == ERROR);
  CHECK(api->update(c) == 0 && api->continuous(c) == 0);
  CHECK(api->get_states(c, x, n) == 0 && api->nominals(c, der, n) == 0);
  for (int k = 0; k < 20; k++) {
    CHECK(api->set_time(c, k * 1e-3) == 0 && api->set_states(c, x, n) == 0 && api->derivatives(c, der, n) == 0);
    for (size_t i = 0; i < n; i++) x[i] += 1e-3 * der[i];
    CHECK(api->event(c) == 0 && api->update(c) == 0 && api->continuous(c) == 0);
    see(api, c, seen);
  }
  CHECK(api->set_states(c, x, n + 1) == ERROR && api->set_time(c, NAN) == ERROR);
  CHECK(api->terminate(c) == 0 && api->set_time(c, 1.0) == ERROR);
  api->destroy(c);
}

/* What must be refused: null pointers, foreign tokens, unknown references, wrong modes, values that are no numbers. */
static void exercise_errors(const Api* api) {
  double value = 0.0, not_a_number = NAN;
  unsigned outside[] = {(unsigned)M->variable_count + 1, 0xFFFFFFFFu, 0};
  int heard = messages;
  CHECK(api->create(BY_CO_SIMULATION, "foreign") == NULL && api->create(BY_MODEL_EXCHANGE, NULL) == NULL);
  CHECK(messages == heard + 2);
  CHECK(api->get(NULL, outside, 1, &value) == ERROR && api->set(NULL, outside, 1, &value) == ERROR);
  CHECK(api->step(NULL, 0.0, 1.0) == ERROR && api->reset(NULL) == ERROR && api->terminate(NULL) == ERROR);
  CHECK(api->derivatives(NULL, &value, 0) & ERROR);
  void* c = api->create(BY_CO_SIMULATION, M->token);
  CHECK(api->get(c, outside, 1, &value) == ERROR && api->get(c, outside + 1, 1, &value) == ERROR);
  CHECK(api->set(c, outside, 1, &value) == ERROR && api->set(c, references[ROLE_TIME], 1, &value) == ERROR);
  CHECK(api->step(c, 0.0, 1e-3) == ERROR && api->terminate(c) == ERROR && api->update(c) & ERROR);
  if (count_of(ROLE_OUTPUT)) CHECK(api->set(c, references[ROLE_OUTPUT], 1, &value) == ERROR);
  if (count_of(ROLE_PARAMETER)) CHECK(api->set(c, references[ROLE_PARAMETER], 1, &not_a_number) == ERROR);
  CHECK(api->initialize(c, 0.0) == 0 && api->initialize(c, 0.0) & ERROR);
  drive(api, c, 0, 3, 0.0);
  CHECK(api->step(c, 3 * 7e-4, 0.0) == ERROR && api->step(c, 3 * 7e-4, NAN) == ERROR &&
        api->step(c, 7.0, 1.0) == ERROR);
  if (count_of(ROLE_INPUT)) {
    double before[MAX], after[MAX];
    CHECK(api->set(c, references[ROLE_INPUT], 1, &not_a_number) == 0);
    CHECK(api->get(c, references[ROLE_STATE], count_of(ROLE_STATE), before) == 0);
    heard = messages;
    CHECK(api->step(c, 3 * 7e-4, 7e-4) == ERROR && messages == heard + 1);
    CHECK(api->get(c, references[ROLE_STATE], count_of(ROLE_STATE), after) == 0);
    CHECK(memcmp(before, after, count_of(ROLE_STATE) * sizeof(double)) == 0);
    drive(api, c, 3, 6, 0.0);
  }
  api->destroy(c);
}

/* Strings, and calls about types and features that no model of ours has. */
static void exercise_the_rest(void) {
  const Api* api = &apis[0];
  const fmi2String two_categories[] = {"logStatusError", "logStatusDiscard"}, noise[] = {"noise"};
  const char* text = NULL;
  unsigned vr = 0;
  void* c = create2(BY_CO_SIMULATION, M->token);
  CHECK(fmi2SetDebugLogging(c, 1, 2, two_categories) == fmi2OK && fmi2SetDebugLogging(c, 1, 1, noise) == fmi2Error);
  CHECK(strcmp(fmi2GetVersion(), "2.0") == 0 && strlen(fmi2GetTypesPlatform()) > 0);
  CHECK(fmi2GetString(c, references[ROLE_TEXT], count_of(ROLE_TEXT), &text) == fmi2OK || count_of(ROLE_TEXT) > 1);
  CHECK(fmi2GetString(c, &vr, 1, &text) == fmi2Error && fmi2SetString(c, &vr, 1, &text) == fmi2Error);
  CHECK(fmi2GetInteger(c, &vr, 0, NULL) == fmi2OK && fmi2GetInteger(c, &vr, 1, NULL) == fmi2Error);
  CHECK(fmi2SetInteger(c, &vr, 1, NULL) == fmi2Error && fmi2SetBoolean(c, &vr, 1, NULL) == fmi2Error);
  CHECK(fmi2GetBoolean(c, &vr, 1, NULL) == fmi2Error && fmi2CancelStep(c) == fmi2Error);
  fmi2Status status;
  fmi2Boolean flag = fmi2True;
  fmi2Real last = -1.0;
  fmi2Integer integer;
  CHECK(fmi2GetStatus(c, fmi2DoStepStatus, &status) == fmi2Discard);
  CHECK(fmi2GetBooleanStatus(c, fmi2Terminated, &flag) == fmi2OK && !flag);
  CHECK(fmi2GetRealStatus(c, fmi2LastSuccessfulTime, &last) == fmi2OK && last == 0.0);
  CHECK(fmi2GetIntegerStatus(c, fmi2DoStepStatus, &integer) == fmi2Discard);
  CHECK(fmi2GetStringStatus(c, fmi2PendingStatus, &text) == fmi2OK && *text == 0);
  fmi2FreeInstance(c);
  fmi2FreeInstance(NULL);
  void* silent = fmi2Instantiate("silent", fmi2CoSimulation, M->token, NULL, NULL, 0, 1);
  CHECK(silent && fmi2SetReal(silent, &vr, 1, &last) == fmi2Error);
  fmi2FreeInstance(silent);

  api = &apis[1];
  c = create3(BY_CO_SIMULATION, M->token);
  CHECK(strcmp(fmi3GetVersion(), "3.0") == 0);
  CHECK(fmi3InstantiateCoSimulation("it", M->token, "", 0, 1, 1, 0, NULL, 0, NULL, log3, NULL) == NULL);
  CHECK(fmi3InstantiateCoSimulation("it", M->token, "", 0, 1, 0, 0, &vr, 1, NULL, log3, NULL) == NULL);
  CHECK(fmi3InstantiateScheduledExecution("it", M->token, "", 0, 1, NULL, log3, NULL, NULL, NULL) == NULL);
  CHECK(fmi3SetDebugLogging(c, 1, 2, two_categories) == fmi3OK && fmi3SetDebugLogging(c, 1, 1, noise) == fmi3Error);
#define REFUSED(Type)                                                                                   \
  CHECK(fmi3Get##Type(c, &vr, 0, NULL, 0) == fmi3OK && fmi3Get##Type(c, &vr, 1, NULL, 1) == fmi3Error); \
  CHECK(fmi3Set##Type(c, &vr, 1, NULL, 1) == fmi3Error)
  REFUSED(Float32);
  REFUSED(Int8);
  REFUSED(UInt8);
  REFUSED(Int16);
  REFUSED(UInt16);
  REFUSED(Int32);
  REFUSED(UInt32);
  REFUSED(Int64);
  REFUSED(UInt64);
  REFUSED(Boolean);
  CHECK(fmi3GetString(c, &vr, 1, &text, 1) == fmi3Error && fmi3SetString(c, &vr, 1, &text, 1) == fmi3Error);
  CHECK(fmi3GetBinary(c, &vr, 1, NULL, NULL, 1) == fmi3Error && fmi3SetBinary(c, &vr, 1, NULL, NULL, 1) == fmi3Error);
  CHECK(fmi3GetClock(c, &vr, 1, NULL) == fmi3Error && fmi3SetClock(c, &vr, 1, NULL) == fmi3Error);
  CHECK(fmi3GetIntervalDecimal(c, &vr, 1, NULL, NULL) == fmi3Error &&
        fmi3SetIntervalDecimal(c, &vr, 1, NULL) == fmi3Error);
  CHECK(fmi3GetIntervalFraction(c, &vr, 1, NULL, NULL, NULL) == fmi3Error);
  CHECK(fmi3SetIntervalFraction(c, &vr, 1, NULL, NULL) == fmi3Error &&
        fmi3GetShiftDecimal(c, &vr, 1, NULL) == fmi3Error);
  CHECK(fmi3GetShiftFraction(c, &vr, 1, NULL, NULL) == fmi3Error && fmi3SetShiftDecimal(c, &vr, 1, NULL) == fmi3Error);
  CHECK(fmi3SetShiftFraction(c, &vr, 1, NULL, NULL) == fmi3Error && fmi3ActivateModelPartition(c, 0, 0.0) == fmi3Error);
  CHECK(fmi3GetNumberOfVariableDependencies(c, 0, NULL) == fmi3Error);
  CHECK(fmi3GetVariableDependencies(c, 0, NULL, NULL, NULL, NULL, 0) == fmi3Error);
  CHECK(fmi3EnterConfigurationMode(c) == fmi3Error && fmi3ExitConfigurationMode(c) == fmi3Error);
  CHECK(fmi3GetFloat64(c, &vr, 1, &last, 2) == fmi3Error && fmi3EnterStepMode(c) == fmi3Error);
  fmi3FreeInstance(c);
}

int main(void) {
  find_references();
  for (const Api* api = apis; api < apis + 2; api++) {
    exercise_states(api);
    exercise_derivatives(api, BY_CO_SIMULATION);
    exercise_derivatives(api, BY_MODEL_EXCHANGE);
    exercise_steps(api);
    exercise_output_derivatives(api);
    exercise_model_exchange(api);
    exercise_errors(api);
  }
  exercise_intermediate_update();
  exercise_the_rest();
  printf("%d checks, %d failed, %d messages\n", checks, failures, messages);
  return failures != 0;
}
