/* One communication step: the events announced, the time between them, an early return, and a step that cannot be done. */
#ifndef STEP_H
#define STEP_H

#include "instance.h"

/* Advance from `current` by `size` [s]. `early`, where it is set, says whether the step ended at a periodic instant inside
   it, which only happens where the importer allows it. STATUS_DISCARD: the step cannot be done and has left no trace. */
PRIVATE Status instance_do_step(Instance *instance, const char *function, double current, double size, bool *early);

/* STATUS_DISCARD, in words with the switch and the time, where the runtime gave up a switch that chatters; told once. */
PRIVATE Status step_check_switches(Instance *instance, const char *function);

#endif
