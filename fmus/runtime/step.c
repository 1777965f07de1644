/* One communication step: solver and ticks in turn. A failed step leaves the instance unchanged.

   A step that runs out of work (budget.c) is a failed one too. What it did come to is kept in `before`, and
   `hfsa_keep_part` makes it the state of the instance: the end of a shorter step. */

#include "core.h"

#include <float.h>
#include <math.h>
#include <string.h>

static Status check_step(const Model* m, const Instance* in, double t, double h) {
  const State* s = in->state;
  if (!isfinite(t) || !(h > 0.0) || !isfinite(h))
    return hfsa_report(in, ERROR, "DoStep from %g by %g: expected a finite time and a step above 0", t, h);
  if (!(t + h > t) || !isfinite(t + h))
    return hfsa_report(in, ERROR, "DoStep from %.15g by %g: times are %g s apart there, so the step is lost", t, h,
                       nextafter(fabs(t), HUGE_VAL) - fabs(t));
  if (hfsa_ticks_are_lost(m, in, t + h))
    return hfsa_report(in, ERROR, "DoStep to %.15g: times are %g s apart there, too much for the sample time %g s",
                       t + h, nextafter(fabs(t + h), HUGE_VAL) - fabs(t + h), in->p[m->sample_time]);
  double slack = 1e-3 * h + 8.0 * DBL_EPSILON * fabs(t);
  if (fabs(t - s->time) > slack)
    return hfsa_report(in, ERROR, "DoStep from %.15g, but the last step ended at %.15g", t, s->time);
  if (t + h > s->stop_time + slack)
    return hfsa_report(in, ERROR, "DoStep to %.15g goes beyond the stop time %.15g", t + h, s->stop_time);
  if (hfsa_all_finite(in->u, m->size[ROLE_INPUT])) return OK;
  int i = 0;
  while (isfinite(in->u[i])) i++;
  return hfsa_report(in, ERROR, "input %s is %g at time %.15g", hfsa_name(m, ROLE_INPUT, i), in->u[i], t);
}

/* The instance is at `offset` while the importer looks at it; a solver that goes on finds it as it was. */
int hfsa_pause(const Model* m, Instance* in, double offset) {
  State* s = in->state;
  if (!in->listener.tell || !(offset > 0.0) || offset >= in->length * (1.0 - 1e-12)) return 0;
  size_t inputs = (size_t)m->size[ROLE_INPUT] * sizeof(double);
  double time = s->time;
  if (in->degree) memcpy(in->u, hfsa_inputs(m, in, offset), inputs);
  s->time = time + offset;
  s->mode = INTERMEDIATE;
  in->valid = 0;
  if (in->listener.tell(in)) in->ended = offset;
  s->time = time;
  s->mode = STEP;
  in->valid = 0;
  /* the step begins with these inputs, which `before` has behind its head */
  if (in->degree) memcpy(in->u, (State*)in->before + 1, inputs);
  return isfinite(in->ended);
}

static Status solve(const Model* m, Instance* in, double offset, double h) {
  if (!m->solver || !(h > 0.0)) return OK;
  Status status = m->solver->advance(m, in, offset, h);
  if (status || hfsa_all_finite(in->x, m->size[ROLE_STATE])) return status;
  int i = 0;
  while (isfinite(in->x[i])) i++;
  return hfsa_report(in, ERROR, "state %s is %g after the step from %.15g by %g", hfsa_name(m, ROLE_STATE, i), in->x[i],
                     in->state->time, offset + h);
}

/* Solve a part of the step, unless the importer has ended it, and tell of its end. */
static Status advance(const Model* m, Instance* in, double offset, double h) {
  if (isfinite(in->ended)) return OK;
  Status status = solve(m, in, offset, h);
  if (!status && !isfinite(in->ended)) hfsa_pause(m, in, offset + h);
  return status;
}

/* Solve up to each tick of the step, execute it, and solve the rest. A tick at the beginning belongs to this step, one
   at the end to the next. Offsets are integer multiples of 2^-40 of the step: rounding then produces only a few
   different lengths, which a solver can cache, and the lengths add up to the step exactly. */
static Status advance_with_ticks(const Model* m, Instance* in, double h) {
  const double part = ldexp(h, -40);
  double tolerance = fmin(hfsa_tick_tolerance(m, in, in->state->time + h), 0.5 * h);
  double done = 0.0;
  Status status = OK;
  while (!status) {
    double tick = hfsa_tick_time(m, in), offset = tick - in->state->time;
    if (offset >= h - tolerance) break;
    double at = offset <= tolerance ? done : floor(offset / part + 0.5);
    status = advance(m, in, done * part, (at - done) * part);
    done = at;
    if (isfinite(in->ended)) return status;
    if (!status && in->allowed < 1.0) status = hfsa_exhausted(m, in, done * part, -1);
    in->allowed -= 1.0;
    if (!status) status = hfsa_do_tick(m, in, tick, hfsa_inputs(m, in, done * part));
  }
  return status ? status : advance(m, in, done * part, (0x1p40 - done) * part);
}

/* Return the highest order of a nonzero derivative of an input. */
static int degree(const Model* m, const Instance* in) {
  for (int k = m->size[ROLE_INPUT_DERIVATIVE]; k > 0; k--)
    if (in->rates[k - 1] != 0.0) return k > m->size[ROLE_INPUT] ? 2 : 1;
  return 0;
}

/* End a step of h from t, where the inputs have the final values of their polynomials. */
static void end_at(const Model* m, Instance* in, double t, double h) {
  if (in->degree) memcpy(in->u, hfsa_inputs(m, in, h), (size_t)m->size[ROLE_INPUT] * sizeof(double));
  if (in->state->once) memset(in->rates, 0, (size_t)m->size[ROLE_INPUT_DERIVATIVE] * sizeof(double));
  in->state->once = 0;
  in->state->time = t + h;
}

/* Return to the state before the step; what has been reached of it goes to `before`. */
static void take_back(Instance* in) {
  char *now = (char*)in->state, *before = in->before;
  for (size_t k = 0; k < in->moving_size; k++) {
    char byte = now[k];
    now[k] = before[k];
    before[k] = byte;
  }
}

/* Step from communication point t to t + h, or to where the importer ends it before, and tell how far. */
Status hfsa_do_step(const Model* m, Instance* in, double t, double h) {
  Status status = hfsa_permit(in, "DoStep", STEP);
  if (in) in->ended = HUGE_VAL;
  if (!status) status = check_step(m, in, t, h);
  if (status) return status;
  hfsa_allow(m, in);
  memcpy(in->before, in->state, in->moving_size);
  in->state->time = t;
  in->length = h;
  in->degree = degree(m, in);
  in->valid = 0;
  status = m->sample_time >= 0 ? advance_with_ticks(m, in, h) : advance(m, in, 0.0, h);
  if (!status || isfinite(in->ended)) end_at(m, in, t, fmin(in->ended, h));
  if (status) take_back(in);
  in->valid = 0;
  return status;
}

/* Make the part that a step without enough work has come to the state of the instance; DISCARD if there is none. */
Status hfsa_keep_part(Instance* in) {
  if (!in || !isfinite(in->ended) || !(in->ended > 0.0)) return DISCARD;
  memcpy(in->state, in->before, in->moving_size);
  in->valid = 0;
  return OK;
}
