/* Products, balancing and LU factors of small dense matrices, stored column by column. */

#include "matrix.h"

#include <math.h>
#include <string.h>

/* y += a x; `restrict` and blocks of four columns enable vectorisation. */
void hfsa_add_product(int n, const double* restrict a, const double* restrict x, double* restrict y) {
  int j = 0;
  for (; j + 4 <= n; j += 4) {
    const double *c = a + j * n, *d = c + n, *e = d + n, *f = e + n;
    double p = x[j], q = x[j + 1], r = x[j + 2], s = x[j + 3];
    for (int i = 0; i < n; i++) y[i] += (c[i] * p + d[i] * q) + (e[i] * r + f[i] * s);
  }
  for (; j < n; j++)
    for (int i = 0; i < n; i++) y[i] += a[j * n + i] * x[j];
}

void hfsa_multiply(int n, const double* a, const double* b, double* product) {
  memset(product, 0, (size_t)n * (size_t)n * sizeof(double));
  for (int j = 0; j < n; j++) hfsa_add_product(n, a, b + j * n, product + j * n);
}

/* Return the largest sum of magnitudes in a column; NaN if an entry is NaN. */
double hfsa_norm(int n, const double* a) {
  double largest = 0.0;
  for (int j = 0; j < n; j++) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += fabs(a[j * n + i]);
    if (!(sum <= largest)) largest = sum;
  }
  return largest;
}

/* Balance rows and columns: a = diag(scale)^-1 a diag(scale). The scales are powers of two, so the result is exact. */
void hfsa_balance(int n, double* a, double* scale) {
  for (int i = 0; i < n; i++) scale[i] = 1.0;
  for (int sweep = 0, changed = 1; changed && sweep < 100; sweep++) {
    changed = 0;
    for (int i = 0; i < n; i++) {
      double column = 0.0, row = 0.0;
      for (int k = 0; k < n; k++) {
        if (k == i) continue;
        column += fabs(a[i * n + k]);
        row += fabs(a[k * n + i]);
      }
      if (column == 0.0 || row == 0.0 || !isfinite(column) || !isfinite(row)) continue;
      double factor = exp2(floor(0.5 * log2(row / column) + 0.5));
      if (column * factor + row / factor >= 0.95 * (column + row)) continue;
      changed = 1;
      scale[i] *= factor;
      for (int k = 0; k < n; k++) {
        a[i * n + k] *= factor;
        a[k * n + i] /= factor;
      }
    }
  }
}

/* Factorise in place into LU factors with row exchanges; return 1 for a singular matrix, otherwise 0. */
int hfsa_factorize(int n, double* a, int* pivot) {
  for (int k = 0; k < n; k++) {
    int best = k;
    for (int i = k + 1; i < n; i++)
      if (fabs(a[k * n + i]) > fabs(a[k * n + best])) best = i;
    pivot[k] = best;
    if (!(fabs(a[k * n + best]) > 0.0)) return 1;
    for (int j = 0; j < n && best != k; j++) {
      double swap = a[j * n + k];
      a[j * n + k] = a[j * n + best];
      a[j * n + best] = swap;
    }
    double inverse = 1.0 / a[k * n + k];
    for (int i = k + 1; i < n; i++) a[k * n + i] *= inverse;
    for (int j = k + 1; j < n; j++) {
      double factor = a[j * n + k];
      if (factor == 0.0) continue;
      for (int i = k + 1; i < n; i++) a[j * n + i] -= a[k * n + i] * factor;
    }
  }
  return 0;
}

/* x = a^-1 x from the factors of a. */
void hfsa_solve(int n, const double* factors, const int* pivot, double* x) {
  for (int k = 0; k < n; k++) {
    double swap = x[pivot[k]];
    x[pivot[k]] = x[k];
    x[k] = swap;
  }
  for (int k = 0; k < n; k++)
    for (int i = k + 1; i < n; i++) x[i] -= factors[k * n + i] * x[k];
  for (int k = n - 1; k >= 0; k--) {
    x[k] /= factors[k * n + k];
    for (int i = 0; i < k; i++) x[i] -= factors[k * n + i] * x[k];
  }
}
