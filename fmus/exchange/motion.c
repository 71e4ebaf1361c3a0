/* A model exchange FMU from event to event, with the functions of co-simulation: what `motion.py` and `slave.py` do in Python, call by
   call. What goes wrong is left to Python, which has the words. */
#include "steps.c"

typedef struct { char converged, references, values, terminate, upcoming; double next; } Info1;
typedef struct { int again, terminate, nominals, values, defined; double next; } Info2;
typedef struct { bool again, terminate, nominals, values, defined; double next; } Info3;
typedef struct { bool again, terminate, nominals; double next; } Info;
typedef int (*Plain)(void *);
typedef int (*Update1)(void *, char, Info1 *);
typedef int (*Update2)(void *, Info2 *);
typedef int (*Update3)(void *, bool *, bool *, bool *, bool *, bool *, double *);

/* -- events ---------------------------------------------------------------------------------------------------------- */

static bool plain(Exchange *e, int64_t place) { /* FMI 1 knows no modes */
    return e->version == 1 || done(e, place, ((Plain)e->functions[place])(e->instance));
}

static bool enter_event_mode(Exchange *e) {
    if (!e->in_event_mode && !plain(e, ENTER_EVENT))
        return false;
    e->in_event_mode = true;
    return true;
}

/* One event iteration, in Event Mode. */
static bool updated(Exchange *e, Info *said) {
    void *function = e->functions[UPDATE];
    if (e->version == 1) {
        Info1 info = {0};
        bool fine = done(e, UPDATE, ((Update1)function)(e->instance, 0, &info));
        *said = (Info){!info.converged, info.terminate != 0, false, info.upcoming ? info.next : INFINITY};
        return fine;
    }
    if (e->version == 2) {
        Info2 *info = e->info;
        bool fine = done(e, UPDATE, ((Update2)function)(e->instance, info));
        *said = (Info){info->again != 0, info->terminate != 0, info->nominals != 0, info->defined ? info->next : INFINITY};
        return fine;
    }
    Info3 *info = e->info;
    Update3 update = (Update3)function;
    bool fine = done(e, UPDATE,
                     update(e->instance, &info->again, &info->terminate, &info->nominals, &info->values, &info->defined, &info->next));
    *said = (Info){info->again, info->terminate, info->nominals, info->defined ? info->next : INFINITY};
    return fine;
}

/* In Event Mode: iterate until the discrete states do not change any more, and go on in Continuous-Time Mode. */
static int64_t settle(Exchange *e) {
    for (int64_t k = 0; k < e->most_iterations; k++) {
        Info said;
        if (!updated(e, &said))
            return REFUSED;
        if (isnan(said.next))
            return NO_TIME;
        e->next_event = said.next;
        e->terminated |= said.terminate;
        e->nominals_known &= !said.nominals;
        if (said.again && !e->terminated)
            continue;
        if (!e->terminated && !plain(e, ENTER_CONTINUOUS))
            return REFUSED;
        e->in_event_mode = false;
        e->anew = true;
        return REACHED;
    }
    return UNSETTLED;
}

static int64_t counted(Exchange *e) {
    e->events++;
    e->at_once = fabs(e->reached - e->last_event) <= e->tolerated ? e->at_once + 1 : 1;
    e->last_event = e->reached;
    return e->at_once > e->most_at_once ? CHATTERS : EVENT;
}

/* -- time ------------------------------------------------------------------------------------------------------------ */

static bool scale(Exchange *e) {
    double *sizes = e->absolute;
    for (int64_t i = 0; i < (e->states ? e->states : 1); i++)
        sizes[i] = 1.0;
    if (e->states && !transfer(e, GET_NOMINALS, sizes, e->states))
        return false;
    for (int64_t i = 0; i < (e->states ? e->states : 1); i++) {
        double size = isfinite(sizes[i]) && sizes[i] != 0.0 ? fabs(sizes[i]) : 1.0;
        if (e->nominals != NULL)
            e->nominals[i] = size;
        e->absolute[i] = e->tolerance * size;
    }
    e->nominals_known = true;
    return true;
}

/* The solver begins anew from the states of the FMU. */
static int64_t begin_anew(Exchange *e, double t) {
    if (e->states && !transfer(e, GET_STATES, e->array(e->x), e->states))
        return REFUSED;
    if (!e->nominals_known && !scale(e))
        return REFUSED;
    e->flag = e->begin(e->memory, t, e->x);
    e->share = e->first_share;
    e->anew = false;
    return e->flag < 0 ? GAVE_UP : REACHED;
}

/* To the first event, which is not handled, or the end of the step; where that is stands in `reached`. */
static int64_t to_event(Exchange *e, double t, double until) {
    for (int64_t k = 0; k < e->most_steps; k++) {
        double stop = e->next_event < until ? e->next_event : until;
        int64_t ended = REACHED;
        e->rooted = false;
        e->reached = t;
        if (stop - t > e->rounding * fmax(fabs(t), fabs(stop)) * 2.0) {
            if (e->anew)
                ended = begin_anew(e, t);
            if (ended == REACHED)
                ended = internal_steps(e, stop);
            if (ended > EVENT)
                return ended;
            e->rooted = e->flag == AT_ROOT;
        } else if (stop > t) {
            e->reached = stop;
            if (!done(e, SET_TIME, ((SetTime)e->functions[SET_TIME])(e->instance, stop)))
                return REFUSED;
        }
        t = e->reached;
        e->met = ended == EVENT;
        if (e->met || e->next_event <= t + e->rounding * fmax(fabs(t), 1.0))
            return counted(e);
        if (t >= until - e->rounding * fmax(fabs(until), 1.0)) {
            e->reached = until;
            return REACHED;
        }
    }
    return TOO_MANY;
}

/* To the end of a communication step, events on the way handled; one at its end, or each where `returns`, is left to the caller. */
EXPORT int64_t exchange_advance(Exchange *e, double t, double until, bool returns) {
    e->reached = t;
    if (until < t)
        return BACK;
    for (int64_t k = 0; k < e->most_events; k++) {
        if (e->in_event_mode) {
            int64_t settled = settle(e);
            if (settled != REACHED)
                return settled;
            if (e->terminated)
                return TERMINATE;
        }
        int64_t ended = to_event(e, t, until);
        if (ended != EVENT || returns || until - e->reached <= e->tolerated)
            return ended;
        t = e->reached;
        if (!enter_event_mode(e))
            return REFUSED;
    }
    return EVENTS;
}

/* -- the functions of co-simulation ---------------------------------------------------------------------------------- */

/* A communication step, in FMI 1 and 2 with the events at its end. */
static int stepped(Exchange *e, double t, double until) {
    int64_t ended = exchange_advance(e, t, until, e->version == 3 && e->returns);
    e->length = until - t;
    e->event = ended == EVENT;
    if (e->event && e->version < 3)
        ended = enter_event_mode(e) ? settle(e) : REFUSED;
    e->end = ended == TERMINATE || (e->version < 3 && e->terminated && ended < GAVE_UP);
    if (ended > TERMINATE || e->noted) {
        int status = e->proceed(ended, until);
        if (status > WARNING)
            return status;
    }
    e->arrived = e->reached;
    return e->end && e->version < 3 ? DISCARD : 0;
}

typedef int (*Step1)(void *, double, double, char);
typedef int (*Step2)(void *, double, double, int);
typedef int (*Step3)(void *, double, double, bool, bool *, bool *, bool *, double *);

EXPORT int exchange_step1(Exchange *e, double t, double h, char whole) {
    return e->elsewhere ? ((Step1)e->otherwise)(e->instance, t, h, whole) : stepped(e, t, t + h);
}

EXPORT int exchange_step2(Exchange *e, double t, double h, int past) {
    return e->elsewhere ? ((Step2)e->otherwise)(e->instance, t, h, past) : stepped(e, t, t + h);
}

EXPORT int exchange_step3(Exchange *e, double t, double h, bool past, bool *event, bool *terminate, bool *early, double *reached) {
    if (e->elsewhere)
        return ((Step3)e->otherwise)(e->instance, t, h, past, event, terminate, early, reached);
    int status = stepped(e, t, t + h);
    if (status <= WARNING) {
        *event = e->event;
        *terminate = e->end;
        *early = t + h - e->arrived > e->tolerated;
        *reached = e->arrived;
    }
    return status;
}

/* What variables were last set to, by one function and their references. */
typedef struct {
    Exchange *exchange;
    void *function, *otherwise; /* of the FMU; in Python */
    uint8_t *content;
    int64_t bytes;
    bool known; /* nothing else was set since that has a variable of these */
} Sent;

typedef int (*Set12)(void *, const uint32_t *, size_t, const void *);
typedef int (*Set3)(void *, const uint32_t *, size_t, const void *, size_t);

static int called(const Sent *s, void *function, const uint32_t *references, size_t n, const void *values, size_t count) {
    void *instance = s->exchange->instance;
    return s->exchange->version == 3 ? ((Set3)function)(instance, references, n, values, count)
                                     : ((Set12)function)(instance, references, n, values);
}

/* A setter, for always the same references; through Event Mode, where values differ from those that were set last. */
EXPORT int exchange_set(Sent *s, const uint32_t *references, size_t n, const void *values, size_t count) {
    Exchange *e = s->exchange;
    if (!s->known || e->elsewhere)
        return called(s, s->otherwise, references, n, values, count);
    if (memcmp(s->content, values, (size_t)s->bytes) == 0)
        return 0;
    if (!enter_event_mode(e))
        return e->proceed(REFUSED, e->reached);
    int status = called(s, s->function, references, n, values, count);
    if (status <= WARNING)
        memcpy(s->content, values, (size_t)s->bytes);
    return status;
}
