/* An FMI 3 FMU that follows the time, and from 0.05 s on returns from each step at half of it, without being allowed to. */

#include <stdlib.h>

#include "fmi3Functions.h"

typedef struct {
  double time, u;
} Fmu;

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
  return early ? 0 : calloc(1, sizeof(Fmu));
}
void fmi3FreeInstance(fmi3Instance f) { free(f); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  ((Fmu*)f)->time = start;
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3SetDebugLogging(fmi3Instance f, fmi3Boolean on, size_t n, const fmi3String categories[]) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m) {
  for (size_t i = 0; i < n; i++) v[i] = r[i] == 1 ? ((Fmu*)f)->u : ((Fmu*)f)->time;
  return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance f, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m) {
  for (size_t i = 0; i < n; i++) ((Fmu*)f)->u = v[i];
  return fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance f, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_state, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
  *event = *terminate = 0;
  *early = time >= 0.05 - 1e-9;
  ((Fmu*)f)->time = *last = time + (*early ? size / 2 : size);
  return fmi3OK;
}
