/* A model whose variables are scalars and that remembers nothing for speed. Included by it after it defined `Model`. */
#ifndef PLAIN_H
#define PLAIN_H

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define SAME 1e-12 /* closer in time than this is the same instant [s] */

/* The variables behind the time, `reference` by reference, and where in the model their values stand. */
#define VARIABLES(...)                                            \
    static Slot model_slot(Model *m, unsigned reference) {        \
        switch (reference) {                                      \
            VARIABLE(TIME, F64, OUTPUT, time)                     \
            __VA_ARGS__                                           \
            default: return (Slot){0};                            \
        }                                                         \
    }
#define VARIABLE(REFERENCE, KIND, ROLE, place) \
    case REFERENCE: return (Slot){.kind = KIND, .role = ROLE, .at = &m->place, .size = 1};

/* Outputs are up to date after each step and event. */
#define NOTHING_TO_REFRESH \
    static void model_refresh(Model *m) { (void)m; }

#define BEGINS_AT_ITS_TIME \
    static void model_begin(Model *m, double t0) { m->time = t0; }

/* The end of a step: `until`, or `next` where an event is due there, event mode is used and the step may end early. */
static inline Outcome arrived_at_event(const Host *host, bool due, double next, double until) {
    Outcome outcome = arrived(until);
    if (host->event_mode && due && next <= until + SAME) {
        outcome.event = true;
        outcome.early = host->early_allowed && next < until - SAME;
        outcome.reached = outcome.early ? next : until;
    }
    return outcome;
}

/* A step to its end or to the model's own event, which is due at a time as long as `due` says so. */
#define STEPS_TO_ITS_EVENT(due, at)                                                       \
    static Outcome model_step(Model *m, Host *host, double t, double until) {             \
        (void)t;                                                                          \
        const Outcome outcome = arrived_at_event(host, due(m), m->at, until);             \
        m->time = outcome.reached;                                                        \
        return outcome;                                                                   \
    }

#endif
