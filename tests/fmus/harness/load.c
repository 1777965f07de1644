/* Loads an FMU's library as an importer does, steps it with one input that is held, and prints outputs exactly.

   Usage: load LIBRARY TOKEN INPUT STEP STEPS OUTPUT... (value references; STEP in s). One line of %a per step. Works on
   Linux, and on Windows, where the functions of libraries have other names. */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "fmi2Functions.h"

#ifdef _WIN32
#include <windows.h>
static void* function_of(const char* library, const char* name) {
  return (void*)GetProcAddress(LoadLibraryA(library), name);
}
#else
#include <dlfcn.h>
static void* function_of(const char* library, const char* name) { return dlsym(dlopen(library, RTLD_NOW), name); }
#endif

static void report(void* environment, const char* instance, fmi2Status status, const char* category,
                   const char* message, ...) {
  (void)environment;
  va_list more;
  va_start(more, message);
  fprintf(stderr, "%s %d %s: ", instance, (int)status, category);
  vfprintf(stderr, message, more);
  va_end(more);
}

#define LOAD(Name) fmi2##Name##TYPE* call##Name = (fmi2##Name##TYPE*)function_of(argv[1], "fmi2" #Name)

int main(int argc, char** argv) {
  fmi2CallbackFunctions callbacks = {report, calloc, free, NULL, NULL};
  fmi2ValueReference input = (unsigned)atoi(argv[3]), outputs[64];
  double h = atof(argv[4]), values[64];
  int n = argc - 6;
  for (int i = 0; i < n; i++) outputs[i] = (unsigned)atoi(argv[6 + i]);
  LOAD(Instantiate);
  LOAD(SetupExperiment);
  LOAD(EnterInitializationMode);
  LOAD(ExitInitializationMode);
  LOAD(SetReal);
  LOAD(GetReal);
  LOAD(DoStep);
  LOAD(FreeInstance);
  if (!callInstantiate) return 2;
  fmi2Component c = callInstantiate("it", fmi2CoSimulation, argv[2], "", &callbacks, 0, 1);
  if (!c || callSetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) || callEnterInitializationMode(c) || callExitInitializationMode(c))
    return 3;
  for (int k = 0; k < atoi(argv[5]); k++) {
    double u = 0.125 * (k % 5);
    if (callSetReal(c, &input, 1, &u) || callDoStep(c, k * h, h, 1) || callGetReal(c, outputs, (size_t)n, values)) return 4;
    for (int i = 0; i < n; i++) printf("%a ", values[i]);
    printf("\n");
  }
  callFreeInstance(c);
  return 0;
}
