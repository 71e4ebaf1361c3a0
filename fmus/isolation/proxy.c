/* A library with the functions of FMI 1, 2 and 3 that stands in for that of an FMU, and hands each call to a process of its own that has
   loaded it (`child.c`). Whoever calls sees no difference, but for what the FMU cannot do to this process.

   A set waits for the call behind it, and what was read behind the last step is read along with the next one: a step takes one round trip.
   What a set answers is then said by the call that it waited for. Each file that is loaded serves one FMU; every instance has a process.
 */
#include "reading_ahead.h"

/* -- calls ------------------------------------------------------------------------------------------------------------------- */

static void note_inputs(Session *s, const Function *f, const uint64_t *a) {
    if (f->arguments[1].size != 4 || f->argument_count < 4 || f->arguments[3].size != 8)
        return;
    s->input_function = (int)(f - FUNCTIONS);
    s->input_count = (int)(a[2] < MOST_INPUTS ? a[2] : MOST_INPUTS);
    if (f->arguments[3].count >= 0 && a[f->arguments[3].count] < (uint64_t)s->input_count)
        s->input_count = (int)a[f->arguments[3].count];
    memcpy(s->input_references, (const void *)a[1], (size_t)s->input_count * 4);
    memcpy(s->inputs, (const void *)a[3], (size_t)s->input_count * 8);
}

static void begin_anew(Session *s) {
    s->used = s->base;
    s->reply_used = s->depth == 0 ? AHEAD_BYTES : s->reply_used;
    s->waiting = 0;
}

/* What the FMU printed past its logger, as messages. */
static void tell_printed(Session *s) {
    const off_t end = s->console < 0 ? 0 : lseek(s->console, 0, SEEK_CUR);
    if (end <= 0)
        return;
    char *text = malloc((size_t)end + 1);
    const ssize_t count = pread(s->console, text, (size_t)end, 0);
    lseek(s->console, 0, SEEK_SET);
    text[count > 0 ? count : 0] = '\0';
    for (char *line = text, *next; *line != '\0'; line = next) {
        next = line + strcspn(line, "\n");
        next += *next == '\n' ? (*next = '\0', 1) : 0;
        tell(s, OK_STATUS, "console", line);
    }
    free(text);
}

/* What a call said; messages of what was read ahead are told when that is asked for. */
static int64_t finish(Session *s, const Function *f, const Record *r, const uint64_t *a) {
    const Reply reply = *(const Reply *)(s->replies + r->reply);
    const bool made = reply.number == s->sent;
    const uint64_t end = s->answering->log_seen;
    tell_until(s, f->part == STEP && made && reply.log_end < end ? reply.log_end : end);
    const int64_t waited = waited_status(s);
    if (!made)
        return waited == DISCARD_STATUS && f->part == STEP ? ERROR_STATUS : waited;
    take_results(s, r, f, a);
    return waited == WARNING_STATUS && reply.value == OK_STATUS ? waited : reply.value;
}

static void note_phase(Session *s, const Function *f, int64_t said) {
    const bool well = said <= WARNING_STATUS;
    if (f->part == STARTED && well) {
        s->running = true;
        begin_pace(&s->pace);
    }
    if (f->part == ENDED)
        s->running = false;
    s->clean = (s->clean && f->part == GET) || (f->part == STEP && well && s->running && s->depth == 0);
    if (f->part == CALL || f->part == STARTED || f->part == ENDED)
        tell_printed(s);
}

static int64_t made_call(Session *s, const Function *f, const uint64_t *a, const double *d) {
    int64_t said = FATAL_STATUS;
    if (f->part == GET && s->clean && s->depth == 0 && was_read(s, f, a, &said))
        return said;
    if (s->depth > 0)
        begin_anew(s);
    Record *r = add_call(s, f, a, d);
    if (r == NULL && s->waiting > 0) { /* the sets that wait fill it */
        const bool made = exchange(s);
        const int64_t waited = made ? waited_status(s) : FATAL_STATUS;
        begin_anew(s);
        if (waited > WARNING_STATUS)
            return waited;
        r = add_call(s, f, a, d);
    }
    if (r == NULL) {
        char text[] = "a call hands over more than 64 MiB, which a process of its own does not take.";
        tell(s, ERROR_STATUS, "isolation", text);
        return ERROR_STATUS;
    }
    if (f->part == SET) {
        note_inputs(s, f, a);
        if (s->running && !s->strict && s->depth == 0) {
            s->waiting++;
            s->clean = false;
            return OK_STATUS;
        }
    }
    if (f->part == STEP) {
        s->asking->wanted = 0;
        if (s->running && s->depth == 0)
            want_reads_ahead(s);
    }
    if (exchange(s)) {
        said = finish(s, f, r, a);
        if (f->part == GET && s->clean && s->depth == 0 && known_get(s, f, a) == NULL)
            read_ahead(s, r);
        note_phase(s, f, said);
    }
    begin_anew(s);
    return said;
}

static Session *any_session(void) {
    for (Session *s = sessions; s != NULL; s = s->next)
        if (!s->dead)
            return s;
    return open_session();
}

static void put_away(Session *s) {
    if (!s->dead && s->owner == getpid()) {
        begin_anew(s);
        add_mark(s, N_END);
        s->outside = "unloading its library";
        send_request(s, s->base);
        const double until = now() + patience_seconds();
        const bool listens = listen_for_end();
        while (!reaped(s->supervisor, LOOK_SECONDS) && now() < until && !interrupted)
            ;
        if (listens)
            listen_no_longer();
        const bool ended = atomic_load(&s->supervision->ended) == EXITED && s->supervision->code == PUT_AWAY;
        if (!ended && atomic_load(&s->supervision->ended) == LIVES && interrupted)
            note_interrupted(s);
        else if (!ended && atomic_load(&s->supervision->ended) == LIVES && now() >= until)
            note_overdue(s);
        else if (!ended)
            note_death(s, NULL);
        if (reaped(s->supervisor, 0.0))
            s->supervisor = 0;
    }
    close_session(s);
}

static int64_t forward(int which, const uint64_t *a, const double *d) {
    const Function *f = &FUNCTIONS[which];
    Session *s = f->signature[0] == 'c' ? (Session *)a[0] : any_session();
    static char text[256];
    if (f->part == TEXT) {
        const char *found = NULL;
        if (s != NULL && made_call(s, f, a, d) == OK_STATUS)
            take_texts(s, &(Passed){.bytes = 1, .reply = AHEAD_BYTES + sizeof(Reply)}, &found, NULL);
        snprintf(text, sizeof text, "%s", found == NULL ? "" : found);
        return (int64_t)text;
    }
    if (s == NULL || s->owner != getpid())
        return FATAL_STATUS;
    const int64_t said = s->dead ? FATAL_STATUS : made_call(s, f, a, d);
    if (f->part == FREE)
        put_away(s);
    return said;
}

/* A new instance, in a process that no other instance is in. */
static Session *instantiate(int which, const uint64_t *a, const double *d) {
    const Function *f = &FUNCTIONS[which];
    Session *s = sessions;
    while (s != NULL && (!s->free || s->dead))
        s = s->next;
    if (s == NULL)
        s = open_session();
    if (s == NULL)
        return NULL;
    s->free = false;
    s->version = f->version;
    snprintf(s->name, sizeof s->name, "%s", a[0] == 0 ? "" : (const char *)a[0]);
    const int64_t made = made_call(s, f, a, d);
    if (made != 0 && !s->dead)
        return s;
    if (!s->dead)
        tell_printed(s);
    put_away(s);
    return NULL;
}

#define WORDS_OF_A_CALL uint64_t a0, uint64_t a1, uint64_t a2, uint64_t a3, uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8, \
    uint64_t a9, uint64_t a10, uint64_t a11, double d0, double d1, double d2, double d3
#define F(version, part, name, arguments) \
    EXPORT int64_t name(WORDS_OF_A_CALL) { \
        const uint64_t a[ARGUMENTS_AT_MOST] = {a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11}; \
        const double d[DOUBLES_AT_MOST] = {d0, d1, d2, d3}; \
        return part == INSTANTIATE ? (int64_t)instantiate(N_##name, a, d) : forward(N_##name, a, d); \
    }
UNIFORM_FUNCTIONS
#undef F

typedef struct {
    void *logger, *allocate, *release, *step_finished;
} Callbacks1;

EXPORT void *fmiInstantiateSlave(const char *name, const char *guid, const char *place, const char *mime, double timeout, char visible,
    char interactive, Callbacks1 callbacks, char logging) {
    const uint64_t a[ARGUMENTS_AT_MOST] = {(uint64_t)name, (uint64_t)guid, (uint64_t)place, (uint64_t)mime, (uint64_t)visible,
        (uint64_t)interactive, (uint64_t)logging, (uint64_t)&callbacks};
    return instantiate(N_fmiInstantiateSlave, a, (double[DOUBLES_AT_MOST]){timeout});
}

EXPORT void *fmiInstantiateModel(const char *name, const char *guid, Callbacks1 callbacks, char logging) {
    const uint64_t a[ARGUMENTS_AT_MOST] = {(uint64_t)name, (uint64_t)guid, (uint64_t)logging, (uint64_t)&callbacks};
    return instantiate(N_fmiInstantiateModel, a, (double[DOUBLES_AT_MOST]){0.0});
}

/* -- for Python ---------------------------------------------------------------------------------------------------------------- */

/* Start a process that loads the FMU. False where that cannot be; `isolation_reason` says why. */
EXPORT bool isolation_open(const Options *wanted) {
    options = *wanted;
    if (FUNCTIONS[0].argument_count == 0 && FUNCTIONS[FUNCTION_COUNT - 1].argument_count == 0)
        parse_signatures();
    return open_session() != NULL;
}

/* Whether the library of the FMU has a function, by its name without the prefix of FMI 1. */
EXPORT bool isolation_has(const char *name) {
    for (int k = 0; k < FUNCTION_COUNT; k++)
        if (strcmp(FUNCTIONS[k].name, name) == 0)
            return sessions != NULL && sessions->answering->present[k] != 0;
    return false;
}

/* How the process ended; empty where none has. */
EXPORT const char *isolation_reason(void) {
    return reason;
}

/* Whether it ended because a user asked for the end, and not for what the FMU did. */
EXPORT bool isolation_interrupted(void) {
    return interrupted != 0;
}

EXPORT const char *isolation_printed(void) {
    return printed;
}

/* The last inputs of the process that ended: how many, their value references and values. */
EXPORT int isolation_inputs(uint32_t *references, double *values) {
    if (last_dead == NULL)
        return 0;
    memcpy(references, last_dead->input_references, sizeof last_dead->input_references);
    memcpy(values, last_dead->inputs, sizeof last_dead->inputs);
    return last_dead->input_count;
}

EXPORT __attribute__((destructor)) void isolation_close(void) {
    while (sessions != NULL)
        put_away(sessions);
}
