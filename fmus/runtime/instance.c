/* Creation and destruction of an instance: all memory is allocated here, none while stepping. */

#include "instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double* take(double** cursor, int n) {
  double* column = *cursor;
  *cursor += n;
  return column;
}

/* Allocate the state block: its head, the columns that change while stepping, then parameters and settings. */
static int lay_out_state(const Model* m, Instance* in) {
  int moving = m->size[ROLE_INPUT] + m->size[ROLE_INPUT_DERIVATIVE] + m->size[ROLE_STATE] +
               m->size[ROLE_SAMPLED_STATE] + m->size[ROLE_SAMPLED_OUTPUT];
  int still = m->size[ROLE_PARAMETER] + m->size[ROLE_SOLVER];
  in->moving_size = sizeof(State) + (size_t)moving * sizeof(double);
  in->state_size = in->moving_size + (size_t)still * sizeof(double);
  in->state = calloc(1, in->state_size);
  in->before = malloc(in->moving_size);
  if (!in->state || !in->before) return 0;
  double* cursor = (double*)(in->state + 1);
  in->u = take(&cursor, m->size[ROLE_INPUT]);
  in->rates = take(&cursor, m->size[ROLE_INPUT_DERIVATIVE]);
  in->x = take(&cursor, m->size[ROLE_STATE]);
  in->z = take(&cursor, m->size[ROLE_SAMPLED_STATE]);
  in->held = take(&cursor, m->size[ROLE_SAMPLED_OUTPUT]);
  in->p = take(&cursor, m->size[ROLE_PARAMETER]);
  in->settings = take(&cursor, m->size[ROLE_SOLVER]);
  return 1;
}

/* Allocate all data that can be recomputed. One extra double keeps the pointers of empty columns inside the block. */
static int lay_out_scratch(const Model* m, Instance* in) {
  static const Role knowns[] = {ROLE_TIME, ROLE_STATE, ROLE_SAMPLED_STATE, ROLE_INPUT, ROLE_PARAMETER};
  static const Role unknowns[] = {ROLE_DERIVATIVE, ROLE_OUTPUT, ROLE_NEXT, ROLE_SAMPLED_OUTPUT};
  const int* size = m->size;
  int n_knowns = 0, n_unknowns = 0;
  for (int k = 0; k < 5; k++) n_knowns += size[knowns[k]];
  for (int k = 0; k < 4; k++) n_unknowns += size[unknowns[k]];
  int total =
      2 * n_unknowns + n_knowns + size[ROLE_CONSTANT] + size[ROLE_INPUT] + size[ROLE_STATE] + m->jacobian_entries + 1;
  double* cursor = calloc((size_t)total, sizeof(double));
  if (!cursor) return 0;
  in->memory = cursor;
  in->der = take(&cursor, size[ROLE_DERIVATIVE]);
  in->out = take(&cursor, size[ROLE_OUTPUT]);
  in->next = take(&cursor, size[ROLE_NEXT]);
  in->next_held = take(&cursor, size[ROLE_SAMPLED_OUTPUT]);
  in->seeds = cursor;
  in->seeds_size = (size_t)n_knowns * sizeof(double);
  for (int k = 0; k < 5; k++) in->seed[knowns[k]] = take(&cursor, size[knowns[k]]);
  in->results = cursor;
  in->results_size = (size_t)n_unknowns * sizeof(double);
  for (int k = 0; k < 4; k++) in->result[unknowns[k]] = take(&cursor, size[unknowns[k]]);
  in->column[ROLE_CONSTANT] = take(&cursor, size[ROLE_CONSTANT]);
  in->u_now = take(&cursor, size[ROLE_INPUT]);
  in->nominal = take(&cursor, size[ROLE_STATE]);
  in->jacobian = take(&cursor, m->jacobian_entries);
  return 1;
}

static int take_work(const Model* m, Instance* in) {
  in->arg = malloc((size_t)m->arg_size * sizeof(*in->arg));
  in->res = malloc((size_t)m->res_size * sizeof(*in->res));
  in->iw = malloc(((size_t)m->iw_size + 1) * sizeof(*in->iw));
  in->w = malloc(((size_t)m->w_size + 1) * sizeof(*in->w));
  if (!in->arg || !in->res || !in->iw || !in->w) return 0;
  if (in->interface == BY_MODEL_EXCHANGE || !m->solver) return 1;
  in->work = m->solver->create(m);
  return in->work != NULL;
}

/* Set the pointers to the values of each role, for reading and writing. */
static void point_columns(Instance* in) {
  in->column[ROLE_TIME] = &in->state->time;
  in->column[ROLE_STATE] = in->x;
  in->column[ROLE_DERIVATIVE] = in->der;
  in->column[ROLE_SAMPLED_STATE] = in->z;
  in->column[ROLE_NEXT] = in->next;
  in->column[ROLE_INPUT] = in->u;
  in->column[ROLE_INPUT_DERIVATIVE] = in->rates;
  in->column[ROLE_OUTPUT] = in->out;
  in->column[ROLE_SAMPLED_OUTPUT] = in->held;
  in->column[ROLE_PARAMETER] = in->p;
  in->column[ROLE_SOLVER] = in->settings;
  in->column[ROLE_COUNTER] = in->counts;
}

/* Initialise the state block, after instantiation and reset. */
void hfsa_start_values(const Model* m, Instance* in) {
  memset(in->state, 0, in->state_size);
  memset(in->counts, 0, sizeof in->counts);
  in->state->stop_time = HUGE_VAL;
  in->state->mode = INSTANTIATED;
  in->valid = 0;
  for (int i = 0; i < m->variable_count; i++) {
    const Variable* v = &m->variables[i];
    if (v->role == ROLE_TIME || v->role == ROLE_DERIVATIVE || v->role == ROLE_NEXT || v->role == ROLE_OUTPUT) continue;
    if (v->role == ROLE_STATE) in->nominal[v->index] = v->nominal;
    if (v->role != ROLE_TEXT) in->column[v->role][v->index] = v->start;
  }
}

/* Return a new instance, or log the reason, in any log category, and return a null pointer. */
Instance* hfsa_create(const Model* m, Interface interface, const char* name, const char* token, Log log, int logging) {
  Instance nobody = {0};
  nobody.log = log;
  nobody.log.categories = ~0u;
  nobody.name = (char*)(name ? name : "");
  if (!token || strcmp(token, m->token) != 0) {
    hfsa_report(&nobody, ERROR, "the token is %s, expected %s: the model description belongs to another build of %s",
                token ? token : "missing", m->token, m->name);
    return NULL;
  }
  size_t length = strlen(nobody.name) + 1;
  Instance* in = calloc(1, sizeof(Instance));
  if (in) {
    in->interface = interface;
    in->log = log;
    hfsa_set_logging(in, logging, 0, NULL);
    in->name = malloc(length);
  }
  if (!in || !in->name || !lay_out_state(m, in) || !lay_out_scratch(m, in) || !take_work(m, in)) {
    hfsa_report(&nobody, ERROR, "no memory for an instance of %s", m->name);
    hfsa_free(m, in);
    return NULL;
  }
  memcpy(in->name, nobody.name, length);
  point_columns(in);
  hfsa_start_values(m, in);
  return in;
}

void hfsa_free(const Model* m, Instance* in) {
  if (!in) return;
  if (m->solver) m->solver->destroy(in->work);
  free(in->state);
  free(in->before);
  free(in->memory);
  free((void*)in->arg);
  free(in->res);
  free(in->iw);
  free(in->w);
  free(in->name);
  free(in);
}
