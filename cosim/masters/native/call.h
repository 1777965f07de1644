/* Prepared calls: functions of FMUs with their arguments, and what is done between them on values alone.

   Each carries the function that performs it, so that nobody needs to know what kinds of calls there are. Python reads
   these headers too (headers.py): what is exported here it finds by its name. */

#ifndef CALL_H
#define CALL_H

#include <stdbool.h>
#include <stddef.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* Statuses of FMI; what cosim/fmi/library.py makes of a step that went well but asks to end the run; and of what needs
   more than is done in C. */
typedef enum { FMI_OK = 0, FMI_WARNING = 1, TERMINATED = 100, STALE = 101, EARLY = 102 } Status;

typedef void Function(void);
typedef struct Call Call;

/* Perform a call; a step begins at `time` and takes `step_size` [s]. Returns its status. */
typedef int Perform(const Call* call, double time, double step_size);

/* One prepared call. The component is looked up at each call, for an instance that cannot reset is made anew between
   two runs. `references` and `values` are of what is got, set or differentiated; a step has neither, but `is_final` where
   no state from before it will be brought back. `detail` is what `perform` needs beyond that; where it is made of several
   calls, it keeps in `failing` which of those its status is of. */
struct Call {
  Perform* perform;
  Function* function;
  void* const* component;
  const unsigned* references;
  size_t n;
  double* values;
  void* detail;
  int is_final;
};

static inline int make(const Call* call, double time, double step_size) {
  return call->perform(call, time, step_size);
}

/* Whether a status is worse than a warning; one that FMI does not know is, negative ones too. */
static inline bool fails(int status) {
  return status < FMI_OK || status > FMI_WARNING;
}

/* Make calls that are no steps in order, up to the first that does worse than warn, and return its status, else the
   first warning's. */
static inline int make_all(const Call* calls, size_t begin, size_t end, size_t* failing) {
  int warning = FMI_OK;
  for (size_t i = begin; i < end; i++) {
    int status = make(&calls[i], 0.0, 0.0);
    if (status == FMI_OK) continue;
    *failing = i;
    if (fails(status)) return status;
    warning = warning ? warning : status;
  }
  return warning;
}

#endif
