/* Time, states, derivatives and nominal values for the solver of a Model Exchange importer. */

#include "core.h"

#include <math.h>
#include <string.h>

Status hfsa_set_time(Instance* in, double time) {
  Status status = hfsa_permit(in, "SetTime", EVENT | CONTINUOUS_TIME);
  if (status) return status;
  if (!isfinite(time)) return hfsa_report(in, ERROR, "SetTime: time cannot be %g", time);
  if (in->state->time != time) in->valid = 0;
  in->state->time = time;
  return OK;
}

Status hfsa_set_states(const Model* m, Instance* in, const double* x, size_t n) {
  Status status = hfsa_permit(in, "SetContinuousStates", EVENT | CONTINUOUS_TIME);
  if (!status) status = hfsa_same_size(in, "SetContinuousStates", n, (size_t)m->size[ROLE_STATE]);
  if (status) return status;
  for (size_t i = 0; i < n; i++) in->x[i] = x[i];
  in->valid = 0;
  return OK;
}

static Status copy_out(const Model* m, Instance* in, const char* call, const double* column, double* values, size_t n) {
  Status status = hfsa_same_size(in, call, n, (size_t)m->size[ROLE_STATE]);
  for (size_t i = 0; i < n && !status; i++) values[i] = column[i];
  return status;
}

Status hfsa_get_states(const Model* m, Instance* in, double* x, size_t n) {
  return in ? copy_out(m, in, "GetContinuousStates", in->x, x, n) : ERROR;
}

Status hfsa_get_nominals(const Model* m, Instance* in, double* nominals, size_t n) {
  return in ? copy_out(m, in, "GetNominalsOfContinuousStates", in->nominal, nominals, n) : ERROR;
}

Status hfsa_get_derivatives(const Model* m, Instance* in, double* der, size_t n) {
  if (!in) return ERROR;
  int failed = hfsa_evaluate(m, in, DERIVATIVES_VALID);
  Status status = copy_out(m, in, "GetDerivatives", in->der, der, n);
  if (status) return status;
  if (failed) return hfsa_report(in, DISCARD, "the derivatives cannot be evaluated at time %.15g", in->state->time);
  for (int i = 0; i < m->size[ROLE_STATE]; i++)
    if (!isfinite(der[i]))
      return hfsa_report(in, DISCARD, "%s is %g at time %.15g", hfsa_name(m, ROLE_DERIVATIVE, i), der[i],
                         in->state->time);
  return OK;
}
