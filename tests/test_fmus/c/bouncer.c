/* Answers a change of its discrete input with a change of its discrete output, at the same instant, as long as it is below a limit.
 *
 * On a change of u: y = u + add, where u < limit. At `kick_time` (never where that is negative): y = 1. One with add = 1 and one
 * with add = 0 and no limit, each fed by the other, settle at y = limit after as many rounds.
 */
#include "test_fmus.h"

typedef struct {
    double time, u, seen, y, kick_time, add, limit;
    int32_t changes;
    bool kicked;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
#define SAME 1e-12
enum { TIME = 0, U = 1, Y = 2, CHANGES = 3, KICK_TIME = 4, ADD = 5, LIMIT = 6 };

static void model_start(Model *m) {
    m->kick_time = KICK_START;
    m->add = ADD_START;
    m->limit = LIMIT_START;
}

static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case U: return (Slot){.kind = F64, .role = INPUT, .at = &m->u, .size = 1};
    case Y: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->y, .size = 1};
    case CHANGES: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->changes, .size = 1};
    case KICK_TIME: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->kick_time, .size = 1};
    case ADD: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->add, .size = 1};
    case LIMIT: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->limit, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

static bool to_be_kicked(const Model *m) { return m->kick_time >= 0.0 && !m->kicked; }

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    Outcome outcome = arrived(until);
    if (host->event_mode && to_be_kicked(m) && m->kick_time <= until + SAME) {
        outcome.event = true;
        outcome.early = host->early_allowed && m->kick_time < until - SAME;
        outcome.reached = outcome.early ? m->kick_time : until;
    }
    m->time = outcome.reached;
    return outcome;
}

static void answer(Model *m, double y) {
    m->changes += y != m->y;
    m->y = y;
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)host;
    if (m->u != m->seen) {
        m->seen = m->u;
        if (m->u < m->limit)
            answer(m, m->u + m->add);
    }
    if (to_be_kicked(m) && m->kick_time <= t + SAME) {
        m->kicked = true;
        answer(m, 1.0);
    }
    return (Update){.has_next = to_be_kicked(m), .next = to_be_kicked(m) ? m->kick_time : 0.0};
}

#include "face.h"
