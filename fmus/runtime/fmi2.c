/* FMI 2.0: the functions of the standard, each a call of core.h. */

#include "core.h"

#include "fmi2Functions.h"

#include <string.h>

#define MODEL (&hfsa_model)

/* The message is the format string itself: names contain neither % nor #. */
static void send(const Log* log, const char* instance, Status status, const char* category, const char* text) {
  ((fmi2CallbackLogger)log->callback)(log->environment, instance, (fmi2Status)status, category, text);
}

const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char* fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* functions, fmi2Boolean visible, fmi2Boolean logging) {
  Log log = {send, NULL, NULL, 0};
  (void)resources;
  (void)visible;
  if (functions) {
    log.callback = (void (*)(void))functions->logger;
    log.environment = functions->componentEnvironment;
  }
  return hfsa_create(MODEL, type == fmi2CoSimulation ? BY_CO_SIMULATION : BY_MODEL_EXCHANGE, name, guid, log, logging);
}

void fmi2FreeInstance(fmi2Component c) { hfsa_free(MODEL, c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  return c ? (fmi2Status)hfsa_set_logging(c, on, n, categories) : fmi2Error;
}

/* Modes */

/* The tolerance argument is ignored: the tolerance of the solver is a parameter, the same in every importer. */
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean stop_defined, fmi2Real stop_time) {
  (void)tolerance_defined;
  (void)tolerance;
  return (fmi2Status)hfsa_setup(c, start_time, stop_defined, stop_time);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return (fmi2Status)hfsa_enter_initialization(c); }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return (fmi2Status)hfsa_exit_initialization(c); }

fmi2Status fmi2Terminate(fmi2Component c) { return (fmi2Status)hfsa_terminate(c); }

fmi2Status fmi2Reset(fmi2Component c) { return (fmi2Status)hfsa_reset(MODEL, c); }

fmi2Status fmi2EnterEventMode(fmi2Component c) { return (fmi2Status)hfsa_enter_event_mode(c); }

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return (fmi2Status)hfsa_enter_continuous_time_mode(c); }

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo* info) {
  NextEvent next;
  Status status = hfsa_update_discrete_states(MODEL, c, &next);
  memset(info, 0, sizeof *info);
  info->nextEventTimeDefined = next.defined;
  info->nextEventTime = next.time;
  return (fmi2Status)status;
}

/* Variables */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real values[]) {
  return (fmi2Status)hfsa_get(MODEL, c, vr, n, values);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real values[]) {
  return (fmi2Status)hfsa_set(MODEL, c, vr, n, values);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String values[]) {
  return (fmi2Status)hfsa_get_text(MODEL, c, vr, n, values);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String values[]) {
  (void)values;
  return (fmi2Status)hfsa_refuse(MODEL, c, "SetString", vr, n);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer values[]) {
  (void)values;
  return (fmi2Status)hfsa_refuse(MODEL, c, "GetInteger", vr, n);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer values[]) {
  (void)values;
  return (fmi2Status)hfsa_refuse(MODEL, c, "SetInteger", vr, n);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean values[]) {
  (void)values;
  return (fmi2Status)hfsa_refuse(MODEL, c, "GetBoolean", vr, n);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean values[]) {
  (void)values;
  return (fmi2Status)hfsa_refuse(MODEL, c, "SetBoolean", vr, n);
}

/* FMU states */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate* state) {
  return (fmi2Status)hfsa_get_state(MODEL, c, (Snapshot**)state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return (fmi2Status)hfsa_set_state(MODEL, c, state); }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate* state) {
  return (fmi2Status)hfsa_free_state(c, (Snapshot**)state);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t* size) {
  return (fmi2Status)hfsa_serialized_size(MODEL, c, state, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  return (fmi2Status)hfsa_serialize(MODEL, c, state, bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate* state) {
  return (fmi2Status)hfsa_deserialize(MODEL, c, bytes, size, (Snapshot**)state);
}

/* Derivatives */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[], size_t n_unknowns,
                                        const fmi2ValueReference knowns[], size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
  return (fmi2Status)hfsa_directional(MODEL, c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real values[]) {
  return (fmi2Status)hfsa_set_input_derivatives(MODEL, c, vr, n, order, values);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real values[]) {
  return (fmi2Status)hfsa_output_derivatives(MODEL, c, vr, n, order, values);
}

/* Model Exchange */

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { return (fmi2Status)hfsa_set_time(c, time); }

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
  return (fmi2Status)hfsa_set_states(MODEL, c, x, n);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
  return (fmi2Status)hfsa_get_states(MODEL, c, x, n);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real der[], size_t n) {
  return (fmi2Status)hfsa_get_derivatives(MODEL, c, der, n);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t n) {
  return (fmi2Status)hfsa_get_nominals(MODEL, c, nominals, n);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n) {
  (void)indicators;
  return c ? (fmi2Status)hfsa_same_size(c, "GetEventIndicators", n, 0) : fmi2Error;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean* enter_event_mode,
                                       fmi2Boolean* terminate) {
  (void)no_set_state;
  *enter_event_mode = *terminate = fmi2False;
  return (fmi2Status)hfsa_permit(c, "CompletedIntegratorStep", CONTINUOUS_TIME);
}

/* Co-Simulation */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean no_set_state) {
  (void)no_set_state;
  return (fmi2Status)hfsa_do_step(MODEL, c, time, step_size);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
  return c ? (fmi2Status)hfsa_report(c, ERROR, "CancelStep: no step is ever pending") : fmi2Error;
}

static fmi2Status no_status(fmi2Component c) {
  return c ? (fmi2Status)hfsa_report(c, DISCARD, "GetStatus: this status is not available; no step is ever pending")
           : fmi2Error;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status* value) {
  (void)kind;
  (void)value;
  return no_status(c);
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real* value) {
  if (!c || kind != fmi2LastSuccessfulTime) return no_status(c);
  *value = ((Instance*)c)->state->time;
  return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer* value) {
  (void)kind;
  (void)value;
  return no_status(c);
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean* value) {
  if (!c || kind != fmi2Terminated) return no_status(c);
  *value = fmi2False;
  return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String* value) {
  if (!c || kind != fmi2PendingStatus) return no_status(c);
  *value = "";
  return fmi2OK;
}
