/* Count the allocations of many steps.

   Usage: allocations LIBRARY TOKEN INPUT OUTPUT STEPS (value references). The program's own malloc, calloc, realloc and
   free stand in front of the C library's for everything in the process, the loaded FMU too. */

#include <dlfcn.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2FunctionTypes.h"
#include "fmi2TypesPlatform.h"

void* __libc_malloc(size_t size);
void* __libc_calloc(size_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void __libc_free(void* memory);

static long calls;

void* malloc(size_t size) {
  calls++;
  return __libc_malloc(size);
}

void* calloc(size_t count, size_t size) {
  calls++;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, size_t size) {
  calls++;
  return __libc_realloc(memory, size);
}

void free(void* memory) {
  calls++;
  __libc_free(memory);
}

#define LOAD(name) name##TYPE* name = (name##TYPE*)symbol(library, #name)

static void* symbol(void* library, const char* name) {
  void* found = dlsym(library, name);
  if (!found) exit(2);
  return found;
}

int main(int count, char** arguments) {
  void* library = count == 6 ? dlopen(arguments[1], RTLD_NOW) : NULL;
  if (!library) return 2;
  LOAD(fmi2Instantiate);
  LOAD(fmi2FreeInstance);
  LOAD(fmi2SetupExperiment);
  LOAD(fmi2EnterInitializationMode);
  LOAD(fmi2ExitInitializationMode);
  LOAD(fmi2SetReal);
  LOAD(fmi2GetReal);
  LOAD(fmi2DoStep);
  LOAD(fmi2SetRealInputDerivatives);
  LOAD(fmi2GetRealOutputDerivatives);
  LOAD(fmi2GetDirectionalDerivative);
  LOAD(fmi2GetFMUstate);
  LOAD(fmi2SetFMUstate);

  long before = calls;
  fmi2CallbackFunctions callbacks = {0};
  void* c = fmi2Instantiate("it", fmi2CoSimulation, arguments[2], "", &callbacks, 0, 1);
  if (calls == before) return 3; /* then nothing would be counted */
  int status = fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0);
  status |= fmi2EnterInitializationMode(c) | fmi2ExitInitializationMode(c);
  unsigned input = (unsigned)atoi(arguments[3]), output = (unsigned)atoi(arguments[4]);
  long steps = atol(arguments[5]);
  void* state = NULL;
  status |= fmi2GetFMUstate(c, &state);

  before = calls;
  const double step = 1e-3, one = 1.0;
  const unsigned inputs[] = {input, input};
  const int orders[] = {1, 2};
  const double rates[] = {0.5, 30.0};
  double u, y, sum = 0.0;
  for (long k = 0; k < steps; k++) {
    u = sin(1e-2 * (double)k);
    status |= fmi2SetReal(c, &input, 1, &u);
    if (k % 3 == 0) status |= fmi2SetRealInputDerivatives(c, inputs, 2, orders, rates);
    status |= fmi2DoStep(c, (double)k * step, step, 1) | fmi2GetReal(c, &output, 1, &y);
    sum += y;
    if (k % 100) continue;
    status |= fmi2GetFMUstate(c, &state) | fmi2SetFMUstate(c, state);
    status |= fmi2GetDirectionalDerivative(c, &output, 1, &input, 1, &one, &y);
    status |= fmi2GetRealOutputDerivatives(c, &output, 1, orders, &y);
  }
  long made = calls - before;
  fmi2FreeInstance(c);
  printf("%ld allocations, status %d, finite %d\n", made, status, isfinite(sum) != 0);
  return 0;
}
