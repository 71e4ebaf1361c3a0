/* The runtime: one instance of the model moving through time, events included. Knows no FMI.

   Mirrors the class `Runtime` of `runtime.py` function by function: the same grid, the same order of events, the same
   numbers. All that decides the future is `clock` and `memory`; copying the two is an exact snapshot. */
#ifndef RUNTIME_H
#define RUNTIME_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"

#define STAMP_NOW (-1e30)  /* a stamp of this, or less, means: at the current time */
#define QUEUE_CAPACITY 16  /* events waiting at once */

typedef struct {
    double t;  /* now [s] */
    double t0; /* start of the grid [s] */
    double h;  /* internal step [s] */
} Clock;

typedef struct {
    Clock clock;
    double *memory; /* `runtime_memory_length()` numbers; the arrays down to `queue` lie in it */
    double *x, *u, *p;
    double *periods, *offsets, *ticks; /* by periodic event; a tick is a whole number */
    double *active, *raised, *seen;    /* by triggered event: clock active (FMI 3), count (FMI 2), count handled */
    double *stamps;                    /* by triggered event: instant [s] of the next announcement */
    double *queue_length, *queue;      /* events announced and not yet applied; see events.c */
    double *y, *x_next;                /* results; decide nothing */
    double *real_work;
    int *integer_work;
} Runtime;

/* Number of doubles in `memory`, and of all doubles a runtime needs. */
PRIVATE size_t runtime_memory_length(void);
PRIVATE size_t runtime_total_length(void);

/* Doubles of one entry of the queue: event, stamp, payload. */
PRIVATE size_t runtime_queue_stride(void);

/* Lay the arrays into `numbers` (`runtime_total_length()` doubles) and `integers`; then reset. */
PRIVATE void runtime_place(Runtime *runtime, double *numbers, int *integers);

/* Back to the start values, at time zero. */
PRIVATE void runtime_reset(Runtime *runtime);

/* Begin at t0 [s] and fire the periodic events due there. Returns -1, or the position in p of a parameter with which
   time cannot run: a step or period that is not positive, an offset that is not finite, a seed outside [0, 2^53). */
PRIVATE int runtime_start(Runtime *runtime, double t0);

/* Integrate to t_end [s] and fire the periodic events on the way and at the end. */
PRIVATE void runtime_advance(Runtime *runtime, double t_end);

/* Jump at a triggered event now, with the payload in u. */
PRIVATE void runtime_trigger(Runtime *runtime, int event);

/* Compute y from t, x, u, p. */
PRIVATE void runtime_update_outputs(Runtime *runtime);

/* Closer in time than this [s] is the same instant. */
PRIVATE double runtime_tolerance(const Runtime *runtime, double t);

/* Whether what serves as an index in a `memory` that came from outside is within its bounds. */
PRIVATE bool runtime_memory_is_sane(const double *memory);

/* Position in x of the first state that is not a finite number, or -1. */
PRIVATE int runtime_first_broken_state(const Runtime *runtime);

#endif
