/* The classical Runge-Kutta method of order 4 with equal steps, at most the setting `solver.maximum_step`. */

#include "instance.h"

#include <math.h>
#include <stdlib.h>

enum { MAXIMUM_STEP, MAXIMUM_STEPS }; /* indices of the settings */

typedef struct {
  double *k, *sum, *x;
} Work;

static void* create(const Model* m) {
  size_t n = (size_t)m->size[ROLE_STATE];
  Work* work = calloc(1, sizeof(Work) + 3 * n * sizeof(double));
  if (!work) return NULL;
  work->k = (double*)(work + 1);
  work->sum = work->k + n;
  work->x = work->sum + n;
  return work;
}

/* Compute one stage at `offset`: k, the x of the next stage, and the weighted sum. */
static int stage(const Model* m, Instance* in, double offset, double weight, double ahead) {
  const Work* work = in->work;
  int failed = hfsa_rhs(m, in, in->state->time + offset, work->x, hfsa_inputs(m, in, offset), work->k);
  for (int i = 0; i < m->size[ROLE_STATE]; i++) {
    work->sum[i] += weight * work->k[i];
    work->x[i] = in->x[i] + ahead * work->k[i];
  }
  return failed;
}

static int advance(const Model* m, Instance* in, double offset, double h) {
  const Work* work = in->work;
  int n = m->size[ROLE_STATE];
  double count = fmax(1.0, ceil(h / in->settings[MAXIMUM_STEP] * (1.0 - 1e-9)));
  double step = h / count;
  if (count > in->allowed) {
    in->ended = offset;
    return hfsa_report(in, DISCARD, "a step of %g s is %g steps of the setting %s, and only %g are left of %s", h, count,
                       hfsa_name(m, ROLE_SOLVER, MAXIMUM_STEP), in->allowed,
                       hfsa_name(m, ROLE_SOLVER, MAXIMUM_STEPS));
  }
  in->allowed -= count;
  for (double k = 0.0; k < count; k++) {
    double begin = offset + k * step;
    for (int i = 0; i < n; i++) {
      work->sum[i] = 0.0;
      work->x[i] = in->x[i];
    }
    if (stage(m, in, begin, step / 6.0, 0.5 * step) || stage(m, in, begin + 0.5 * step, step / 3.0, 0.5 * step) ||
        stage(m, in, begin + 0.5 * step, step / 3.0, step) || stage(m, in, begin + step, step / 6.0, 0.0))
      return hfsa_report(in, ERROR, "the derivatives cannot be evaluated at time %.15g", in->state->time + begin);
    for (int i = 0; i < n; i++) in->x[i] += work->sum[i];
    in->counts[ACCEPTED_STEPS] += 1.0;
    if (k + 1.0 < count && hfsa_pause(m, in, begin + step)) return OK;
  }
  return OK;
}

const Solver hfsa_rk4 = {create, advance, free, MAXIMUM_STEPS};
