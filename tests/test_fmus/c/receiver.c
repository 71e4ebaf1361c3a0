/* Takes a value when its triggered input clock ticks, and integrates what it holds: the integral tells the exact instants.
 *
 * Without event mode (and in FMI 1 and 2) the value is a plain discrete input, held over every step.
 */
#include "test_fmus.h"

typedef struct {
    double time, value, held, integral, when;
    int32_t count;
    bool tick;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
enum { TIME = 0, TICK = 1, VALUE = 2, COUNT = 3, HELD = 4, INTEGRAL = 5, WHEN = 6 };

static void model_start(Model *m) { m->when = -1.0; }
static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case TICK: return (Slot){.kind = CLOCK, .role = INPUT_CLOCK, .at = &m->tick, .size = 1};
    case VALUE:
        return (Slot){.kind = F64, .role = HAS_EVENT_MODE ? CLOCKED_INPUT : INPUT, .at = &m->value, .size = 1, .clock = &m->tick};
    case COUNT: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->count, .size = 1};
    case HELD: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->held, .size = 1};
    case INTEGRAL: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->integral, .size = 1};
    case WHEN: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->when, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

static void take(Model *m, double t) {
    m->held = m->value;
    m->when = t;
    m->count++;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    if (!host->event_mode && m->value != m->held)
        take(m, t);
    m->integral += m->held * (until - t);
    m->time = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)host;
    if (m->tick)
        take(m, t);
    m->tick = false;
    return (Update){0};
}

#include "face.h"
