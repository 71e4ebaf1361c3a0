/* A discrete output that jumps at given instants: it announces them as nextEventTime.
 *
 * With early return a step ends there; without, and without event mode, the jump comes at the communication point.
 * `config.h` defines JUMPS, INSTANTS and LEVELS of that length, and FIRST_LEVEL.
 */
#include "test_fmus.h"

typedef struct {
    double time, level;
    int32_t jumps;
} Model;

#include "plain.h"

enum { TIME = 0, LEVEL = 1, COUNT = 2 };

static void model_start(Model *m) { m->level = FIRST_LEVEL; }
BEGINS_AT_ITS_TIME

VARIABLES(
    VARIABLE(LEVEL, F64, OUTPUT, level)
    VARIABLE(COUNT, I32, OUTPUT, jumps))

NOTHING_TO_REFRESH

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    const bool more = m->jumps < JUMPS;
    const Outcome outcome = arrived_at_event(host, more, more ? INSTANTS[m->jumps] : 0.0, until);
    m->time = outcome.reached;
    return outcome;
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)host;
    while (m->jumps < JUMPS && INSTANTS[m->jumps] <= t + SAME)
        m->level = LEVELS[m->jumps++];
    const bool more = m->jumps < JUMPS;
    return (Update){.has_next = more, .next = more ? INSTANTS[m->jumps] : 0.0};
}

#include "face.h"
