/* What this library was compiled with: the size of each structure by its name, where each field is ("Call.detail"), and
   the number of each word. sizes.c is written from all headers when it is compiled (headers.py), and library.py compares
   what is here with what it has read itself. */

#ifndef SIZES_H
#define SIZES_H

#include "call.h"

typedef struct {
  const char* name; /* null behind the last */
  size_t value;
} Size;

EXPORT extern const Size hfsa_sizes[];

#endif
