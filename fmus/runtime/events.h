/* Triggered events with a stamp: announced from outside, queued, applied at their own instants. Knows no FMI version.

   Mirrors the queue of the Python block: an event is taken with its payload and its stamp when it is announced; it waits
   while the stamp lies ahead; one whose stamp lies in the past goes by the late policy. */
#ifndef EVENTS_H
#define EVENTS_H

#include "instance.h"

/* Queue an event with the payload in u and the stamp in `stamps`, and reset the stamp. STATUS_WARNING: it is lost. */
PRIVATE Status events_announce(Instance *instance, int event);

/* Counts: announce every event whose count was raised since the last call. */
PRIVATE Status events_poll_counts(Instance *instance);

/* Apply all queued events whose stamps are not after t_end [s], in the order of their stamps, integrating from one to
   the next. Does not integrate to t_end itself. STATUS_WARNING: one came too late and has no effect. */
PRIVATE Status events_apply_until(Instance *instance, double t_end);

/* Clocks: announce the event of every active clock, in declared order; none is active afterwards. */
PRIVATE Status events_poll_clocks(Instance *instance);

/* Stamp [s] of the next queued event, or INFINITY; and let that event happen now, whatever its stamp. */
PRIVATE double events_first_stamp(const Runtime *runtime);
PRIVATE void events_apply_here(Instance *instance);

#endif
