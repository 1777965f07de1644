/* The two-FMU loop as a C program written for it alone: what a master can at best be as fast as.

   floor PLANT.so PLANT_TOKEN PD.so PD_TOKEN STEPS STEP_SIZE position(plant) force(plant) x(plant) position(pd) force(pd)
   prints the seconds that the steps took and the position after them. The last five are value references. */

#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

typedef struct {
  fmi2Component component;
  fmi2GetRealTYPE* get;
  fmi2SetRealTYPE* set;
  fmi2DoStepTYPE* step;
  fmi2EnterInitializationModeTYPE* enter;
  fmi2ExitInitializationModeTYPE* leave;
} Fmu;

static void quiet(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                  fmi2String message, ...) {
  (void)environment, (void)name, (void)status, (void)category, (void)message;
}

static const fmi2CallbackFunctions HOST = {quiet, calloc, free, NULL, NULL};

static void* symbol(void* library, const char* name) {
  void* found = library ? dlsym(library, name) : NULL;
  if (!found) {
    fprintf(stderr, "%s: %s\n", name, dlerror());
    exit(1);
  }
  return found;
}

static Fmu load(const char* path, const char* token) {
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  fmi2InstantiateTYPE* instantiate = (fmi2InstantiateTYPE*)symbol(library, "fmi2Instantiate");
  fmi2SetupExperimentTYPE* setup = (fmi2SetupExperimentTYPE*)symbol(library, "fmi2SetupExperiment");
  Fmu fmu = {
      .component = instantiate("it", fmi2CoSimulation, token, "file:///", &HOST, fmi2False, fmi2False),
      .get = (fmi2GetRealTYPE*)symbol(library, "fmi2GetReal"),
      .set = (fmi2SetRealTYPE*)symbol(library, "fmi2SetReal"),
      .step = (fmi2DoStepTYPE*)symbol(library, "fmi2DoStep"),
      .enter = (fmi2EnterInitializationModeTYPE*)symbol(library, "fmi2EnterInitializationMode"),
      .leave = (fmi2ExitInitializationModeTYPE*)symbol(library, "fmi2ExitInitializationMode"),
  };
  if (!fmu.component || setup(fmu.component, fmi2False, 0, 0, fmi2False, 0) > fmi2Warning) exit(1);
  return fmu;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char** argv) {
  if (argc != 12) return 2;
  Fmu plant = load(argv[1], argv[2]), pd = load(argv[3], argv[4]);
  long steps = atol(argv[5]);
  double h = atof(argv[6]), position = 1.0, force = 0.0;
  fmi2ValueReference r[5];
  for (int i = 0; i < 5; i++) r[i] = (fmi2ValueReference)atol(argv[7 + i]);
  plant.set(plant.component, &r[2], 1, &position);
  plant.enter(plant.component), pd.enter(pd.component);
  pd.set(pd.component, &r[3], 1, &position);
  pd.get(pd.component, &r[4], 1, &force);
  plant.set(plant.component, &r[1], 1, &force);
  plant.leave(plant.component), pd.leave(pd.component);
  double begin = now();
  for (long k = 0; k < steps; k++) {
    double t = (double)k * h;
    if (plant.step(plant.component, t, h, fmi2True) > fmi2Warning) return 1;
    if (pd.step(pd.component, t, h, fmi2True) > fmi2Warning) return 1;
    if (plant.get(plant.component, &r[0], 1, &position) > fmi2Warning) return 1;
    if (pd.get(pd.component, &r[4], 1, &force) > fmi2Warning) return 1;
    if (pd.set(pd.component, &r[3], 1, &position) > fmi2Warning) return 1;
    if (plant.set(plant.component, &r[1], 1, &force) > fmi2Warning) return 1;
  }
  printf("%.9g %.17g\n", now() - begin, position);
  return 0;
}
