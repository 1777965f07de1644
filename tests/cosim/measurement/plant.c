/* Plants of another maker, Co-Simulation only, FMI 2: KIND selects what y makes of u, time in s. No state is declared. A
 * LIAR offers directional derivatives, and they are those of y = u. Functions that are not here return an error. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

enum { DOUBLE_INTEGRATOR = 1, CREEP, CUBIC, WRAPPED, DELAY, ECHO, LATE, PAIR, LEVEL, GAIN };
enum { U, Y, OTHER, VALUES };
enum { DELAY_STEPS = 1500, KEPT = 2048 };

typedef struct {
  double v[VALUES], time, position, velocity, past[KEPT];
  long count;
  const fmi2CallbackFunctions* host;
} Fmu;

static void begin(Fmu* f) {
  const fmi2CallbackFunctions* host = f->host;
  memset(f, 0, sizeof *f);
  f->host = host;
  f->position = 1;
  f->velocity = 3;
}

static void update(Fmu* f) {
  double u = f->v[U], t = f->time, late = f->past[(f->count + KEPT - DELAY_STEPS) % KEPT];
  double y = 0;
  if (KIND == DOUBLE_INTEGRATOR) y = f->position;
  if (KIND == CREEP) y = u / 100 + 2 * log1p(t);
  if (KIND == CUBIC) y = u / 100 + t * t * t;
  if (KIND == WRAPPED) y = remainder(u / 100 + 10 * t, 8 * atan(1));
  if (KIND == DELAY) y = late;
  if (KIND == ECHO) y = u / 10 + late;
  if (KIND == LATE) y = (t < 2 ? 0.2 : 1) * u;
  if (KIND == PAIR) y = u + 10 * f->v[OTHER];
  if (KIND == LEVEL) y = 3 + u;
  if (KIND == GAIN) y = 1.1 * u;
  f->v[Y] = y;
}

const char* fmi2GetVersion(void) { return "2.0"; }
const char* fmi2GetTypesPlatform(void) { return "default"; }
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  Fmu* f = host->allocateMemory(1, sizeof *f);
  f->host = host;
  begin(f);
  return f;
}
void fmi2FreeInstance(fmi2Component c) { ((Fmu*)c)->host->freeMemory(c); }
fmi2Status fmi2Reset(fmi2Component c) {
  begin(c);
  return fmi2OK;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  update(c);
  return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real out[]) {
  for (size_t i = 0; i < n; i++) out[i] = ((Fmu*)c)->v[r[i]];
  return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real in[]) {
  for (size_t i = 0; i < n; i++) ((Fmu*)c)->v[r[i]] = in[i];
  return fmi2OK;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                        const fmi2ValueReference known[], size_t m, const fmi2Real seed[],
                                        fmi2Real out[]) {
  for (size_t i = 0; i < n; i++) {
    out[i] = 0;
    for (size_t j = 0; j < m; j++)
      if (unknown[i] == Y && known[j] == U) out[i] += seed[j];
  }
  return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  Fmu* f = c;
  double acceleration = f->v[U] + 0.7;
  f->past[f->count++ % KEPT] = f->v[U];
  f->position += h * f->velocity + h * h * acceleration / 2;
  f->velocity += h * acceleration;
  f->time = t + h;
  update(f);
  return fmi2OK;
}
