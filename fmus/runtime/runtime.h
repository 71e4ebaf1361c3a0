/* The runtime: one instance of the model moving through time, events included. Knows no FMI.

   Mirrors the class `Runtime` of `runtime.py` function by function: the same grid, the same order of events, the same
   numbers. All that decides the future is `clock` and `memory`; copying the two is an exact snapshot. */
#ifndef RUNTIME_H
#define RUNTIME_H

#include <stdbool.h>
#include <stddef.h>

#include "model.h"

#define STAMP_NOW (-1e30)  /* a stamp of this, or less, means: at the current time */
#define QUEUE_CAPACITY 64  /* events waiting at once, as in the Python block */
#define SEED_FROM_NAME (-1.0) /* in place of a seed: it follows from the instance name */
#define RUN_SEED 0            /* of a run whose master knows of none, as in `noise.py` */
#define LARGEST_WHOLE 0x1p53 /* whole numbers below are exact */
#define MOST_INTERNAL_STEPS 1e9 /* in one communication step, and instants of one periodic event, as in the Python block */

typedef struct {
    double t;  /* now [s] */
    double t0; /* start of the grid [s] */
    double h;  /* internal step [s] */
} Clock;

typedef struct {
    Clock clock;
    int divisions;  /* of internal steps since the last event or end of a step; decides nothing but when to give up */
    int chattering; /* the switch for which that was given up, or -1; whoever finds it undoes the step */
    double *memory; /* `runtime_memory_length()` numbers; the arrays down to `queue` lie in it */
    double *x, *u, *p;
    double *periods, *offsets, *ticks; /* by periodic event; a tick is a whole number */
    double *resolved, *held;           /* model exchange: 1 once state events are resolved; then signs of the states with dry friction,
                                          and switches */
    double *active, *raised, *seen;    /* by triggered event: clock active (FMI 3), count (FMI 2), count handled */
    double *stamps;                    /* by triggered event: instant [s] of the next announcement */
    double *late_policy, *horizon;     /* parameters: a LatePolicy, and how far back late events can be replayed [s] */
    double *outcomes;                  /* events so far, by Outcome; no replay takes them back */
    double *queue_length, *queue;      /* events announced and not yet applied; see events.c */
    double *y, *x_next;                /* results; decide nothing */
    double *derivatives, *indicators;  /* results */
    double *held_now, *balance;        /* what `held` would be now; what decides on state events, see model.h */
    double *required;                  /* results */
    double *x_before;                  /* continuous states before an event */
    double *seeds, *tangent;           /* of a directional derivative: of t, x, u and p; then by outputs and derivatives */
    double *real_work;
    int *integer_work;
} Runtime;

/* Number of doubles in `memory`, and of all doubles a runtime needs. */
PRIVATE size_t runtime_memory_length(void);
PRIVATE size_t runtime_total_length(void);

/* Of `memory`, how many doubles are in use: the queue comes last and ends where its last entry does. */
PRIVATE size_t runtime_used_length(const Runtime *runtime);

/* Doubles in `seeds`. */
PRIVATE size_t runtime_seed_length(void);

/* Doubles of one entry of the queue: event, stamp, payload. */
PRIVATE size_t runtime_queue_stride(void);

/* Lay the arrays into `numbers` (`runtime_total_length()` doubles) and `integers`; then reset. */
PRIVATE void runtime_place(Runtime *runtime, double *numbers, int *integers);

/* Back to the start values, at time zero. */
PRIVATE void runtime_reset(Runtime *runtime);

/* The first requirement that parameters, and where time starts the states, do not fulfil, or NULL. */
PRIVATE const Requirement *runtime_unfulfilled(const Runtime *runtime, bool starting);

/* Begin at t0 [s], fire the periodic events due there, then the communication events. Returns -1, or the position in p of a
   parameter with which time cannot run: a step or period that is not positive, an offset that is not finite, a seed that is no whole number in [0, 2^53). */
PRIVATE int runtime_start(Runtime *runtime, double t0);

/* Before the start: a seed that nobody gave follows from the instance name. What is drawn then follows from the parameter alone, which
   is saved and restored with the others. */
PRIVATE void runtime_choose_seed(Runtime *runtime, const char *name);

/* Integrate to t_end [s] and fire the periodic events on the way and at the end. */
PRIVATE void runtime_advance(Runtime *runtime, double t_end);

/* How many internal steps, or instants of one periodic event, lie between now and t_end [s]; the larger of the two. */
PRIVATE double runtime_count_steps(const Runtime *runtime, double t_end);

/* The next periodic instant [s] that lies after now and before t_end [s], or INFINITY. */
PRIVATE double runtime_next_instant_before(const Runtime *runtime, double t_end);

/* A communication step ends now: fire the communication events. */
PRIVATE void runtime_communicate(Runtime *runtime);

/* Jump at a triggered event now, with the payload in u. */
PRIVATE void runtime_trigger(Runtime *runtime, int event);

/* Compute y from t, x, u, p. */
PRIVATE void runtime_update_outputs(Runtime *runtime);

/* Fire the periodic events due now, and the next instant [s] of one, or INFINITY. */
PRIVATE void runtime_fire_due(Runtime *runtime);
PRIVATE double runtime_next_due(const Runtime *runtime);

/* Doubles in `held`, and event indicators. */
PRIVATE int runtime_held_count(void);

/* Signs by which dry friction is resolved, and switches: those of the last event in model exchange, else those of the states now. */
PRIVATE const double *runtime_held(Runtime *runtime);

/* Compute what decides on state events into `balance`, and its part that holds the switching functions. */
PRIVATE void runtime_update_balance(Runtime *runtime);
PRIVATE const double *runtime_switching(const Runtime *runtime);

/* Compute the derivatives of the continuous states, dry friction resolved. */
PRIVATE void runtime_update_derivatives(Runtime *runtime);

/* Compute how far each state with dry friction is from a change (its magnitude while it moves, the friction left at rest), then
   the switching functions. */
PRIVATE void runtime_update_indicators(Runtime *runtime);

/* The distance [s] from t to the next larger number. */
PRIVATE double runtime_resolution(double t);

/* Closer in time than this [s] is the same instant. */
PRIVATE double runtime_tolerance(const Runtime *runtime, double t);

/* Whether a clock and a `memory` that came from outside are such that time can run from there, or, before it has `started`, begin;
   whatever serves as an index or a count is within its bounds. Computes in the results of `runtime`, whose own memory stays. */
PRIVATE bool runtime_is_sane(const Runtime *runtime, const Clock *clock, const double *memory, bool started);

/* Position in x of the first state that is not a finite number, or -1. */
PRIVATE int runtime_first_broken_state(const Runtime *runtime);

#endif
