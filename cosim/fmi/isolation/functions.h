/* The functions of FMI that cross from client to host: how each takes its arguments, its name, and for those that move
   values the size of one. Client and host are both made from this list. */

#ifndef FUNCTIONS_H
#define FUNCTIONS_H

#define FUNCTIONS(X)                                  \
  X(INSTANTIATE_2, fmi2Instantiate, 0)                \
  X(FREE, fmi2FreeInstance, 0)                        \
  X(LOGGING_2, fmi2SetDebugLogging, 0)                \
  X(EXPERIMENT_2, fmi2SetupExperiment, 0)             \
  X(PLAIN, fmi2EnterInitializationMode, 0)            \
  X(PLAIN, fmi2ExitInitializationMode, 0)             \
  X(PLAIN, fmi2Terminate, 0)                          \
  X(PLAIN, fmi2Reset, 0)                              \
  X(GET_2, fmi2GetReal, 8)                            \
  X(GET_2, fmi2GetInteger, 4)                         \
  X(GET_2, fmi2GetBoolean, 4)                         \
  X(SET_2, fmi2SetReal, 8)                            \
  X(SET_2, fmi2SetInteger, 4)                         \
  X(SET_2, fmi2SetBoolean, 4)                         \
  X(TEXTS_2, fmi2SetString, 0)                        \
  X(SAVE, fmi2GetFMUstate, 0)                         \
  X(RESTORE, fmi2SetFMUstate, 0)                      \
  X(RELEASE, fmi2FreeFMUstate, 0)                     \
  X(STATE_SIZE, fmi2SerializedFMUstateSize, 0)        \
  X(SERIALIZE, fmi2SerializeFMUstate, 0)              \
  X(DESERIALIZE, fmi2DeSerializeFMUstate, 0)          \
  X(DIRECTIONAL_2, fmi2GetDirectionalDerivative, 0)   \
  X(STEP_2, fmi2DoStep, 0)                            \
  X(RATES_2, fmi2SetRealInputDerivatives, 0)          \
  X(RATES_2, fmi2GetRealOutputDerivatives, 0)         \
  X(PLAIN, fmi2EnterEventMode, 0)                     \
  X(UPDATE_2, fmi2NewDiscreteStates, 0)               \
  X(PLAIN, fmi2EnterContinuousTimeMode, 0)            \
  X(COMPLETED_2, fmi2CompletedIntegratorStep, 0)      \
  X(TIME, fmi2SetTime, 0)                             \
  X(ARRAY, fmi2SetContinuousStates, 0)                \
  X(ARRAY, fmi2GetContinuousStates, 0)                \
  X(ARRAY, fmi2GetDerivatives, 0)                     \
  X(ARRAY, fmi2GetEventIndicators, 0)                 \
  X(ARRAY, fmi2GetNominalsOfContinuousStates, 0)      \
  X(INSTANTIATE_3, fmi3InstantiateCoSimulation, 0)    \
  X(INSTANTIATE_ME_3, fmi3InstantiateModelExchange, 0) \
  X(FREE, fmi3FreeInstance, 0)                        \
  X(LOGGING_3, fmi3SetDebugLogging, 0)                \
  X(EXPERIMENT_3, fmi3EnterInitializationMode, 0)     \
  X(PLAIN, fmi3ExitInitializationMode, 0)             \
  X(PLAIN, fmi3Terminate, 0)                          \
  X(PLAIN, fmi3Reset, 0)                              \
  X(GET_3, fmi3GetFloat32, 4)                         \
  X(GET_3, fmi3GetFloat64, 8)                         \
  X(GET_3, fmi3GetInt8, 1)                            \
  X(GET_3, fmi3GetUInt8, 1)                           \
  X(GET_3, fmi3GetInt16, 2)                           \
  X(GET_3, fmi3GetUInt16, 2)                          \
  X(GET_3, fmi3GetInt32, 4)                           \
  X(GET_3, fmi3GetUInt32, 4)                          \
  X(GET_3, fmi3GetInt64, 8)                           \
  X(GET_3, fmi3GetUInt64, 8)                          \
  X(GET_3, fmi3GetBoolean, 1)                         \
  X(SET_3, fmi3SetFloat32, 4)                         \
  X(SET_3, fmi3SetFloat64, 8)                         \
  X(SET_3, fmi3SetInt8, 1)                            \
  X(SET_3, fmi3SetUInt8, 1)                           \
  X(SET_3, fmi3SetInt16, 2)                           \
  X(SET_3, fmi3SetUInt16, 2)                          \
  X(SET_3, fmi3SetInt32, 4)                           \
  X(SET_3, fmi3SetUInt32, 4)                          \
  X(SET_3, fmi3SetInt64, 8)                           \
  X(SET_3, fmi3SetUInt64, 8)                          \
  X(SET_3, fmi3SetBoolean, 1)                         \
  X(TEXTS_3, fmi3SetString, 0)                        \
  X(SAVE, fmi3GetFMUState, 0)                         \
  X(RESTORE, fmi3SetFMUState, 0)                      \
  X(RELEASE, fmi3FreeFMUState, 0)                     \
  X(STATE_SIZE, fmi3SerializedFMUStateSize, 0)        \
  X(SERIALIZE, fmi3SerializeFMUState, 0)              \
  X(DESERIALIZE, fmi3DeserializeFMUState, 0)          \
  X(DIRECTIONAL_3, fmi3GetDirectionalDerivative, 0)   \
  X(STEP_3, fmi3DoStep, 0)                            \
  X(RATES_3, fmi3GetOutputDerivatives, 0)             \
  X(PLAIN, fmi3EnterEventMode, 0)                     \
  X(UPDATE_3, fmi3UpdateDiscreteStates, 0)            \
  X(PLAIN, fmi3EnterContinuousTimeMode, 0)            \
  X(COMPLETED_3, fmi3CompletedIntegratorStep, 0)      \
  X(TIME, fmi3SetTime, 0)                             \
  X(ARRAY, fmi3SetContinuousStates, 0)                \
  X(ARRAY, fmi3GetContinuousStates, 0)                \
  X(ARRAY, fmi3GetContinuousStateDerivatives, 0)      \
  X(ARRAY, fmi3GetEventIndicators, 0)                 \
  X(ARRAY, fmi3GetNominalsOfContinuousStates, 0)

#define NUMBER(kind, name, size) F_##name,
enum { FUNCTIONS(NUMBER) N_FUNCTIONS };
#undef NUMBER

#endif
