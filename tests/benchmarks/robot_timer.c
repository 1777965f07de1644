/* Processor time of many evaluations of a right-hand side; each has another state, so that none is left out. */

#define _POSIX_C_SOURCE 200809L
#include <time.h>

typedef void Rhs(const double* x, const double* u, const double* p, double* d);
typedef int Casadi(const double** arg, double** res, int* iw, double* w, int mem);

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

__attribute__((visibility("default"))) double time_hand(Rhs* rhs, double* x, const double* u, const double* p, double* d,
                                                        int count) {
  const double begin = now(), x0 = x[0];
  for (int i = 0; i < count; i++) {
    rhs(x, u, p, d);
    x[0] = x0 + 1e-12 * d[0];
  }
  x[0] = x0;
  return now() - begin;
}

__attribute__((visibility("default"))) double time_generated(Casadi* rhs, double* x, const double* u, const double* p,
                                                             double* d, double* w, int count) {
  double t = 0, z = 0;
  const double begin = now(), x0 = x[0];
  const double* arg[] = {&t, x, &z, u, p};
  double* res[] = {d};
  for (int i = 0; i < count; i++) {
    rhs(arg, res, 0, w, 0);
    x[0] = x0 + 1e-12 * d[0];
  }
  x[0] = x0;
  return now() - begin;
}
