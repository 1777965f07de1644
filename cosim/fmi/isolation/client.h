/* The client's end of a channel: a request is begun, its blocks are put in, it is asked, and its blocks are taken out. */

#ifndef CLIENT_H
#define CLIENT_H

#include "channel.h"

typedef struct Client Client;

/* Prepare the next request. */
Client* begin(void* client);

/* Put in the next block: n items of a size, copied from `data`; one byte more where it ends with a zero of its own. */
void put(Client* client, const void* data, size_t n, size_t size);

/* Put in texts as one block of bytes. */
void put_texts(Client* client, const char* const* texts, size_t n);

/* Ask for a function and wait for its answer: its status, or an ending. */
int ask(Client* client, int function);

/* Take a block out again, of the size that it was put in with. */
void take(Client* client, int i, void* data);

Shared* shared_of(Client* client);

#endif
