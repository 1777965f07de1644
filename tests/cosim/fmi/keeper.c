/* An FMU of another maker, FMI 2 or 3, that keeps to its own letter: y follows u with a rate of 50 1/s, exactly for a
 * held input, and `tolerance` is that which it got at initialization, -1 without one. Built with STRICT it gives no
 * value after an input was set, before the next step; with SECRET it gives no input at all; with ONCE it lives in one
 * place, and a second instance is none; with CONSTANT it takes every step for as long as the first; with TOOL it finds
 * nothing to run with. Functions that are not here are stubs that return an error. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if VERSION == 3
#include "fmi3Functions.h"
#else
#include "fmi2Functions.h"
#endif

enum { TIME, U, Y, TOLERANCE, VALUES };

typedef struct {
  double v[VALUES], first;
  int is_running, is_dirty;
} Fmu;

static Fmu only;
static int lives;

static void* made(void) {
#ifdef TOOL
  return 0;
#endif
#ifdef ONCE
  if (lives++) return 0;
  memset(&only, 0, sizeof only);
  return &only;
#else
  return calloc(1, sizeof(Fmu));
#endif
}

static void unmade(void* f) {
#ifdef ONCE
  lives = 0;
#else
  free(f);
#endif
}

static int begin(Fmu* f, int is_defined, double tolerance) {
  f->v[TOLERANCE] = is_defined ? tolerance : -1;
  return 0;
}

static int step(Fmu* f, double t, double h) {
#ifdef CONSTANT
  if (!f->first) f->first = h;
  h = f->first;
#endif
  f->v[TIME] = t + h;
  f->v[Y] = f->v[U] + (f->v[Y] - f->v[U]) * exp(-50 * h);
  f->is_running = 1;
  f->is_dirty = 0;
  return 0;
}

static int values(Fmu* f, const unsigned* r, size_t n, double* out, const double* in) {
#ifdef STRICT
  if (out && f->is_dirty) return 3;
  if (in) f->is_dirty = f->is_running;
#endif
  for (size_t i = 0; i < n; i++) {
    if (r[i] >= VALUES) return 3;
#ifdef SECRET
    if (out && r[i] == U) return 3;
#endif
    if (out) out[i] = f->v[r[i]];
    if (in) f->v[r[i]] = in[i];
  }
  return 0;
}

static int save(Fmu* f, void** state) {
  if (!*state) *state = malloc(sizeof *f);
  memcpy(*state, f, sizeof *f);
  return 0;
}

static int restore(Fmu* f, void* state) {
  memcpy(f, state, sizeof *f);
  return 0;
}

static int release(void** state) {
  free(*state);
  *state = 0;
  return 0;
}

#if VERSION == 3

fmi3Status fmi3GetFMUState(fmi3Instance f, fmi3FMUState* state) { return save(f, state); }
fmi3Status fmi3SetFMUState(fmi3Instance f, fmi3FMUState state) { return restore(f, state); }
fmi3Status fmi3FreeFMUState(fmi3Instance f, fmi3FMUState* state) { return release(state); }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  return made();
}
void fmi3FreeInstance(fmi3Instance f) { unmade(f); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  return begin(f, defined, tolerance);
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
  return values(f, r, n, v, 0);
}
fmi3Status fmi3SetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
  return values(f, r, n, 0, v);
}
fmi3Status fmi3DoStep(fmi3Instance f, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
  return step(f, t, h);
}

#else

fmi2Status fmi2GetFMUstate(fmi2Component f, fmi2FMUstate* state) { return save(f, state); }
fmi2Status fmi2SetFMUstate(fmi2Component f, fmi2FMUstate state) { return restore(f, state); }
fmi2Status fmi2FreeFMUstate(fmi2Component f, fmi2FMUstate* state) { return release(state); }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  return made();
}
void fmi2FreeInstance(fmi2Component f) { unmade(f); }
fmi2Status fmi2SetupExperiment(fmi2Component f, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return begin(f, defined, tolerance);
}
fmi2Status fmi2EnterInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  return values(f, r, n, v, 0);
}
fmi2Status fmi2SetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  return values(f, r, n, 0, v);
}
fmi2Status fmi2DoStep(fmi2Component f, fmi2Real t, fmi2Real h, fmi2Boolean no_set) { return step(f, t, h); }

#endif
