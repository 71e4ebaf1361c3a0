/* Integrates a discrete input, and counts its changes: the integral tells when they arrived. */
#include "test_fmus.h"

typedef struct {
    double time, u, seen, integral, when;
    int32_t changes;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
enum { TIME = 0, U = 1, INTEGRAL = 2, CHANGES = 3, WHEN = 4 };

static void model_start(Model *m) { m->when = -1.0; }

static void model_begin(Model *m, double t0) {
    m->time = t0;
    m->seen = m->u;
}

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case U: return (Slot){.kind = F64, .role = INPUT, .at = &m->u, .size = 1};
    case INTEGRAL: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->integral, .size = 1};
    case CHANGES: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->changes, .size = 1};
    case WHEN: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->when, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

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
