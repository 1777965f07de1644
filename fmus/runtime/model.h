/* The constant side: what the generated file tells the runtime about one model.

   A function takes five columns, t, x, z, u, p, and for derivatives further columns behind them, as
   components/_modelling/functions.py says. Every pointer it is given is valid, also the one of an empty column and the one of
   time. */

#ifndef HFSA_MODEL_H
#define HFSA_MODEL_H

#include <stddef.h>

typedef struct Instance Instance;
typedef struct Model Model;

typedef int Function(const double** arg, double** res, int* iw, double* w, int mem);

typedef enum {
  ROLE_TIME,
  ROLE_STATE,
  ROLE_DERIVATIVE,
  ROLE_SAMPLED_STATE,
  ROLE_NEXT,
  ROLE_INPUT,
  ROLE_INPUT_DERIVATIVE,
  ROLE_OUTPUT,
  ROLE_SAMPLED_OUTPUT,
  ROLE_PARAMETER,
  ROLE_SOLVER,
  ROLE_CONSTANT,
  ROLE_TEXT,
  ROLES
} Role;

/* One variable of the FMU; its value reference is its place in the list. Bounds that are not given are infinite. */
typedef struct {
  const char* name;
  Role role;
  int index; /* place in the column of its role */
  int fixed; /* a parameter that only initialization may change */
  double start, nominal, min, max;
  const char* text; /* value of a ROLE_TEXT, else a null pointer */
} Variable;

/* A solver of Co-Simulation. `advance` takes the states from `offset` to `offset + h` seconds behind the beginning of
   the communication step; `create` allocates what it works on, once per instance, and returns a null pointer when it
   cannot; `destroy` frees that, or does nothing with a null pointer. */
typedef struct {
  void* (*create)(const Model* m);
  int (*advance)(const Model* m, Instance* in, double offset, double h);
  void (*destroy)(void* work);
} Solver;

extern const Solver hfsa_exact, hfsa_rosenbrock, hfsa_rk4, hfsa_cvode;

struct Model {
  const char* name;
  const char* token;
  const Variable* variables;
  int size[ROLES]; /* length of the column of each role */
  int variable_count;
  int sample_time;      /* place among the parameters, -1 where nothing is sampled */
  int time_varying;     /* whether the right-hand side depends on time itself */
  const Solver* solver; /* null pointer where there are no continuous states */
  Function *rhs, *out, *tick, *jacobian, *fwd, *adj;
  const int* jacobian_columns; /* compressed columns: entries of column j are [columns[j], columns[j + 1]) */
  const int* jacobian_rows;
  int jacobian_entries;
  int arg_size, res_size, iw_size, w_size; /* work that the functions need, the largest of all */
};

extern const Model hfsa_model;

#endif
