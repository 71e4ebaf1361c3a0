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

#include "plain.h"

enum { TIME = 0, U = 1, Y = 2, CHANGES = 3, KICK_TIME = 4, ADD = 5, LIMIT = 6 };

static void model_start(Model *m) {
    m->kick_time = KICK_START;
    m->add = ADD_START;
    m->limit = LIMIT_START;
}

BEGINS_AT_ITS_TIME

VARIABLES(
    VARIABLE(U, F64, INPUT, u)
    VARIABLE(Y, F64, OUTPUT, y)
    VARIABLE(CHANGES, I32, OUTPUT, changes)
    VARIABLE(KICK_TIME, F64, PARAMETER, kick_time)
    VARIABLE(ADD, F64, PARAMETER, add)
    VARIABLE(LIMIT, F64, PARAMETER, limit))

NOTHING_TO_REFRESH

static bool to_be_kicked(const Model *m) { return m->kick_time >= 0.0 && !m->kicked; }

STEPS_TO_ITS_EVENT(to_be_kicked, kick_time)

static void respond(Model *m, double y) {
    m->changes += y != m->y;
    m->y = y;
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)host;
    if (m->u != m->seen) {
        m->seen = m->u;
        if (m->u < m->limit)
            respond(m, m->u + m->add);
    }
    if (to_be_kicked(m) && m->kick_time <= t + SAME) {
        m->kicked = true;
        respond(m, 1.0);
    }
    return (Update){.has_next = to_be_kicked(m), .next = to_be_kicked(m) ? m->kick_time : 0.0};
}

#include "face.h"
