/* One face for FMI 2 and FMI 3, linked statically: statuses have the same values in both. */

#include <string.h>

#include "core.h"
#include "fmi2Functions.h"
#include "fmi3Functions.h"

static int messages;

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
  return fmi2Instantiate("it", i == BY_CO_SIMULATION ? fmi2CoSimulation : fmi2ModelExchange, token, "", &callbacks, 0, 1);
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
  if (i == BY_MODEL_EXCHANGE) return fmi3InstantiateModelExchange("it", token, "", 0, 1, NULL, log3);
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
