/* Requests of a proxy: what the FMU said meanwhile, a call with its arguments, the way there and back, what came of it. Part of `proxy.c`.
 */
#include "session.h"

/* -- messages ------------------------------------------------------------------------------------------------------------- */

typedef void (*Logger12)(void *environment, const char *name, int status, const char *category, const char *format, ...);
typedef void (*Logger3)(void *environment, int status, const char *category, const char *text);
typedef void (*StepFinished)(void *environment, int status);

static void take(const Session *s, uint64_t at, void *bytes, size_t count) {
    for (size_t k = 0; k < count; k++)
        ((char *)bytes)[k] = s->messages[(at + k) % LOG_BYTES];
}

/* A text for a logger that fills in arguments: it has none. */
static void double_percent(char *to, const char *from) {
    for (; *from != '\0'; from++) {
        *to++ = *from;
        if (*from == '%')
            *to++ = '%';
    }
    *to = '\0';
}

static void tell(Session *s, int status, const char *category, char *text) {
    if (s->logger == NULL)
        return;
    if (s->version == 3) {
        ((Logger3)s->logger)(s->environment, status, category, text);
        return;
    }
    char *plain = malloc(2 * strlen(text) + 1);
    double_percent(plain, text);
    ((Logger12)s->logger)(s->environment, s->name, status, category, plain);
    free(plain);
}

/* Hand on the messages up to a place; what is no message ends it. */
static void tell_until(Session *s, uint64_t end) {
    while (s->log_told < end && end - s->log_told <= LOG_BYTES) {
        Message head;
        take(s, s->log_told, &head, sizeof head);
        const size_t rest_bytes = head.bytes - sizeof head;
        if (head.bytes < sizeof head || head.bytes > end - s->log_told || head.category_bytes > rest_bytes)
            break;
        char *category = malloc(rest_bytes + 2), *text = category + head.category_bytes + 1;
        take(s, s->log_told + sizeof head, category, head.category_bytes);
        take(s, s->log_told + sizeof head + head.category_bytes, text, rest_bytes - head.category_bytes);
        category[head.category_bytes] = text[rest_bytes - head.category_bytes] = '\0';
        s->log_told += head.bytes;
        if (head.kind == 0)
            tell(s, head.status, category, text);
        else if (s->step_finished != NULL)
            ((StepFinished)s->step_finished)(s->environment, head.status);
        free(category);
    }
    if (end > s->log_told)
        s->log_told = end;
    if (s->asking->log_taken != s->log_told)
        s->asking->log_taken = s->log_told;
}

static void tell_all(Session *s) {
    tell_until(s, atomic_load(&s->answering->log_end));
}

/* -- a request ------------------------------------------------------------------------------------------------------------ */

/* What has not changed since the last request is not written: it stays in the cache of who reads it. */
static void keep(void *at, const void *bytes, size_t count) {
    if (memcmp(at, bytes, count) != 0)
        memcpy(at, bytes, count);
}

/* Room for more bytes behind a record that is being written; NULL where there is none. */
static char *room(Session *s, Record *r, size_t bytes) {
    const size_t at = (size_t)((char *)r - s->requests);
    if (bytes > AREA_BYTES || at + s->filled + bytes + PAGE > AREA_BYTES)
        return NULL;
    char *made = (char *)r + s->filled;
    s->filled += aligned(bytes);
    return made;
}

static bool add_bytes(Session *s, Record *r, Passed *p, const void *bytes, size_t count) {
    char *to = bytes == NULL ? NULL : room(s, r, count);
    p->value = to == NULL ? NONE : (uint64_t)(to - (char *)r);
    p->bytes = (uint32_t)count;
    if (to != NULL)
        keep(to, bytes, count);
    return bytes == NULL || to != NULL;
}

static bool add_texts(Session *s, Record *r, Passed *p, const char *const *texts, size_t count, const size_t *lengths) {
    uint64_t *offsets = (uint64_t *)(texts == NULL ? NULL : room(s, r, count * sizeof *offsets));
    p->bytes = texts == NULL ? 0 : (uint32_t)count;
    p->value = offsets == NULL ? 0 : (uint64_t)((char *)offsets - (char *)r);
    for (size_t k = 0; offsets != NULL && k < count; k++) {
        const size_t length = texts[k] == NULL ? 0 : lengths == NULL ? strlen(texts[k]) + 1 : lengths[k];
        char *to = texts[k] == NULL ? NULL : room(s, r, length);
        if (texts[k] != NULL && to == NULL)
            return false;
        offsets[k] = to == NULL ? NONE : (uint64_t)(to - (char *)r);
        if (to != NULL)
            memcpy(to, texts[k], length);
    }
    return texts == NULL || offsets != NULL;
}

static void note_callback(Session *s, char code, const void *given) {
    void *const address = (void *)(uintptr_t)given;
    void *const *fields = given;
    if (code == 'e')
        s->environment = address;
    else if (code == 'l')
        s->logger = address;
    else if (code == 'u')
        s->intermediate_update = address;
    else if (code == 'C')
        s->clock_update = address;
    else if (code == 'L')
        s->lock = address;
    else if (code == 'U')
        s->unlock = address;
    else { /* logger, allocateMemory, freeMemory, stepFinished and, in FMI 2, componentEnvironment */
        s->logger = fields[0];
        s->step_finished = fields[3];
        s->environment = s->version == 2 ? fields[4] : NULL;
    }
}

static size_t counted(const Argument *argument, const uint64_t *a) {
    return argument->count < 0 ? 1 : (size_t)a[argument->count];
}

/* Room for replies; where there is none, past the end. */
static uint32_t reply_room(Session *s, size_t bytes) {
    const uint32_t at = (uint32_t)s->reply_used;
    s->reply_used += bytes > AREA_BYTES ? AREA_BYTES : aligned(bytes);
    return at;
}

static bool add_argument(Session *s, Record *r, Passed *p, const Function *f, int k, const uint64_t *a, const double *d) {
    const Argument *argument = &f->arguments[k];
    const uint64_t word = a[argument->word];
    const size_t count = counted(argument, a);
    switch (argument->code) {
    case 'c': return true;
    case 'i': p->value = (uint64_t)(int64_t)(int32_t)word; return true;
    case 'b': p->value = (uint8_t)word; return true;
    case 'z': case 'h': p->value = word; return true;
    case 'd': memcpy(&p->value, &d[argument->word], sizeof(double)); return true;
    case 's': return add_bytes(s, r, p, (const char *)word, word == 0 ? 0 : strlen((const char *)word) + 1);
    case '>': case 'H': p->reply = reply_room(s, count * (size_t)argument->size); /* and what stands there now */ /* fall through */
    case '<': return count < AREA_BYTES && add_bytes(s, r, p, (const void *)word, count * (size_t)argument->size);
    case 'S': return count < AREA_BYTES && add_texts(s, r, p, (const char *const *)word, count, NULL);
    case 'X': return count < AREA_BYTES && add_texts(s, r, p, (const char *const *)word, count, (const size_t *)a[f->arguments[k - 1].word]);
    case 'G': case 'Y': p->bytes = (uint32_t)count; p->reply = (uint32_t)s->reply_used; s->reply_used += 16 * count; return count < AREA_BYTES;
    default: note_callback(s, argument->code, (const void *)word); p->value = argument->code != 'k' ? word != 0 : (uint64_t)((s->step_finished != NULL) | (s->environment != NULL) << 1); return true;
    }
}

/* A call, as the last one of the request; NULL where it does not fit. */
static Record *add_call(Session *s, const Function *f, const uint64_t *a, const double *d) {
    Record *r = request_at(s, s->used);
    const size_t size = aligned(sizeof *r + (size_t)f->argument_count * sizeof(Passed)), replies = s->reply_used;
    if (s->used + size + PAGE > AREA_BYTES)
        return NULL;
    Passed passed[ARGUMENTS_AT_MOST] = {{0}};
    Record head = {.function = (uint32_t)(f - FUNCTIONS), .reply = reply_room(s, sizeof(Reply))};
    s->filled = size;
    bool fits = true;
    for (int k = 0; fits && k < f->argument_count; k++)
        fits = add_argument(s, r, &passed[k], f, k, a, d);
    if (!fits || s->reply_used > AREA_BYTES) {
        s->reply_used = replies;
        return NULL;
    }
    head.bytes = (uint32_t)s->filled;
    keep(r, &head, sizeof head);
    keep(r->arguments, passed, (size_t)f->argument_count * sizeof *passed);
    s->used += s->filled;
    return r;
}

static void add_mark(Session *s, uint32_t function) {
    Record *r = request_at(s, s->used);
    keep(r, &(Record){.function = function, .bytes = sizeof *r}, sizeof *r);
    s->used += aligned(sizeof *r);
}

static void send_request(Session *s, size_t first) {
    s->asking->first = (uint32_t)first;
    s->asking->looks = s->pace.place == THIS_CORE ? 0 : LOOKS;
    put_in_place(&s->pace, s->supervision->child);
    s->number++;
    post(&s->asking->number, s->number, &s->answering->sleeps);
}

/* -- callbacks in the middle of a call --------------------------------------------------------------------------------------- */

typedef void (*IntermediateUpdate)(void *, double, bool, bool, bool, bool, bool *, double *);
typedef void (*ClockUpdate)(void *);
typedef void (*Preemption)(void);

static void answer_callback(Session *s) {
    const Answering said = *s->answering;
    bool early = false;
    double when = 0.0;
    tell_all(s);
    if (said.kind == INTERMEDIATE_UPDATE && s->intermediate_update != NULL)
        ((IntermediateUpdate)s->intermediate_update)(
            s->environment, said.time, said.flags[0] != 0, said.flags[1] != 0, said.flags[2] != 0, said.flags[3] != 0, &early, &when);
    else if (said.kind == CLOCK_UPDATE && s->clock_update != NULL)
        ((ClockUpdate)s->clock_update)(s->environment);
    else if (said.kind == LOCK_PREEMPTION && s->lock != NULL)
        ((Preemption)s->lock)();
    else if (said.kind == UNLOCK_PREEMPTION && s->unlock != NULL)
        ((Preemption)s->unlock)();
    Record *r = request_at(s, s->used);
    memset(r, 0, sizeof *r + 2 * sizeof(Passed));
    r->function = N_RETURN;
    r->arguments[0].value = early;
    memcpy(&r->arguments[1].value, &when, sizeof when);
}

/* Have the request made. False where the process ended. */
static bool exchange(Session *s) {
    const size_t base = s->base, first = s->base;
    const bool paced = s->running && s->depth == 0;
    if (paced)
        begin_call(&s->pace);
    add_mark(s, N_STOP);
    send_request(s, first);
    const uint32_t sent = s->number;
    while (!s->dead && await(s)) {
        s->sent = sent;
        if (s->answering->kind == REPLY) {
            if (paced)
                end_call(&s->pace);
            return true;
        }
        const size_t used = s->used, replies = s->reply_used;
        s->base = used;
        s->depth++;
        answer_callback(s);
        s->depth--;
        s->base = base;
        s->used = used;
        s->reply_used = replies;
        if (!s->dead)
            send_request(s, used);
    }
    tell_all(s);
    return false;
}

/* -- what came of it --------------------------------------------------------------------------------------------------------- */

static bool within(uint64_t at, uint64_t bytes) {
    return at <= AREA_BYTES && bytes <= AREA_BYTES - at;
}

/* Texts that the FMU returned are kept until the next are. */
static void take_texts(Session *s, const Passed *p, const char **to, size_t *lengths) {
    const uint64_t *entries = (const uint64_t *)(s->replies + p->reply);
    uint64_t *seen = calloc(2 * p->bytes + 1, sizeof *seen), bytes = 0;
    for (uint64_t k = 0; k < p->bytes; k++) { /* read once: they may change meanwhile */
        seen[2 * k] = entries[2 * k];
        seen[2 * k + 1] = entries[2 * k + 1];
        if (seen[2 * k] != NONE && !within(seen[2 * k], seen[2 * k + 1]))
            seen[2 * k] = NONE;
        bytes += seen[2 * k] == NONE ? 0 : seen[2 * k + 1] + 1;
    }
    free(s->texts);
    char *at = s->texts = malloc(bytes + 1);
    for (uint64_t k = 0; k < p->bytes; k++) {
        to[k] = seen[2 * k] == NONE ? NULL : at;
        if (seen[2 * k] != NONE) {
            memcpy(at, s->replies + seen[2 * k], seen[2 * k + 1]);
            at[seen[2 * k + 1]] = '\0';
            at += seen[2 * k + 1] + 1;
        }
        if (lengths != NULL && seen[2 * k] == NONE)
            lengths[k] = 0;
    }
    free(seen);
}

static void take_results(Session *s, const Record *r, const Function *f, const uint64_t *a) {
    for (int k = 0; k < f->argument_count; k++) {
        const Argument *argument = &f->arguments[k];
        void *to = (void *)a[argument->word];
        const Passed *p = &r->arguments[k];
        if ((argument->code == '>' || argument->code == 'H') && to != NULL)
            memcpy(to, s->replies + p->reply, p->bytes);
        if (argument->code == 'G')
            take_texts(s, p, to, NULL);
        if (argument->code == 'Y')
            take_texts(s, p, to, (size_t *)a[f->arguments[k - 1].word]);
    }
}

/* The worst that the sets said which waited, up to the call behind them. */
static int64_t waited_status(Session *s) {
    int64_t worst = OK_STATUS;
    const Record *r = request_at(s, s->base);
    for (int k = 0; k < s->waiting; k++, r = (const Record *)((const char *)r + r->bytes)) {
        const Reply reply = *(const Reply *)(s->replies + r->reply);
        const int64_t said = reply.number == s->sent ? reply.value : OK_STATUS;
        if (said == OK_STATUS)
            continue;
        s->strict = true; /* from now on every set says for itself what it has to say */
        if (said > worst) {
            worst = said;
            char text[128];
            snprintf(text, sizeof text, "%s returned status %d; that is told with the next call.", FUNCTIONS[r->function].name, (int)said);
            tell(s, (int)said, "isolation", text);
        }
        if (said > WARNING_STATUS)
            break;
    }
    return worst;
}
