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

#include "plain.h"

enum { TIME = 0, TICK = 1, VALUE = 2, COUNT = 3, HELD = 4, INTEGRAL = 5, WHEN = 6 };

static void model_start(Model *m) { m->when = -1.0; }
BEGINS_AT_ITS_TIME

VARIABLES(
    VARIABLE(TICK, CLOCK, INPUT_CLOCK, tick)
    case VALUE:
        return (Slot){.kind = F64, .role = HAS_EVENT_MODE ? CLOCKED_INPUT : INPUT, .at = &m->value, .size = 1, .clock = &m->tick};
    VARIABLE(COUNT, I32, OUTPUT, count)
    VARIABLE(HELD, F64, OUTPUT, held)
    VARIABLE(INTEGRAL, F64, OUTPUT, integral)
    VARIABLE(WHEN, F64, OUTPUT, when))

NOTHING_TO_REFRESH

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
