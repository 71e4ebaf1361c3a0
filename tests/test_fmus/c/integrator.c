/* Integrates a discrete input, and counts its changes: the integral tells when they arrived. */
#include "test_fmus.h"

typedef struct {
    double time, u, seen, integral, when;
    int32_t changes;
} Model;

#include "plain.h"

enum { TIME = 0, U = 1, INTEGRAL = 2, CHANGES = 3, WHEN = 4 };

static void model_start(Model *m) { m->when = -1.0; }

static void model_begin(Model *m, double t0) {
    m->time = t0;
    m->seen = m->u;
}

VARIABLES(
    VARIABLE(U, F64, INPUT, u)
    VARIABLE(INTEGRAL, F64, OUTPUT, integral)
    VARIABLE(CHANGES, I32, OUTPUT, changes)
    VARIABLE(WHEN, F64, OUTPUT, when))

NOTHING_TO_REFRESH

static void notice(Model *m, double t) {
    if (m->u == m->seen)
        return;
    m->seen = m->u;
    m->when = t;
    m->changes++;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)host;
    notice(m, t);
    m->integral += m->u * (until - t);
    m->time = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    if (host->event_mode)
        notice(m, t);
    return (Update){0};
}

#include "face.h"
