/* What a step of linearised feedback begins with: cosim/actions/feedback.py. */

#ifndef FEEDBACK_H
#define FEEDBACK_H

#include "call.h"

/* Gains of a plant (n,): of the derivatives that the calls but the last fetch, `entries` are added up at `places`; the
   last call sets them. */
typedef struct {
  double* gains;
  size_t n;
  const double* derivatives;
  const size_t *entries, *places;
  size_t n_entries;
  const Call* calls;
  size_t n_calls, failing;
} Gains;

/* Rates of n outputs of one instance: `result` of the calls, whose seed has a part `fed` by rates of inputs. Both lie
   among the `rates` of the bus. */
typedef struct {
  double* rates;
  const size_t* feeding;
  double* fed;
  size_t n_feeding;
  const size_t* places;
  const double* result;
  size_t n;
  const Call* calls;
  size_t n_calls, failing;
} Rates;

/* Slopes of n inputs of one instance, of some of which the end is known; of a plant without what it follows itself,
   `own` (n_own, 3): slope, gain, and place of a rate. */
typedef struct {
  const double *bus, *before, *rates;
  const size_t* places;
  const size_t* is_known;
  double* slopes;
  size_t n;
  const double* gains;
  const size_t* own;
  size_t n_own;
  const Call* calls;
  size_t n_calls, failing;
} Lines;

EXPORT Perform hfsa_find_gains, hfsa_find_rates, hfsa_lay_lines;

#endif
