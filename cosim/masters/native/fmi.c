#include "fmi.h"

typedef int Values2(void* component, const unsigned* references, size_t n, double* values);
typedef int Values3(void* component, const unsigned* references, size_t n, double* values, size_t n_values);
typedef int Derivatives2(void* component, const unsigned* references, size_t n, const int* orders,
                         const double* values);
typedef int Directional2(void* component, const unsigned* unknowns, size_t n_unknowns, const unsigned* knowns,
                         size_t n_knowns, const double* seed, double* result);
typedef int Directional3(void* component, const unsigned* unknowns, size_t n_unknowns, const unsigned* knowns,
                         size_t n_knowns, const double* seed, size_t n_seed, double* result, size_t n_result);
typedef int Step2(void* component, double time, double step_size, int no_state_before);
typedef int Step3(void* component, double time, double step_size, bool no_state_before, bool* event_needed,
                  bool* terminate, bool* early_return, double* last_time);
typedef int Save(void* component, void** state);
typedef int Restore(void* component, void* state);

int hfsa_values_2(const Call* call, double time, double step_size) {
  (void)time, (void)step_size;
  return ((Values2*)call->function)(*call->component, call->references, call->n, call->values);
}

int hfsa_values_3(const Call* call, double time, double step_size) {
  (void)time, (void)step_size;
  return ((Values3*)call->function)(*call->component, call->references, call->n, call->values, call->n);
}

int hfsa_input_derivatives_2(const Call* call, double time, double step_size) {
  (void)time, (void)step_size;
  return ((Derivatives2*)call->function)(*call->component, call->references, call->n, call->detail, call->values);
}

int hfsa_directional_2(const Call* call, double time, double step_size) {
  const Knowns* knowns = call->detail;
  (void)time, (void)step_size;
  return ((Directional2*)call->function)(*call->component, call->references, call->n, knowns->references, knowns->n,
                                         knowns->seed, call->values);
}

int hfsa_directional_3(const Call* call, double time, double step_size) {
  const Knowns* knowns = call->detail;
  (void)time, (void)step_size;
  return ((Directional3*)call->function)(*call->component, call->references, call->n, knowns->references, knowns->n,
                                         knowns->seed, knowns->n, call->values, call->n);
}

int hfsa_step_2(const Call* call, double time, double step_size) {
  return ((Step2*)call->function)(*call->component, time, step_size, call->is_final);
}

int hfsa_step_3(const Call* call, double time, double step_size) {
  bool event_needed = false, terminate = false, early_return = false;
  double last_time = 0.0;
  int status = ((Step3*)call->function)(*call->component, time, step_size, call->is_final, &event_needed, &terminate,
                                        &early_return, &last_time);
  if (status != FMI_OK) return status;
  return terminate ? TERMINATED : early_return ? EARLY : FMI_OK;
}

int hfsa_save(const Call* call, double time, double step_size) {
  (void)time, (void)step_size;
  return ((Save*)call->function)(*call->component, call->detail);
}

int hfsa_restore(const Call* call, double time, double step_size) {
  (void)time, (void)step_size;
  return ((Restore*)call->function)(*call->component, *(void**)call->detail);
}
