/* Evaluation of the model's equations and their derivatives. */

#include "instance.h"

#include <math.h>
#include <string.h>

static void set_point(Instance* in, const double* t, const double* x, const double* u) {
  in->arg[0] = t;
  in->arg[1] = x;
  in->arg[2] = in->z;
  in->arg[3] = u;
  in->arg[4] = in->p;
}

static int call(Instance* in, Function* function) { return function(in->arg, in->res, in->iw, in->w, 0); }

/* Compute der(x) for a solver, which counts; `hfsa_evaluate` computes what an importer reads. */
int hfsa_rhs(const Model* m, Instance* in, double t, const double* x, const double* u, double* der) {
  set_point(in, &t, x, u);
  in->res[0] = der;
  in->counts[EVALUATIONS] += 1.0;
  return call(in, m->rhs);
}

/* Compute d der / d x as a dense matrix, column by column. */
int hfsa_jacobian(const Model* m, Instance* in, double t, const double* x, const double* u, double* dense) {
  int n = m->size[ROLE_STATE];
  set_point(in, &t, x, u);
  in->res[0] = in->jacobian;
  in->counts[JACOBIANS] += 1.0;
  int failed = call(in, m->jacobian);
  memset(dense, 0, (size_t)n * (size_t)n * sizeof(double));
  for (int j = 0; j < n; j++)
    for (int k = m->jacobian_columns[j]; k < m->jacobian_columns[j + 1]; k++)
      dense[j * n + m->jacobian_rows[k]] = in->jacobian[k];
  return failed;
}

/* Compute the directional derivatives of all unknowns along `seed` into `result`. */
int hfsa_forward(const Model* m, Instance* in, double t, const double* x, const double* u) {
  set_point(in, &t, x, u);
  in->arg[5] = in->seed[ROLE_TIME];
  in->arg[6] = in->seed[ROLE_STATE];
  in->arg[7] = in->seed[ROLE_SAMPLED_STATE];
  in->arg[8] = in->seed[ROLE_INPUT];
  in->arg[9] = in->seed[ROLE_PARAMETER];
  in->res[0] = in->result[ROLE_DERIVATIVE];
  in->res[1] = in->result[ROLE_OUTPUT];
  in->res[2] = in->result[ROLE_NEXT];
  in->res[3] = in->result[ROLE_SAMPLED_OUTPUT];
  return call(in, m->fwd);
}

/* Compute the gradient of the sum of the unknowns weighted by `result`, with respect to all knowns, into `seed`. */
int hfsa_adjoint(const Model* m, Instance* in) {
  set_point(in, &in->state->time, in->x, in->u);
  in->arg[5] = in->result[ROLE_DERIVATIVE];
  in->arg[6] = in->result[ROLE_OUTPUT];
  in->arg[7] = in->result[ROLE_NEXT];
  in->arg[8] = in->result[ROLE_SAMPLED_OUTPUT];
  in->res[0] = in->seed[ROLE_TIME];
  in->res[1] = in->seed[ROLE_STATE];
  in->res[2] = in->seed[ROLE_SAMPLED_STATE];
  in->res[3] = in->seed[ROLE_INPUT];
  in->res[4] = in->seed[ROLE_PARAMETER];
  return call(in, m->adj);
}

/* Make results valid for the present state block; only invalid ones are evaluated. */
int hfsa_evaluate(const Model* m, Instance* in, unsigned results) {
  unsigned missing = results & ~in->valid;
  int failed = 0;
  if (!missing) return 0;
  set_point(in, &in->state->time, in->x, in->u);
  if (missing & DERIVATIVES_VALID) {
    in->res[0] = in->der;
    failed |= call(in, m->rhs);
  }
  if (missing & OUTPUTS_VALID) {
    set_point(in, &in->state->time, in->x, in->u);
    in->res[0] = in->out;
    failed |= call(in, m->out);
  }
  if (missing & NEXT_VALID) failed |= hfsa_tick(m, in, in->state->time, in->u);
  if (!failed) in->valid |= missing;
  return failed;
}

/* Evaluate the tick map at time t into `next` and `next_held`, without changing the state block. */
int hfsa_tick(const Model* m, Instance* in, double t, const double* u) {
  set_point(in, &t, in->x, u);
  in->res[0] = in->next;
  in->res[1] = in->next_held;
  return call(in, m->tick);
}

/* Return the inputs `offset` seconds after the beginning of the step: constant, or u + u' s + u'' s^2 / 2. */
const double* hfsa_inputs(const Model* m, Instance* in, double offset) {
  int n = m->size[ROLE_INPUT];
  const double *first = in->rates, *second = in->rates + n;
  if (!in->degree || offset == 0.0) return in->u;
  for (int i = 0; i < n; i++) in->u_now[i] = in->u[i] + (first[i] + 0.5 * second[i] * offset) * offset;
  return in->u_now;
}

/* Set `seed` to the rates of time and inputs at `offset`, all other rates to 0. */
void hfsa_seed_motion(const Model* m, Instance* in, double offset) {
  int n = m->size[ROLE_INPUT];
  memset(in->seeds, 0, in->seeds_size);
  in->seed[ROLE_TIME][0] = 1.0;
  for (int i = 0; i < n; i++) in->seed[ROLE_INPUT][i] = in->rates[i] + in->rates[n + i] * offset;
}

/* Return 1 if all numbers are finite: a number times 0 is 0 unless it is infinite or NaN. */
int hfsa_all_finite(const double* column, int n) {
  double sum = 0.0;
  for (int i = 0; i < n; i++) sum += column[i] * 0.0;
  return sum == 0.0;
}
