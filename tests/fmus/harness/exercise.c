/* Every function of both versions, linked with one model's sources, so that sanitizers see all of it.

   Usage: exercise. Prints what failed and returns 1, or prints the number of checks. The model's own table tells which
   variables there are, so the same program serves every model. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

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

static int checks, failures, messages;

/* One face for both versions: statuses have the same values in both. */
typedef struct {
  const char* name;
  void* (*create)(Interface interface, const char* token);
  void (*destroy)(void* c);
  int (*initialize)(void* c, double start_time);
  int (*terminate)(void* c);
  int (*reset)(void* c);
  int (*get)(void* c, const unsigned* vr, size_t n, double* values);
  int (*set)(void* c, const unsigned* vr, size_t n, const double* values);
  int (*step)(void* c, double t, double h);
  int (*get_state)(void* c, void** state);
  int (*set_state)(void* c, void* state);
  int (*free_state)(void* c, void** state);
  int (*size)(void* c, void* state, size_t* size);
  int (*serialize)(void* c, void* state, char* bytes, size_t size);
  int (*deserialize)(void* c, const char* bytes, size_t size, void** state);
  int (*directional)(void* c, const unsigned* u, size_t nu, const unsigned* k, size_t nk, const double* seed,
                     double* out);
  int (*output_derivatives)(void* c, const unsigned* vr, size_t n, const int* orders, double* values);
  int (*update)(void* c);
  int (*continuous)(void* c);
  int (*event)(void* c);
  int (*set_time)(void* c, double t);
  int (*set_states)(void* c, const double* x, size_t n);
  int (*get_states)(void* c, double* x, size_t n);
  int (*derivatives)(void* c, double* der, size_t n);
  int (*nominals)(void* c, double* nominals, size_t n);
} Api;

/* FMI 2 */

static void log2_(fmi2ComponentEnvironment e, fmi2String name, fmi2Status s, fmi2String category, fmi2String text,
                  ...) {
  (void)e;
  messages += strlen(name) && strlen(category) && strlen(text) && s > fmi2Warning;
}
static const fmi2CallbackFunctions callbacks = {log2_, NULL, NULL, NULL, NULL};
static void* create2(Interface i, const char* token) {
  return fmi2Instantiate("it", i == CO_SIMULATION ? fmi2CoSimulation : fmi2ModelExchange, token, "", &callbacks, 0, 1);
}
static int initialize2(void* c, double t) {
  int a = fmi2SetupExperiment(c, fmi2True, 1e-6, t, fmi2False, 0.0);
  return a | fmi2EnterInitializationMode(c) | fmi2ExitInitializationMode(c);
}
static int terminate2(void* c) { return fmi2Terminate(c); }
static int reset2(void* c) { return fmi2Reset(c); }
static int get2(void* c, const unsigned* vr, size_t n, double* v) { return fmi2GetReal(c, vr, n, v); }
static int set2(void* c, const unsigned* vr, size_t n, const double* v) { return fmi2SetReal(c, vr, n, v); }
static int step2(void* c, double t, double h) { return fmi2DoStep(c, t, h, fmi2False); }
static int get_state2(void* c, void** s) { return fmi2GetFMUstate(c, s); }
static int set_state2(void* c, void* s) { return fmi2SetFMUstate(c, s); }
static int free_state2(void* c, void** s) { return fmi2FreeFMUstate(c, s); }
static int size2(void* c, void* s, size_t* n) { return fmi2SerializedFMUstateSize(c, s, n); }
static int serialize2(void* c, void* s, char* b, size_t n) { return fmi2SerializeFMUstate(c, s, b, n); }
static int deserialize2(void* c, const char* b, size_t n, void** s) { return fmi2DeSerializeFMUstate(c, b, n, s); }
static int directional2(void* c, const unsigned* u, size_t nu, const unsigned* k, size_t nk, const double* d,
                        double* o) {
  return fmi2GetDirectionalDerivative(c, u, nu, k, nk, d, o);
}
static int output_derivatives2(void* c, const unsigned* vr, size_t n, const int* orders, double* v) {
  return fmi2GetRealOutputDerivatives(c, vr, n, orders, v);
}
static int update2(void* c) {
  fmi2EventInfo info;
  return fmi2NewDiscreteStates(c, &info);
}
static int continuous2(void* c) { return fmi2EnterContinuousTimeMode(c); }
static int event2(void* c) {
  fmi2Boolean enter, terminate;
  return fmi2CompletedIntegratorStep(c, fmi2True, &enter, &terminate) | fmi2EnterEventMode(c);
}
static int set_time2(void* c, double t) { return fmi2SetTime(c, t); }
static int set_states2(void* c, const double* x, size_t n) { return fmi2SetContinuousStates(c, x, n); }
static int get_states2(void* c, double* x, size_t n) { return fmi2GetContinuousStates(c, x, n); }
static int derivatives2(void* c, double* x, size_t n) {
  return fmi2GetDerivatives(c, x, n) | fmi2GetEventIndicators(c, x, 0);
}
static int nominals2(void* c, double* x, size_t n) { return fmi2GetNominalsOfContinuousStates(c, x, n); }

/* FMI 3 */

static void log3(fmi3InstanceEnvironment e, fmi3Status s, fmi3String category, fmi3String text) {
  (void)e;
  messages += strlen(category) && strlen(text) && s > fmi3Warning;
}
static void* create3(Interface i, const char* token) {
  if (i == MODEL_EXCHANGE) return fmi3InstantiateModelExchange("it", token, "", 0, 1, NULL, log3);
  return fmi3InstantiateCoSimulation("it", token, "", 0, 1, 0, 0, NULL, 0, NULL, log3, NULL);
}
static int initialize3(void* c, double t) {
  return fmi3EnterInitializationMode(c, fmi3True, 1e-6, t, fmi3True, 1e9) | fmi3ExitInitializationMode(c);
}
static int terminate3(void* c) { return fmi3Terminate(c); }
static int reset3(void* c) { return fmi3Reset(c); }
static int get3(void* c, const unsigned* vr, size_t n, double* v) { return fmi3GetFloat64(c, vr, n, v, n); }
static int set3(void* c, const unsigned* vr, size_t n, const double* v) { return fmi3SetFloat64(c, vr, n, v, n); }
static int step3(void* c, double t, double h) {
  fmi3Boolean event, terminate, early;
  fmi3Float64 last;
  return fmi3DoStep(c, t, h, 0, &event, &terminate, &early, &last);
}
static int get_state3(void* c, void** s) { return fmi3GetFMUState(c, s); }
static int set_state3(void* c, void* s) { return fmi3SetFMUState(c, s); }
static int free_state3(void* c, void** s) { return fmi3FreeFMUState(c, s); }
static int size3(void* c, void* s, size_t* n) { return fmi3SerializedFMUStateSize(c, s, n); }
static int serialize3(void* c, void* s, char* b, size_t n) { return fmi3SerializeFMUState(c, s, (fmi3Byte*)b, n); }
static int deserialize3(void* c, const char* b, size_t n, void** s) {
  return fmi3DeserializeFMUState(c, (const fmi3Byte*)b, n, s);
}
static int directional3(void* c, const unsigned* u, size_t nu, const unsigned* k, size_t nk, const double* d,
                        double* o) {
  return fmi3GetDirectionalDerivative(c, u, nu, k, nk, d, nk, o, nu);
}
static int output_derivatives3(void* c, const unsigned* vr, size_t n, const int* orders, double* v) {
  return fmi3GetOutputDerivatives(c, vr, n, orders, v, n);
}
static int update3(void* c) {
  fmi3Boolean a, b, d, e, f;
  fmi3Float64 time;
  return fmi3EvaluateDiscreteStates(c) | fmi3UpdateDiscreteStates(c, &a, &b, &d, &e, &f, &time);
}
static int continuous3(void* c) { return fmi3EnterContinuousTimeMode(c); }
static int event3(void* c) {
  fmi3Boolean enter, terminate;
  return fmi3CompletedIntegratorStep(c, 1, &enter, &terminate) | fmi3EnterEventMode(c);
}
static int set_time3(void* c, double t) { return fmi3SetTime(c, t); }
static int set_states3(void* c, const double* x, size_t n) { return fmi3SetContinuousStates(c, x, n); }
static int get_states3(void* c, double* x, size_t n) { return fmi3GetContinuousStates(c, x, n); }
static int derivatives3(void* c, double* x, size_t n) {
  size_t states = 0, indicators = 1;
  int status = fmi3GetNumberOfContinuousStates(c, &states) | fmi3GetNumberOfEventIndicators(c, &indicators);
  return status | (states != n) | (indicators != 0) | fmi3GetContinuousStateDerivatives(c, x, n) |
         fmi3GetEventIndicators(c, x, 0);
}
static int nominals3(void* c, double* x, size_t n) { return fmi3GetNominalsOfContinuousStates(c, x, n); }

static const Api apis[] = {
    {"FMI 2",      create2,      fmi2FreeInstance,    initialize2, terminate2,  reset2, get2,
     set2,         step2,        get_state2,          set_state2,  free_state2, size2,  serialize2,
     deserialize2, directional2, output_derivatives2, update2,     continuous2, event2, set_time2,
     set_states2,  get_states2,  derivatives2,        nominals2},
    {"FMI 3",      create3,      fmi3FreeInstance,    initialize3, terminate3,  reset3, get3,
     set3,         step3,        get_state3,          set_state3,  free_state3, size3,  serialize3,
     deserialize3, directional3, output_derivatives3, update3,     continuous3, event3, set_time3,
     set_states3,  get_states3,  derivatives3,        nominals3},
};

/* Value references by role */

static unsigned references[ROLES][MAX];

static void find_references(void) {
  for (int i = 0; i < M->variable_count; i++) references[M->variables[i].role][M->variables[i].index] = (unsigned)i;
}

static size_t count_of(Role role) { return (size_t)M->size[role]; }

/* All that can be seen of an instance, inputs driven to be different at each step. */
static size_t see(const Api* api, void* c, double* seen) {
  static const Role roles[] = {ROLE_TIME,   ROLE_STATE,          ROLE_DERIVATIVE, ROLE_SAMPLED_STATE, ROLE_NEXT,
                               ROLE_OUTPUT, ROLE_SAMPLED_OUTPUT, ROLE_PARAMETER,  ROLE_SOLVER,        ROLE_CONSTANT};
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
    c[i] = api->create(CO_SIMULATION, M->token);
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

/* Derivatives of every unknown by every known; in FMI 3 the adjoint is the transpose. */
static void exercise_derivatives(const Api* api, Interface interface) {
  static const Role known_roles[] = {ROLE_TIME, ROLE_STATE, ROLE_SAMPLED_STATE, ROLE_INPUT, ROLE_PARAMETER};
  static const Role unknown_roles[] = {ROLE_DERIVATIVE, ROLE_OUTPUT, ROLE_NEXT, ROLE_SAMPLED_OUTPUT};
  unsigned knowns[MAX], unknowns[MAX];
  size_t nk = 0, nu = 0;
  double u[MAX], seed[MAX], forward[MAX], backward[MAX], weight[MAX];
  for (int r = 0; r < 5; r++)
    for (size_t i = 0; i < count_of(known_roles[r]); i++) knowns[nk++] = references[known_roles[r]][i];
  for (int r = 0; r < 4; r++)
    for (size_t i = 0; i < count_of(unknown_roles[r]); i++) unknowns[nu++] = references[unknown_roles[r]][i];
  void* c = api->create(interface, M->token);
  for (size_t i = 0; i < count_of(ROLE_INPUT); i++) u[i] = 1.5 + (double)i;
  CHECK(api->set(c, references[ROLE_INPUT], count_of(ROLE_INPUT), u) == 0);
  CHECK(api->initialize(c, 0.6) == 0);
  for (size_t i = 0; i < nk; i++) seed[i] = cos((double)i);
  for (size_t i = 0; i < nu; i++) weight[i] = sin(1.0 + (double)i);
  CHECK(api->directional(c, unknowns, nu, knowns, nk, seed, forward) == 0);
  if (api == &apis[1]) {
    double along = 0.0, across = 0.0;
    CHECK(fmi3GetAdjointDerivative(c, unknowns, nu, knowns, nk, weight, nu, backward, nk) == fmi3OK);
    for (size_t i = 0; i < nu; i++) along += weight[i] * forward[i];
    for (size_t i = 0; i < nk; i++) across += seed[i] * backward[i];
    CHECK(fabs(along - across) <= 1e-10 * (1.0 + fabs(along)));
    CHECK(fmi3GetAdjointDerivative(c, unknowns, nu, knowns, nk, weight, nu + 1, backward, nk) == fmi3Error);
  }
  unsigned outside = (unsigned)M->variable_count;
  CHECK(api->directional(c, &outside, 1, knowns, nk, seed, forward) == ERROR);
  CHECK(api->directional(c, unknowns, nu, &outside, 1, seed, forward) == ERROR);
  if (interface == CO_SIMULATION) {
    int orders[MAX], two = 2;
    for (int i = 0; i < MAX; i++) orders[i] = 1;
    drive(api, c, 0, 0, 0.0);
    CHECK(api->step(c, 0.6, 1e-3) == 0);
    CHECK(api->output_derivatives(c, references[ROLE_OUTPUT], count_of(ROLE_OUTPUT), orders, forward) == 0);
    CHECK(api->output_derivatives(c, references[ROLE_SAMPLED_OUTPUT], count_of(ROLE_SAMPLED_OUTPUT), orders, forward) ==
          0);
    CHECK(api->output_derivatives(c, references[ROLE_OUTPUT], 1, &two, forward) == ERROR);
    CHECK(api->output_derivatives(c, references[ROLE_TIME], 1, orders, forward) == ERROR);
    if (api == &apis[0] && count_of(ROLE_INPUT)) {
      CHECK(fmi2SetRealInputDerivatives(c, references[ROLE_INPUT], count_of(ROLE_INPUT), orders, seed) == fmi2OK);
      CHECK(fmi2SetRealInputDerivatives(c, references[ROLE_TIME], 1, orders, seed) == fmi2Error);
      CHECK(api->step(c, 0.601, 4.3e-3) == 0);
    }
  }
  api->destroy(c);
}

/* Model Exchange: continuous time, events, and Euler steps of ours. */
static void exercise_model_exchange(const Api* api) {
  double x[MAX], der[MAX], u[MAX], seen[MAX];
  size_t n = count_of(ROLE_STATE);
  void* c = api->create(MODEL_EXCHANGE, M->token);
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
  unsigned outside[] = {(unsigned)M->variable_count, 0xFFFFFFFFu};
  int heard = messages;
  CHECK(api->create(CO_SIMULATION, "foreign") == NULL && api->create(MODEL_EXCHANGE, NULL) == NULL);
  CHECK(messages == heard + 2);
  CHECK(api->get(NULL, outside, 1, &value) == ERROR && api->set(NULL, outside, 1, &value) == ERROR);
  CHECK(api->step(NULL, 0.0, 1.0) == ERROR && api->reset(NULL) == ERROR && api->terminate(NULL) == ERROR);
  CHECK(api->derivatives(NULL, &value, 0) & ERROR);
  void* c = api->create(CO_SIMULATION, M->token);
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
  void* c = create2(CO_SIMULATION, M->token);
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
  c = create3(CO_SIMULATION, M->token);
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
    exercise_derivatives(api, CO_SIMULATION);
    exercise_derivatives(api, MODEL_EXCHANGE);
    exercise_model_exchange(api);
    exercise_errors(api);
  }
  exercise_the_rest();
  printf("%d checks, %d failed, %d messages\n", checks, failures, messages);
  return failures != 0;
}
