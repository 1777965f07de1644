/* The mutable side: one instance of the model.

   Everything that decides how an instance goes on lies in one plain block, `State` with its columns behind it. An FMU
   state is a copy of that block. All else is scratch, or is remembered with the values that it was made from. */

#ifndef HFSA_INSTANCE_H
#define HFSA_INSTANCE_H

#include "model.h"

/* Values of FMI 2 and FMI 3 alike. */
typedef enum { OK, WARNING, DISCARD, ERROR } Status;

typedef enum { MODEL_EXCHANGE, CO_SIMULATION } Interface;

/* Modes are bits, so that a set of modes is a number. */
typedef enum {
  INSTANTIATED = 1,
  INITIALIZATION = 2,
  EVENT = 4,
  CONTINUOUS_TIME = 8,
  STEP = 16,
  TERMINATED = 32,
  INITIALIZED = EVENT | CONTINUOUS_TIME | STEP,
  ANY_MODE = 63
} Mode;

/* The importer's logger. `send` knows the true type of `callback`; `categories` has a bit for each status that passes.
 */
typedef struct Log Log;
struct Log {
  void (*send)(const Log* log, const char* instance, Status status, const char* category, const char* text);
  void (*callback)(void);
  void* environment;
  unsigned categories;
};

/* Behind it lie the columns [u | rates | x | z | held | p | settings]; those up to `held` change while stepping.
   `rates` are the first time derivatives of the inputs, then the second ones. */
typedef struct {
  double time;       /* communication point, or the time that Model Exchange has set [s] */
  double start_time; /* ticks are counted from it [s] */
  double stop_time;  /* infinite where none is defined [s] */
  double step;       /* step that an error-controlled solver tries next, 0 at first [s] */
  long long ticks;   /* ticks that have been */
  int mode;
  int once; /* whether `rates` count for the next step only, and not until they are changed */
} State;

/* Results that may be kept: a bit is set while the result belongs to the present state block. */
enum { DERIVATIVES_VALID = 1, OUTPUTS_VALID = 2, NEXT_VALID = 4 };

struct Instance {
  char* name;
  Interface interface;
  Log log;

  State* state;
  size_t state_size, moving_size;                  /* of the whole block, and up to the end of `held` [bytes] */
  void* before;                                    /* the moving part as it was before the step */
  double *u, *rates, *x, *z, *held, *p, *settings; /* columns of the block */

  unsigned valid;
  double *der, *out, *next, *next_held; /* last results, held as of a tick now */
  double* column[ROLES];                /* where the value of a variable of that role is read */

  double* seed[ROLES];   /* directions of knowns, null pointers for roles that cannot be known */
  double* result[ROLES]; /* derivatives of unknowns, likewise */
  double *seeds, *results;
  size_t seeds_size, results_size; /* [bytes] */

  int degree;       /* of the polynomials that the inputs are on in the present step */
  double* u_now;    /* inputs inside a step */
  double* nominal;  /* of the continuous states */
  double* jacobian; /* entries of the sparse Jacobian */
  const double** arg;
  double** res;
  int* iw;
  double* w;
  void* work;   /* the solver's own */
  void* memory; /* all the doubles above but the state block */
};

/* instance.c: life of an instance */
Instance* hfsa_create(const Model* m, Interface interface, const char* name, const char* token, Log log, int logging);
void hfsa_free(const Model* m, Instance* in);
void hfsa_start_values(const Model* m, Instance* in);

/* messages.c: `hfsa_report` sends a message and returns `status`; `hfsa_permit` reports a call in a wrong mode */
Status hfsa_report(const Instance* in, Status status, const char* format, ...);
Status hfsa_permit(const Instance* in, const char* call, int modes);
Status hfsa_set_logging(Instance* in, int on, size_t n, const char* const categories[]);
const char* hfsa_mode_name(int mode);
const char* hfsa_name(const Model* m, Role role, int index);

/* equations.c: values of the functions; all return 0, or something else where the equations cannot be evaluated */
int hfsa_rhs(const Model* m, Instance* in, double t, const double* x, const double* u, double* der);
int hfsa_jacobian(const Model* m, Instance* in, double t, const double* x, const double* u, double* dense);
int hfsa_forward(const Model* m, Instance* in, double t, const double* x, const double* u);
int hfsa_adjoint(const Model* m, Instance* in);
int hfsa_evaluate(const Model* m, Instance* in, unsigned results);
int hfsa_tick(const Model* m, Instance* in, double t, const double* u);
const double* hfsa_inputs(const Model* m, Instance* in, double offset);
void hfsa_seed_motion(const Model* m, Instance* in, double offset);
int hfsa_all_finite(const double* column, int n);

#endif
