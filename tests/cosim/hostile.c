/* An FMI 2 FMU of bad manners: y follows the time, and from time `at` on each step does what parameter `manner` says to the
 * process that it is in. It has directional derivatives, which misbehave too, where they are asked for from `at` on. */

#define _GNU_SOURCE
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "fmi2Functions.h"

#ifndef ALWAYS /* the manner from the first step on */
#define ALWAYS 0
#endif

enum { TIME, U, Y, MANNER, AT, PROCESS, VALUES };
enum { CRASH = 1, LEAVE, ABORT, DIVIDE, KILL, HANG, FLOOD, MOVE, TRAP, SLEEP, DISTURB, LAST_WORDS, TALK, EAT };

static double v_once;
typedef struct {
  double v[VALUES];
} Fmu;

static void deaf(int number) { (void)number; }

static void misbehave(int manner) {
  static volatile int zero = 0;
  switch (manner) {
    case CRASH: raise(SIGSEGV); break;
    case LEAVE: exit(0);
    case ABORT: abort();
    case DIVIDE: zero = 7 / zero; break;
    case KILL: kill(getpid(), SIGKILL); break;
    case HANG:
      if (getenv("HFSA_HANGS")) {
        FILE* file = fopen(getenv("HFSA_HANGS"), "w");
        fprintf(file, "%d", getpid());
        fclose(file);
      }
      for (;;) pause();
    case FLOOD:
      for (int i = 0; i < 2000; i++) printf("%05d of very many lines that nobody has asked for, {\"json\": false}\n", i);
      fflush(stdout);
      break;
    case MOVE:
      if (chdir("/")) abort();
      umask(0777);
      setlocale(LC_ALL, "de_DE.UTF-8");
      setenv("HFSA_CACHE", "/nowhere", 1);
      break;
    case TRAP:
      feenableexcept(FE_ALL_EXCEPT);
      break;
    case SLEEP: nanosleep(&(struct timespec){0, 30000000}, 0); break;
    case DISTURB:
      for (int n = 1; n < 32; n++) signal(n, deaf);
      close(0), close(1), close(2);
      break;
    case LAST_WORDS:
      fprintf(stderr, "the spring is gone\n");
      abort();
    case TALK:
      for (;;) fputs("one more of very many lines\n", stderr);
    case EAT:
      while (malloc(1 << 26)) continue;
      _exit(9);
  }
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions* host, fmi2Boolean visible, fmi2Boolean logging) {
  Fmu* f = calloc(1, sizeof *f);
  if (v_once++) return 0; /* one instance per process */
  f->v[PROCESS] = getpid();
  f->v[MANNER] = ALWAYS;
  f->v[AT] = ALWAYS ? 0 : 1e9;
  return f;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
  ((Fmu*)c)->v[TIME] = start;
  return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) {
  Fmu* f = c;
  double process = f->v[PROCESS];
  memset(f->v, 0, sizeof f->v);
  f->v[PROCESS] = process;
  f->v[AT] = 1e9;
  return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[]) {
  for (size_t i = 0; i < n; i++) v[i] = ((Fmu*)c)->v[r[i]];
  return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[]) {
  for (size_t i = 0; i < n; i++) ((Fmu*)c)->v[r[i]] = v[i];
  return fmi2OK;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t n, const fmi2ValueReference k[],
                                        size_t m, const fmi2Real seed[], fmi2Real result[]) {
  Fmu* f = c;
  if (f->v[AT] < 0) misbehave((int)f->v[MANNER]);
  for (size_t i = 0; i < n; i++) {
    result[i] = 0;
    for (size_t j = 0; j < m; j++) result[i] += u[i] == Y && k[j] == U ? seed[j] : 0;
  }
  return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
  Fmu* f = c;
  if (t >= f->v[AT] - h / 2 && f->v[AT] >= 0) misbehave((int)f->v[MANNER]);
  f->v[TIME] = t + h;
  f->v[Y] = f->v[U] + t + h;
  return fmi2OK;
}
