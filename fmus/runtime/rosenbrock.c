/* RODAS5P: a Rosenbrock method of order 5 with 8 stages, L-stable and stiffly accurate, for nonlinear models.

     W k_i = f(t + c_i h, x + sum a_ij k_j) + h d_i f_t + sum (C_ij / h) k_j        W = 1 / (gamma h) - d f / d x

   with a new analytic Jacobian in every step. The last stage is the difference of the result and the embedded result of
   order 4: the error estimate. A one-step method has no history, so a jump of the inputs does not affect the accuracy.

   Coefficients: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical benchmarks within the
   Julia Differential Equations package, BIT Numer. Math. 63, 27 (2023), in the form that needs no product with the
   Jacobian. */

#include "instance.h"
#include "matrix.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { STAGES = 8 };
enum { RELATIVE_TOLERANCE, MAXIMUM_STEP, MAXIMUM_STEPS }; /* indices of the settings */

static const double gamma_diagonal = 0.21193756319429014;

static const double c[STAGES] = {
    0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0};

static const double d[STAGES] = {0.21193756319429014,
                                 -0.42387512638858027,
                                 -0.3384627126235924,
                                 1.8046452872882734,
                                 2.325825639765069,
                                 0.0,
                                 0.0,
                                 0.0};

static const double a[STAGES][STAGES - 1] = {
    {0.0},
    {3.0},
    {2.849394379747939, 0.45842242204463923},
    {-6.954028509809101, 2.489845061869568, -10.358996098473584},
    {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946, 1.0},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946, 1.0, 1.0},
};

static const double C[STAGES][STAGES - 1] = {
    {0.0},
    {-14.155112264123755},
    {-17.97296035885952, -2.859693295451294},
    {147.12150275711716, -1.41221402718213, 71.68940251302358},
    {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
    {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
    {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
     -28.087943162872662},
    {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
     -54.66780262877968, -9.48861652309627},
};

typedef struct {
  double *jacobian, *w; /* n x n */
  double *f, *f_t, *x;
  double* k[STAGES];
  int* pivot;
} Work;

static void* create(const Model* m) {
  size_t n = (size_t)m->size[ROLE_STATE];
  Work* work = calloc(1, sizeof(Work) + (2 * n * n + (3 + STAGES) * n) * sizeof(double) + n * sizeof(int));
  if (!work) return NULL;
  double* cursor = (double*)(work + 1);
  work->jacobian = cursor;
  work->w = work->jacobian + n * n;
  work->f = work->w + n * n;
  work->f_t = work->f + n;
  work->x = work->f_t + n;
  for (int i = 0; i < STAGES; i++) work->k[i] = work->x + n + (size_t)i * n;
  work->pivot = (int*)(work->k[STAGES - 1] + n);
  return work;
}

/* Compute f_t, the derivative of f along time and the inputs. */
static int along_time(const Model* m, Instance* in, double offset, const double* u) {
  const Work* work = in->work;
  size_t bytes = (size_t)m->size[ROLE_STATE] * sizeof(double);
  if (!m->time_varying && !in->degree) {
    memset(work->f_t, 0, bytes);
    return 0;
  }
  hfsa_seed_motion(m, in, offset);
  int failed = hfsa_forward(m, in, in->state->time + offset, in->x, u);
  memcpy(work->f_t, in->result[ROLE_DERIVATIVE], bytes);
  return failed;
}

/* Compute f, f_t and the Jacobian at the beginning of a step. */
static int linearize(const Model* m, Instance* in, double offset) {
  const Work* work = in->work;
  double t = in->state->time + offset;
  const double* u = hfsa_inputs(m, in, offset);
  return along_time(m, in, offset, u) || hfsa_rhs(m, in, t, in->x, u, work->f) ||
         hfsa_jacobian(m, in, t, in->x, u, work->jacobian);
}

/* Compute the stages of a trial step and its result `x`; return 1 if an evaluation fails. */
static int try_step(const Model* m, Instance* in, double offset, double h) {
  const Work* work = in->work;
  int n = m->size[ROLE_STATE];
  for (int k = 0; k < n * n; k++) work->w[k] = -work->jacobian[k];
  for (int i = 0; i < n; i++) work->w[i * n + i] += 1.0 / (gamma_diagonal * h);
  in->counts[FACTORIZATIONS] += 1.0;
  if (hfsa_factorize(n, work->w, work->pivot)) return 1;
  for (int s = 0; s < STAGES; s++) {
    double* k = work->k[s];
    memcpy(work->x, in->x, (size_t)n * sizeof(double));
    for (int j = 0; j < s; j++)
      for (int i = 0; i < n; i++) work->x[i] += a[s][j] * work->k[j][i];
    double at = offset + c[s] * h;
    if (s == 0)
      memcpy(k, work->f, (size_t)n * sizeof(double));
    else if (hfsa_rhs(m, in, in->state->time + at, work->x, hfsa_inputs(m, in, at), k))
      return 1;
    for (int i = 0; i < n; i++) k[i] += h * d[s] * work->f_t[i];
    for (int j = 0; j < s; j++)
      for (int i = 0; i < n; i++) k[i] += C[s][j] / h * work->k[j][i];
    hfsa_solve(n, work->w, work->pivot, k);
  }
  for (int i = 0; i < n; i++) work->x[i] += work->k[STAGES - 1][i];
  return 0;
}

/* Return the largest error / tolerance over the states, infinite for a trial that is not finite, and its state. */
static double error_of(const Model* m, const Instance* in, int* worst) {
  const Work* work = in->work;
  double largest = 0.0;
  for (int i = 0; i < m->size[ROLE_STATE]; i++) {
    double size = in->nominal[i] + fmax(fabs(in->x[i]), fabs(work->x[i]));
    double error = fabs(work->k[STAGES - 1][i]) / (in->settings[RELATIVE_TOLERANCE] * size);
    if (error <= largest) continue;
    *worst = i;
    if (!isfinite(error)) return HUGE_VAL;
    largest = error;
  }
  return largest;
}

/* Error control starts from the step size of the last communication step. A step shortened by a communication point
   does not reduce the proposed step size. */
static int advance(const Model* m, Instance* in, double offset, double h) {
  const Work* work = in->work;
  double limit = in->settings[MAXIMUM_STEP], done = 0.0;
  double proposed = in->state->step > 0.0 ? in->state->step : h;
  int worst = 0, fresh = 0;
  while (done < h) {
    double rest = h - done, step = fmin(proposed, limit);
    int last = step >= rest * (1.0 - 1e-9);
    if (last)
      step = rest;
    else if (step > 0.5 * rest)
      step = 0.5 * rest;
    double now = in->state->time + offset + done;
    if (step < 16.0 * DBL_EPSILON * fmax(fabs(now), h) && !last)
      return hfsa_report(in, DISCARD, "no step from %.15g is small enough for the tolerance of state %s; tried %g s",
                         now, hfsa_name(m, ROLE_STATE, worst), step);
    if (in->allowed < 1.0) return hfsa_exhausted(m, in, offset + done, worst);
    in->allowed -= 1.0;
    if (!fresh && linearize(m, in, offset + done))
      return hfsa_report(in, DISCARD, "the derivatives cannot be evaluated at time %.15g", now);
    fresh = 1;
    double error = try_step(m, in, offset + done, step) ? HUGE_VAL : error_of(m, in, &worst);
    double factor = fmin(6.0, fmax(0.2, 0.9 * pow(error, -0.2)));
    in->counts[error > 1.0 ? REJECTED_STEPS : ACCEPTED_STEPS] += 1.0;
    if (error > 1.0) {
      proposed = step * factor;
      continue;
    }
    memcpy(in->x, work->x, (size_t)m->size[ROLE_STATE] * sizeof(double));
    done = last ? h : done + step;
    fresh = 0;
    proposed = step < proposed && factor >= 1.0 ? fmax(proposed, step * factor) : step * factor;
    if (!last && hfsa_pause(m, in, offset + done)) break;
  }
  in->state->step = fmin(proposed, limit);
  return OK;
}

const Solver hfsa_rosenbrock = {create, advance, free, MAXIMUM_STEPS};
