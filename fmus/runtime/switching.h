/* Steps divided at switches: an internal step ends where a switching function changes its sign, and the next begins there. Mirrors
   `switching.py`. */
#ifndef SWITCHING_H
#define SWITCHING_H

#include "runtime.h"

/* Move the continuous states over one internal step of length h [s] from t [s]. */
PRIVATE void switching_step(Runtime *runtime, double t, double h);

#endif
