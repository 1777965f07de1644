/* CVODE of SUNDIALS, for comparison: BDF of variable order and step, Newton's method with the analytic Jacobian.

   The history of a multistep method becomes invalid when an input jumps at a communication point, and a rollback would
   have to restore it. Here every call therefore restarts CVODE at order 1 from the states alone. The time of CVODE
   counts from the beginning of the call, which loses no digits late in a run.

   This file is part of FMUs with this solver only. It requires headers and libraries of SUNDIALS 6 or later. */

#include "instance.h"

#include <cvode/cvode.h>
#include <math.h>
#include <nvector/nvector_serial.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#if SUNDIALS_VERSION_MAJOR < 6
#error "this file requires SUNDIALS 6 or later"
#endif
#ifndef SUN_COMM_NULL /* before SUNDIALS 7 */
#define SUN_COMM_NULL NULL
#endif
#if SUNDIALS_VERSION_MAJOR == 6 && SUNDIALS_VERSION_MINOR < 2
#define get_unsolved_steps CVodeGetNumNonlinSolvConvFails
#else
#define get_unsolved_steps CVodeGetNumStepSolveFails
#endif

enum { RELATIVE_TOLERANCE, MAXIMUM_STEP, MAXIMUM_ORDER, MAXIMUM_STEPS }; /* indices of the settings */

typedef struct {
  const Model* m;
  Instance* in;  /* instance of the present call */
  double offset; /* start of the present call, from the beginning of the communication step [s] */
  SUNContext context;
  N_Vector x, tolerance;
  SUNMatrix matrix;
  SUNLinearSolver linear;
  void* memory;
  double jacobian[]; /* n x n, column by column */
} Work;

/* Compute der(x); return 1 if it is not finite, so that CVODE tries a shorter step. */
static int rhs(double t, N_Vector x, N_Vector der, void* data) {
  Work* work = data;
  Instance* in = work->in;
  double at = work->offset + t, *values = N_VGetArrayPointer(der);
  const double* u = hfsa_inputs(work->m, in, at);
  return hfsa_rhs(work->m, in, in->state->time + at, N_VGetArrayPointer(x), u, values) ||
         !hfsa_all_finite(values, work->m->size[ROLE_STATE]);
}

/* Compute the matrix of Newton's method, 1 - gamma d der / d x, with a new Jacobian unless CVODE keeps the last one.
   Dense matrices of SUNDIALS are stored column by column, as ours. */
static int newton_matrix(double t, N_Vector x, N_Vector der, SUNMatrix matrix, int keep, int* is_new, double gamma,
                         void* data, N_Vector a, N_Vector b, N_Vector c) {
  Work* work = data;
  Instance* in = work->in;
  int n = work->m->size[ROLE_STATE];
  double at = work->offset + t, *entries = SUNDenseMatrix_Data(matrix);
  const double* u = hfsa_inputs(work->m, in, at);
  (void)der, (void)a, (void)b, (void)c;
  *is_new = !keep;
  if (!keep && hfsa_jacobian(work->m, in, in->state->time + at, N_VGetArrayPointer(x), u, work->jacobian)) return 1;
  for (int k = 0; k < n * n; k++) entries[k] = -gamma * work->jacobian[k];
  for (int i = 0; i < n; i++) entries[i * n + i] += 1.0;
  in->counts[FACTORIZATIONS] += 1.0; /* CVODE factorises every matrix that it obtains */
  return 0;
}

/* Disable the messages of SUNDIALS; errors go to the importer's logger. */
#if SUNDIALS_VERSION_MAJOR < 7
static void silent(int code, const char* module, const char* function, char* text, void* data) {
  (void)code, (void)module, (void)function, (void)text, (void)data;
}
static int silence(Work* work) { return CVodeSetErrHandlerFn(work->memory, silent, NULL); }
#else
static int silence(Work* work) { return SUNContext_ClearErrHandlers(work->context); }
#endif

/* Create all objects that are the same for every call; return 1 if one of them cannot be created. */
static int prepare(const Model* m, Work* work) {
  long n = m->size[ROLE_STATE];
  if (SUNContext_Create(SUN_COMM_NULL, &work->context)) return 1;
  work->x = N_VNew_Serial(n, work->context);
  work->tolerance = N_VNew_Serial(n, work->context);
  work->matrix = SUNDenseMatrix(n, n, work->context);
  if (!work->x || !work->tolerance || !work->matrix) return 1;
  N_VConst(0.0, work->x);
  N_VConst(1.0, work->tolerance);
  work->linear = SUNLinSol_Dense(work->x, work->matrix, work->context);
  work->memory = CVodeCreate(CV_BDF, work->context);
  if (!work->linear || !work->memory || silence(work)) return 1;
  void* memory = work->memory;
  return CVodeInit(memory, rhs, 0.0, work->x) || CVodeSVtolerances(memory, 1.0, work->tolerance) ||
         CVodeSetUserData(memory, work) || CVodeSetLinearSolver(memory, work->linear, work->matrix) ||
         CVodeSetLinSysFn(memory, newton_matrix) ||
         CVodeSetMaxHnilWarns(memory, -1);
}

static void destroy(void* data) {
  Work* work = data;
  if (!work) return;
  CVodeFree(&work->memory);
  SUNLinSolFree(work->linear);
  SUNMatDestroy(work->matrix);
  N_VDestroy(work->tolerance);
  N_VDestroy(work->x);
  SUNContext_Free(&work->context);
  free(work);
}

static void* create(const Model* m) {
  size_t n = (size_t)m->size[ROLE_STATE];
  Work* work = calloc(1, sizeof(Work) + n * n * sizeof(double));
  if (!work) return NULL;
  work->m = m;
  if (!prepare(m, work)) return work;
  destroy(work);
  return NULL;
}

/* Return the index of the state with the largest error / tolerance; overwrites the two vectors of `work`. */
static int worst_state(const Work* work) {
  const double *errors = N_VGetArrayPointer(work->x), *weights = N_VGetArrayPointer(work->tolerance);
  int worst = 0;
  CVodeGetEstLocalErrors(work->memory, work->x);
  CVodeGetErrWeights(work->memory, work->tolerance);
  for (int i = 1; i < work->m->size[ROLE_STATE]; i++)
    if (fabs(errors[i] * weights[i]) > fabs(errors[worst] * weights[worst])) worst = i;
  return worst;
}

/* Add the steps of this call, and return those that were accepted; CVodeReInit has set the counts of CVODE to 0. A trial
   step is rejected by the test of its error or because Newton's method does not converge. */
static double count_steps(Work* work) {
  long accepted = 0, inaccurate = 0, unsolved = 0;
  CVodeGetNumSteps(work->memory, &accepted);
  CVodeGetNumErrTestFails(work->memory, &inaccurate);
  get_unsolved_steps(work->memory, &unsolved);
  work->in->counts[ACCEPTED_STEPS] += (double)accepted;
  work->in->counts[REJECTED_STEPS] += (double)(inaccurate + unsolved);
  return (double)accepted;
}

/* The tolerance of a state is the relative tolerance * magnitude + the relative tolerance * nominal value. */
static int advance(const Model* m, Instance* in, double offset, double h) {
  Work* work = in->work;
  void* memory = work->memory;
  double tolerance = in->settings[RELATIVE_TOLERANCE], reached = 0.0;
  double *x = N_VGetArrayPointer(work->x), *absolute = N_VGetArrayPointer(work->tolerance);
  size_t bytes = (size_t)m->size[ROLE_STATE] * sizeof(double);
  if (in->allowed < 1.0) return hfsa_exhausted(m, in, offset, -1);
  work->in = in;
  work->offset = offset;
  memcpy(x, in->x, bytes);
  for (int i = 0; i < m->size[ROLE_STATE]; i++) absolute[i] = tolerance * in->nominal[i];
  int code = CVodeReInit(memory, 0.0, work->x);
  if (!code) code = CVodeSVtolerances(memory, tolerance, work->tolerance);
  if (!code) code = CVodeSetMaxStep(memory, in->settings[MAXIMUM_STEP]);
  if (!code) code = CVodeSetMaxOrd(memory, (int)in->settings[MAXIMUM_ORDER]);
  if (!code) code = CVodeSetMaxNumSteps(memory, (long)fmin(in->allowed, 1e9));
  if (!code) code = CVodeSetStopTime(memory, h);
  if (!code) code = CVode(memory, h, work->x, &reached, CV_NORMAL);
  in->allowed -= count_steps(work);
  if (code == CV_TOO_MUCH_WORK) {
    memcpy(in->x, x, bytes);
    return hfsa_exhausted(m, in, offset + reached, worst_state(work));
  }
  if (code < 0)
    return hfsa_report(in, DISCARD, "CVODE stopped at time %.15g with its code %d; largest error in state %s",
                       in->state->time + offset + reached, code, hfsa_name(m, ROLE_STATE, worst_state(work)));
  memcpy(in->x, x, bytes);
  return OK;
}

const Solver hfsa_cvode = {create, advance, destroy, MAXIMUM_STEPS};
