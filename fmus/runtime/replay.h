/* Moving through time with a memory, and living the past again with one more event in it. Mirrors `policy.py`. */
#ifndef REPLAY_H
#define REPLAY_H

#include "journal.h"
#include "log.h"

/* What is remembered goes into `journal`; with late_policy other than replay, or in model exchange, nothing is. */

/* Advance to `until` [s]; nothing where the runtime is there already. */
PRIVATE void move_advance(Runtime *runtime, Journal *journal, double until);

/* Jump now at an event. The payload is handed to the model for the time of the jump; what stands in u stays. Returns its verdict. */
PRIVATE int move_jump(Runtime *runtime, Journal *journal, int event, double *payload);

/* A communication step ends now. */
PRIVATE void move_communicate(Runtime *runtime, Journal *journal);

/* Live the past again with an event at its stamp: what comes out is what would be, had it been announced in time. What was given
   last is kept. Returns the model's verdict on it (those after it are evaluated anew), or BEYOND_... with nothing changed where the memory does not reach back to the stamp. */
PRIVATE int move_replay(Runtime *runtime, Journal *journal, int event, double stamp, double *payload);

#endif
