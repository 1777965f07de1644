/* What the stepping loop is given, and how far it has come. */

#ifndef STEP_H
#define STEP_H

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

/* Go on until `last` steps have been taken, or until something is not well; returns the Outcome. Called again, it goes on
   behind that. */
EXPORT int hfsa_advance(const Cycle* cycle, Run* run, long long last);

#endif
