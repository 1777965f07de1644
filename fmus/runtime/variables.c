/* Reading and writing variables by value reference. */

#include "core.h"

#include <math.h>
#include <string.h>

/* Modes in which the variables of each role can be set. */
static const int settable[ROLES] = {
    [ROLE_STATE] = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS_TIME,
    [ROLE_SAMPLED_STATE] = INSTANTIATED | INITIALIZATION,
    [ROLE_INPUT] = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS_TIME | STEP,
    [ROLE_INPUT_DERIVATIVE] = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS_TIME | STEP,
    [ROLE_SAMPLED_OUTPUT] = INSTANTIATED | INITIALIZATION,
    [ROLE_PARAMETER] = INSTANTIATED | INITIALIZATION | EVENT | CONTINUOUS_TIME | STEP,
    [ROLE_SOLVER] = INSTANTIATED | INITIALIZATION,
};

/* Results that must be valid before the variables of each role are read. */
static const unsigned needed[ROLES] = {
    [ROLE_DERIVATIVE] = DERIVATIVES_VALID,
    [ROLE_NEXT] = NEXT_VALID,
    [ROLE_OUTPUT] = OUTPUTS_VALID,
};

/* Return the variable with a value reference, or log an error and return a null pointer. */
const Variable* hfsa_variable(const Model* m, const Instance* in, const char* call, Reference reference) {
  if (reference && reference <= (Reference)m->variable_count) return &m->variables[reference - 1];
  hfsa_report(in, ERROR, "%s: there is no value reference %u; %s has 1 to %d", call, reference, m->name,
              m->variable_count);
  return NULL;
}

Status hfsa_same_size(const Instance* in, const char* call, size_t found, size_t expected) {
  if (found == expected) return OK;
  return hfsa_report(in, ERROR, "%s was called with %lu values, expected %lu", call, (unsigned long)found,
                     (unsigned long)expected);
}

/* Read values; results that a change of the state block has invalidated are evaluated first. */
Status hfsa_get(const Model* m, Instance* in, const Reference* references, size_t n, double* values) {
  Status status = hfsa_permit(in, "Get", ANY_MODE);
  for (size_t i = 0; i < n && status != ERROR; i++) {
    const Variable* v = hfsa_variable(m, in, "Get", references[i]);
    if (!v) return ERROR;
    if (v->role == ROLE_TEXT) return hfsa_report(in, ERROR, "Get: %s is a string, not a number", v->name);
    if (needed[v->role] && hfsa_evaluate(m, in, needed[v->role]))
      return hfsa_report(in, DISCARD, "%s cannot be evaluated at time %.15g", v->name, in->state->time);
    values[i] = in->column[v->role][v->index];
    if (needed[v->role] && !isfinite(values[i]))
      status = hfsa_report(in, DISCARD, "%s is %g at time %.15g", v->name, values[i], in->state->time);
  }
  return status;
}

static Status refuse_set(const Instance* in, const Variable* v) {
  switch (v->role) {
    case ROLE_TIME:
      return hfsa_report(in, ERROR, "Set: %s is the independent variable", v->name);
    case ROLE_DERIVATIVE:
    case ROLE_NEXT:
    case ROLE_OUTPUT:
    case ROLE_COUNTER:
      return hfsa_report(in, ERROR, "Set: %s is calculated", v->name);
    case ROLE_CONSTANT:
    case ROLE_TEXT:
      return hfsa_report(in, ERROR, "Set: %s is a constant of the exported model", v->name);
    default:
      return hfsa_report(
          in, ERROR, "Set: %s was set %s; %s", v->name, hfsa_mode_name(in->state->mode),
          in->state->mode == TERMINATED ? "reset the instance first" : "it can be set until the end of initialization");
  }
}

/* Check that a value is admissible; inputs are checked at the beginning of a step. */
static Status check_value(const Instance* in, const Variable* v, double value) {
  int bounded = v->role == ROLE_PARAMETER || v->role == ROLE_SOLVER;
  if (v->role == ROLE_INPUT) return OK;
  if (!isfinite(value)) return hfsa_report(in, ERROR, "Set: %s cannot be %g, expected a finite number", v->name, value);
  if (v->role == ROLE_SOLVER && !(value > 0.0))
    return hfsa_report(in, ERROR, "Set: %s cannot be %g, expected a number above 0", v->name, value);
  if (bounded && !(value >= v->min && value <= v->max))
    return hfsa_report(in, ERROR, "Set: %s cannot be %g, expected %g to %g", v->name, value, v->min, v->max);
  return OK;
}

/* Write values up to the first inadmissible one. Cached results stay valid if no value changes. */
Status hfsa_set(const Model* m, Instance* in, const Reference* references, size_t n, const double* values) {
  if (!in) return ERROR;
  for (size_t i = 0; i < n; i++) {
    const Variable* v = hfsa_variable(m, in, "Set", references[i]);
    if (!v) return ERROR;
    int modes = v->fixed ? INSTANTIATED | INITIALIZATION : settable[v->role];
    if (!(in->state->mode & modes)) return refuse_set(in, v);
    if (check_value(in, v, values[i])) return ERROR;
    double* place = &in->column[v->role][v->index];
    if (memcmp(place, &values[i], sizeof(double)) != 0) in->valid = 0;
    *place = values[i];
  }
  return OK;
}

Status hfsa_get_text(const Model* m, Instance* in, const Reference* references, size_t n, const char** values) {
  if (!in) return ERROR;
  for (size_t i = 0; i < n; i++) {
    const Variable* v = hfsa_variable(m, in, "GetString", references[i]);
    if (!v) return ERROR;
    if (v->role != ROLE_TEXT) return hfsa_report(in, ERROR, "GetString: %s is a number, not a string", v->name);
    values[i] = v->text;
  }
  return OK;
}

/* Reject a call for a type that no variable has, or for setting strings; an empty list is accepted. */
Status hfsa_refuse(const Model* m, Instance* in, const char* call, const Reference* references, size_t n) {
  if (!in) return ERROR;
  if (n == 0) return OK;
  const Variable* v = hfsa_variable(m, in, call, references[0]);
  if (!v) return ERROR;
  return hfsa_report(in, ERROR, "%s: %s is %s", call, v->name,
                     v->role == ROLE_TEXT ? "a constant string" : "a real number");
}
