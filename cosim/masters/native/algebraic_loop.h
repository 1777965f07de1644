/* Outputs that follow each other without a step between: cosim/actions/algebraic_loop.py. */

#ifndef ALGEBRAIC_LOOP_H
#define ALGEBRAIC_LOOP_H

#include "call.h"

/* n values of the bus, and the calls that set them (the first `n_inner`) and fetch what follows from them. */
typedef struct {
  double* bus;
  const size_t* places;
  const double *inverse, *scale;
  double *guess, *change;
  size_t n;
  const Call* calls;
  size_t n_inner, n_calls, failing;
  double tolerance, rounding;
  int passes;
} Loop;

/* Correct the values until they agree; STALE where the inverse there is does not suffice. */
EXPORT Perform hfsa_solve;

#endif
