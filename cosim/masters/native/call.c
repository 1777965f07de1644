#include "call.h"

#include "algebraic_loop.h"
#include "extrapolation.h"
#include "feedback.h"
#include "iterated.h"

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

static int step_3(const Call* call, double time, double step_size) {
  bool event_needed = false, terminate = false, early_return = false;
  double last_time = 0.0;
  int status = ((Step3*)call->function)(*call->component, time, step_size, call->is_final, &event_needed, &terminate,
                                        &early_return, &last_time);
  return status == FMI_OK && terminate ? TERMINATED : status;
}

static int directional_2(const Call* call) {
  const Knowns* knowns = call->detail;
  return ((Directional2*)call->function)(*call->component, call->references, call->n, knowns->references, knowns->n,
                                         knowns->seed, call->values);
}

static int directional_3(const Call* call) {
  const Knowns* knowns = call->detail;
  return ((Directional3*)call->function)(*call->component, call->references, call->n, knowns->references, knowns->n,
                                         knowns->seed, knowns->n, call->values, call->n);
}

int make(const Call* call, double time, double step_size) {
  switch (call->kind) {
    case VALUES_2:
      return ((Values2*)call->function)(*call->component, call->references, call->n, call->values);
    case VALUES_3:
      return ((Values3*)call->function)(*call->component, call->references, call->n, call->values, call->n);
    case STEP_2:
      return ((Step2*)call->function)(*call->component, time, step_size, call->is_final);
    case STEP_3:
      return step_3(call, time, step_size);
    case DERIVATIVES_2:
      return ((Derivatives2*)call->function)(*call->component, call->references, call->n, call->detail, call->values);
    case DIRECTIONAL_2:
      return directional_2(call);
    case DIRECTIONAL_3:
      return directional_3(call);
    case SAVE:
      return ((Save*)call->function)(*call->component, call->detail);
    case RESTORE:
      return ((Restore*)call->function)(*call->component, *(void**)call->detail);
    case REMEMBER:
      return remember(call->detail);
    case EXTRAPOLATE:
      return extrapolate(call->detail, step_size);
    case LOOP:
      return solve(call->detail);
    case CONVERGE:
      return converge(call->detail, time, step_size);
    case GAINS:
      return find_gains(call->detail);
    case RATES:
      return find_rates(call->detail);
    default:
      return lay_lines(call->detail, step_size);
  }
}

EXPORT int hfsa_make(const Call* call, double time, double step_size) { return make(call, time, step_size); }

int make_all(const Call* calls, size_t begin, size_t end, size_t* failing) {
  int warning = FMI_OK;
  for (size_t i = begin; i < end; i++) {
    int status = make(&calls[i], 0.0, 0.0);
    if (status == FMI_OK) continue;
    *failing = i;
    if (status > FMI_WARNING) return status;
    warning = warning ? warning : status;
  }
  return warning;
}
