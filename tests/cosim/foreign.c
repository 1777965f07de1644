/* An FMU of another maker, FMI 2 or 3: y integrates u, and from time `at` on it misbehaves as parameter `behaviour` says.
 * It cannot reset, has no derivatives, and does not tell that it can get and set its state. Functions that are not here
 * are stubs that return an error. FOLLOW is a lie about its dependencies: y follows u at once, which the description
 * denies; REFUSE gives no state, LOSE takes none back; DAWDLE takes 20 ms for each step, HANG for ever; NEGATIVE and
 * BEYOND return statuses that no standard has; MUTTER logs a warning and returns ok. Built with DEADLY, it kills the process as soon as it is loaded: 1 by a
 * signal, 2 by an exit. */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#if VERSION == 3
#include "fmi3Functions.h"
#else
#include "fmi2Functions.h"
#endif

enum { TIME, U, Y, BEHAVIOUR, AT, VALUES };
enum { WARN = 1, DISCARD, FAIL, DIE, FINISH, GO_NAN, FOLLOW, CRASH, REFUSE, LOSE, DAWDLE, HANG, NEGATIVE, BEYOND, MUTTER };

typedef struct {
  double v[VALUES];
#if VERSION == 3
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
#else
  const fmi2CallbackFunctions* host;
#endif
} Fmu;

#ifdef DEADLY
__attribute__((constructor)) static void kill_at_once(void) {
  if (DEADLY == 1) raise(SIGSEGV);
  _exit(0);
}
#endif

static int step(Fmu* f, double t, double h, int* finish) {
  int kind = t >= f->v[AT] ? (int)f->v[BEHAVIOUR] : 0;
  f->v[TIME] = t + h;
  f->v[Y] += h * f->v[U];
  if (kind == CRASH) raise(SIGSEGV);
  if (kind == DAWDLE) nanosleep(&(struct timespec){0, 20000000}, 0);
  while (kind == HANG) pause();
  if (kind == GO_NAN) f->v[Y] = NAN;
  *finish = kind == FINISH;
  if (kind == NEGATIVE) return -1;
  if (kind == BEYOND) return 101;
  return kind >= WARN && kind <= DIE ? kind : 0;
}

static int mutters(Fmu* f, double t) { return t >= f->v[AT] && f->v[BEHAVIOUR] == MUTTER; }

static int values(Fmu* f, const unsigned* r, size_t n, double* out, const double* in) {
  for (size_t i = 0; i < n; i++) {
    if (r[i] >= VALUES) return 3;
    if (out) out[i] = f->v[r[i]];
    if (in) f->v[r[i]] = in[i];
    if (out && r[i] == Y && f->v[BEHAVIOUR] == FOLLOW) out[i] = 1 + f->v[AT] * f->v[U];
  }
  return 0;
}

static int save(Fmu* f, void** state) {
  if (f->v[TIME] >= f->v[AT] && f->v[BEHAVIOUR] == REFUSE) return 3;
  if (!*state) *state = malloc(sizeof f->v);
  memcpy(*state, f->v, sizeof f->v);
  return 0;
}

static int restore(Fmu* f, void* state) {
  if (f->v[TIME] >= f->v[AT] && f->v[BEHAVIOUR] == LOSE) return 3;
  memcpy(f->v, state, sizeof f->v);
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
  Fmu* f = calloc(1, sizeof *f);
  f->environment = environment;
  f->log = log;
  return f;
}
void fmi3FreeInstance(fmi3Instance f) { free(f); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  ((Fmu*)f)->v[TIME] = start;
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
  return values(f, r, n, v, 0);
}
fmi3Status fmi3SetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
  return values(f, r, n, 0, v);
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
  Fmu* f = c;
  int finish, status = step(f, t, h, &finish);
  *terminate = finish;
  if (status) f->log(f->environment, status, "logStatusError", "the spring is broken");
  if (mutters(f, t)) f->log(f->environment, fmi3Warning, "logStatusWarning", "the spring creaks");
  return status;
}

#else

fmi2Status fmi2GetFMUstate(fmi2Component f, fmi2FMUstate* state) { return save(f, state); }
fmi2Status fmi2SetFMUstate(fmi2Component f, fmi2FMUstate state) { return restore(f, state); }
fmi2Status fmi2FreeFMUstate(fmi2Component f, fmi2FMUstate* state) { return release(state); }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  Fmu* f = host->allocateMemory(1, sizeof *f);
  f->host = host;
  return f;
}
void fmi2FreeInstance(fmi2Component c) { ((Fmu*)c)->host->freeMemory(c); }
fmi2Status fmi2SetupExperiment(fmi2Component f, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  ((Fmu*)f)->v[TIME] = start;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  return values(f, r, n, v, 0);
}
fmi2Status fmi2SetReal(fmi2Component f, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  return values(f, r, n, 0, v);
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  Fmu* f = c;
  int finish, status = step(f, t, h, &finish);
  if (status) f->host->logger(f->host->componentEnvironment, "f", status, "logStatusError", "the %s is %s", "spring", "broken");
  if (mutters(f, t)) f->host->logger(f->host->componentEnvironment, "f", fmi2Warning, "logStatusWarning", "it %s", "creaks");
  return status;
}

#endif
