/* Prepared calls: functions of FMUs with their arguments, and what is done between them on values alone.

   One that is made of several (`detail` says of which) keeps in `failing` which of those its status is of. */

#ifndef CALL_H
#define CALL_H

#include <stdbool.h>
#include <stddef.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* How a function is called, in FMI 2 or FMI 3: get and set (alike), step, set input derivatives, differentiate, keep
   and bring back the state; and what is done on values, each in a file of its own. */
typedef enum {
  VALUES_2,
  VALUES_3,
  STEP_2,
  STEP_3,
  DERIVATIVES_2,
  DIRECTIONAL_2,
  DIRECTIONAL_3,
  SAVE,
  RESTORE,
  REMEMBER,
  EXTRAPOLATE,
  LOOP,
  CONVERGE,
  GAINS,
  RATES,
  LINES
} Kind;

typedef void Function(void);

/* One prepared call. The component is looked up at each call, for an instance that cannot reset is made anew between
   two runs. `references` and `values` are of what is got, set or differentiated; a step has neither, but `is_final` where
   no state from before it will be brought back. `detail` are the orders of DERIVATIVES_2, the Knowns of DIRECTIONAL,
   where the pointer to a state is, and what is done on values. */
typedef struct {
  int kind;
  int is_final;
  Function* function;
  void* const* component;
  const unsigned* references;
  size_t n;
  double* values;
  void* detail;
} Call;

/* What is differentiated by, and along which direction. */
typedef struct {
  const unsigned* references;
  size_t n;
  const double* seed;
} Knowns;

/* Statuses of FMI; what cosim/fmi/library.py makes of a step that went well but asks to end the run; and of what needs
   more than is done in C. */
enum { FMI_OK = 0, FMI_WARNING = 1, TERMINATED = 100, STALE = 101 };

/* Make one call; a step begins at `time` and takes `step_size` [s]. Returns its status. */
int make(const Call* call, double time, double step_size);

/* The same for Python. */
EXPORT int hfsa_make(const Call* call, double time, double step_size);

/* Make calls that are no steps in order, up to the first that does worse than warn, and return its status, else the
   first warning's. */
int make_all(const Call* calls, size_t begin, size_t end, size_t* failing);

#endif
