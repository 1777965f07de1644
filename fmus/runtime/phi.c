/* The matrices of an exact step: h phi1(h a), h^2 phi2(h a) and h^3 phi3(h a).

     phi1(z) = (e^z - 1) / z        phi2(z) = (e^z - 1 - z) / z^2        phi3(z) = (e^z - 1 - z - z^2 / 2) / z^3

   Scaling and squaring: the matrix is balanced and halved until its norm is at most 1/2, where the Taylor series of
   phi3 is accurate to rounding; then the argument is doubled as many times. The doubling uses psi = e^z - 1 instead of
   e^z, which preserves all digits of a slow mode beside one 10^12 times faster; 1 + z would lose them. */

#include "matrix.h"

#include <math.h>
#include <string.h>

enum { TERMS = 15 };

/* Compute phi3 = 1/3! + z/4! + z^2/5! + ... by Horner's rule; `next` is scratch. */
static void taylor(int n, const double* z, double* phi3, double* next) {
  double factorial = 6.0;
  for (int k = 4; k <= TERMS + 2; k++) factorial *= k;
  memset(phi3, 0, (size_t)n * (size_t)n * sizeof(double));
  for (int i = 0; i < n; i++) phi3[i * n + i] = 1.0 / factorial;
  for (int k = TERMS + 2; k > 3; k--) {
    factorial /= k;
    hfsa_multiply(n, z, phi3, next);
    memcpy(phi3, next, (size_t)n * (size_t)n * sizeof(double));
    for (int i = 0; i < n; i++) phi3[i * n + i] += 1.0 / factorial;
  }
}

/* Compute the function of the next lower order, phi_(k - 1)(z) = z phi_k(z) + 1 / (k - 1)!. */
static void lower_order(int n, const double* z, const double* phi, double constant, double* lower) {
  hfsa_multiply(n, z, phi, lower);
  for (int i = 0; i < n; i++) lower[i * n + i] += constant;
}

/* Update all functions from the argument z to 2 z; `product` is scratch.

     psi  = psi (psi + 2)            phi1 = phi1 + psi phi1 / 2
     phi2 = (phi1^2 + 2 phi2) / 4    phi3 = (phi1 phi2 + phi2 + 2 phi3) / 8 */
static void double_argument(int n, double* psi, double* phi1, double* phi2, double* phi3, double* product) {
  hfsa_multiply(n, phi1, phi2, product);
  for (int k = 0; k < n * n; k++) phi3[k] = 0.125 * (product[k] + phi2[k]) + 0.25 * phi3[k];
  hfsa_multiply(n, phi1, phi1, product);
  for (int k = 0; k < n * n; k++) phi2[k] = 0.25 * product[k] + 0.5 * phi2[k];
  hfsa_multiply(n, psi, phi1, product);
  for (int k = 0; k < n * n; k++) phi1[k] += 0.5 * product[k];
  hfsa_multiply(n, psi, psi, product);
  for (int k = 0; k < n * n; k++) psi[k] = product[k] + 2.0 * psi[k];
}

/* Compute the three matrices, one after the other, into `phi`; `scratch` has 3 n^2 + n entries. Returns 1 if h a is not
   finite. */
int hfsa_phi(int n, const double* a, double h, double* phi, double* scratch) {
  double *phi1 = phi, *phi2 = phi1 + n * n, *phi3 = phi2 + n * n;
  double *z = scratch, *psi = z + n * n, *product = psi + n * n, *scale = product + n * n;
  for (int k = 0; k < n * n; k++) z[k] = h * a[k];
  hfsa_balance(n, z, scale);
  double norm = hfsa_norm(n, z);
  if (!isfinite(norm)) return 1;
  int doublings = norm > 0.5 ? (int)ceil(log2(norm)) + 1 : 0;
  for (int k = 0; k < n * n; k++) z[k] = ldexp(z[k], -doublings);

  taylor(n, z, phi3, product);
  lower_order(n, z, phi3, 0.5, phi2);
  lower_order(n, z, phi2, 1.0, phi1);
  lower_order(n, z, phi1, 0.0, psi);
  for (int k = 0; k < doublings; k++) double_argument(n, psi, phi1, phi2, phi3, product);

  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      double unscale = scale[i] / scale[j];
      phi1[j * n + i] *= h * unscale;
      phi2[j * n + i] *= h * h * unscale;
      phi3[j * n + i] *= h * h * h * unscale;
    }
  return 0;
}
