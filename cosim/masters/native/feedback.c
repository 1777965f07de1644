#include "feedback.h"

int hfsa_find_gains(const Call* call, double time, double step_size) {
  Gains* g = call->detail;
  (void)time, (void)step_size;
  size_t last = g->n_calls - 1;
  int fetched = make_all(g->calls, 0, last, &g->failing);
  if (fails(fetched)) return fetched;
  for (size_t k = 0; k < g->n; k++) g->gains[k] = 0.0;
  for (size_t k = 0; k < g->n_entries; k++) g->gains[g->places[k]] += g->derivatives[g->entries[k]];
  int set = make_all(g->calls, last, g->n_calls, &g->failing);
  return fails(set) || !fetched ? set : fetched;
}

int hfsa_find_rates(const Call* call, double time, double step_size) {
  Rates* r = call->detail;
  (void)time, (void)step_size;
  for (size_t k = 0; k < r->n_feeding; k++) r->fed[k] = r->rates[r->feeding[k]];
  int status = make_all(r->calls, 0, r->n_calls, &r->failing);
  if (fails(status)) return status;
  for (size_t k = 0; k < r->n; k++) r->rates[r->places[k]] = r->result[k];
  return status;
}

int hfsa_lay_lines(const Call* call, double time, double step_size) {
  Lines* l = call->detail;
  (void)time;
  for (size_t k = 0; k < l->n; k++) {
    size_t place = l->places[k];
    l->slopes[k] = l->is_known[k] ? (l->bus[place] - l->before[place]) / step_size : l->rates[place];
  }
  for (const size_t* own = l->own; own < l->own + 3 * l->n_own; own += 3) {
    l->slopes[own[0]] -= l->gains[own[1]] * l->rates[own[2]];
  }
  return make_all(l->calls, 0, l->n_calls, &l->failing);
}
