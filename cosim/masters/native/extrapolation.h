/* Inputs that move within a step: cosim/actions/extrapolation.py. */

#ifndef EXTRAPOLATION_H
#define EXTRAPOLATION_H

#include "call.h"

/* Values at the last three communication points, (3, n). */
typedef struct {
  const double* bus;
  double* points;
  size_t n;
} History;

/* Derivatives (2, n) of n inputs, by weights (2, 4, n), and the calls that hand them over. */
typedef struct {
  const History* history;
  const size_t* places;
  const double* weights;
  double* derivatives;
  size_t n;
  const Call* calls;
  size_t n_calls, failing;
} Extrapolate;

EXPORT Perform hfsa_remember, hfsa_extrapolate;

#endif
