#include "iterated.h"

#include <string.h>

#include "newton.h"

static void take(const Past* past, double time, const double* bus) {
  memmove(past->times + 1, past->times, 2 * sizeof(double));
  memmove(past->points + past->n, past->points, 2 * past->n * sizeof(double));
  past->times[0] = time;
  memcpy(past->points, bus, past->n * sizeof(double));
  if (*past->known < 3) ++*past->known;
}

/* The bus at a time, on the polynomial through the last points. */
static void predict(const Past* past, double time, double* bus) {
  const double* times = past->times;
  for (size_t k = 0; k < past->n; k++) bus[k] = 0.0;
  for (size_t i = 0; i < *past->known; i++) {
    double weight = 1.0;
    for (size_t j = 0; j < *past->known; j++) {
      if (j != i) weight *= (time - times[j]) / (times[i] - times[j]);
    }
    for (size_t k = 0; k < past->n; k++) bus[k] += weight * past->points[i * past->n + k];
  }
}

/* Lay the lines from the last point to the guess. */
static void aim(const IteratedStep* c, double step_size) {
  for (const Line* line = c->lines; line < c->lines + c->n_lines; line++) {
    for (size_t i = 0; i < line->n; i++) {
      double first = c->past.points[line->places[i]], last = c->guess[line->places[i]];
      line->values[i] = line->is_able ? (last - first) / step_size : (first + last) / 2;
    }
  }
}

/* Make the calls of a pass that are still to be made. */
static int go_on(IteratedStep* c, double time, double step_size) {
  Progress* p = c->progress;
  size_t before = 2 * c->n_instances;
  for (; before + p->next < c->n_calls; p->next++) {
    int status = make(&c->calls[before + p->next], time, step_size);
    if (status == FMI_OK) continue;
    if (status == STALE) return STALE;
    c->failing = before + p->next;
    if (fails(status)) return status;
    p->warning = p->warning ? p->warning : status;
  }
  return FMI_OK;
}

/* Find by how much the guess is to change; returns the largest change relative to its size, or not a number. */
static double correct(const IteratedStep* c) {
  double largest = 0.0;
  for (size_t i = 0; i < c->n; i++) c->change[i] = 0.0;
  for (size_t j = 0; j < c->n; j++) {
    double residual = c->bus[c->places[j]] - c->guess[c->places[j]];
    if (c->inverse)
      add_column(c->change, c->inverse, c->n, j, residual);
    else
      c->change[j] = residual;
  }
  for (size_t i = 0; i < c->n; i++) {
    largest = larger(largest, fabs(c->change[i]) / fmax(fabs(c->bus[c->places[i]]), c->nominal[i]));
  }
  return largest;
}

/* Try steps until the guess is good enough. */
static int iterate(IteratedStep* c, double time, double step_size) {
  Progress* p = c->progress;
  for (;;) {
    if (p->next == 0) aim(c, step_size);
    int status = go_on(c, time, step_size);
    if (status != FMI_OK) return status;
    if (c->inverse && !(fabs(step_size - p->inverse_step) <= c->reuse * step_size)) return STALE;
    double largest = correct(c);
    p->passes++;
    p->tried++;
    if (largest <= c->tolerance || (p->before / 2 < largest && largest <= c->rounding)) return p->warning;
    if (!isfinite(largest) || p->tried == c->passes) return STALE;
    for (size_t i = 0; i < c->n; i++) c->guess[c->places[i]] += c->change[i];
    p->before = largest;
    p->next = 0;
    status = make_all(c->calls, c->n_instances, 2 * c->n_instances, &c->failing);
    if (fails(status)) return status;
    p->warning = p->warning ? p->warning : status;
  }
}

int hfsa_converge(const Call* call, double time, double step_size) {
  IteratedStep* c = call->detail;
  Progress* p = c->progress;
  take(&c->past, time, c->bus);
  p->warning = make_all(c->calls, 0, c->n_instances, &c->failing);
  if (fails(p->warning)) return p->warning;
  predict(&c->past, time + step_size, c->guess);
  p->before = INFINITY;
  p->next = 0;
  p->tried = p->rounds = 0;
  return iterate(c, time, step_size);
}
