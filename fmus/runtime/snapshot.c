/* FMU states: a header and a copy of the state block; serialised, the header has a checksum of the block as well. */

#include "core.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* All fields but the checksum are compared with those of the instance, to reject the states of other models, builds or
   interfaces. The token is a hash of this file too, so that it is also the version of the format. */
typedef struct {
  char token[72];
  long long interface, size;
  unsigned long long checksum; /* of the block, 0 in memory */
} Header;

struct Snapshot {
  Header header;
};

static Header own_header(const Model* m, const Instance* in) {
  Header header;
  memset(&header, 0, sizeof header);
  strncpy(header.token, m->token, sizeof header.token - 1);
  header.interface = in->interface;
  header.size = (long long)in->state_size;
  return header;
}

static Status check_header(const Model* m, const Instance* in, const void* bytes) {
  Header own = own_header(m, in);
  if (memcmp(&own, bytes, offsetof(Header, checksum)) == 0) return OK;
  return hfsa_report(in, ERROR, "the FMU state belongs to another model, build or interface than this %s", m->name);
}

/* Return the 64-bit FNV-1a hash of bytes. */
static unsigned long long checksum(const void* bytes, size_t size) {
  unsigned long long hash = 0xcbf29ce484222325u;
  for (const unsigned char *b = bytes, *end = b + size; b < end; b++) hash = (hash ^ *b) * 0x100000001b3u;
  return hash;
}

static size_t snapshot_size(const Instance* in) { return sizeof(Header) + in->state_size; }

static Snapshot* new_snapshot(const Instance* in) {
  Snapshot* snapshot = malloc(snapshot_size(in));
  if (!snapshot) hfsa_report(in, ERROR, "no memory for an FMU state");
  return snapshot;
}

/* An existing snapshot is overwritten, so repeated calls allocate memory only once. */
Status hfsa_get_state(const Model* m, Instance* in, Snapshot** snapshot) {
  if (!in || !snapshot) return ERROR;
  if (*snapshot && check_header(m, in, *snapshot)) return ERROR;
  if (!*snapshot) *snapshot = new_snapshot(in);
  if (!*snapshot) return ERROR;
  (*snapshot)->header = own_header(m, in);
  memcpy(*snapshot + 1, in->state, in->state_size);
  return OK;
}

Status hfsa_set_state(const Model* m, Instance* in, const Snapshot* snapshot) {
  if (!in) return ERROR;
  if (!snapshot) return hfsa_report(in, ERROR, "SetFMUState: the FMU state is a null pointer");
  if (check_header(m, in, snapshot)) return ERROR;
  memcpy(in->state, snapshot + 1, in->state_size);
  in->valid = 0;
  return OK;
}

Status hfsa_free_state(const Instance* in, Snapshot** snapshot) {
  if (!in) return ERROR;
  if (!snapshot) return OK;
  free(*snapshot);
  *snapshot = NULL;
  return OK;
}

Status hfsa_serialized_size(const Model* m, Instance* in, const Snapshot* snapshot, size_t* size) {
  if (!in || !snapshot || check_header(m, in, snapshot)) return ERROR;
  *size = snapshot_size(in);
  return OK;
}

Status hfsa_serialize(const Model* m, Instance* in, const Snapshot* snapshot, void* bytes, size_t size) {
  if (!in || !snapshot || check_header(m, in, snapshot)) return ERROR;
  if (hfsa_same_size(in, "SerializeFMUState", size, snapshot_size(in))) return ERROR;
  Header header = snapshot->header;
  header.checksum = checksum(snapshot + 1, in->state_size);
  memcpy(bytes, &header, sizeof header);
  memcpy((char*)bytes + sizeof header, snapshot + 1, in->state_size);
  return OK;
}

/* Whether the head of a state block is one that an instance can have. */
static int is_possible(const Instance* in, const State* s) {
  enum { ALWAYS = INSTANTIATED | INITIALIZATION | TERMINATED };
  const int modes = in->interface == BY_CO_SIMULATION ? ALWAYS | STEP : ALWAYS | EVENT | CONTINUOUS_TIME;
  int is_one_mode = s->mode > 0 && (s->mode & (s->mode - 1)) == 0 && (s->mode & modes) == s->mode;
  return is_one_mode && (s->once == 0 || s->once == 1) && s->ticks >= 0 && isfinite(s->time) &&
         isfinite(s->start_time) && s->stop_time >= s->start_time && s->step >= 0.0 && isfinite(s->step);
}

static int is_within(const Variable* v, double value) {
  return isfinite(value) && value >= v->min && value <= v->max && (v->role != ROLE_SOLVER || value > 0.0);
}

/* Check what a checksum does not: the bytes of a caller may have a right one and never have been a state. */
static Status check_block(const Model* m, const Instance* in, const char* block) {
  State head;
  memcpy(&head, block, sizeof head);
  if (!is_possible(in, &head))
    return hfsa_report(in, ERROR, "DeserializeFMUState: no %s has a mode, time or count of ticks as in these bytes",
                       m->name);
  for (int i = 0; i < m->variable_count; i++) {
    const Variable* v = &m->variables[i];
    if (v->role != ROLE_PARAMETER && v->role != ROLE_SOLVER) continue;
    double value;
    memcpy(&value, block + ((char*)&in->column[v->role][v->index] - (char*)in->state), sizeof value);
    if (!is_within(v, value))
      return hfsa_report(in, ERROR, "DeserializeFMUState: %s cannot be %g, expected %g to %g", v->name, value, v->min,
                         v->max);
  }
  return OK;
}

Status hfsa_deserialize(const Model* m, Instance* in, const void* bytes, size_t size, Snapshot** snapshot) {
  if (!in || !snapshot) return ERROR;
  if (hfsa_same_size(in, "DeserializeFMUState", size, snapshot_size(in)) || check_header(m, in, bytes)) return ERROR;
  const char* block = (const char*)bytes + sizeof(Header);
  Header header;
  memcpy(&header, bytes, sizeof header);
  if (header.checksum != checksum(block, in->state_size))
    return hfsa_report(in, ERROR, "DeserializeFMUState: the bytes of the FMU state are damaged: their checksum is wrong");
  if (check_block(m, in, block)) return ERROR;
  if (!*snapshot) *snapshot = new_snapshot(in);
  if (!*snapshot) return ERROR;
  header.checksum = 0;
  (*snapshot)->header = header;
  memcpy(*snapshot + 1, block, in->state_size);
  return OK;
}
