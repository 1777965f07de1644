/* The memory that a client and a host share, and how either waits for the other.

   The client is the process that asks for calls of an FMU, the host the one that makes them. A request is a function, a few
   numbers, and blocks of bytes behind the header; its answer is a status, and the same blocks, rewritten. `request` and
   `answer` count, so that the answer to a request is there when both are equal. Who waits looks again and again for some
   microseconds, and sleeps on a pipe after that. A pipe whose other end is closed tells that the other process is gone. */

#ifndef CHANNEL_H
#define CHANNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { BLOCKS = 6, NUMBERS = 3, LOG = 1 << 16, WORDS = 1 << 11, MOST_MISSES = 6 };

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

/* Who looks for a counter: how often before it sleeps, how many times in a row that was in vain, and how many times more it
   sleeps at once for that. */
typedef struct {
  int looks, misses, rests;
} Looker;

/* Whether a counter reaches a value within some hundred microseconds. To look is ten times as fast as to sleep and wake up, but
   in vain where a call takes long or other processes want the processor: after misses, it is left for a while. */
static inline bool comes_soon(const uint32_t* counter, uint32_t value, Looker* looker) {
  if (__atomic_load_n(counter, __ATOMIC_ACQUIRE) == value) return true;
  if (looker->rests > 0) {
    looker->rests--;
    return false;
  }
  for (int i = 0; i < looker->looks; i++) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#endif
    if (__atomic_load_n(counter, __ATOMIC_ACQUIRE) == value) {
      looker->misses = 0;
      return true;
    }
  }
  if (looker->misses < MOST_MISSES) looker->misses++;
  looker->rests = (1 << looker->misses) - 1;
  return false;
}

#endif
