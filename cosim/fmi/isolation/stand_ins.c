/* Functions of FMI that ask a host for those of an FMU, by the same names and with the same arguments. */

#include "client.h"
#include "functions.h"

void* client_attached(void* environment, void* log_2, void* log_3);

typedef struct {
  void *logger, *allocate, *release, *step_finished, *environment;
} Callbacks;

#define INSTANTIATE_2(name, size)                                                                                   \
  EXPORT void* name(const char* instance, int type, const char* token, const char* resources, const Callbacks* host, \
                    int visible, int logging) {                                                                     \
    void* client = client_attached(host->environment, host->logger, 0);                                             \
    Client* c = begin(client);                                                                                      \
    put_texts(c, (const char*[]){instance, token, resources}, 3);                                                   \
    shared_of(c)->flags[0] = type, shared_of(c)->flags[1] = visible, shared_of(c)->flags[2] = logging;               \
    ask(c, F_##name);                                                                                               \
    return client;                                                                                                  \
  }

#define INSTANTIATE_3(name, size)                                                                                  \
  EXPORT void* name(const char* instance, const char* token, const char* resources, bool visible, bool logging,      \
                    bool event_mode, bool early_return, const unsigned* required, size_t n, void* environment,       \
                    void* logger, void* update) {                                                                  \
    (void)event_mode, (void)early_return, (void)required, (void)n, (void)update;                                    \
    return instantiate_3(instance, token, resources, visible, logging, environment, logger, F_##name);              \
  }

#define INSTANTIATE_ME_3(name, size)                                                                              \
  EXPORT void* name(const char* instance, const char* token, const char* resources, bool visible, bool logging,     \
                    void* environment, void* logger) {                                                            \
    return instantiate_3(instance, token, resources, visible, logging, environment, logger, F_##name);             \
  }

static void* instantiate_3(const char* instance, const char* token, const char* resources, bool visible, bool logging,
                           void* environment, void* logger, int function) {
  void* client = client_attached(environment, 0, logger);
  Client* c = begin(client);
  put_texts(c, (const char*[]){instance, token, resources}, 3);
  shared_of(c)->flags[0] = 0, shared_of(c)->flags[1] = visible, shared_of(c)->flags[2] = logging;
  ask(c, function);
  return client;
}

/* Whether an instantiation gave an instance: 1, 0, or NOT_LOADED. */
EXPORT int hfsa_is_instance(void* client) {
  Shared* s = shared_of(client);
  return s->status == NOT_LOADED ? NOT_LOADED : s->address != 0;
}

#define FREE(name, size) \
  EXPORT void name(void* client) { ask(begin(client), F_##name); }

#define PLAIN(name, size) \
  EXPORT int name(void* client) { return ask(begin(client), F_##name); }

#define LOGGING(name, Flag)                                                                   \
  EXPORT int name(void* client, Flag on, size_t n, const char* const categories[]) {            \
    Client* c = begin(client);                                                                \
    put_texts(c, categories, n);                                                              \
    shared_of(c)->flags[0] = on;                                                              \
    return ask(c, F_##name);                                                                  \
  }
#define LOGGING_2(name, size) LOGGING(name, int)
#define LOGGING_3(name, size) LOGGING(name, bool)

#define EXPERIMENT(name, Flag)                                                                                \
  EXPORT int name(void* client, Flag has_tolerance, double tolerance, double start, Flag has_stop, double stop) { \
    Client* c = begin(client);                                                                                \
    Shared* s = shared_of(c);                                                                                 \
    s->flags[0] = has_tolerance, s->flags[1] = has_stop;                                                      \
    s->numbers[0] = tolerance, s->numbers[1] = start, s->numbers[2] = stop;                                   \
    return ask(c, F_##name);                                                                                  \
  }
#define EXPERIMENT_2(name, size) EXPERIMENT(name, int)
#define EXPERIMENT_3(name, size) EXPERIMENT(name, bool)

#define GET_2(name, size)                                                          \
  EXPORT int name(void* client, const unsigned* references, size_t n, void* values) { \
    Client* c = begin(client);                                                     \
    put(c, references, n, sizeof *references);                                     \
    put(c, values, n, size);                                                       \
    int status = ask(c, F_##name);                                                 \
    take(c, 1, values);                                                            \
    return status;                                                                 \
  }

#define SET_2(name, size)                                                                \
  EXPORT int name(void* client, const unsigned* references, size_t n, const void* values) { \
    Client* c = begin(client);                                                           \
    put(c, references, n, sizeof *references);                                           \
    put(c, values, n, size);                                                             \
    return ask(c, F_##name);                                                             \
  }

#define GET_3(name, size)                                                                            \
  EXPORT int name(void* client, const unsigned* references, size_t n, void* values, size_t n_values) { \
    Client* c = begin(client);                                                                       \
    put(c, references, n, sizeof *references);                                                       \
    put(c, values, n_values, size);                                                                  \
    int status = ask(c, F_##name);                                                                   \
    take(c, 1, values);                                                                              \
    return status;                                                                                   \
  }

#define SET_3(name, size)                                                                                  \
  EXPORT int name(void* client, const unsigned* references, size_t n, const void* values, size_t n_values) { \
    Client* c = begin(client);                                                                             \
    put(c, references, n, sizeof *references);                                                             \
    put(c, values, n_values, size);                                                                        \
    return ask(c, F_##name);                                                                               \
  }

#define TEXTS_2(name, size)                                                                         \
  EXPORT int name(void* client, const unsigned* references, size_t n, const char* const values[]) { \
    Client* c = begin(client);                                                                      \
    put(c, references, n, sizeof *references);                                                      \
    put_texts(c, values, n);                                                                        \
    return ask(c, F_##name);                                                                        \
  }

#define TEXTS_3(name, size)                                                                                           \
  EXPORT int name(void* client, const unsigned* references, size_t n, const char* const values[], size_t n_values) { \
    Client* c = begin(client);                                                                                        \
    put(c, references, n, sizeof *references);                                                                        \
    put_texts(c, values, n_values);                                                                                   \
    return ask(c, F_##name);                                                                                          \
  }

#define RATES(name, client, references, n, orders, values, n_values) \
  Client* c = begin(client);                                         \
  put(c, references, n, sizeof *references);                         \
  put(c, orders, n, sizeof *orders);                                 \
  put(c, values, n_values, sizeof *values);                          \
  int status = ask(c, F_##name);                                     \
  take(c, 2, values);                                                \
  return status;
#define RATES_2(name, size)                                                                                 \
  EXPORT int name(void* client, const unsigned* references, size_t n, const int* orders, double* values) { \
    RATES(name, client, references, n, orders, values, n)                                                  \
  }
#define RATES_3(name, size)                                                                                \
  EXPORT int name(void* client, const unsigned* references, size_t n, const int* orders, double* values, \
                  size_t n_values) {                                                                      \
    RATES(name, client, references, n, orders, values, n_values)                                          \
  }

#define DIRECTIONAL(name, n_seed, n_result)   \
  Client* c = begin(client);                  \
  put(c, unknowns, n_unknowns, sizeof(int));  \
  put(c, knowns, n_knowns, sizeof(int));      \
  put(c, seed, n_seed, sizeof *seed);         \
  put(c, result, n_result, sizeof *result);   \
  int status = ask(c, F_##name);              \
  take(c, 3, result);                         \
  return status;
#define DIRECTIONAL_2(name, size)                                                                               \
  EXPORT int name(void* client, const unsigned* unknowns, size_t n_unknowns, const unsigned* knowns, size_t n_knowns, \
                  const double* seed, double* result) {                                                        \
    DIRECTIONAL(name, n_knowns, n_unknowns)                                                                    \
  }
#define DIRECTIONAL_3(name, size)                                                                               \
  EXPORT int name(void* client, const unsigned* unknowns, size_t n_unknowns, const unsigned* knowns, size_t n_knowns, \
                  const double* seed, size_t n_seed, double* result, size_t n_result) {                        \
    DIRECTIONAL(name, n_seed, n_result)                                                                        \
  }

#define STEP_2(name, size)                                                              \
  EXPORT int name(void* client, double time, double step_size, int no_state_before) { \
    Client* c = begin(client);                                                          \
    Shared* s = shared_of(c);                                                           \
    s->numbers[0] = time, s->numbers[1] = step_size, s->flags[0] = no_state_before;     \
    return ask(c, F_##name);                                                            \
  }

#define STEP_3(name, size)                                                                                    \
  EXPORT int name(void* client, double time, double step_size, bool no_state_before, bool* event_needed,      \
                  bool* terminate, bool* early_return, double* last_time) {                                   \
    Client* c = begin(client);                                                                                \
    Shared* s = shared_of(c);                                                                                 \
    s->numbers[0] = time, s->numbers[1] = step_size, s->flags[0] = no_state_before;                           \
    put(c, (bool[]){*event_needed, *terminate, *early_return}, 3, sizeof(bool));                              \
    put(c, last_time, 1, sizeof *last_time);                                                                  \
    int status = ask(c, F_##name);                                                                            \
    bool* flags = block(s, 0);                                                                                \
    *event_needed = flags[0], *terminate = flags[1], *early_return = flags[2];                                \
    take(c, 1, last_time);                                                                                    \
    return status;                                                                                            \
  }

#define TIME(name, size)                      \
  EXPORT int name(void* client, double time) { \
    Client* c = begin(client);                \
    shared_of(c)->numbers[0] = time;          \
    return ask(c, F_##name);                  \
  }

#define ARRAY(name, size)                                   \
  EXPORT int name(void* client, double* values, size_t n) { \
    Client* c = begin(client);                              \
    put(c, values, n, sizeof *values);                      \
    int status = ask(c, F_##name);                          \
    take(c, 0, values);                                     \
    return status;                                          \
  }

typedef struct {
  int again, terminate, nominals_changed, values_changed, is_defined;
  double next_time;
} EventInfo;

#define UPDATE_2(name, size)                        \
  EXPORT int name(void* client, EventInfo* info) { \
    Client* c = begin(client);                      \
    put(c, info, 1, sizeof *info);                  \
    int status = ask(c, F_##name);                  \
    take(c, 0, info);                               \
    return status;                                  \
  }

#define UPDATE_3(name, size)                                                                                        \
  EXPORT int name(void* client, bool* again, bool* terminate, bool* nominals_changed, bool* values_changed,         \
                  bool* is_defined, double* next_time) {                                                            \
    Client* c = begin(client);                                                                                      \
    put(c, (bool[]){*again, *terminate, *nominals_changed, *values_changed, *is_defined}, 5, sizeof(bool));         \
    put(c, next_time, 1, sizeof *next_time);                                                                        \
    int status = ask(c, F_##name);                                                                                  \
    bool* f = block(shared_of(c), 0);                                                                               \
    *again = f[0], *terminate = f[1], *nominals_changed = f[2], *values_changed = f[3], *is_defined = f[4];         \
    take(c, 1, next_time);                                                                                          \
    return status;                                                                                                  \
  }

#define COMPLETED(name, Flag)                                                        \
  EXPORT int name(void* client, Flag no_state_before, Flag* event, Flag* terminate) { \
    Client* c = begin(client);                                                       \
    shared_of(c)->flags[0] = no_state_before;                                        \
    put(c, event, 1, sizeof *event);                                                 \
    put(c, terminate, 1, sizeof *terminate);                                         \
    int status = ask(c, F_##name);                                                   \
    take(c, 0, event);                                                               \
    take(c, 1, terminate);                                                           \
    return status;                                                                   \
  }
#define COMPLETED_2(name, size) COMPLETED(name, int)
#define COMPLETED_3(name, size) COMPLETED(name, bool)

/* States are known here by their address there. */

#define SAVE(name, size)                                \
  EXPORT int name(void* client, void** state) {         \
    Client* c = begin(client);                          \
    Shared* s = shared_of(c);                           \
    s->address = (uintptr_t)*state;                     \
    int status = ask(c, F_##name);                      \
    if (status <= 1) *state = (void*)(uintptr_t)s->address; \
    return status;                                      \
  }

#define RESTORE(name, size)                      \
  EXPORT int name(void* client, void* state) {   \
    Client* c = begin(client);                   \
    shared_of(c)->address = (uintptr_t)state;    \
    return ask(c, F_##name);                     \
  }

/* A state that is gone with its host needs no release. */
#define RELEASE(name, size)                       \
  EXPORT int name(void* client, void** state) {   \
    Client* c = begin(client);                    \
    shared_of(c)->address = (uintptr_t)*state;    \
    int status = ask(c, F_##name);                \
    *state = 0;                                   \
    return status >= LOST ? 0 : status;           \
  }

#define STATE_SIZE(name, size)                               \
  EXPORT int name(void* client, void* state, size_t* bytes) { \
    Client* c = begin(client);                               \
    shared_of(c)->address = (uintptr_t)state;                \
    put(c, bytes, 1, sizeof *bytes);                         \
    int status = ask(c, F_##name);                           \
    take(c, 0, bytes);                                       \
    return status;                                           \
  }

#define SERIALIZE(name, size)                                            \
  EXPORT int name(void* client, void* state, unsigned char* data, size_t n) { \
    Client* c = begin(client);                                           \
    shared_of(c)->address = (uintptr_t)state;                            \
    put(c, data, n, 1);                                                  \
    int status = ask(c, F_##name);                                       \
    take(c, 0, data);                                                    \
    return status;                                                       \
  }

#define DESERIALIZE(name, size)                                               \
  EXPORT int name(void* client, const unsigned char* data, size_t n, void** state) { \
    Client* c = begin(client);                                                \
    Shared* s = shared_of(c);                                                 \
    s->address = (uintptr_t)*state;                                           \
    put(c, data, n, 1);                                                       \
    int status = ask(c, F_##name);                                            \
    if (status <= 1) *state = (void*)(uintptr_t)s->address;                   \
    return status;                                                            \
  }

#define STAND_IN(kind, name, size) kind(name, size)
FUNCTIONS(STAND_IN)
