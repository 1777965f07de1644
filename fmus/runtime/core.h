/* The functions of an FMU, common to both versions of the standard; fmi2.c and fmi3.c only convert types.

   Every function checks that the present mode permits the call, and logs a message for each error. */

#ifndef HFSA_CORE_H
#define HFSA_CORE_H

#include "instance.h"

typedef unsigned int Reference;

typedef struct {
  int defined;
  double time; /* [s] */
} NextEvent;

/* modes.c */
Status hfsa_setup(Instance* in, double start_time, int stop_defined, double stop_time);
Status hfsa_enter_initialization(Instance* in);
Status hfsa_exit_initialization(Instance* in);
Status hfsa_enter_event_mode(Instance* in);
Status hfsa_enter_continuous_time_mode(Instance* in);
Status hfsa_update_discrete_states(const Model* m, Instance* in, NextEvent* next);
Status hfsa_terminate(Instance* in);
Status hfsa_reset(const Model* m, Instance* in);

/* variables.c */
Status hfsa_get(const Model* m, Instance* in, const Reference* references, size_t n, double* values);
Status hfsa_set(const Model* m, Instance* in, const Reference* references, size_t n, const double* values);
Status hfsa_get_text(const Model* m, Instance* in, const Reference* references, size_t n, const char** values);
Status hfsa_refuse(const Model* m, Instance* in, const char* call, const Reference* references, size_t n);
const Variable* hfsa_variable(const Model* m, const Instance* in, const char* call, Reference reference);
Status hfsa_same_size(const Instance* in, const char* call, size_t found, size_t expected);

/* continuous.c: interface for the solver of a Model Exchange importer */
Status hfsa_set_time(Instance* in, double time);
Status hfsa_set_states(const Model* m, Instance* in, const double* x, size_t n);
Status hfsa_get_states(const Model* m, Instance* in, double* x, size_t n);
Status hfsa_get_derivatives(const Model* m, Instance* in, double* der, size_t n);
Status hfsa_get_nominals(const Model* m, Instance* in, double* nominals, size_t n);

/* derivatives.c */
Status hfsa_directional(const Model* m, Instance* in, const Reference* unknowns, size_t n_unknowns,
                        const Reference* knowns, size_t n_knowns, const double* seed, double* sensitivity);
Status hfsa_adjoint_derivative(const Model* m, Instance* in, const Reference* unknowns, size_t n_unknowns,
                               const Reference* knowns, size_t n_knowns, const double* seed, double* sensitivity);
Status hfsa_output_derivatives(const Model* m, Instance* in, const Reference* references, size_t n, const int* orders,
                               double* values);
Status hfsa_set_input_derivatives(const Model* m, Instance* in, const Reference* references, size_t n,
                                  const int* orders, const double* values);

/* snapshot.c: an FMU state is a header and a copy of the state block; serialisation copies its bytes */
typedef struct Snapshot Snapshot;
Status hfsa_get_state(const Model* m, Instance* in, Snapshot** snapshot);
Status hfsa_set_state(const Model* m, Instance* in, const Snapshot* snapshot);
Status hfsa_free_state(const Instance* in, Snapshot** snapshot);
Status hfsa_serialized_size(const Model* m, Instance* in, const Snapshot* snapshot, size_t* size);
Status hfsa_serialize(const Model* m, Instance* in, const Snapshot* snapshot, void* bytes, size_t size);
Status hfsa_deserialize(const Model* m, Instance* in, const void* bytes, size_t size, Snapshot** snapshot);

/* ticks.c */
double hfsa_tick_time(const Model* m, const Instance* in);
double hfsa_tick_tolerance(const Model* m, const Instance* in, double t);
int hfsa_ticks_are_lost(const Model* m, const Instance* in, double t);
Status hfsa_do_tick(const Model* m, Instance* in, double t, const double* u);
Status hfsa_do_due_ticks(const Model* m, Instance* in);

/* step.c */
Status hfsa_do_step(const Model* m, Instance* in, double t, double h);
Status hfsa_keep_part(Instance* in);

#endif
