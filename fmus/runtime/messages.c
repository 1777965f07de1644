/* Log messages to the importer, and the names in them. */

#include "instance.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

/* Log categories of both standards. */
static const char* category_of(Status status) { return status == DISCARD ? "logStatusDiscard" : "logStatusError"; }

/* Format and send a message, unless the importer has disabled its category or has no logger. */
Status hfsa_report(const Instance* in, Status status, const char* format, ...) {
  char text[1024];
  va_list values;
  if (!in->log.callback || !(in->log.categories >> status & 1u)) return status;
  va_start(values, format);
  vsnprintf(text, sizeof text, format, values);
  va_end(values);
  in->log.send(&in->log, in->name, status, category_of(status), text);
  return status;
}

/* Enable or disable log categories; without names, all of them. */
Status hfsa_set_logging(Instance* in, int on, size_t n, const char* const categories[]) {
  unsigned wanted = n ? 0u : ~0u;
  for (size_t i = 0; i < n; i++) {
    Status status = strcmp(categories[i], category_of(DISCARD)) == 0 ? DISCARD : ERROR;
    if (strcmp(categories[i], category_of(status)) != 0)
      return hfsa_report(in, ERROR, "there is no log category %s; there are %s and %s", categories[i],
                         category_of(DISCARD), category_of(ERROR));
    wanted |= 1u << status;
  }
  in->log.categories = on ? wanted : 0u;
  return OK;
}

const char* hfsa_mode_name(int mode) {
  switch (mode) {
    case INSTANTIATED:
      return "before initialization";
    case INITIALIZATION:
      return "in initialization mode";
    case EVENT:
      return "in event mode";
    case CONTINUOUS_TIME:
      return "in continuous-time mode";
    case STEP:
      return "in step mode";
    case INTERMEDIATE:
      return "in intermediate update mode";
    default:
      return "after termination";
  }
}

/* Check that a call is permitted: the instance exists and is in one of `modes`. */
Status hfsa_permit(const Instance* in, const char* call, int modes) {
  char possible[160] = "";
  if (!in) return ERROR;
  if (in->state->mode & modes) return OK;
  for (int mode = INSTANTIATED; mode <= TERMINATED; mode <<= 1) {
    if (!(mode & modes) || (mode == STEP && in->interface == BY_MODEL_EXCHANGE)) continue;
    if ((mode & (EVENT | CONTINUOUS_TIME)) && in->interface == BY_CO_SIMULATION) continue;
    if (*possible) strcat(possible, " or ");
    strcat(possible, hfsa_mode_name(mode));
  }
  return hfsa_report(in, ERROR, "%s was called %s; it is possible %s only", call, hfsa_mode_name(in->state->mode),
                     *possible ? possible : "in the other interface");
}

const char* hfsa_name(const Model* m, Role role, int index) {
  for (int i = 0; i < m->variable_count; i++)
    if (m->variables[i].role == role && m->variables[i].index == index) return m->variables[i].name;
  return "";
}
