#define _GNU_SOURCE

#include "client.h"

#include "functions.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { PERIOD = 100, LAST_CALL = 20 };

typedef void Logger2(void* environment, const char* name, int status, const char* category, const char* message, ...);
typedef void Logger3(void* environment, int status, const char* category, const char* message);

struct Client {
  Shared* shared;
  size_t size, used, sizes[BLOCKS];
  int n, host, to_host, from_host;
  Looker looker;
  uint32_t count;
  int ending;
  bool is_too_large;
  void* environment;
  Logger2* log_2;
  Logger3* log_3;
};

/* The client that the next instantiation on this thread uses. */
static __thread Client* attached;

/* Whether to go on waiting: 1, or an ending; any other number where it could not tell, because of an exception. */
static int (*patience)(void);

EXPORT void hfsa_set_patience(int (*function)(void)) { patience = function; }

EXPORT int hfsa_attach(int host, int memory, size_t size, int to_host, int from_host, int looks) {
  Shared* shared = mmap(0, size, PROT_READ | PROT_WRITE, MAP_SHARED, memory, 0);
  Client* client = shared == MAP_FAILED ? 0 : calloc(1, sizeof *client);
  if (!client) return -1;
  client->shared = shared;
  client->size = size;
  client->host = host;
  client->to_host = to_host;
  client->from_host = from_host;
  client->looker.looks = looks;
  attached = client;
  return 0;
}

/* Take the attached client for an instance whose messages go to a logger; of two, one is null. */
void* client_attached(void* environment, void* log_2, void* log_3) {
  Client* client = attached;
  attached = 0;
  client->environment = environment;
  client->log_2 = (Logger2*)log_2;
  client->log_3 = (Logger3*)log_3;
  return client;
}

EXPORT const char* hfsa_words(void* client, size_t* n) {
  Shared* shared = shared_of(client);
  *n = shared->n_words < WORDS ? shared->n_words : WORDS;
  return shared->words;
}

EXPORT int hfsa_ending(void* client) { return ((Client*)client)->ending; }

EXPORT void hfsa_detach(void* client) {
  Client* c = client;
  munmap(c->shared, c->size);
  close(c->to_host);
  close(c->from_host);
  free(c);
}

Shared* shared_of(Client* client) { return client->shared; }

Client* begin(void* client) {
  Client* c = client;
  c->n = 0;
  c->used = 0;
  c->is_too_large = false;
  return c;
}

void put(Client* c, const void* data, size_t n, size_t size) {
  size_t room = c->size - sizeof(Shared) - c->used, bytes = n * size;
  int i = c->n++;
  c->shared->places[i] = c->used;
  c->shared->counts[i] = n;
  c->sizes[i] = 0;
  if (n > room / (size ? size : 1)) {
    c->is_too_large = true;
    return;
  }
  c->sizes[i] = bytes;
  if (bytes) memcpy(block(c->shared, i), data, bytes);
  bytes = (bytes + 15) / 16 * 16;
  c->used += bytes < room ? bytes : room;
}

void put_texts(Client* c, const char* const* texts, size_t n) {
  size_t bytes = 0, place = 0;
  for (size_t i = 0; i < n; i++) bytes += strlen(texts[i]) + 1;
  char* all = malloc(bytes + 1);
  for (size_t i = 0; all && i < n; i++) {
    size_t length = strlen(texts[i]) + 1;
    memcpy(all + place, texts[i], length);
    place += length;
  }
  put(c, all, all ? bytes : 0, 1);
  c->shared->counts[c->n - 1] = n;
  free(all);
}

void take(Client* c, int i, void* data) {
  if (c->sizes[i]) memcpy(data, block(c->shared, i), c->sizes[i]);
}

static void tell(Client* c, int status, const char* message) {
  if (c->log_2) c->log_2(c->environment, "", status, "", "%s", message);
  if (c->log_3) c->log_3(c->environment, status, "", message);
}

/* Give the logger the messages of the FMU, each of which begins with the digit of its status. */
static void tell_all(Client* c) {
  Shared* s = c->shared;
  size_t n = s->n_log < LOG ? s->n_log : LOG;
  for (size_t i = 0; i < n; i += strlen(s->log + i) + 1) {
    s->log[LOG - 1] = 0;
    if (s->log[i]) tell(c, s->log[i] - '0', s->log + i + 1);
  }
  s->n_log = 0;
}

static int ended(Client* c, int ending) {
  c->ending = ending;
  kill(-c->host, SIGKILL);
  return ending;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* Whether the host has ended; its parent still reaps it. */
static bool is_gone(Client* c) {
  siginfo_t info = {0};
  int found = waitid(P_PID, (id_t)c->host, &info, WEXITED | WNOHANG | WNOWAIT);
  return found ? errno == ECHILD : info.si_pid != 0;
}

/* Sleep until the answer is there: 0, or an ending. `periods` are the longest to wait, 0 for any number. */
static int wait_long(Client* c, int periods) {
  Shared* s = c->shared;
  double next = now() + PERIOD;
  for (int i = 0;;) {
    __atomic_store_n(&s->client_sleeps, 1, __ATOMIC_SEQ_CST);
    if (__atomic_load_n(&s->answer, __ATOMIC_SEQ_CST) == c->count) break;
    struct pollfd fd = {c->from_host, POLLIN, 0};
    double left = next - now();
    int found = poll(&fd, 1, left > 0 ? (int)left + 1 : 0);
    char byte;
    if (found > 0 && fd.revents & POLLIN && read(c->from_host, &byte, 1) < 0 && errno != EINTR) return ended(c, LOST);
    if (__atomic_load_n(&s->answer, __ATOMIC_SEQ_CST) == c->count) break;
    if (found > 0 && fd.revents & (POLLHUP | POLLERR) && !(fd.revents & POLLIN)) return ended(c, LOST);
    if (now() < next) continue;
    next = now() + PERIOD;
    if (is_gone(c)) return ended(c, LOST);
    if (periods && ++i >= periods) return ended(c, OVERDUE);
    int going = patience ? patience() : 1;
    if (going != 1) return ended(c, going == OVERDUE ? OVERDUE : INTERRUPTED);
  }
  __atomic_store_n(&s->client_sleeps, 0, __ATOMIC_SEQ_CST);
  return 0;
}

int ask(Client* c, int function) {
  Shared* s = c->shared;
  if (c->ending) return c->ending;
  if (c->is_too_large) {
    tell(c, 0, "one call moves more values than the memory shared with the FMU's process holds");
    return 3;
  }
  s->function = function;
  __atomic_store_n(&s->request, ++c->count, __ATOMIC_SEQ_CST);
  /* a write to a host that is gone fails, which the wait will find */
  if (__atomic_load_n(&s->host_sleeps, __ATOMIC_SEQ_CST) && write(c->to_host, "", 1) < 0 && errno == EBADF)
    return ended(c, LOST);
  if (!comes_soon(&s->answer, c->count, &c->looker)) {
    bool is_last = function == F_fmi2FreeInstance || function == F_fmi3FreeInstance;
    int ending = wait_long(c, is_last ? LAST_CALL : 0);
    if (ending) {
      tell_all(c);
      return ending;
    }
  }
  if (s->n_log) tell_all(c);
  return s->status;
}
