/* Right-hand sides of the SDelta at its symmetric posture, written for speed: what generated code can be as fast as.

   numbers.h has the constants; states, inputs and parameters are in the order of the part `sdelta`, preset ch4, reference
   point S. The rows and entries that are zero at this posture are left out by hand. */

#include <math.h>

#include "numbers.h"

typedef void Rhs(const double* x, const double* u, const double* p, double* d);

/* y += M x */
static inline void add(int rows, int columns, const double* M, const double* x, double* y) {
  for (int i = 0; i < rows; i++) {
    double sum = 0;
    for (int j = 0; j < columns; j++) sum += M[i * columns + j] * x[j];
    y[i] += sum;
  }
}

/* tubes by drive, [slide_1, angle_1, ...], from [slides, angles] */
static inline void by_drive(const double* u, double* q) {
  for (int j = 0; j < 3; j++) q[2 * j] = u[j], q[2 * j + 1] = u[3 + j];
}

/* M xdd = w - K (x - T q) - zeta D (xd - T qd), about C */
void cartesian(const double* x, const double* u, const double* p, double* d) {
  double q[12], slip[12];
  by_drive(u, q), by_drive(u + 6, q + 6);
  for (int i = 0; i < 12; i++) slip[i] = x[i];
  add(6, 6, MINUS_T, q, slip), add(6, 6, MINUS_T, q + 6, slip + 6);
  const double *n = u + 18, *f = u + 21, c = CENTER;
  double w[6] = {n[0] + c * f[1], n[1] - c * f[0], n[2], f[0], f[1], f[2] - MASS * p[1]};
  const double *a = slip, *b = slip + 6, z = p[0];
  w[0] -= K11 * a[0] - K24 * a[4] + z * (D11 * b[0] - D24 * b[4]);
  w[1] -= K11 * a[1] + K24 * a[3] + z * (D11 * b[1] + D24 * b[3]);
  w[2] -= K33 * a[2] + z * D33 * b[2];
  w[3] -= K44 * a[3] + K24 * a[1] + z * (D44 * b[3] + D24 * b[1]);
  w[4] -= K44 * a[4] - K24 * a[0] + z * (D44 * b[4] - D24 * b[0]);
  w[5] -= K66 * a[5] + z * D66 * b[5];
  for (int i = 0; i < 6; i++) d[i] = x[6 + i];
  d[6] = w[0] / I11, d[7] = w[1] / I11, d[8] = w[2] / I33;
  d[9] = w[3] / MASS, d[10] = w[4] / MASS, d[11] = w[5] / MASS;
}

/* eta'' = W^T w - omega^2 (eta - G q) - 2 zeta omega (eta' - G qd) */
void generalized(const double* x, const double* u, const double* p, double* d) {
  double q[12], force[12] = {0}, a[12], b[12];
  by_drive(u, q), by_drive(u + 6, q + 6);
  const double *n = u + 18, *f = u + 21, c = CENTER;
  double w[6] = {n[0] + c * f[1], n[1] - c * f[0], n[2], f[0], f[1], f[2] - MASS * p[1]};
  for (int i = 0; i < 12; i++) a[i] = x[i], b[i] = x[12 + i];
  add(12, 6, MINUS_G, q, a), add(12, 6, MINUS_G, q + 6, b);
  add(12, 6, W_T, w, force);
  for (int i = 0; i < 12; i++) {
    d[i] = x[12 + i];
    d[12 + i] = force[i] - OMEGA2[i] * a[i] - p[0] * RATE[i] * b[i];
  }
}

static inline void cross(const double* a, const double* b, double* c) {
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

/* finite motion, springs along the actual limbs; the equations are in components/_mechanics/sdelta_nonlinear.py */
void nonlinear(const double* x, const double* u, const double* p, double* d) {
  const double *s = x, *at = x + 3, *o = x + 6, *v = x + 9;
  const double square = s[0] * s[0] + s[1] * s[1] + s[2] * s[2], r = square / 16, k = 1 / ((1 + r) * (1 + r));
  const double h = k / 2, g = k * (1 - r), diagonal = h * square;
  const double hx = h * s[0], hy = h * s[1], xy = hx * s[1], xz = hx * s[2], yz = hy * s[2];
  const double gx = g * s[0], gy = g * s[1], gz = g * s[2];
  const double R[3][3] = {{hx * s[0] - diagonal, xy - gz, xz + gy},
                          {xy + gz, hy * s[1] - diagonal, yz - gx},
                          {xz - gy, yz + gx, h * s[2] * s[2] - diagonal}};
  const double c[3] = {CENTER * R[0][2], CENTER * R[1][2], CENTER + CENTER * R[2][2]};
  double swing[3][3], force[3][3], total[3], arm[2][3];
  for (int i = 0; i < 3; i++) {
    swing[0][i] = ARM_Y[0] * R[i][1];
    swing[1][i] = ARM_X[1] * R[i][0] + ARM_Y[1] * R[i][1];
    swing[2][i] = -(swing[0][i] + swing[1][i]);
  }
  const double base[3] = {at[0] - c[0], at[1] - c[1], at[2] - (c[2] - CENTER)};
  for (int j = 0; j < 3; j++) {
    const double sin_d = sin(u[3 + j]), cos_d = cos(u[3 + j]);
    const double sin_a = SIN * cos_d + COS * sin_d, cos_a = COS * cos_d - SIN * sin_d;
    const double mx = base[0] + swing[j][0], my = base[1] + swing[j][1], mz = base[2] + swing[j][2];
    const double into = AXIS_X[j] * my - AXIS_Y[j] * mx;
    const double fc = STIFFNESS * (AXIS_X[j] * mx + AXIS_Y[j] * my - u[j]);
    const double fn = STIFFNESS * (cos_a * mz - sin_a * into - LENGTH * sin_d);
    const double inwards = fn * sin_a;
    force[j][0] = -(fc * AXIS_X[j] + inwards * AXIS_Y[j]);
    force[j][1] = inwards * AXIS_X[j] - fc * AXIS_Y[j];
    force[j][2] = -fn * cos_a;
  }
  double n[3], turned[3], one[3], other[3];
  for (int i = 0; i < 3; i++) {
    const double third = force[2][i];
    total[i] = force[0][i] + force[1][i] + third;
    force[0][i] -= third, force[1][i] -= third;
    arm[0][i] = swing[0][i], arm[1][i] = swing[1][i];
  }
  arm[0][1] += ARM_Y[0], arm[1][0] += ARM_X[1], arm[1][1] += ARM_Y[1];
  const double at_S[3] = {total[0] + u[21], total[1] + u[22], total[2] + u[23]};
  cross(arm[0], force[0], n), cross(arm[1], force[1], one), cross(c, at_S, other);

  double damped[6] = {D11 * o[0] - D24 * v[1], D11 * o[1] + D24 * v[0], D33 * o[2],
                      D44 * v[0] + D24 * o[1], D44 * v[1] - D24 * o[0], D66 * v[2]};
  for (int j = 0; j < 3; j++)
    for (int i = 0; i < 6; i++) damped[i] += MINUS_D_T[6 * (2 * j) + i] * u[6 + j] + MINUS_D_T[6 * (2 * j + 1) + i] * u[9 + j];
  double world[3];
  for (int i = 0; i < 3; i++) world[i] = n[i] + one[i] - other[i] + u[18 + i] - p[0] * damped[i];
  double own[3], spin[3];
  for (int i = 0; i < 3; i++) {
    own[i] = world[i] + R[0][i] * world[0] + R[1][i] * world[1] + R[2][i] * world[2];
    spin[i] = o[i] + R[0][i] * o[0] + R[1][i] * o[1] + R[2][i] * o[2];
  }
  const double gyro = (I33 - I11) * spin[2];
  turned[0] = (own[0] - gyro * spin[1]) / I11, turned[1] = (own[1] + gyro * spin[0]) / I11, turned[2] = own[2] / I33;

  const double along = (s[0] * o[0] + s[1] * o[1] + s[2] * o[2]) / 8, q = 1 - r;
  const double half[3] = {s[0] / 2, s[1] / 2, s[2] / 2};
  cross(half, o, other);
  for (int i = 0; i < 3; i++) {
    d[i] = q * o[i] - other[i] + along * s[i];
    d[3 + i] = v[i];
    d[6 + i] = turned[i] + R[i][0] * turned[0] + R[i][1] * turned[1] + R[i][2] * turned[2];
    d[9 + i] = (at_S[i] - p[0] * damped[3 + i]) / MASS;
  }
  d[11] -= p[1];
}
