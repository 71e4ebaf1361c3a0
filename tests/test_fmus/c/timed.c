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

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
#define SAME 1e-12
enum { TIME = 0, LEVEL = 1, COUNT = 2 };

static void model_start(Model *m) { m->level = FIRST_LEVEL; }
static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case LEVEL: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->level, .size = 1};
    case COUNT: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->jumps, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    Outcome outcome = arrived(until);
    if (host->event_mode && m->jumps < JUMPS && INSTANTS[m->jumps] <= until + SAME) {
        const double next = INSTANTS[m->jumps];
        outcome.event = true;
        outcome.early = host->early_allowed && next < until - SAME;
        outcome.reached = outcome.early ? next : until;
    }
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
