/* An integrator, y' = u, that does something awkward at the time AT; BEHAVIOUR says what. What is said of it is legal, except:
 * SHORT in FMI 1 and 2 moves less than it says.
 */
#include "test_fmus.h"

#define QUIT 1        /* asks for the end of the run at AT */
#define QUIT_UPDATE 2 /* the same, from the event at AT (FMI 3 with event mode) */
#define REFUSE_STEP 3 /* discards a step over AT that is longer than LONGEST_STEP; FMI 1 and 2: at AT, if it tells how far it came */
#define SHORT 4       /* comes no further than LONGEST_STEP in one step */
#define CHATTY 5      /* logs at AT, AT + EVERY, ...: category, text and arguments in turn */
#define WARNS 6       /* every step ends with a warning */
#define FAILS 7       /* error in the step over AT */
#define DIES 8        /* fatal error in the step over AT */
#define WAITS 9       /* pending (FMI 1 and 2) */
#define EXACT_STEPS 11 /* refuses a step that is no whole multiple of u, to the last bit */
#define OVERSHOOTS 12 /* says from AT on that it stands beyond the end of the step */
#define CRIES 13      /* says in the step over AT that there is an event */
#define HALVES 14     /* comes half of the way in every step, and says so (FMI 3) */
#define OWN_STEPS 10  /* moves in whole steps of LONGEST_STEP, and waits at the last one of them before the end of a step */

typedef struct {
    double time, u, y, moved_to;
    int32_t said;
} Model;

#include "plain.h"

enum { TIME = 0, U = 1, Y = 2 };

static void model_start(Model *m) { m->u = 1.0; }
BEGINS_AT_ITS_TIME

VARIABLES(
    VARIABLE(U, F64, INPUT, u)
    VARIABLE(Y, F64, OUTPUT, y))

NOTHING_TO_REFRESH

#if BEHAVIOUR == CHATTY
static void talk(Model *m, const Host *host, double until) {
    for (; AT + EVERY * m->said <= until + SAME; m->said++) {
        const double when = AT + EVERY * m->said;
        if (m->said % 3 == 0)
            SAY(host, OK, "logEvents", "event %d of '%s' at %.3f s", m->said, "test_fmus", when);
        else if (m->said % 3 == 1)
            SAY(host, WARNING, "logStatusWarning", "u = %g is large, 100 %% sure", m->u);
        else
            SAY(host, OK, "logAll", "nothing to say");
    }
}
#endif

static Outcome model_step(Model *m, Host *host, double t, double until) {
    Outcome outcome = arrived(until);
    const bool over = t < AT - SAME && until >= AT - SAME;
    (void)over, (void)host;
#if BEHAVIOUR == QUIT
    if (over) {
        outcome.terminate = true;
        outcome.early = FMI_VERSION == 3 && host->early_allowed && until > AT + SAME;
        outcome.reached = outcome.early || FMI_VERSION < 3 ? AT : until;
    }
#elif BEHAVIOUR == QUIT_UPDATE
    outcome = arrived_at_event(host, over, AT, until);
#elif BEHAVIOUR == REFUSE_STEP
    if (over && until - t > LONGEST_STEP + SAME) {
        SAY(host, DISCARD, "logStatusDiscard", "a step of %g s over %g s is too long, at most %g s", until - t, AT, LONGEST_STEP);
        const double reached = FMI_VERSION == 3 || HIDES_LAST_TIME ? t : AT; /* FMI 3: as before the call */
        m->y += m->u * (reached - t);
        m->time = reached;
        return (Outcome){.status = DISCARD, .reached = reached};
    }
#elif BEHAVIOUR == SHORT
    if (until > t + LONGEST_STEP + SAME) {
        outcome.reached = t + LONGEST_STEP;
        outcome.early = FMI_VERSION == 3;
    }
#elif BEHAVIOUR == HALVES
    outcome.reached = t + 0.5 * (until - t);
    outcome.early = true;
#elif BEHAVIOUR == OWN_STEPS
    for (; m->moved_to + LONGEST_STEP <= until + SAME; m->moved_to = LONGEST_STEP * ++m->said)
        m->y += m->u * LONGEST_STEP;
    m->time = until;
    outcome.lag = until - m->moved_to;
    return outcome;
#elif BEHAVIOUR == OVERSHOOTS
    outcome.lag = t > AT - SAME ? t - until : 0.0;
#elif BEHAVIOUR == CRIES
    outcome.event = over;
#elif BEHAVIOUR == EXACT_STEPS
    if (host->length != round(host->length / m->u) * m->u) {
        SAY(host, ERROR, "logStatusError", "a step of %.17g s is no multiple of %.17g s", host->length, m->u);
        return (Outcome){.status = ERROR, .reached = t};
    }
#elif BEHAVIOUR == CHATTY
    talk(m, host, until);
#elif BEHAVIOUR == WARNS
    outcome.status = WARNING;
#elif BEHAVIOUR == FAILS || BEHAVIOUR == DIES
    if (over) {
        SAY(host, BEHAVIOUR == DIES ? FATAL : ERROR, "logStatusError", "the solver gave up at %g s", AT);
        return (Outcome){.status = BEHAVIOUR == DIES ? FATAL : ERROR, .reached = t};
    }
#elif BEHAVIOUR == WAITS
    if (over)
        return (Outcome){.status = PENDING, .reached = t};
#endif
    m->y += m->u * (outcome.reached - t);
    m->time = outcome.reached;
    return outcome;
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
#if BEHAVIOUR == QUIT_UPDATE
    return (Update){.terminate = t >= AT - SAME, .has_next = t < AT - SAME, .next = AT};
#else
    return (Update){0};
#endif
}

#include "face.h"
