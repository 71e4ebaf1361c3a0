/* A sampler on a time-based input clock: constant interval INTERVAL, first tick at start + SHIFT.
 *
 * Every tick counts, notes the time and takes the input. Without event mode it sees the ticks at the communication points only.
 */
#include "test_fmus.h"

typedef struct {
    double time, start, u, when, sample;
    double last_when, last_sample; /* of the ticks that are over */
    int32_t count, over;
    bool tick;
} Model;

#include "plain.h"

#define HAS_INTERVALS 1
enum { TIME = 0, TICK = 1, U = 2, COUNT = 3, WHEN = 4, SAMPLE = 5 };

static void model_start(Model *m) { m->last_when = -1.0; }
static void model_begin(Model *m, double t0) { m->time = m->start = t0; }

VARIABLES(
    VARIABLE(TICK, CLOCK, INPUT_CLOCK, tick)
    VARIABLE(U, F64, INPUT, u)
    VARIABLE(COUNT, I32, OUTPUT, count)
    VARIABLE(WHEN, F64, OUTPUT, when)
    VARIABLE(SAMPLE, F64, OUTPUT, sample))

/* While the clock is active the outputs are already those of the tick. */
static void model_refresh(Model *m) {
    m->count = m->over + m->tick;
    m->when = m->tick ? m->time : m->last_when;
    m->sample = m->tick ? m->u : m->last_sample;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)host, (void)t;
    m->time = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    const int32_t due = (int32_t)floor((t - m->start - SHIFT) / INTERVAL + 1e-9) + 1;
    const int32_t ticks = host->event_mode ? m->tick : due - m->over;
    if (ticks > 0) {
        m->over += ticks;
        m->last_when = t;
        m->last_sample = m->u;
    }
    m->tick = false;
    return (Update){0};
}

static bool model_interval(Model *m, unsigned reference, double *interval, Qualifier *qualifier) {
    (void)m;
    *interval = INTERVAL;
    *qualifier = UNCHANGED; /* it stands in the model description */
    return reference == TICK;
}

static bool model_shift(Model *m, unsigned reference, double *shift) {
    (void)m;
    *shift = SHIFT;
    return reference == TICK;
}

#include "face.h"
