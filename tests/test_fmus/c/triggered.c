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

#include "plain.h"

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

VARIABLES(
    VARIABLE(RATE, F64, PARAMETER, rate)
    VARIABLE(LEVEL, F64, PARAMETER, level)
    VARIABLE(CROSSING, CLOCK, OUTPUT_CLOCK, crossing)
    VARIABLE(VALUE, F64, OUTPUT, value)
    VARIABLE(COUNT, I32, OUTPUT, count)
    VARIABLE(RAMP, F64, OUTPUT, ramp)
    VARIABLE(WHEN, F64, OUTPUT, when))

static void model_refresh(Model *m) {
    m->ramp = m->rate * m->time;
    m->count = m->crossing ? crossings(m, m->time) : m->over;
    m->value = m->level * m->count;
    if (m->crossing)
        m->when = m->time;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    const Outcome outcome = arrived_at_event(host, true, m->level * (m->over + 1) / m->rate, until);
    m->crossing = m->crossing || outcome.event;
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
