/* The stepping loop of cosim/masters/master.py in C: the same prepared calls in the same order, so the same bits.

   A co-simulation algorithm is an order of calls between arrays that an output and the inputs it feeds share: get, set,
   step, and what is done between them on values. masters/master.py makes that order once per system; here it is followed for
   thousands of communication points. Nothing is allocated, and nothing is decided that masters/master.py has not decided:
   whatever is not plainly well is returned to cosim/masters/native/stepping.py, which reports it as masters/master.py does and may go on from
   there.

   call.h says what a call is; the files of what is done on values have the names of those in cosim/actions that say the
   same. */

#include <math.h>
#include <string.h>

#include "call.h"

/* Values that must be finite and within their bounds. */
typedef struct {
  const double *values, *low, *high;
  size_t n;
} Watch;

/* A cycle is three runs of calls: those before `exchange` lead to the next communication point, those before `record`
   exchange values at it, and the rest fetch what is recorded there. */
typedef struct {
  const Call* calls;
  size_t exchange, record, end;
  Watch bus, row;
  double start_time, step_size;
  long long every; /* communication points between two rows; 0 where nothing is recorded */
} Cycle;

typedef enum { STEPPING, EXCHANGING, RECORDING } Phase;

/* How far a run has come. */
typedef struct {
  long long count; /* steps taken: the communication point is at start_time + count * step_size */
  size_t next;     /* the next call */
  int phase;
  int status;             /* of the call before `next`, where `hfsa_advance` came back with CALL_NOT_OK */
  double *time, *values;  /* rows of the recording */
  size_t rows, capacity;
} Run;

/* Why `hfsa_advance` came back. */
typedef enum { COMPLETE, CALL_NOT_OK, BUS_WRONG, ROW_WRONG, RECORDING_FULL } Outcome;

/* Make the calls from `next` to before `end`; false at the first that is not ok, with `next` behind it. */
static bool make_until(const Cycle* cycle, Run* run, size_t end) {
  double time = cycle->start_time + (double)run->count * cycle->step_size;
  while (run->next < end) {
    run->status = make(&cycle->calls[run->next++], time, cycle->step_size);
    if (run->status != FMI_OK) return false;
  }
  return true;
}

static bool is_well(const Watch* watch) {
  for (size_t i = 0; i < watch->n; i++) {
    double value = watch->values[i];
    if (!isfinite(value) || value < watch->low[i] || value > watch->high[i]) return false;
  }
  return true;
}

static void take_row(const Cycle* cycle, Run* run) {
  run->time[run->rows] = cycle->start_time + (double)run->count * cycle->step_size;
  memcpy(run->values + run->rows * cycle->row.n, cycle->row.values, cycle->row.n * sizeof(double));
  run->rows++;
}

/* Go on until `last` steps have been taken, or until something is not well. Called again, it goes on behind that. */
EXPORT int hfsa_advance(const Cycle* cycle, Run* run, long long last) {
  while (run->phase != STEPPING || run->count < last) {
    if (run->phase == STEPPING) {
      if (!make_until(cycle, run, cycle->exchange)) return CALL_NOT_OK;
      run->count++;
      run->phase = EXCHANGING;
    }
    if (run->phase == EXCHANGING) {
      if (!make_until(cycle, run, cycle->record)) return CALL_NOT_OK;
      run->phase = RECORDING;
      if (!is_well(&cycle->bus)) return BUS_WRONG;
    }
    bool is_row = cycle->every && run->count % cycle->every == 0;
    if (is_row) {
      if (run->rows == run->capacity) return RECORDING_FULL;
      if (!make_until(cycle, run, cycle->end)) return CALL_NOT_OK;
      take_row(cycle, run);
    }
    run->phase = STEPPING;
    run->next = 0;
    if (is_row && !is_well(&cycle->row)) return ROW_WRONG;
  }
  return COMPLETE;
}
