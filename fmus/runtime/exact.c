/* The exact step of a linear model with inputs on polynomials of degree 2:

     x(t + h) = x + h phi1(h A) f + h^2 phi2(h A) B u' + h^3 phi3(h A) B u''

   with f = der(x) and u' at the beginning. A and B depend on parameters only. The three matrices are cached for the
   last few step sizes h; they are functions of h and the parameters, so the cache never changes a result. */

#include "instance.h"
#include "matrix.h"

#include <stdlib.h>
#include <string.h>

enum { CACHED = 8 };

typedef struct {
  int filled, oldest;
  double h[CACHED];
  double* phi[CACHED]; /* h phi1, h^2 phi2, h^3 phi3 */
  double* parameters;  /* parameters of the cached matrices */
  double *a, *scratch, *f;
} Exact;

static void* create(const Model* m) {
  size_t n = (size_t)m->size[ROLE_STATE], np = (size_t)m->size[ROLE_PARAMETER];
  Exact* e = calloc(1, sizeof(Exact) + (CACHED * 3 * n * n + np + 4 * n * n + 2 * n) * sizeof(double));
  if (!e) return NULL;
  double* cursor = (double*)(e + 1);
  for (int k = 0; k < CACHED; k++, cursor += 3 * n * n) e->phi[k] = cursor;
  e->parameters = cursor;
  e->a = e->parameters + np;
  e->scratch = e->a + n * n;
  e->f = e->scratch + 3 * n * n + n;
  return e;
}

/* Return the matrices for a step of h, cached or newly computed; a null pointer on failure. */
static const double* matrices(const Model* m, Instance* in, Exact* e, double h) {
  int n = m->size[ROLE_STATE];
  size_t bytes = (size_t)m->size[ROLE_PARAMETER] * sizeof(double);
  if (memcmp(e->parameters, in->p, bytes) != 0 || !e->filled) {
    e->filled = e->oldest = 0;
    memcpy(e->parameters, in->p, bytes);
    if (hfsa_jacobian(m, in, in->state->time, in->x, in->u, e->a)) return NULL;
  }
  for (int k = 0; k < e->filled; k++)
    if (e->h[k] == h) return e->phi[k];
  int k = e->oldest;
  e->h[k] = 0.0;
  if (hfsa_phi(n, e->a, h, e->phi[k], e->scratch)) return NULL;
  e->h[k] = h;
  e->oldest = (k + 1) % CACHED;
  if (e->filled < CACHED) e->filled++;
  return e->phi[k];
}

/* Compute `result` for der(x) = B u' or B u'' at `offset`; a linear model does not depend on time explicitly. */
static int along_inputs(const Model* m, Instance* in, int order, double offset, const double* u) {
  int n = m->size[ROLE_INPUT];
  hfsa_seed_motion(m, in, offset);
  if (order == 2) memcpy(in->seed[ROLE_INPUT], in->rates + n, (size_t)n * sizeof(double));
  return hfsa_forward(m, in, in->state->time + offset, in->x, u);
}

static int advance(const Model* m, Instance* in, double offset, double h) {
  Exact* e = in->work;
  int n = m->size[ROLE_STATE];
  double t = in->state->time + offset;
  const double* u = hfsa_inputs(m, in, offset);
  const double* phi = matrices(m, in, e, h);
  if (!phi || hfsa_rhs(m, in, t, in->x, u, e->f))
    return hfsa_report(in, ERROR, "the step from %.15g by %g has no finite matrices", t, h);
  for (int order = in->degree; order > 0; order--) {
    if (along_inputs(m, in, order, offset, u))
      return hfsa_report(in, ERROR, "the derivatives along the inputs cannot be evaluated at time %.15g", t);
    hfsa_add_product(n, phi + order * n * n, in->result[ROLE_DERIVATIVE], in->x);
  }
  hfsa_add_product(n, phi, e->f, in->x);
  return OK;
}

const Solver hfsa_exact = {create, advance, free, -1};
