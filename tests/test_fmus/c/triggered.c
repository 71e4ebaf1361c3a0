/* A ramp that ticks a triggered output clock at every multiple of a level: at k level / rate, k = 1, 2, ...
 *
 * With early return it returns there exactly; with event mode alone, and without, it notices at the communication point.
 */
#include "test_fmus.h"

typedef struct {
    double time, rate, level, ramp, value, when;
    int32_t count, over; /* crossings: as read, and those whose event is over */
    bool crossing;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
#define SAME 1e-12
enum { TIME = 0, RATE = 1, LEVEL = 2, CROSSING = 3, VALUE = 4, COUNT = 5, RAMP = 6, WHEN = 7 };

static void model_start(Model *m) {
    m->rate = 1.0;
    m->level = LEVEL_START;
    m->when = -1.0;
}

static int32_t crossings(const Model *m, double t) { return (int32_t)floor((t + SAME) * m->rate / m->level); }

static void model_begin(Model *m, double t0) {
    m->time = t0;
    m->over = crossings(m, t0);
}

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case RATE: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->rate, .size = 1};
    case LEVEL: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->level, .size = 1};
    case CROSSING: return (Slot){.kind = CLOCK, .role = OUTPUT_CLOCK, .at = &m->crossing, .size = 1};
    case VALUE: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->value, .size = 1};
    case COUNT: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->count, .size = 1};
    case RAMP: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->ramp, .size = 1};
    case WHEN: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->when, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) {
    m->ramp = m->rate * m->time;
    m->count = m->crossing ? crossings(m, m->time) : m->over;
    m->value = m->level * m->count;
    if (m->crossing)
        m->when = m->time;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    const double next = m->level * (m->over + 1) / m->rate;
    Outcome outcome = arrived(until);
    if (host->event_mode && next <= until + SAME) {
        outcome.event = m->crossing = true;
        outcome.early = host->early_allowed && next < until - SAME;
        outcome.reached = outcome.early ? next : until;
    }
    m->time = outcome.reached;
    return outcome;
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)host;
    if (crossings(m, t) > m->over) {
        m->over = crossings(m, t);
        m->when = t;
    }
    m->crossing = false;
    return (Update){0};
}

#include "face.h"
