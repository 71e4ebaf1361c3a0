/* A model exchange FMU as CVODE asks it, and internal steps of CVODE: what `cvode.py` and `model_calls.py` do in Python, without
   Python between. Part of `motion.c`. */
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum {
    SET_TIME, SET_STATES, GET_RATES, GET_INDICATORS, COMPLETED, GET_STATES, GET_NOMINALS, UPDATE, ENTER_EVENT, ENTER_CONTINUOUS, GET_SLOPES,
    FUNCTIONS,
};
enum { WARNING = 1, DISCARD = 2 };
#define SHIFT 1e-7
enum { ONE_STEP = 2, AT_STOP = 1, AT_ROOT = 2, STARTED = 3 };
enum { REACHED, EVENT, TERMINATE, GAVE_UP, REFUSED, TOO_MANY, NO_TIME, UNSETTLED, CHATTERS, EVENTS, BACK };

typedef struct {
    void *functions[FUNCTIONS]; /* of the FMU; COMPLETED is NULL where it need not be told of completed steps */
    void *instance;
    int64_t version, states, indicators;
    double *(*array)(void *vector);
    int (*begin)(void *memory, double t, void *x);
    int (*set_stop)(void *memory, double stop);
    int (*step)(void *memory, double stop, void *x, double *reached, int task);
    int (*last_order)(void *memory, int *order);
    void *memory, *x;
    double *absolute;
    double tolerance, share, first_share, reached; /* `reached`: where it stands [s] */
    int64_t steps, flag, status, place; /* what CVODE said last; what the FMU refused with, and which function did */
    int64_t rates; /* how often derivatives were asked for */
    const uint32_t *unknowns, *knowns; /* value references of the derivatives, and of what each state is an element of */
    const int64_t *sizes, *places; /* of each state: size of the array that it stands in, and where */
    double *seed, *(*columns)(void *matrix); /* `seed`: zeros, as many as the largest array has elements */
    double *nominals, *scratch; /* magnitudes of the states; room for states and derivatives */
    int64_t unknown_count, differing; /* number of the derivative whose slope is not what a difference gives, from 1 */
    int64_t noted; /* whether there is anything to be said of warnings, refusals and slopes */
    int64_t warnings[FUNCTIONS];
    /* its motion */
    double next_event, last_event; /* that the FMU knows of, and the last one [s] */
    int64_t events, at_once;       /* how many on the way, and how many of them within a billionth of a second before */
    int64_t most_steps, most_iterations, most_events, most_at_once;
    double tolerated, rounding; /* instants closer than this are the same [s]; what instants lose, relative */
    bool in_event_mode, terminated, anew, nominals_known;
    bool rooted, met; /* what the last event was: an indicator changed its sign; asked for by the FMU, or that */
    bool returns;     /* every event ends a step, and is left to the master */
    bool elsewhere;   /* Python makes the steps */
    bool event, end;  /* where the last step ended: at an event; the FMU asks for the end */
    void *info;       /* what it says at the end of an event iteration */
    double arrived, length; /* where the last step ended, and how long it was to be [s] */
    void *otherwise;        /* doStep in Python */
    int (*proceed)(int64_t ended, double until); /* Python sees to what C does not; it returns a status of FMI */
} Exchange;

typedef int (*SetTime)(void *, double);
typedef int (*Transfer)(void *, double *, size_t);
typedef int (*Slopes2)(void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, double *);
typedef int (*Slopes3)(void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, size_t, double *, size_t);
typedef int (*Completed1)(void *, char *);
typedef int (*Completed2)(void *, int, int *, int *);
typedef int (*Completed3)(void *, bool, bool *, bool *);

/* Whether the FMU did what it was asked for. */
static bool done(Exchange *e, int64_t place, int status) {
    e->warnings[place] += status == WARNING;
    e->noted |= status >= WARNING;
    if (status <= WARNING)
        return true;
    e->status = status;
    e->place = place;
    return false;
}

static bool transfer(Exchange *e, int64_t place, double *values, int64_t count) {
    return done(e, place, ((Transfer)e->functions[place])(e->instance, values, (size_t)count));
}

static bool move(Exchange *e, double t, double *x) {
    return done(e, SET_TIME, ((SetTime)e->functions[SET_TIME])(e->instance, t)) && (e->states == 0 || transfer(e, SET_STATES, x, e->states));
}

static int said(const Exchange *e, bool done) {
    return done ? 0 : e->status == DISCARD ? 1 : -1;
}

EXPORT int exchange_rates(double t, void *x, void *written, void *data) {
    Exchange *e = data;
    if (e->states == 0) { /* a state that stands, so that the solver has one */
        e->array(written)[0] = 0.0;
        return 0;
    }
    e->rates++;
    return said(e, move(e, t, e->array(x)) && transfer(e, GET_RATES, e->array(written), e->states));
}

EXPORT int exchange_roots(double t, void *x, double *written, void *data) {
    Exchange *e = data;
    return said(e, move(e, t, e->array(x)) && transfer(e, GET_INDICATORS, written, e->indicators));
}

/* Of a state in the direction of a difference. */
static double length(const Exchange *e, const double *x, int64_t j) {
    return (0.5 + fmod(0.6180339887498949 * (double)j, 1.0)) * (fabs(x[j]) + e->nominals[j]);
}

/* Differences of the derivatives in that direction, or against it; false where the FMU refused. */
static bool differences(Exchange *e, double t, const double *x, const double *rates, double shift, double *slopes) {
    double *point = e->scratch;
    for (int64_t j = 0; j < e->states; j++)
        point[j] = x[j] + shift * length(e, x, j);
    e->rates++;
    if (!move(e, t, point) || !transfer(e, GET_RATES, slopes, e->states))
        return false;
    for (int64_t i = 0; i < e->states; i++)
        slopes[i] = (slopes[i] - rates[i]) / shift;
    return true;
}

/* Number of the first derivative whose slope in that direction lies outside of differences, from 1; 0 where none does. */
static int64_t outside(Exchange *e, const double *x, const double *rates, const double *columns, const double *one, const double *other) {
    const double shift = SHIFT, share = 0.1, rounding = 1e3 * DBL_EPSILON;
    int64_t n = e->states;
    for (int64_t i = 0; i < n; i++) {
        double slope = 0.0, size = 0.0, low = fmin(one[i], other[i]), high = fmax(one[i], other[i]);
        for (int64_t j = 0; j < n; j++) {
            slope += length(e, x, j) * columns[j * n + i];
            size += length(e, x, j) * fabs(columns[j * n + i]);
        }
        double most = share * size + rounding * (2.0 * fabs(rates[i]) + shift * fmax(fabs(low), fabs(high))) / shift;
        if (!(slope >= low - most && slope <= high + most))
            return i + 1;
    }
    return 0;
}

/* The same of the Jacobian at x: the difference in one direction, and that in the other where the first one says no, for
   between both lies any slope at a kink, and what bends goes to both sides. -1 where the FMU refused. */
static int64_t differing(Exchange *e, double t, const double *x, const double *rates, const double *columns) {
    double *ahead = e->scratch + e->states, *back = ahead + e->states;
    if (!differences(e, t, x, rates, SHIFT, ahead))
        return -1;
    if (outside(e, x, rates, columns, ahead, ahead) == 0)
        return 0;
    return differences(e, t, x, rates, -SHIFT, back) ? outside(e, x, rates, columns, ahead, back) : -1;
}

/* The Jacobian by directional derivatives, column by column. */
EXPORT int exchange_jacobian(double t, void *x, void *fx, void *matrix, void *data, void *a, void *b, void *c) {
    Exchange *e = data;
    (void)a, (void)b, (void)c;
    bool fine = move(e, t, e->array(x));
    double *all = e->columns(matrix), *column = all;
    for (int64_t j = 0; fine && j < e->states; j++, column += e->states) {
        void *function = e->functions[GET_SLOPES];
        size_t unknowns = (size_t)e->unknown_count, size = (size_t)e->sizes[j];
        e->seed[e->places[j]] = 1.0;
        fine = done(e, GET_SLOPES,
                    e->version == 2
                        ? ((Slopes2)function)(e->instance, e->unknowns, unknowns, e->knowns + j, 1, e->seed, column)
                        : ((Slopes3)function)(e->instance, e->unknowns, unknowns, e->knowns + j, 1, e->seed, size, column, (size_t)e->states));
        e->seed[e->places[j]] = 0.0;
    }
    e->differing = fine ? differing(e, t, e->array(x), e->array(fx), all) : 0;
    e->noted |= e->differing > 0;
    return e->differing > 0 ? -1 : said(e, fine && e->differing == 0);
}

EXPORT int exchange_weights(void *x, void *weights, void *data) {
    Exchange *e = data;
    double *states = e->array(x), *written = e->array(weights);
    for (int64_t i = 0; i < (e->states ? e->states : 1); i++) {
        double tolerated = e->share * (e->tolerance * fabs(states[i]) + e->absolute[i]);
        if (!(tolerated > 0.0))
            return -1;
        written[i] = 1.0 / tolerated;
    }
    return 0;
}

static bool completed(Exchange *e, bool *event, bool *terminate) {
    void *function = e->functions[COMPLETED];
    *event = *terminate = false;
    if (function == NULL)
        return true;
    if (e->version == 1) {
        char wanted = 0;
        bool fine = done(e, COMPLETED, ((Completed1)function)(e->instance, &wanted));
        *event = wanted != 0;
        return fine;
    }
    if (e->version == 2) {
        int wanted = 0, end = 0;
        bool fine = done(e, COMPLETED, ((Completed2)function)(e->instance, 0, &wanted, &end));
        *event = wanted != 0;
        *terminate = end != 0;
        return fine;
    }
    return done(e, COMPLETED, ((Completed3)function)(e->instance, false, event, terminate));
}

/* Internal steps to `stop` [s], or to the first event before it. */
static int64_t internal_steps(Exchange *e, double stop) {
    for (int64_t k = 0; k < e->most_steps; k++) {
        bool event, terminate;
        int order = STARTED;
        double reached = stop;
        e->steps++;
        e->flag = e->set_stop(e->memory, stop);
        if (e->flag >= 0)
            e->flag = e->step(e->memory, stop, e->x, &reached, ONE_STEP);
        if (e->flag < 0)
            return GAVE_UP;
        if (e->share < 1.0) {
            e->last_order(e->memory, &order);
            if (order >= STARTED)
                e->share = 1.0;
        }
        e->reached = e->flag == AT_STOP ? stop : reached;
        if (!move(e, e->reached, e->array(e->x)) || !completed(e, &event, &terminate))
            return REFUSED;
        e->terminated |= terminate;
        if (terminate)
            return TERMINATE;
        if (event || e->flag == AT_ROOT)
            return EVENT;
        if (e->flag == AT_STOP)
            return REACHED;
    }
    return TOO_MANY;
}
