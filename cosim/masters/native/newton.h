/* What is alike wherever values are made to agree by Newton's method. */

#ifndef NEWTON_H
#define NEWTON_H

#include <math.h>
#include <stddef.h>

/* Add to `sum` column j of a matrix (n, n) times a value: a product summed column by column is that of Python. */
static inline void add_column(double* sum, const double* matrix, size_t n, size_t j, double value) {
  for (size_t i = 0; i < n; i++) sum[i] += matrix[i * n + j] * value;
}

/* The larger of two changes, and not a number where one of them is none. */
static inline double larger(double first, double second) {
  return isnan(first) || second <= first ? first : second;
}

#endif
