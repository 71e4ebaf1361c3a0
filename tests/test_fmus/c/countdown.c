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

#include "plain.h"

#define HAS_INTERVALS 1
enum { TIME = 0, START = 1, ALARM = 2, DELAY = 3, ARM_TIME = 4, REPEAT = 5, ALARMS = 6, WHEN = 7, ARMED = 8 };

static void model_start(Model *m) {
    m->delay = DELAY_START;
    m->arm_time = ARM_START;
    m->when = -1.0;
    m->qualifier = NOT_YET_KNOWN;
}

BEGINS_AT_ITS_TIME

VARIABLES(
    VARIABLE(START, CLOCK, INPUT_CLOCK, start)
    VARIABLE(ALARM, CLOCK, INPUT_CLOCK, alarm)
    VARIABLE(DELAY, F64, PARAMETER, delay)
    VARIABLE(ARM_TIME, F64, PARAMETER, arm_time)
    VARIABLE(REPEAT, BOOL, PARAMETER, repeat)
    VARIABLE(ALARMS, I32, OUTPUT, alarms)
    VARIABLE(WHEN, F64, OUTPUT, when)
    VARIABLE(ARMED, BOOL, OUTPUT, armed))

NOTHING_TO_REFRESH

static bool to_be_armed(const Model *m) { return m->arm_time >= 0.0 && !m->was_armed; }

STEPS_TO_ITS_EVENT(to_be_armed, arm_time)

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
