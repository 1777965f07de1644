/* The modes of an instance and the transitions between them, from instantiation to termination. */

#include "core.h"

#include <math.h>
#include <string.h>

Status hfsa_setup(Instance* in, double start_time, int stop_defined, double stop_time) {
  Status status = hfsa_permit(in, "SetupExperiment", INSTANTIATED);
  if (status) return status;
  if (!isfinite(start_time))
    return hfsa_report(in, ERROR, "the start time is %g, expected a finite number", start_time);
  if (stop_defined && !(stop_time >= start_time))
    return hfsa_report(in, ERROR, "the stop time is %g, expected at least the start time %g", stop_time, start_time);
  in->state->time = in->state->start_time = start_time;
  in->state->stop_time = stop_defined ? stop_time : HUGE_VAL;
  in->valid = 0;
  return OK;
}

static Status change_mode(Instance* in, const char* call, int from, int to) {
  Status status = hfsa_permit(in, call, from);
  if (!status) in->state->mode = to;
  return status;
}

Status hfsa_enter_initialization(Instance* in) {
  Status status = change_mode(in, "EnterInitializationMode", INSTANTIATED, INITIALIZATION);
  if (!status) memset(in->counts, 0, sizeof in->counts);
  return status;
}

Status hfsa_exit_initialization(Instance* in) {
  return change_mode(in, "ExitInitializationMode", INITIALIZATION, in && in->interface == BY_CO_SIMULATION ? STEP : EVENT);
}

Status hfsa_enter_event_mode(Instance* in) { return change_mode(in, "EnterEventMode", CONTINUOUS_TIME, EVENT); }

Status hfsa_enter_continuous_time_mode(Instance* in) {
  return change_mode(in, "EnterContinuousTimeMode", EVENT, CONTINUOUS_TIME);
}

Status hfsa_terminate(Instance* in) { return change_mode(in, "Terminate", INITIALIZATION | INITIALIZED, TERMINATED); }

/* Event iteration of Model Exchange: execute the ticks that are due, and return the time of the next one. */
Status hfsa_update_discrete_states(const Model* m, Instance* in, NextEvent* next) {
  Status status = hfsa_permit(in, "the update of discrete states", EVENT);
  next->defined = m->sample_time >= 0;
  next->time = 0.0;
  if (!next->defined) return status;
  while (!status && hfsa_tick_time(m, in) <= in->state->time + hfsa_tick_tolerance(m, in))
    status = hfsa_do_tick(m, in, hfsa_tick_time(m, in), in->u);
  if (!status) next->time = hfsa_tick_time(m, in);
  return status;
}

Status hfsa_reset(const Model* m, Instance* in) {
  if (!in) return ERROR;
  hfsa_start_values(m, in);
  return OK;
}
