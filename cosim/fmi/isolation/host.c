/* The host's end of a channel: loads the binary of an FMU, makes the calls that are asked for, and ends with its client.

   A second thread keeps the last of what the FMU prints, and ends this process with all that it has started when the client
   is gone, whatever the FMU is busy with. */

#define _GNU_SOURCE

#include "channel.h"
#include "functions.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

typedef struct {
  void (*logger)(void*, const char*, int, const char*, const char*, ...);
  void* (*allocate)(size_t, size_t);
  void (*release)(void*);
  void *step_finished, *environment;
} Callbacks;

typedef struct {
  Shared* shared;
  int from_client, to_client, printed;
  Looker looker;
  void *binary, *instance, *functions[N_FUNCTIONS];
} Host;

static Host host;
static pthread_mutex_t logging = PTHREAD_MUTEX_INITIALIZER;

#define NAME(kind, name, size) #name,
static const char* const names[] = {FUNCTIONS(NAME)};

/* Messages and prints ------------------------------------------------------------------------------------------------ */

/* Keep a message after the character of its status: a digit, '9' for one that FMI does not know. */
static void note(int status, const char* message) {
  Shared* s = host.shared;
  pthread_mutex_lock(&logging);
  size_t n = s->n_log, length = strlen(message) + 2;
  if (n < LOG - 2) {
    if (length > LOG - n) length = LOG - n;
    s->log[n] = (char)('0' + (status < 0 || status > 9 ? 9 : status));
    memcpy(s->log + n + 1, message, length - 1);
    s->log[n + length - 1] = 0;
    s->n_log = (uint32_t)(n + length);
  }
  pthread_mutex_unlock(&logging);
}

static void log_2(void* environment, const char* name, int status, const char* category, const char* message, ...) {
  char text[2048];
  va_list arguments;
  (void)environment, (void)name, (void)category;
  va_start(arguments, message);
  vsnprintf(text, sizeof text, message, arguments);
  va_end(arguments);
  note(status, text);
}

static void log_3(void* environment, int status, const char* category, const char* message) {
  (void)environment, (void)category;
  note(status, message ? message : "");
}

static void keep(const char* printed, size_t n) {
  Shared* s = host.shared;
  size_t kept = s->n_words + n > WORDS ? WORDS - n : s->n_words;
  memmove(s->words, s->words + s->n_words - kept, kept);
  memcpy(s->words + kept, printed, n);
  s->n_words = (uint32_t)(kept + n);
}

static void* watch(void* nothing) {
  struct pollfd fds[] = {{host.from_client, 0, 0}, {host.printed, POLLIN, 0}};
  char printed[WORDS];
  for (;;) {
    if (poll(fds, 2, -1) < 0) continue;
    if (fds[0].revents & (POLLHUP | POLLERR | POLLNVAL)) {
      kill(0, SIGKILL);
      _exit(1);
    }
    if (fds[1].revents & POLLIN) {
      ssize_t n = read(host.printed, printed, sizeof printed);
      if (n > 0) keep(printed, (size_t)n);
    } else if (fds[1].revents) {
      fds[1].fd = -1;
    }
  }
  return nothing;
}

/* Calls -------------------------------------------------------------------------------------------------------------- */

static const unsigned* references(int i) { return block(host.shared, i); }

/* The next of several texts in a block. */
static const char* text_after(const char* text) { return text + strlen(text) + 1; }

static const char** texts_of(int i) {
  size_t n = host.shared->counts[i];
  const char** texts = malloc((n + 1) * sizeof *texts);
  const char* text = block(host.shared, i);
  for (size_t k = 0; texts && k < n; k++, text = text_after(text)) texts[k] = text;
  return texts;
}

#define F(...) ((int (*)(void*, __VA_ARGS__))f)
#define INSTANCE host.instance
#define TRUTH(flag) ((flag) != 0)

#define DO_INSTANTIATE_2                                                                                               \
  {                                                                                                                    \
    static const Callbacks callbacks = {log_2, calloc, free, 0, 0};                                                    \
    const char **text = texts_of(0);                                                                                   \
    typedef void* Instantiate(const char*, int, const char*, const char*, const Callbacks*, int, int);                 \
    INSTANCE = ((Instantiate*)f)(text[0], s->flags[0], text[1], text[2], &callbacks, s->flags[1], s->flags[2]);        \
    s->address = (uintptr_t)INSTANCE;                                                                                  \
    return 0;                                                                                                          \
  }
#define DO_INSTANTIATE_3                                                                                               \
  {                                                                                                                    \
    const char **text = texts_of(0);                                                                                   \
    typedef void* Instantiate(const char*, const char*, const char*, bool, bool, bool, bool, const unsigned*, size_t,  \
                              void*, void*, void*);                                                                    \
    INSTANCE = ((Instantiate*)f)(text[0], text[1], text[2], TRUTH(s->flags[1]), TRUTH(s->flags[2]), false, false, 0, 0, \
                                 0, (void*)log_3, 0);                                                                  \
    s->address = (uintptr_t)INSTANCE;                                                                                  \
    return 0;                                                                                                          \
  }
#define DO_INSTANTIATE_ME_3                                                                                            \
  {                                                                                                                    \
    const char **text = texts_of(0);                                                                                   \
    typedef void* Instantiate(const char*, const char*, const char*, bool, bool, void*, void*);                        \
    INSTANCE = ((Instantiate*)f)(text[0], text[1], text[2], TRUTH(s->flags[1]), TRUTH(s->flags[2]), 0, (void*)log_3);   \
    s->address = (uintptr_t)INSTANCE;                                                                                  \
    return 0;                                                                                                          \
  }
#define DO_FREE                          \
  {                                      \
    ((void (*)(void*))f)(INSTANCE);      \
    return 0;                            \
  }
#define DO_PLAIN return ((int (*)(void*))f)(INSTANCE);
#define DO_LOGGING_2                                                        \
  {                                                                         \
    const char** texts = texts_of(0);                                       \
    return F(int, size_t, const char**)(INSTANCE, s->flags[0], s->counts[0], texts); \
  }
#define DO_LOGGING_3                                                        \
  {                                                                         \
    const char** texts = texts_of(0);                                       \
    return F(bool, size_t, const char**)(INSTANCE, TRUTH(s->flags[0]), s->counts[0], texts); \
  }
#define DO_EXPERIMENT_2                                                                             \
  return F(int, double, double, int, double)(INSTANCE, s->flags[0], s->numbers[0], s->numbers[1], s->flags[1], \
                                             s->numbers[2]);
#define DO_EXPERIMENT_3                                                                                         \
  return F(bool, double, double, bool, double)(INSTANCE, TRUTH(s->flags[0]), s->numbers[0], s->numbers[1], \
                                               TRUTH(s->flags[1]), s->numbers[2]);
#define DO_GET_2 return F(const unsigned*, size_t, void*)(INSTANCE, references(0), s->counts[0], block(s, 1));
#define DO_SET_2 DO_GET_2
#define DO_GET_3 \
  return F(const unsigned*, size_t, void*, size_t)(INSTANCE, references(0), s->counts[0], block(s, 1), s->counts[1]);
#define DO_SET_3 DO_GET_3
#define DO_TEXTS_2                                                                                    \
  {                                                                                                   \
    const char** texts = texts_of(1);                                                                 \
    int status = F(const unsigned*, size_t, const char**)(INSTANCE, references(0), s->counts[0], texts); \
    free(texts);                                                                                      \
    return status;                                                                                    \
  }
#define DO_TEXTS_3                                                                                           \
  {                                                                                                          \
    const char** texts = texts_of(1);                                                                        \
    int status = F(const unsigned*, size_t, const char**, size_t)(INSTANCE, references(0), s->counts[0], texts, \
                                                                  s->counts[1]);                             \
    free(texts);                                                                                             \
    return status;                                                                                           \
  }
#define DO_RATES_2                                                                                              \
  return F(const unsigned*, size_t, const int*, double*)(INSTANCE, references(0), s->counts[0], block(s, 1), \
                                                         block(s, 2));
#define DO_RATES_3                                                                                                      \
  return F(const unsigned*, size_t, const int*, double*, size_t)(INSTANCE, references(0), s->counts[0], block(s, 1), \
                                                                 block(s, 2), s->counts[2]);
#define DO_DIRECTIONAL_2                                                                                \
  return F(const unsigned*, size_t, const unsigned*, size_t, const double*, double*)(                   \
      INSTANCE, references(0), s->counts[0], references(1), s->counts[1], block(s, 2), block(s, 3));
#define DO_DIRECTIONAL_3                                                                                         \
  return F(const unsigned*, size_t, const unsigned*, size_t, const double*, size_t, double*, size_t)(            \
      INSTANCE, references(0), s->counts[0], references(1), s->counts[1], block(s, 2), s->counts[2], block(s, 3), \
      s->counts[3]);
#define DO_STEP_2 return F(double, double, int)(INSTANCE, s->numbers[0], s->numbers[1], s->flags[0]);
#define DO_STEP_3                                                                                                      \
  {                                                                                                                    \
    bool* flags = block(s, 0);                                                                                         \
    return F(double, double, bool, bool*, bool*, bool*, double*)(INSTANCE, s->numbers[0], s->numbers[1],               \
                                                                 TRUTH(s->flags[0]), flags, flags + 1, flags + 2,      \
                                                                 block(s, 1));                                         \
  }
#define DO_TIME return F(double)(INSTANCE, s->numbers[0]);
#define DO_ARRAY return F(double*, size_t)(INSTANCE, block(s, 0), s->counts[0]);
#define DO_UPDATE_2 return F(void*)(INSTANCE, block(s, 0));
#define DO_UPDATE_3                                                                                               \
  {                                                                                                               \
    bool* g = block(s, 0);                                                                                        \
    return F(bool*, bool*, bool*, bool*, bool*, double*)(INSTANCE, g, g + 1, g + 2, g + 3, g + 4, block(s, 1));    \
  }
#define DO_COMPLETED_2 return F(int, int*, int*)(INSTANCE, s->flags[0], block(s, 0), block(s, 1));
#define DO_COMPLETED_3 return F(bool, bool*, bool*)(INSTANCE, TRUTH(s->flags[0]), block(s, 0), block(s, 1));
#define DO_SAVE                                \
  {                                            \
    void* state = (void*)(uintptr_t)s->address; \
    int status = F(void**)(INSTANCE, &state);  \
    s->address = (uintptr_t)state;             \
    return status;                             \
  }
#define DO_RELEASE DO_SAVE
#define DO_RESTORE return F(void*)(INSTANCE, (void*)(uintptr_t)s->address);
#define DO_STATE_SIZE return F(void*, size_t*)(INSTANCE, (void*)(uintptr_t)s->address, block(s, 0));
#define DO_SERIALIZE \
  return F(void*, void*, size_t)(INSTANCE, (void*)(uintptr_t)s->address, block(s, 0), s->counts[0]);
#define DO_DESERIALIZE                                                   \
  {                                                                      \
    void* state = (void*)(uintptr_t)s->address;                          \
    int status = F(void*, size_t, void**)(INSTANCE, block(s, 0), s->counts[0], &state); \
    s->address = (uintptr_t)state;                                       \
    return status;                                                       \
  }

/* Make the call of a request: its status. */
static int call(Shared* s) {
  void* f = host.functions[s->function];
  if (!f) f = host.functions[s->function] = dlsym(host.binary, names[s->function]);
  if (!f) {
    char text[256];
    snprintf(text, sizeof text, "the binary lacks %s, a function of the standard", names[s->function]);
    note(0, text);
    return NOT_LOADED;
  }
  switch (s->function) {
#define CASE(kind, name, size) \
  case F_##name:               \
    DO_##kind
    FUNCTIONS(CASE)
  }
  return 3;
}

/* Serving ------------------------------------------------------------------------------------------------------------ */

/* Wait for the next request. */
static void wait_for(uint32_t request) {
  Shared* s = host.shared;
  if (comes_soon(&s->request, request, &host.looker)) return;
  for (;;) {
    __atomic_store_n(&s->host_sleeps, 1, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&s->request, __ATOMIC_SEQ_CST) == request) break;
    char byte;
    ssize_t n = read(host.from_client, &byte, 1);
    if (n == 0 || (n < 0 && errno != EINTR)) _exit(n < 0);
  }
  __atomic_store_n(&s->host_sleeps, 0, __ATOMIC_SEQ_CST);
}

static void start(const char* binary) {
  Shared* s = host.shared;
  pthread_t thread;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
  pthread_create(&thread, &attributes, watch, 0);
  fcntl(host.from_client, F_SETFD, FD_CLOEXEC);
  fcntl(host.to_client, F_SETFD, FD_CLOEXEC);
  fcntl(host.printed, F_SETFD, FD_CLOEXEC);
  signal(SIGPIPE, SIG_DFL);
  wait_for(1);
  host.binary = dlopen(binary, RTLD_NOW | RTLD_LOCAL);
  if (!host.binary) note(0, dlerror());
  s->address = 0;
}

EXPORT void hfsa_serve(const char* binary, int memory, size_t size, int from_client, int to_client, int printed,
                       int looks) {
  Shared* s = mmap(0, size, PROT_READ | PROT_WRITE, MAP_SHARED, memory, 0);
  if (s == MAP_FAILED) _exit(1);
  host = (Host){.shared = s, .from_client = from_client, .to_client = to_client, .printed = printed, .looker = {looks, 0, 0}};
  close(memory);
  start(binary);
  for (uint32_t request = 1;; request++) {
    wait_for(request);
    s->status = host.binary ? call(s) : NOT_LOADED;
    bool is_last = s->function == F_fmi2FreeInstance || s->function == F_fmi3FreeInstance;
    __atomic_store_n(&s->answer, request, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&s->client_sleeps, __ATOMIC_SEQ_CST) && write(to_client, "", 1) < 0) _exit(1);
    if (is_last) _exit(0);
  }
}
