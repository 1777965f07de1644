/* Steps taken again until their inputs end at what the outputs come to: cosim/actions/iterated.py. */

#ifndef ITERATED_H
#define ITERATED_H

#include "call.h"

/* Inputs of one instance on straight lines: `values` are their slopes or, where it takes none, the lines' middles. */
typedef struct {
  const size_t* places;
  double* values;
  size_t n;
  int is_able;
} Line;

/* The last communication points, latest first: times (3,), buses (3, n), and how many of them are known. */
typedef struct {
  double *times, *points;
  size_t* known;
  size_t n;
} Past;

/* How far the step under way has come, for Python, which goes on where STALE is returned. */
typedef struct {
  long long passes;    /* steps tried since the start */
  double before;       /* largest change of the pass before */
  double inverse_step; /* step size [s] that the inverse is made for */
  size_t next;         /* the next call of the pass */
  int tried, rounds;   /* passes of this round; rounds that did not suffice */
  int warning;         /* of the first call that warned */
} Progress;

/* `calls` are one that keeps the state of each instance, one that brings it back, and those of a pass: hand the lines
   over, step, exchange. The guess is an array like the bus, of which `n` places count. A fixed point has no inverse. */
typedef struct {
  Progress* progress;
  Past past;
  const double* bus;
  double *guess, *change;
  const size_t* places;
  const double *nominal, *inverse;
  size_t n;
  const Line* lines;
  size_t n_lines;
  const Call* calls;
  size_t n_instances, n_calls, failing;
  double tolerance, rounding, reuse;
  int passes;
} IteratedStep;

/* Step to the next communication point. STALE where a loop is to be solved anew, where an inverse is to be made, or
   where the passes do not suffice. */
EXPORT Perform hfsa_converge;

#endif
