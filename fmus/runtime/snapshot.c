/* FMU states: a header and a copy of the state block, the same in memory and serialised. */

#include "core.h"

#include <stdlib.h>
#include <string.h>

/* All fields are compared with those of the instance, to reject the states of other models, builds or interfaces. */
typedef struct {
  char token[72];
  long long interface, size;
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
  if (memcmp(&own, bytes, sizeof own) == 0) return OK;
  return hfsa_report(in, ERROR, "the FMU state belongs to another model, build or interface than this %s", m->name);
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
  memcpy(bytes, snapshot, size);
  return OK;
}

Status hfsa_deserialize(const Model* m, Instance* in, const void* bytes, size_t size, Snapshot** snapshot) {
  if (!in || !snapshot) return ERROR;
  if (hfsa_same_size(in, "DeserializeFMUState", size, snapshot_size(in)) || check_header(m, in, bytes)) return ERROR;
  if (!*snapshot) *snapshot = new_snapshot(in);
  if (!*snapshot) return ERROR;
  memcpy(*snapshot, bytes, size);
  return OK;
}
