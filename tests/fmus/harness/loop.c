/* Many steps at once, for tests that take too many for Python: doStep of either version, called through its address. */

#include <stdint.h>

typedef int (*DoStep2)(void* c, double time, double step, int no_set_state);
typedef int (*DoStep3)(void* c, double time, double step, _Bool no_set_state, _Bool* event, _Bool* terminate,
                       _Bool* early, double* last);

/* Step `count` times from step number `first`; the worst status. */
int steps2(DoStep2 do_step, void* c, double step, int64_t first, int64_t count) {
  int worst = 0;
  for (int64_t k = first; k < first + count; k++) {
    int status = do_step(c, (double)k * step, step, 1);
    if (status > worst) worst = status;
  }
  return worst;
}

int steps3(DoStep3 do_step, void* c, double step, int64_t first, int64_t count) {
  int worst = 0;
  _Bool event, terminate, early;
  double last;
  for (int64_t k = first; k < first + count; k++) {
    int status = do_step(c, (double)k * step, step, 1, &event, &terminate, &early, &last);
    if (status > worst) worst = status;
  }
  return worst;
}
