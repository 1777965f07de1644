/* A ball of another maker, FMI 2 or 3, in Model Exchange: it falls, is driven by an input, bounces off the floor, and is
 * kicked upwards by 1 m/s at a time of its own. Behind a bounce it wants to be updated once more. Slower than the least
 * speed it stays on the floor. Functions that are not here are stubs that return an error. */

#include <stdlib.h>

#if VERSION == 3
#include "fmi3Functions.h"
#else
#include "fmi2Functions.h"
#endif

enum { TIME, H, DER_H, V, DER_V, PUSH, BOUNCES, BOUNCED_AT, RESTITUTION, LEAST_SPEED, KICK_AT, FLOOR, VALUES };

typedef struct {
  double v[VALUES];
  int is_resting, is_kicked;
} Ball;

static Ball* made(void) {
  Ball* b = calloc(1, sizeof *b);
  b->v[H] = 1;
  b->v[RESTITUTION] = 0.7;
  b->v[KICK_AT] = -1;
  return b;
}

static void evaluate(Ball* b) {
  b->v[DER_H] = b->is_resting ? 0 : b->v[V];
  b->v[DER_V] = b->is_resting ? 0 : b->v[PUSH] - 9.81;
  b->v[FLOOR] = b->is_resting ? 1 : b->v[H];
}

static int values(Ball* b, const unsigned* r, size_t n, double* out, const double* in) {
  if (out) evaluate(b);
  for (size_t i = 0; i < n; i++) {
    if (r[i] >= VALUES) return 3;
    if (out) out[i] = b->v[r[i]];
    if (in) b->v[r[i]] = in[i];
  }
  return 0;
}

/* One update: 1 where another is wanted. */
static int update(Ball* b) {
  int is_bounce = b->v[H] <= 0 && b->v[V] < 0;
  if (is_bounce) {
    b->v[H] = 0;
    b->v[V] *= -b->v[RESTITUTION];
    b->v[BOUNCES] += 1;
    b->v[BOUNCED_AT] = b->v[TIME];
    if (b->v[V] < b->v[LEAST_SPEED]) {
      b->is_resting = 1;
      b->v[V] = 0;
    }
  }
  if (b->v[KICK_AT] >= 0 && !b->is_kicked && b->v[TIME] >= b->v[KICK_AT]) {
    b->is_kicked = 1;
    b->v[V] += 1;
  }
  return is_bounce;
}

static int next_event(const Ball* b, double* time) {
  *time = b->v[KICK_AT];
  return b->v[KICK_AT] >= 0 && !b->is_kicked;
}

static int set_states(Ball* b, const double x[]) {
  b->v[H] = x[0];
  b->v[V] = x[1];
  return 0;
}

static int get_two(Ball* b, double x[], int first, int second) {
  evaluate(b);
  x[0] = b->v[first];
  x[1] = b->v[second];
  return 0;
}

static int nominals(double x[]) {
  x[0] = x[1] = 1;
  return 0;
}

#if VERSION == 3

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment e, fmi3LogMessageCallback log) {
  return made();
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  ((Ball*)c)->v[TIME] = start;
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
  return values(c, r, n, v, 0);
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
  return values(c, r, n, 0, v);
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* again, fmi3Boolean* end, fmi3Boolean* nominals_changed,
                                    fmi3Boolean* values_changed, fmi3Boolean* defined, fmi3Float64* time) {
  *again = *values_changed = update(c);
  *end = *nominals_changed = 0;
  *defined = next_event(c, time);
  return fmi3OK;
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean* event, fmi3Boolean* end) {
  *event = *end = 0;
  return fmi3OK;
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
  ((Ball*)c)->v[TIME] = time;
  return fmi3OK;
}
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { return set_states(c, x); }
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { return get_two(c, x, H, V); }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 x[], size_t n) {
  return get_two(c, x, DER_H, DER_V);
}
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
  evaluate(c);
  z[0] = ((Ball*)c)->v[FLOOR];
  return fmi3OK;
}
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { return nominals(x); }

#else

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  return made();
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  ((Ball*)c)->v[TIME] = start;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  return values(c, r, n, v, 0);
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  return values(c, r, n, 0, v);
}
fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
  info->newDiscreteStatesNeeded = info->valuesOfContinuousStatesChanged = update(c);
  info->terminateSimulation = info->nominalsOfContinuousStatesChanged = 0;
  info->nextEventTimeDefined = next_event(c, &info->nextEventTime);
  return fmi2OK;
}
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean* event, fmi2Boolean* end) {
  *event = *end = 0;
  return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
  ((Ball*)c)->v[TIME] = time;
  return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) { return set_states(c, x); }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { return get_two(c, x, H, V); }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real x[], size_t n) { return get_two(c, x, DER_H, DER_V); }
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
  evaluate(c);
  z[0] = ((Ball*)c)->v[FLOOR];
  return fmi2OK;
}
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { return nominals(x); }

#endif
