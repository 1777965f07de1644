/* Values that are fed to inputs: cosim/actions/feed.py. */

#ifndef FEED_H
#define FEED_H

#include "call.h"

/* Rows of n values that are known ahead, (rows, n); `next` is the place of the next one. It goes into `array`, and the
   calls hand it over. */
typedef struct {
  const double* block;
  double* array;
  size_t* next;
  size_t rows, n;
  const Call* calls;
  size_t n_calls, failing;
} Feed;

EXPORT Perform hfsa_feed;

#endif
