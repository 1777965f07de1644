/* A Co-Simulation FMU of another maker with sampled control inside: every tenth step of any size y becomes 2 u + 20 z,
 * and z grows by u / 100. Its directional derivatives are those of a moment at which it does not tick, 0; with STATIC it
 * is a gain, y = 2 u at once, whose derivative is 2. Functions that are not here are stubs that return an error. */

#include <stdlib.h>
#include <string.h>

#if VERSION == 3
#include "fmi3Functions.h"
#else
#include "fmi2Functions.h"
#endif

enum { TIME, U, Y, Z, MODE, VALUES };

typedef struct {
  double v[VALUES];
  long count;
#if VERSION == 2
  const fmi2CallbackFunctions* host;
#endif
} Fmu;

static int step(Fmu* f, double t, double h) {
  f->v[TIME] = t + h;
  if (++f->count % 10 == 0) {
    f->v[Z] += f->v[U] / 100;
    f->v[Y] = 2 * f->v[U] + 20 * f->v[Z];
  }
  return 0;
}

static int get(Fmu* f, const unsigned* r, size_t n, double* out) {
  for (size_t i = 0; i < n; i++) {
    if (r[i] >= VALUES) return 3;
    out[i] = f->v[r[i]];
#ifdef STATIC
    if (r[i] == Y) out[i] = 2 * f->v[U];
#endif
  }
  return 0;
}

static int set(Fmu* f, const unsigned* r, size_t n, const double* in) {
  for (size_t i = 0; i < n; i++) {
    if (r[i] >= VALUES) return 3;
    f->v[r[i]] = in[i];
  }
  return 0;
}

static int slope(const unsigned* unknown, size_t n, const unsigned* known, size_t m, const double* seed, double* out) {
  for (size_t i = 0; i < n; i++) {
    out[i] = 0;
#ifdef STATIC
    for (size_t j = 0; j < m; j++)
      if (unknown[i] == Y && known[j] == U) out[i] += 2 * seed[j];
#endif
  }
  return 0;
}

#if VERSION == 3

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  return calloc(1, sizeof(Fmu));
}
void fmi3FreeInstance(fmi3Instance f) { free(f); }
fmi3Status fmi3Reset(fmi3Instance f) {
  memset(f, 0, sizeof(Fmu));
  return fmi3OK;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
  return get(f, r, n, v);
}
fmi3Status fmi3SetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
  return set(f, r, n, v);
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance f, const fmi3ValueReference u[], size_t n,
                                        const fmi3ValueReference k[], size_t m, const fmi3Float64 seed[], size_t s,
                                        fmi3Float64 out[], size_t o) {
  return slope(u, n, k, m, seed, out);
}
fmi3Status fmi3DoStep(fmi3Instance f, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
  *terminate = 0;
  return step(f, t, h);
}

#else

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  Fmu* f = host->allocateMemory(1, sizeof *f);
  f->host = host;
  return f;
}
void fmi2FreeInstance(fmi2Component c) { ((Fmu*)c)->host->freeMemory(c); }
fmi2Status fmi2Reset(fmi2Component c) {
  Fmu* f = c;
  memset(f->v, 0, sizeof f->v);
  f->count = 0;
  return fmi2OK;
}
fmi2Status fmi2SetupExperiment(fmi2Component f, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, fmi2Real v[]) { return get(f, r, n, v); }
fmi2Status fmi2SetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  return set(f, r, n, v);
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component f, const fmi2ValueReference u[], size_t n,
                                        const fmi2ValueReference k[], size_t m, const fmi2Real seed[], fmi2Real out[]) {
  return slope(u, n, k, m, seed, out);
}
fmi2Status fmi2DoStep(fmi2Component f, fmi2Real t, fmi2Real h, fmi2Boolean no_set) { return step(f, t, h); }

#endif
