/* Bounded work: the number of steps of the solver and ticks in one communication step, so that every one ends. */

#include "instance.h"

/* Of a model whose solver has no setting for it. */
static const double largest_count = 1e7;

static int setting(const Model* m) { return m->solver ? m->solver->maximum_steps : -1; }

/* Allow the present communication step all its work. */
void hfsa_allow(const Model* m, Instance* in) {
  int index = setting(m);
  in->allowed = index < 0 ? largest_count : in->settings[index];
}

/* Report that nothing is left at `offset`; `state` is the index of the state that requires so many steps, or -1. */
Status hfsa_exhausted(const Model* m, Instance* in, double offset, int state) {
  int index = setting(m);
  in->ended = offset;
  const char* due = state < 0 ? "" : "; the shortest ones are due to state ";
  const char* name = state < 0 ? "" : hfsa_name(m, ROLE_STATE, state);
  double time = in->state->time + offset;
  if (index < 0)
    return hfsa_report(in, DISCARD, "%g ticks, the most in a communication step, reached only time %.15g%s%s",
                       largest_count, time, due, name);
  return hfsa_report(in, DISCARD, "%g steps, all that %s allows, reached only time %.15g%s%s", in->settings[index],
                     hfsa_name(m, ROLE_SOLVER, index), time, due, name);
}
