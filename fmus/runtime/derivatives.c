/* Directional and adjoint derivatives of unknowns with respect to knowns, output and input derivatives.

   Knowns are time, states, sampled states, inputs and parameters. Unknowns are derivatives, outputs and the tick map,
   next values and sampled outputs of a tick at the present time, so that sampled models can be linearised. */

#include "core.h"

#include <math.h>
#include <string.h>

static const int derivative_modes = INITIALIZATION | INITIALIZED | TERMINATED;

/* Return the entry of a variable in the seeds or results, or log an error and return a null pointer. */
static double* place_of(const Model* m, const Instance* in, double* const columns[], Reference reference,
                        const char* word) {
  const Variable* v = hfsa_variable(m, in, word, reference);
  if (v && !columns[v->role]) hfsa_report(in, ERROR, "%s is not among the %s of a derivative", v->name, word);
  return v && columns[v->role] ? &columns[v->role][v->index] : NULL;
}

static Status check_finite(const Model* m, const Instance* in, const Reference* references, size_t n,
                           const double* values) {
  for (size_t i = 0; i < n; i++)
    if (!isfinite(values[i]))
      return hfsa_report(in, DISCARD, "the derivative for %s is %g at time %.15g",
                         hfsa_variable(m, in, "derivative", references[i])->name, values[i], in->state->time);
  return OK;
}

/* Scatter the seed into one set of columns, evaluate the function, and gather the result from the other set. */
static Status propagate(const Model* m, Instance* in, int backward, const Reference* unknowns, size_t n_unknowns,
                        const Reference* knowns, size_t n_knowns, const double* seed, double* sensitivity) {
  const Reference* from = backward ? unknowns : knowns;
  const Reference* to = backward ? knowns : unknowns;
  size_t n_from = backward ? n_unknowns : n_knowns, n_to = backward ? n_knowns : n_unknowns;
  double* const* sources = backward ? in->result : in->seed;
  double* const* targets = backward ? in->seed : in->result;
  memset(backward ? in->results : in->seeds, 0, backward ? in->results_size : in->seeds_size);
  for (size_t i = 0; i < n_from; i++) {
    double* place = place_of(m, in, sources, from[i], backward ? "unknowns" : "knowns");
    if (!place) return ERROR;
    *place += seed[i];
  }
  if (backward ? hfsa_adjoint(m, in) : hfsa_forward(m, in, in->state->time, in->x, in->u))
    return hfsa_report(in, DISCARD, "the derivatives cannot be evaluated at time %.15g", in->state->time);
  for (size_t i = 0; i < n_to; i++) {
    const double* place = place_of(m, in, targets, to[i], backward ? "knowns" : "unknowns");
    if (!place) return ERROR;
    sensitivity[i] = *place;
  }
  return check_finite(m, in, to, n_to, sensitivity);
}

Status hfsa_directional(const Model* m, Instance* in, const Reference* unknowns, size_t n_unknowns,
                        const Reference* knowns, size_t n_knowns, const double* seed, double* sensitivity) {
  Status status = hfsa_permit(in, "GetDirectionalDerivative", derivative_modes);
  return status ? status : propagate(m, in, 0, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

Status hfsa_adjoint_derivative(const Model* m, Instance* in, const Reference* unknowns, size_t n_unknowns,
                               const Reference* knowns, size_t n_knowns, const double* seed, double* sensitivity) {
  Status status = hfsa_permit(in, "GetAdjointDerivative", derivative_modes);
  return status ? status : propagate(m, in, 1, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity);
}

static Status check_order(const Instance* in, const char* call, const Variable* v, int order, int highest) {
  if (order >= 1 && order <= highest) return OK;
  return hfsa_report(in, ERROR, "%s: order %d of %s is not known; the highest is %d", call, order, v->name, highest);
}

/* Time derivatives of outputs along the trajectory: time, states and inputs change, all other variables are held. */
Status hfsa_output_derivatives(const Model* m, Instance* in, const Reference* references, size_t n, const int* orders,
                               double* values) {
  static const char call[] = "GetOutputDerivatives";
  Status status = hfsa_permit(in, call, STEP | TERMINATED);
  for (size_t i = 0; i < n && !status; i++) {
    const Variable* v = hfsa_variable(m, in, call, references[i]);
    if (!v) return ERROR;
    if (v->role != ROLE_OUTPUT && v->role != ROLE_SAMPLED_OUTPUT)
      return hfsa_report(in, ERROR, "%s: %s is not an output", call, v->name);
    status = check_order(in, call, v, orders[i], 1);
  }
  if (status) return status;
  hfsa_seed_motion(m, in, 0.0);
  int failed = hfsa_evaluate(m, in, DERIVATIVES_VALID);
  memcpy(in->seed[ROLE_STATE], in->der, (size_t)m->size[ROLE_STATE] * sizeof(double));
  if (failed || hfsa_forward(m, in, in->state->time, in->x, in->u))
    return hfsa_report(in, DISCARD, "the derivatives cannot be evaluated at time %.15g", in->state->time);
  for (size_t i = 0; i < n; i++) {
    const Variable* v = hfsa_variable(m, in, call, references[i]);
    values[i] = v->role == ROLE_OUTPUT ? in->result[ROLE_OUTPUT][v->index] : 0.0;
  }
  return check_finite(m, in, references, n, values);
}

/* Set derivatives of inputs for the next step only. */
Status hfsa_set_input_derivatives(const Model* m, Instance* in, const Reference* references, size_t n,
                                  const int* orders, const double* values) {
  static const char call[] = "SetRealInputDerivatives";
  Status status = hfsa_permit(in, call, INITIALIZATION | STEP);
  for (size_t i = 0; i < n && !status; i++) {
    const Variable* v = hfsa_variable(m, in, call, references[i]);
    if (!v) return ERROR;
    if (v->role != ROLE_INPUT) return hfsa_report(in, ERROR, "%s: %s is not an input", call, v->name);
    if (!isfinite(values[i])) return hfsa_report(in, ERROR, "%s: the derivative of %s is %g", call, v->name, values[i]);
    status = check_order(in, call, v, orders[i], 2);
    if (status) return status;
    in->rates[(orders[i] - 1) * m->size[ROLE_INPUT] + v->index] = values[i];
    in->state->once = 1;
  }
  return status;
}
