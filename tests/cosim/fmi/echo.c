/* An FMU of another maker, FMI 2 or 3, that hands on values of every type: after a step each output is what its input
 * was before it. The reference of an input is 10 k, of its output 10 k + 1. In FMI 3 there is an array of two rows and
 * three columns as well, whose output is twice its input, and whatever the version a text, whose length is an output.
 * Functions that are not here are stubs that return an error. */

#include <stdlib.h>
#include <string.h>

#if VERSION == 3
#include "fmi3Functions.h"
#define TYPES                                                                                                     \
  TYPE(Float64, double) TYPE(Float32, float) TYPE(Int8, fmi3Int8) TYPE(UInt8, fmi3UInt8) TYPE(Int16, fmi3Int16) \
  TYPE(UInt16, fmi3UInt16) TYPE(Int32, fmi3Int32) TYPE(UInt32, fmi3UInt32) TYPE(Int64, fmi3Int64)               \
  TYPE(UInt64, fmi3UInt64) TYPE(Boolean, fmi3Boolean)
#else
#include "fmi2Functions.h"
#define TYPES TYPE(Real, double) TYPE(Integer, int) TYPE(Boolean, fmi2Boolean)
#endif

enum { ARRAY = 200, LENGTH = 301, ENUMERATION = 400 };

#define TYPE(NAME, C) \
  C in_##NAME, out_##NAME;
typedef struct {
  TYPES
  double array[12];
  long long chosen, kept;
  int length;
} Fmu;
#undef TYPE

static void step(Fmu* f) {
#define TYPE(NAME, C) f->out_##NAME = f->in_##NAME;
  TYPES
#undef TYPE
  for (int i = 0; i < 6; i++) f->array[6 + i] = 2 * f->array[i];
  f->kept = f->chosen;
}

#if VERSION == 3

#define TYPE(NAME, C)                                                                                               \
  fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, C v[], size_t m) {               \
    Fmu* f = c;                                                                                                     \
    size_t k = 0;                                                                                                   \
    for (size_t i = 0; i < n; i++) {                                                                                \
      if (r[i] / 10 * 10 == ARRAY) {                                                                                \
        for (int j = 0; j < 6; j++) v[k++] = (C)f->array[6 * (r[i] % 10) + j];                                      \
      } else if (r[i] == LENGTH) {                                                                                  \
        v[k++] = (C)f->length;                                                                                      \
      } else if (r[i] / 10 * 10 == ENUMERATION) {                                                                   \
        v[k++] = (C)(r[i] % 10 ? f->kept : f->chosen);                                                              \
      } else {                                                                                                      \
        v[k++] = r[i] % 10 ? f->out_##NAME : f->in_##NAME;                                                          \
      }                                                                                                             \
    }                                                                                                               \
    return k == m ? fmi3OK : fmi3Error;                                                                             \
  }                                                                                                                 \
  fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference r[], size_t n, const C v[], size_t m) {         \
    Fmu* f = c;                                                                                                     \
    size_t k = 0;                                                                                                   \
    for (size_t i = 0; i < n; i++) {                                                                                \
      if (r[i] == ARRAY) {                                                                                          \
        for (int j = 0; j < 6; j++) f->array[j] = (double)v[k++];                                                   \
      } else if (r[i] == ENUMERATION) {                                                                             \
        f->chosen = (long long)v[k++];                                                                              \
      } else {                                                                                                      \
        f->in_##NAME = v[k++];                                                                                      \
      }                                                                                                             \
    }                                                                                                               \
    return k == m ? fmi3OK : fmi3Error;                                                                             \
  }
TYPES

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3String v[], size_t m) {
  ((Fmu*)c)->length = (int)strlen(v[0]);
  return n == 1 && m == 1 ? fmi3OK : fmi3Error;
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String path, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
  return calloc(1, sizeof(Fmu));
}
void fmi3FreeInstance(fmi3Instance f) { free(f); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance f, fmi3Boolean defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop) {
  return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance f) { return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean* event,
                      fmi3Boolean* terminate, fmi3Boolean* early, fmi3Float64* last) {
  step(c);
  return fmi3OK;
}

#else

#define TYPE(NAME, C)                                                                                        \
  fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, C v[]) {                 \
    Fmu* f = c;                                                                                              \
    for (size_t i = 0; i < n; i++) {                                                                         \
      if (r[i] == LENGTH) v[i] = (C)f->length;                                                               \
      else if (r[i] / 10 * 10 == ENUMERATION) v[i] = (C)(r[i] % 10 ? f->kept : f->chosen);                   \
      else v[i] = r[i] % 10 ? f->out_##NAME : f->in_##NAME;                                                  \
    }                                                                                                        \
    return fmi2OK;                                                                                           \
  }                                                                                                          \
  fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference r[], size_t n, const C v[]) {           \
    Fmu* f = c;                                                                                              \
    for (size_t i = 0; i < n; i++) {                                                                         \
      if (r[i] == ENUMERATION) f->chosen = (long long)v[i];                                                  \
      else f->in_##NAME = v[i];                                                                              \
    }                                                                                                        \
    return fmi2OK;                                                                                           \
  }
TYPES

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2String v[]) {
  ((Fmu*)c)->length = (int)strlen(v[0]);
  return fmi2OK;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  return calloc(1, sizeof(Fmu));
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component f, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component f) { return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  step(c);
  return fmi2OK;
}

#endif
