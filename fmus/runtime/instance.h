/* One mutable instance of the model.

   All data that determine the future of an instance are in one plain block, `State` followed by its columns. An FMU
   state is a copy of this block. All other data are scratch, or caches stored with the values that they depend on, or
   counts of work, which no restored state undoes. */

#ifndef HFSA_INSTANCE_H
#define HFSA_INSTANCE_H

#include "model.h"

/* Status values, the same in FMI 2 and FMI 3. */
typedef enum { OK, WARNING, DISCARD, ERROR } Status;

/* `MODEL_EXCHANGE` and `CO_SIMULATION` are macros of builds by other tools. */
typedef enum { BY_MODEL_EXCHANGE, BY_CO_SIMULATION } Interface;

/* Modes are bits, so a set of modes is a number. */
typedef enum {
  INSTANTIATED = 1,
  INITIALIZATION = 2,
  EVENT = 4,
  CONTINUOUS_TIME = 8,
  STEP = 16,
  TERMINATED = 32,
  INTERMEDIATE = 64, /* inside a communication step, while the importer is told of it */
  INITIALIZED = EVENT | CONTINUOUS_TIME | STEP,
  ANY_MODE = 127
} Mode;

/* The logger of the importer. `send` casts `callback` to its type; `categories` has a bit for each status to log. */
typedef struct Log Log;
struct Log {
  void (*send)(const Log* log, const char* instance, Status status, const char* category, const char* text);
  void (*callback)(void);
  void* environment;
  unsigned categories;
};

/* Head of the state block, followed by the columns [u | rates | x | z | held | p | settings]; the columns up to `held`
   change while stepping. `rates` are the first time derivatives of the inputs, then the second ones. */
typedef struct {
  double time;       /* communication point, or the time set in Model Exchange [s] */
  double start_time; /* time of the first tick [s] */
  double stop_time;  /* infinite if undefined [s] */
  double step;       /* next trial step of an error-controlled solver, 0 at first [s] */
  long long ticks;   /* number of past ticks */
  int mode;
  int once; /* 1 if `rates` apply to the next step only, 0 if they apply until changed */
} State;

/* Counts of the work of the solver, in the order of `COUNTERS` in fmus/_solvers.py. */
enum { ACCEPTED_STEPS, EVALUATIONS, REJECTED_STEPS, JACOBIANS, FACTORIZATIONS, COUNTERS };

/* Cached results: a bit is set while the result is valid for the present state block. */
enum { DERIVATIVES_VALID = 1, OUTPUTS_VALID = 2, NEXT_VALID = 4 };

/* How an importer of FMI 3 is told of points inside a communication step. `tell` casts `callback` to its type and
   returns whether the step has to end there; it is a null pointer where nobody listens. */
typedef struct {
  int (*tell)(Instance* in);
  void (*callback)(void);
  int may_end;
} Listener;

struct Instance {
  char* name;
  Interface interface;
  Log log;
  Listener listener;

  State* state;
  size_t state_size, moving_size;                  /* size of the block, and of its part up to `held` [bytes] */
  void* before;                                    /* copy of the moving part at the beginning of the step */
  double *u, *rates, *x, *z, *held, *p, *settings; /* columns of the block */

  double counts[COUNTERS]; /* since initialization */

  unsigned valid;
  double *der, *out, *next, *next_held; /* last results; `next_held`: sampled outputs of a tick at the present time */
  double* column[ROLES];                /* values of the variables of each role */

  double* seed[ROLES];   /* seeds of knowns by role, null pointers for roles that are no knowns */
  double* result[ROLES]; /* derivatives of unknowns by role, null pointers for roles that are no unknowns */
  double *seeds, *results;
  size_t seeds_size, results_size; /* [bytes] */

  double length;    /* length of the present communication step [s] */
  double ended;     /* offset at which the importer has ended it, else infinite [s] */
  int degree;       /* degree of the polynomials of the inputs in the present step */
  double* u_now;    /* inputs inside a step */
  double* nominal;  /* nominal values of the continuous states */
  double* jacobian; /* entries of the sparse Jacobian */
  const double** arg;
  double** res;
  int* iw;
  double* w;
  void* work;   /* work space of the solver */
  void* memory; /* block of all the doubles above, without the state block */
};

/* instance.c: creation and destruction of an instance */
Instance* hfsa_create(const Model* m, Interface interface, const char* name, const char* token, Log log, int logging);
void hfsa_free(const Model* m, Instance* in);
void hfsa_start_values(const Model* m, Instance* in);

/* messages.c: `hfsa_report` sends a message and returns `status`; `hfsa_permit` reports a call in a wrong mode */
Status hfsa_report(const Instance* in, Status status, const char* format, ...);
Status hfsa_permit(const Instance* in, const char* call, int modes);
Status hfsa_set_logging(Instance* in, int on, size_t n, const char* const categories[]);
const char* hfsa_mode_name(int mode);
const char* hfsa_name(const Model* m, Role role, int index);

/* equations.c: evaluation of the functions; an `int` result is 0, or nonzero if the evaluation fails */
int hfsa_rhs(const Model* m, Instance* in, double t, const double* x, const double* u, double* der);
int hfsa_jacobian(const Model* m, Instance* in, double t, const double* x, const double* u, double* dense);
int hfsa_forward(const Model* m, Instance* in, double t, const double* x, const double* u);
int hfsa_adjoint(const Model* m, Instance* in);
int hfsa_evaluate(const Model* m, Instance* in, unsigned results);
int hfsa_tick(const Model* m, Instance* in, double t, const double* u);
const double* hfsa_inputs(const Model* m, Instance* in, double offset);
void hfsa_seed_motion(const Model* m, Instance* in, double offset);
int hfsa_all_finite(const double* column, int n);

/* step.c: tell the importer that the solver has reached `offset` in the step; nonzero if the step ends there */
int hfsa_pause(const Model* m, Instance* in, double offset);

#endif
