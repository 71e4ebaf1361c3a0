/* Steps divided at switches. Mirrors `switching.py`; change the two together. */
#include "switching.h"

#include <string.h>

#define MOST_SWITCHES 100 /* in one internal step; what chatters more is no longer divided */
#ifndef MOST_DIVISIONS
#define MOST_DIVISIONS 100000 /* between two events; what chatters more is given up, each division costs some 50 trials */
#endif

/* Compute the state after an internal step; whether a switch changes on the way. */
static bool attempt(Runtime *runtime, double t, double h) {
    double switched = 0.0;
    const double *arguments[] = {&t, &h, runtime->x, runtime->u, runtime->p};
    double *results[] = {runtime->x_next, &switched};
    model.step(arguments, results, runtime->integer_work, runtime->real_work, 0);
    return switched != 0.0;
}

/* Take the state computed last; memory changes in jumps only. */
static void accept_step(Runtime *runtime) {
    memcpy(runtime->x, runtime->x_next, (size_t)model.continuous * sizeof(double));
}

/* The shortest step after which a switch has changed, to the resolution of time, where one has after h. */
static double until_switch(Runtime *runtime, double t, double h) {
    double before = 0.0, after = h, narrow = 4.0 * runtime_resolution(t + h);
    while (after - before > narrow) {
        double middle = 0.5 * (before + after);
        if (attempt(runtime, t, middle))
            after = middle;
        else
            before = middle;
    }
    return after;
}

/* The switch that changes in the part tried last is the one that chatters, and time stands there for whoever undoes the step. */
static void give_up(Runtime *runtime, double t, double h) {
    const double *now = runtime_switching(runtime);
    double *before = runtime->indicators;
    runtime->clock.t = t;
    runtime_update_balance(runtime);
    memcpy(before, now, (size_t)model.switching_count * sizeof(double));
    accept_step(runtime);
    runtime->clock.t = t + h;
    runtime_update_balance(runtime);
    runtime->chattering = 0;
    while (runtime->chattering < model.switching_count - 1 && (now[runtime->chattering] >= 0.0) == (before[runtime->chattering] >= 0.0))
        runtime->chattering++;
}

/* A step on which a switch changes, as was just tried: in parts that end where one does. */
static void divided_step(Runtime *runtime, double t, double h) {
    double end = t + h;
    for (int i = 0; i < MOST_SWITCHES; i++) {
        h = until_switch(runtime, t, h);
        attempt(runtime, t, h);
        if (++runtime->divisions > MOST_DIVISIONS) {
            give_up(runtime, t, h);
            return;
        }
        accept_step(runtime);
        t += h;
        h = end - t;
        if (h <= 0.0)
            return;
        if (!attempt(runtime, t, h))
            break;
    }
    accept_step(runtime);
}

PRIVATE void switching_step(Runtime *runtime, double t, double h) {
    if (model.step == NULL || runtime->chattering >= 0)
        return;
    if (attempt(runtime, t, h))
        divided_step(runtime, t, h);
    else
        accept_step(runtime);
}
