/* The stepping loop of cosim/master.py in C: the same prepared calls in the same order, so the same bits.

   A co-simulation algorithm is an order of three kinds of calls between arrays that an output and the inputs it feeds
   share: get, set and step. master.py makes that order once per system; here it is followed for thousands of
   communication points. Nothing is allocated, and nothing is decided that master.py has not decided: whatever is not
   plainly well is returned to cosim/stepping.py, which reports it as master.py does and may go on from there. */

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

/* How a function is called: get and set (alike), step, or set input derivatives, in FMI 2 or FMI 3; and what is done
   between calls, on values alone. */
typedef enum { VALUES_2, VALUES_3, STEP_2, STEP_3, DERIVATIVES_2, REMEMBER, EXTRAPOLATE, LOOP } Kind;

typedef void Function(void);
typedef int Values2(void* component, const unsigned* references, size_t n, double* values);
typedef int Values3(void* component, const unsigned* references, size_t n, double* values, size_t n_values);
typedef int Derivatives2(void* component, const unsigned* references, size_t n, const int* orders,
                         const double* values);
typedef int Step2(void* component, double time, double step_size, int no_state_before);
typedef int Step3(void* component, double time, double step_size, bool no_state_before, bool* event_needed,
                  bool* terminate, bool* early_return, double* last_time);

/* One prepared call; a step has neither references nor values. The component is looked up at each call, for an
   instance that cannot reset is made anew between two runs. `detail` are the orders of DERIVATIVES_2, and what REMEMBER,
   EXTRAPOLATE and LOOP work on. */
typedef struct {
  int kind;
  Function* function;
  void* const* component;
  const unsigned* references;
  size_t n;
  double* values;
  void* detail;
} Call;

/* cosim/actions/extrapolation.py: values at the last three communication points, (3, n). */
typedef struct {
  const double* bus;
  double* points;
  size_t n;
} Remember;

/* cosim/actions/extrapolation.py: derivatives (2, n) of n inputs, by weights (2, 4, n), and the calls that hand them over. */
typedef struct {
  const Remember* remember;
  const size_t* places;
  const double* weights;
  double* derivatives;
  size_t n;
  const Call* setters;
  size_t n_setters, failing;
} Extrapolate;

/* cosim/actions/algebraic_loop.py: n values of the bus, and the calls that set them and fetch what follows from them. */
typedef struct {
  double* bus;
  const size_t* places;
  const double *inverse, *scale;
  double *guess, *change;
  size_t n;
  const Call* calls;
  size_t n_inner, n_calls, failing;
  double tolerance, rounding;
  int passes;
} Loop;

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

/* Statuses of FMI, and what cosim/_fmi/library.py makes of a step that went well but asks to end the run. */
enum { FMI_OK = 0, FMI_WARNING = 1, TERMINATED = 100, STALE = 101 };

static int make(const Call* call, double time, double step_size);

static int step_3(const Call* call, double time, double step_size) {
  bool event_needed = false, terminate = false, early_return = false;
  double last_time = 0.0;
  int status = ((Step3*)call->function)(*call->component, time, step_size, true, &event_needed, &terminate,
                                        &early_return, &last_time);
  return status == FMI_OK && terminate ? TERMINATED : status;
}

/* Make calls in order up to the first that does worse than warn, and return its status, else the first warning's. */
static int make_all(const Call* calls, size_t begin, size_t end, size_t* failing) {
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

static int remember(const Remember* r) {
  memcpy(r->points + 2 * r->n, r->points + r->n, r->n * sizeof(double));
  memcpy(r->points + r->n, r->points, r->n * sizeof(double));
  memcpy(r->points, r->bus, r->n * sizeof(double));
  return FMI_OK;
}

static int extrapolate(Extrapolate* e, double step_size) {
  const Remember* r = e->remember;
  double divisor = step_size;
  for (size_t order = 0; order < 2; order++, divisor *= step_size) {
    const double* weights = e->weights + order * 4 * e->n;
    for (size_t i = 0; i < e->n; i++) {
      size_t place = e->places[i];
      double total = 0.0;
      total += weights[i] * r->bus[place];
      for (size_t k = 0; k < 3; k++) total += weights[(k + 1) * e->n + i] * r->points[k * r->n + place];
      e->derivatives[order * e->n + i] = total / divisor;
    }
  }
  return make_all(e->setters, 0, e->n_setters, &e->failing);
}

/* One step of Newton's method with the inverse there is; the largest change relative to its size, or not a number. */
static double correct(Loop* l) {
  double largest = 0.0;
  for (size_t i = 0; i < l->n; i++) l->change[i] = 0.0;
  for (size_t j = 0; j < l->n; j++) {
    double residual = l->bus[l->places[j]] - l->guess[j];
    for (size_t i = 0; i < l->n; i++) l->change[i] += l->inverse[i * l->n + j] * residual;
  }
  for (size_t i = 0; i < l->n; i++) {
    double change = fabs(l->change[i]) / fmax(fabs(l->guess[i]), l->scale[i]);
    l->bus[l->places[i]] = l->guess[i] + l->change[i];
    if (!(change <= largest)) largest = change;
  }
  return largest;
}

static int solve(Loop* l) {
  int warning = FMI_OK;
  bool was_close = false;
  if (isnan(l->inverse[0])) return STALE;
  for (int pass = 0; pass < l->passes; pass++) {
    int status = make_all(l->calls, 0, l->n_inner, &l->failing);
    if (status > FMI_WARNING) return status;
    warning = warning ? warning : status;
    for (size_t i = 0; i < l->n; i++) l->guess[i] = l->bus[l->places[i]];
    status = make_all(l->calls, l->n_inner, l->n_calls, &l->failing);
    if (status > FMI_WARNING) return status;
    warning = warning ? warning : status;
    double change = correct(l);
    if (change <= l->rounding || (was_close && change <= l->tolerance)) return warning;
    was_close = change <= l->tolerance;
  }
  return STALE;
}

static int make(const Call* call, double time, double step_size) {
  switch (call->kind) {
    case VALUES_2:
      return ((Values2*)call->function)(*call->component, call->references, call->n, call->values);
    case VALUES_3:
      return ((Values3*)call->function)(*call->component, call->references, call->n, call->values, call->n);
    case STEP_2:
      return ((Step2*)call->function)(*call->component, time, step_size, 1);
    case DERIVATIVES_2:
      return ((Derivatives2*)call->function)(*call->component, call->references, call->n, call->detail, call->values);
    case REMEMBER:
      return remember(call->detail);
    case EXTRAPOLATE:
      return extrapolate(call->detail, step_size);
    case LOOP:
      return solve(call->detail);
    default:
      return step_3(call, time, step_size);
  }
}

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
