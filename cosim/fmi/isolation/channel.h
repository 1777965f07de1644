/* The memory that a client and a host share, and how either waits for the other.

   The client is the process that asks for calls of an FMU, the host the one that makes them. A request is a function, a few
   numbers, and blocks of bytes behind the header; its answer is a status, and the same blocks, rewritten. `request` and
   `answer` count, so that the answer to a request is there when both are equal. Who waits looks again and again for some
   microseconds, and sleeps on a pipe after that. A pipe whose other end is closed tells that the other process is gone. */

#ifndef CHANNEL_H
#define CHANNEL_H

#include <sched.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { BLOCKS = 6, NUMBERS = 3, LOG = 1 << 16, WORDS = 1 << 11, YIELDING = 4 };

/* Statuses beside those of FMI: the host is gone; the caller has been interrupted; the call has taken too long; the binary
   cannot be loaded, or lacks the function. */
typedef enum { LOST = 110, INTERRUPTED = 111, OVERDUE = 112, NOT_LOADED = 113 } Ending;

/* `log` holds messages of the FMU, each with its zero; `words` the last of what it has printed. `places` are where blocks
   begin behind the header, `counts` their numbers of items. */
typedef struct {
  uint32_t request, host_sleeps;
  char pad[56];
  uint32_t answer, client_sleeps;
  int32_t function, status;
  double numbers[NUMBERS];
  int32_t flags[NUMBERS];
  uint64_t address;
  uint64_t places[BLOCKS], counts[BLOCKS];
  uint32_t n_log, n_words;
  char log[LOG], words[WORDS];
} Shared;

static inline void* block(Shared* shared, int i) { return (char*)(shared + 1) + shared->places[i]; }

/* Whether a counter reaches a value within some hundred microseconds: first nothing else is done, then other threads that
   wait for this processor, perhaps the very one that counts, come first. To sleep at once would cost more than most calls. */
static inline bool comes_soon(const uint32_t* counter, uint32_t value, int looks) {
  for (int i = 0; i <= looks; i++) {
    if (__atomic_load_n(counter, __ATOMIC_ACQUIRE) == value) return true;
    if (i >= looks / YIELDING) sched_yield();
#if defined(__x86_64__) || defined(__i386__)
    else __builtin_ia32_pause();
#endif
  }
  return false;
}

#endif
