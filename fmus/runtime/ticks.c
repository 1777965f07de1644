/* Ticks of sampled models at start + n * sample_time, without accumulation of rounding errors. */

#include "core.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Time of the next tick [s]. */
double hfsa_tick_time(const Model* m, const Instance* in) {
  return in->state->start_time + (double)in->state->ticks * in->p[m->sample_time];
}

/* Tolerance of the time of a tick near t [s]: what rounding does to times must not move a tick to another step. */
double hfsa_tick_tolerance(const Model* m, const Instance* in, double t) {
  return fmax(1e-9 * in->p[m->sample_time], 8.0 * DBL_EPSILON * fmax(fabs(t), fabs(in->state->start_time)));
}

/* Whether the ticks near t cannot be told apart. */
int hfsa_ticks_are_lost(const Model* m, const Instance* in, double t) {
  return m->sample_time >= 0 && !(hfsa_tick_tolerance(m, in, t) < 0.1 * in->p[m->sample_time]);
}

/* Execute one tick: evaluate outputs and next values from the states before it, then copy both to the state block. */
Status hfsa_do_tick(const Model* m, Instance* in, double t, const double* u) {
  int n_next = m->size[ROLE_NEXT], n_held = m->size[ROLE_SAMPLED_OUTPUT];
  in->valid = 0;
  if (hfsa_tick(m, in, t, u)) return hfsa_report(in, ERROR, "the tick at time %.15g cannot be evaluated", t);
  for (int i = 0; i < n_next; i++)
    if (!isfinite(in->next[i]))
      return hfsa_report(in, ERROR, "%s is %g at the tick at time %.15g", hfsa_name(m, ROLE_NEXT, i), in->next[i], t);
  for (int i = 0; i < n_held; i++)
    if (!isfinite(in->next_held[i]))
      return hfsa_report(in, ERROR, "%s is %g at the tick at time %.15g", hfsa_name(m, ROLE_SAMPLED_OUTPUT, i),
                         in->next_held[i], t);
  memcpy(in->z, in->next, (size_t)n_next * sizeof(double));
  memcpy(in->held, in->next_held, (size_t)n_held * sizeof(double));
  in->state->ticks++;
  return OK;
}

/* Execute all ticks up to the present time, those that the importer has stepped over too. */
Status hfsa_do_due_ticks(const Model* m, Instance* in) {
  double now = in->state->time;
  Status status = OK;
  if (hfsa_ticks_are_lost(m, in, now))
    return hfsa_report(in, ERROR, "the ticks every %g s cannot be told apart at time %.15g", in->p[m->sample_time], now);
  hfsa_allow(m, in);
  while (!status && hfsa_tick_time(m, in) <= now + hfsa_tick_tolerance(m, in, now)) {
    if (in->allowed < 1.0) return hfsa_exhausted(m, in, hfsa_tick_time(m, in) - now, -1);
    in->allowed -= 1.0;
    status = hfsa_do_tick(m, in, hfsa_tick_time(m, in), in->u);
  }
  return status;
}
