#include "algebraic_loop.h"

#include "newton.h"

/* One step of Newton's method with the inverse there is; the largest change relative to its size, or not a number. */
static double correct(Loop* l) {
  double largest = 0.0;
  for (size_t i = 0; i < l->n; i++) l->change[i] = 0.0;
  for (size_t j = 0; j < l->n; j++) add_column(l->change, l->inverse, l->n, j, l->bus[l->places[j]] - l->guess[j]);
  for (size_t i = 0; i < l->n; i++) {
    largest = larger(largest, fabs(l->change[i]) / fmax(fabs(l->guess[i]), l->scale[i]));
    l->bus[l->places[i]] = l->guess[i] + l->change[i];
  }
  return largest;
}

int hfsa_solve(const Call* call, double time, double step_size) {
  Loop* l = call->detail;
  (void)time, (void)step_size;
  int warning = FMI_OK;
  bool was_close = false;
  if (isnan(l->inverse[0])) return STALE;
  for (int pass = 0; pass < l->passes; pass++) {
    int status = make_all(l->calls, 0, l->n_inner, &l->failing);
    if (fails(status)) return status;
    warning = warning ? warning : status;
    for (size_t i = 0; i < l->n; i++) l->guess[i] = l->bus[l->places[i]];
    status = make_all(l->calls, l->n_inner, l->n_calls, &l->failing);
    if (fails(status)) return status;
    warning = warning ? warning : status;
    double change = correct(l);
    if (change <= l->rounding || (was_close && change <= l->tolerance)) return warning;
    was_close = change <= l->tolerance;
  }
  return STALE;
}
