/* The matrices of an exact step: h phi1(h a) and h^2 phi2(h a).

     phi1(z) = (e^z - 1) / z        phi2(z) = (e^z - 1 - z) / z^2

   The matrix is balanced and halved until its norm is at most 1/2, where the Taylor series of phi2 is exact to
   rounding, and the results are doubled as often again. What is doubled is psi = e^z - 1, never e^z: beside a mode a
   million million times faster, a slow mode is then still known to all its digits, which 1 + z would have rounded away.
 */

#include "matrix.h"

#include <math.h>
#include <string.h>

enum { TERMS = 15 };

/* phi2 = 1/2! + z/3! + z^2/4! + ... by Horner's rule; `next` is scratch. */
static void taylor(int n, const double* z, double* phi2, double* next) {
  double factorial = 2.0, size = (double)n * n;
  for (int k = 3; k <= TERMS + 2; k++) factorial *= k;
  memset(phi2, 0, (size_t)size * sizeof(double));
  for (int i = 0; i < n; i++) phi2[i * n + i] = 1.0 / factorial;
  for (int k = TERMS + 2; k > 2; k--) {
    factorial /= k;
    hfsa_multiply(n, z, phi2, next);
    memcpy(phi2, next, (size_t)size * sizeof(double));
    for (int i = 0; i < n; i++) phi2[i * n + i] += 1.0 / factorial;
  }
}

/* psi(2z) = psi (psi + 2), phi1(2z) = phi1 + psi phi1 / 2, phi2(2z) = (phi1^2 + 2 phi2) / 4; `product` is scratch. */
static void double_argument(int n, double* psi, double* phi1, double* phi2, double* product) {
  hfsa_multiply(n, phi1, phi1, product);
  for (int k = 0; k < n * n; k++) phi2[k] = 0.25 * product[k] + 0.5 * phi2[k];
  hfsa_multiply(n, psi, phi1, product);
  for (int k = 0; k < n * n; k++) phi1[k] += 0.5 * product[k];
  hfsa_multiply(n, psi, psi, product);
  for (int k = 0; k < n * n; k++) psi[k] = product[k] + 2.0 * psi[k];
}

/* phi1 and phi2 as above from a and h; `scratch` has 3 n^2 + n places. 1 where the matrix is not finite. */
int hfsa_phi(int n, const double* a, double h, double* phi1, double* phi2, double* scratch) {
  double *z = scratch, *psi = z + n * n, *product = psi + n * n, *scale = product + n * n;
  for (int k = 0; k < n * n; k++) z[k] = h * a[k];
  hfsa_balance(n, z, scale);
  double norm = hfsa_norm(n, z);
  if (!isfinite(norm)) return 1;
  int doublings = norm > 0.5 ? (int)ceil(log2(norm / 0.5)) : 0;
  for (int k = 0; k < n * n; k++) z[k] = ldexp(z[k], -doublings);

  taylor(n, z, phi2, product);
  hfsa_multiply(n, z, phi2, phi1);
  for (int i = 0; i < n; i++) phi1[i * n + i] += 1.0;
  hfsa_multiply(n, z, phi1, psi);
  for (int k = 0; k < doublings; k++) double_argument(n, psi, phi1, phi2, product);

  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) {
      double unscale = scale[i] / scale[j];
      phi1[j * n + i] *= h * unscale;
      phi2[j * n + i] *= h * h * unscale;
    }
  return 0;
}
