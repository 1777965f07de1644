/* FMI 3.0: the functions of the standard, each a call of core.h. */

#include "core.h"

#include "fmi3Functions.h"

#include <math.h>

#define MODEL (&hfsa_model)

static void send(const Log* log, const char* instance, Status status, const char* category, const char* text) {
  (void)instance;
  ((fmi3LogMessageCallback)log->callback)(log->environment, (fmi3Status)status, category, text);
}

static Log log_of(fmi3LogMessageCallback callback, fmi3InstanceEnvironment environment) {
  Log log = {send, NULL, NULL, 0};
  log.callback = (void (*)(void))callback;
  log.environment = environment;
  return log;
}

/* Tell the importer of a point inside a step, at which it can read but not set. A request to return early is met at
   once, not at the later time that it may name: the importer steps on from there. */
static int tell(Instance* in) {
  fmi3Boolean requested = fmi3False;
  fmi3Float64 time = in->state->time;
  ((fmi3IntermediateUpdateCallback)in->listener.callback)(in->log.environment, time, fmi3False, fmi3True, fmi3True,
                                                          in->listener.may_end != 0, &requested, &time);
  return requested && in->listener.may_end;
}

/* Reject a call of a feature that the model description of this FMU does not declare. */
static fmi3Status not_offered(fmi3Instance c, const char* call, const char* feature) {
  return c ? (fmi3Status)hfsa_report(c, ERROR, "%s: this FMU has no %s", call, feature) : fmi3Error;
}

const char* fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback callback) {
  (void)resources;
  (void)visible;
  return hfsa_create(MODEL, BY_MODEL_EXCHANGE, name, token, log_of(callback, environment), logging);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n_required,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback callback,
                                         fmi3IntermediateUpdateCallback update) {
  (void)resources;
  (void)visible;
  (void)required; /* all variables can be read */
  Instance* in = hfsa_create(MODEL, BY_CO_SIMULATION, name, token, log_of(callback, environment), logging);
  if (in && update) in->listener = (Listener){tell, (void (*)(void))update, early_return};
  if (!in || (!event_mode && (update || n_required == 0))) return in;
  in->log.categories = ~0u;
  if (event_mode)
    not_offered(in, "InstantiateCoSimulation", "event mode in Co-Simulation");
  else
    hfsa_report(in, ERROR, "InstantiateCoSimulation: intermediate variables are required, but no function takes them");
  hfsa_free(MODEL, in);
  return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment, fmi3LogMessageCallback callback,
                                               fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
  (void)name;
  (void)token;
  (void)resources;
  (void)visible;
  (void)logging;
  (void)clock_update;
  (void)lock;
  (void)unlock;
  if (callback) callback(environment, fmi3Error, "logStatusError", "this FMU has no Scheduled Execution");
  return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { hfsa_free(MODEL, c); }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
  return c ? (fmi3Status)hfsa_set_logging(c, on, n, categories) : fmi3Error;
}

/* Modes */

/* The tolerance argument is ignored: the tolerance of the solver is a parameter, the same in every importer. */
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start_time, fmi3Boolean stop_defined, fmi3Float64 stop_time) {
  (void)tolerance_defined;
  (void)tolerance;
  Status status = hfsa_permit(c, "EnterInitializationMode", INSTANTIATED);
  if (!status) status = hfsa_setup(c, start_time, stop_defined, stop_time);
  return (fmi3Status)(status ? status : hfsa_enter_initialization(c));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return (fmi3Status)hfsa_exit_initialization(c); }

fmi3Status fmi3Terminate(fmi3Instance c) { return (fmi3Status)hfsa_terminate(c); }

fmi3Status fmi3Reset(fmi3Instance c) { return (fmi3Status)hfsa_reset(MODEL, c); }

fmi3Status fmi3EnterEventMode(fmi3Instance c) { return (fmi3Status)hfsa_enter_event_mode(c); }

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { return (fmi3Status)hfsa_enter_continuous_time_mode(c); }

/* There is no event mode in Co-Simulation, so this call only checks the mode. */
fmi3Status fmi3EnterStepMode(fmi3Instance c) { return (fmi3Status)hfsa_permit(c, "EnterStepMode", STEP); }

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
  return not_offered(c, "EnterConfigurationMode", "structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
  return not_offered(c, "ExitConfigurationMode", "structural parameters");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
  return (fmi3Status)hfsa_permit(c, "EvaluateDiscreteStates", INITIALIZATION | EVENT);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean* need_update, fmi3Boolean* terminate,
                                    fmi3Boolean* nominals_changed, fmi3Boolean* values_changed,
                                    fmi3Boolean* next_defined, fmi3Float64* next_time) {
  NextEvent next;
  Status status = hfsa_update_discrete_states(MODEL, c, &next);
  *need_update = *terminate = *nominals_changed = *values_changed = fmi3False;
  *next_defined = next.defined != 0;
  *next_time = next.time;
  return (fmi3Status)status;
}

/* Variables */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 values[],
                          size_t n_values) {
  if (!c || hfsa_same_size(c, "GetFloat64", n_values, n)) return fmi3Error;
  return (fmi3Status)hfsa_get(MODEL, c, vr, n, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 values[],
                          size_t n_values) {
  if (!c || hfsa_same_size(c, "SetFloat64", n_values, n)) return fmi3Error;
  return (fmi3Status)hfsa_set(MODEL, c, vr, n, values);
}

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String values[],
                         size_t n_values) {
  if (!c || hfsa_same_size(c, "GetString", n_values, n)) return fmi3Error;
  return (fmi3Status)hfsa_get_text(MODEL, c, vr, n, values);
}

/* Types that no variable has, and strings, which are constant. */
#define REFUSE_GET(Type)                                                                                 \
  fmi3Status fmi3Get##Type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##Type values[], \
                           size_t n_values) {                                                            \
    (void)values;                                                                                        \
    (void)n_values;                                                                                      \
    return (fmi3Status)hfsa_refuse(MODEL, c, "Get" #Type, vr, n);                                        \
  }

#define REFUSE_SET(Type)                                                                                       \
  fmi3Status fmi3Set##Type(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##Type values[], \
                           size_t n_values) {                                                                  \
    (void)values;                                                                                              \
    (void)n_values;                                                                                            \
    return (fmi3Status)hfsa_refuse(MODEL, c, "Set" #Type, vr, n);                                              \
  }

#define REFUSE(Type) REFUSE_GET(Type) REFUSE_SET(Type)

REFUSE(Float32)
REFUSE(Int8)
REFUSE(UInt8)
REFUSE(Int16)
REFUSE(UInt16)
REFUSE(Int32)
REFUSE(UInt32)
REFUSE(Int64)
REFUSE(UInt64)
REFUSE(Boolean)
REFUSE_SET(String)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[],
                         size_t n_values) {
  (void)sizes;
  (void)values;
  (void)n_values;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetBinary", vr, n);
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t n_values) {
  (void)sizes;
  (void)values;
  (void)n_values;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetBinary", vr, n);
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference reference, size_t* n) {
  (void)reference;
  (void)n;
  return not_offered(c, "GetNumberOfVariableDependencies", "dependencies of array elements");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent, size_t element_of_dependent[],
                                       fmi3ValueReference independents[], size_t elements_of_independents[],
                                       fmi3DependencyKind kinds[], size_t n) {
  (void)dependent;
  (void)element_of_dependent;
  (void)independents;
  (void)elements_of_independents;
  (void)kinds;
  (void)n;
  return not_offered(c, "GetVariableDependencies", "dependencies of array elements");
}

/* FMU states */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState* state) {
  return (fmi3Status)hfsa_get_state(MODEL, c, (Snapshot**)state);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return (fmi3Status)hfsa_set_state(MODEL, c, state); }

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState* state) {
  return (fmi3Status)hfsa_free_state(c, (Snapshot**)state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t* size) {
  return (fmi3Status)hfsa_serialized_size(MODEL, c, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
  return (fmi3Status)hfsa_serialize(MODEL, c, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState* state) {
  return (fmi3Status)hfsa_deserialize(MODEL, c, bytes, size, (Snapshot**)state);
}

/* Derivatives */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                        const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
  static const char call[] = "GetDirectionalDerivative";
  if (!c || hfsa_same_size(c, call, n_seed, n_knowns) || hfsa_same_size(c, call, n_sensitivity, n_unknowns))
    return fmi3Error;
  return (fmi3Status)hfsa_directional(MODEL, c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,
                                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
  static const char call[] = "GetAdjointDerivative";
  if (!c || hfsa_same_size(c, call, n_seed, n_unknowns) || hfsa_same_size(c, call, n_sensitivity, n_knowns))
    return fmi3Error;
  return (fmi3Status)hfsa_adjoint_derivative(MODEL, c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t n_values) {
  if (!c || hfsa_same_size(c, "GetOutputDerivatives", n_values, n)) return fmi3Error;
  return (fmi3Status)hfsa_output_derivatives(MODEL, c, vr, n, orders, values);
}

/* Model Exchange */

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) { return (fmi3Status)hfsa_set_time(c, time); }

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
  return (fmi3Status)hfsa_set_states(MODEL, c, x, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
  return (fmi3Status)hfsa_get_states(MODEL, c, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 der[], size_t n) {
  return (fmi3Status)hfsa_get_derivatives(MODEL, c, der, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n) {
  return (fmi3Status)hfsa_get_nominals(MODEL, c, nominals, n);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t* n) {
  *n = (size_t)hfsa_model.size[ROLE_STATE];
  return c ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t* n) {
  *n = 0;
  return c ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n) {
  (void)indicators;
  return c ? (fmi3Status)hfsa_same_size(c, "GetEventIndicators", n, 0) : fmi3Error;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state, fmi3Boolean* enter_event_mode,
                                       fmi3Boolean* terminate) {
  (void)no_set_state;
  *enter_event_mode = *terminate = fmi3False;
  return (fmi3Status)hfsa_permit(c, "CompletedIntegratorStep", CONTINUOUS_TIME);
}

/* Co-Simulation */

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step_size, fmi3Boolean no_set_state,
                      fmi3Boolean* event_needed, fmi3Boolean* terminate, fmi3Boolean* early_return,
                      fmi3Float64* last_time) {
  (void)no_set_state;
  Status status = hfsa_do_step(MODEL, c, time, step_size);
  *event_needed = *terminate = fmi3False;
  *early_return = c && !status && isfinite(((Instance*)c)->ended);
  *last_time = c ? ((Instance*)c)->state->time : time;
  return (fmi3Status)status;
}

/* Clocks and Scheduled Execution */

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[]) {
  (void)values;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetClock", vr, n);
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
  (void)values;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetClock", vr, n);
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
  (void)intervals;
  (void)qualifiers;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetIntervalDecimal", vr, n);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
  (void)counters;
  (void)resolutions;
  (void)qualifiers;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetIntervalFraction", vr, n);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]) {
  (void)shifts;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetShiftDecimal", vr, n);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[]) {
  (void)counters;
  (void)resolutions;
  return (fmi3Status)hfsa_refuse(MODEL, c, "GetShiftFraction", vr, n);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                  const fmi3Float64 intervals[]) {
  (void)intervals;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetIntervalDecimal", vr, n);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) {
  (void)counters;
  (void)resolutions;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetIntervalFraction", vr, n);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[]) {
  (void)shifts;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetShiftDecimal", vr, n);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) {
  (void)counters;
  (void)resolutions;
  return (fmi3Status)hfsa_refuse(MODEL, c, "SetShiftFraction", vr, n);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time) {
  (void)clock;
  (void)time;
  return not_offered(c, "ActivateModelPartition", "clocks");
}
