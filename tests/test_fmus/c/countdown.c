/* A one-shot delay on a countdown clock: an event arms it, `delay` later the importer ticks `alarm`.
 *
 * Armed by the triggered clock `start`, and by a time event of its own at `arm_time` (never where that is negative); with `repeat`
 * every alarm arms the next. Without event mode: armed at arm_time only, alarms at the communication points.
 */
#include "test_fmus.h"

typedef struct {
    double time, delay, arm_time, when, due;
    double interval;
    Qualifier qualifier;
    int32_t alarms;
    bool start, alarm, armed, was_armed, repeat;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 1
#define SAME 1e-12
enum { TIME = 0, START = 1, ALARM = 2, DELAY = 3, ARM_TIME = 4, REPEAT = 5, ALARMS = 6, WHEN = 7, ARMED = 8 };

static void model_start(Model *m) {
    m->delay = DELAY_START;
    m->arm_time = ARM_START;
    m->when = -1.0;
    m->qualifier = NOT_YET_KNOWN;
}

static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case START: return (Slot){.kind = CLOCK, .role = INPUT_CLOCK, .at = &m->start, .size = 1};
    case ALARM: return (Slot){.kind = CLOCK, .role = INPUT_CLOCK, .at = &m->alarm, .size = 1};
    case DELAY: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->delay, .size = 1};
    case ARM_TIME: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->arm_time, .size = 1};
    case REPEAT: return (Slot){.kind = BOOL, .role = PARAMETER, .at = &m->repeat, .size = 1};
    case ALARMS: return (Slot){.kind = I32, .role = OUTPUT, .at = &m->alarms, .size = 1};
    case WHEN: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->when, .size = 1};
    case ARMED: return (Slot){.kind = BOOL, .role = OUTPUT, .at = &m->armed, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

static bool to_be_armed(const Model *m) { return m->arm_time >= 0.0 && !m->was_armed; }

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)t;
    Outcome outcome = arrived(until);
    if (host->event_mode && to_be_armed(m) && m->arm_time <= until + SAME) {
        outcome.event = true;
        outcome.early = host->early_allowed && m->arm_time < until - SAME;
        outcome.reached = outcome.early ? m->arm_time : until;
    }
    m->time = outcome.reached;
    return outcome;
}

static void arm(Model *m, double t) {
    m->interval = m->delay;
    m->due = t + m->delay;
    m->qualifier = CHANGED;
    m->armed = true;
}

static void ring(Model *m, double t) {
    m->alarms++;
    m->when = t;
    m->armed = false;
    m->qualifier = NOT_YET_KNOWN;
    if (m->repeat)
        arm(m, t);
}

static Update model_update(Model *m, const Host *host, double t) {
    const bool own = to_be_armed(m) && m->arm_time <= t + SAME;
    if (host->event_mode ? m->alarm : m->armed && m->due <= t + SAME)
        ring(m, t);
    if (m->start || own) {
        m->was_armed = m->was_armed || own;
        arm(m, t);
    }
    m->start = m->alarm = false;
    return (Update){.has_next = to_be_armed(m), .next = to_be_armed(m) ? m->arm_time : 0.0};
}

static bool model_interval(Model *m, unsigned reference, double *interval, Qualifier *qualifier) {
    *interval = m->interval;
    *qualifier = m->qualifier;
    if (m->qualifier == CHANGED)
        m->qualifier = UNCHANGED; /* said once */
    return reference == ALARM;
}

static bool model_shift(Model *m, unsigned reference, double *shift) {
    (void)m, (void)reference, (void)shift;
    return false;
}

#include "face.h"
