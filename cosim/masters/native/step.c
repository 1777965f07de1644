/* The stepping loop of cosim/masters/master.py in C: the same prepared calls in the same order, so the same bits.

   A co-simulation algorithm is an order of calls between arrays that an output and the inputs it feeds share: get, set,
   step, and what is done between them on values. masters/master.py makes that order once per system; here it is followed
   for thousands of communication points. Nothing is allocated, and nothing is decided that masters/master.py has not
   decided: whatever is not plainly well is returned to masters/native/stepping.py, which reports it as masters/master.py
   does and may go on from there.

   call.h says what a call is, fmi.c calls functions of FMUs; the other files are what is done on values, and have the
   names of those in cosim/actions that say the same. None of them knows another. */

#include "step.h"

#include <math.h>
#include <string.h>

/* Make the calls from `next` to before `end`; false at the first that is not ok, with `next` behind it. */
static bool make_until(const Cycle* cycle, Run* run, size_t end) {
  double time = cycle->start_time + (double)run->count * cycle->step_size;
  for (size_t i = run->next; i < end; i++) {
    int status = make(&cycle->calls[i], time, cycle->step_size);
    if (status != FMI_OK) {
      run->status = status;
      run->next = i + 1;
      return false;
    }
  }
  run->next = end;
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

int hfsa_advance(const Cycle* cycle, Run* run, long long last) {
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
