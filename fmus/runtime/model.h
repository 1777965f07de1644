/* The constant table of one model, defined in the generated file.

   A function takes the five columns t, x, z, u, p, followed by further columns for derivatives, as in
   components/_modelling/functions.py. All its pointers are valid, also those of time and of empty columns. */

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
  ROLE_COUNTER,
  ROLE_CONSTANT,
  ROLE_TEXT,
  ROLES
} Role;

/* One variable of the FMU; its value reference is its position in the list, from 1. Missing bounds are infinite. */
typedef struct {
  const char* name;
  Role role;
  int index; /* index in the column of its role */
  int fixed; /* 1 for a parameter that can be set only before the end of initialization */
  double start, nominal, min, max;
  const char* text; /* value of a ROLE_TEXT variable, otherwise a null pointer */
} Variable;

/* A Co-Simulation solver. `create` allocates the work space of an instance and returns a null pointer on failure.
   `advance` integrates the states from `offset` to `offset + h`, seconds from the beginning of the communication step.
   `destroy` frees the work space; it accepts a null pointer. */
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
  int sample_time;      /* index among the parameters, -1 for a model without ticks */
  int time_varying;     /* 1 if the right-hand side depends on time explicitly */
  const Solver* solver; /* null pointer for a model without continuous states */
  Function *rhs, *out, *tick, *jacobian, *fwd, *adj;
  const int* jacobian_columns; /* compressed columns: column j has the entries columns[j] to columns[j + 1] - 1 */
  const int* jacobian_rows;
  int jacobian_entries;
  int arg_size, res_size, iw_size, w_size; /* largest work space of the functions */
};

extern const Model hfsa_model;

#endif
