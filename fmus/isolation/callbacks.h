/* What an FMU is given to call: messages, updates in the middle of a step; and the state of its process. Part of `child.c`. */
#include "supervisor.h"

#include <pthread.h>

static Asking *asking;
static Answering *answering;
static char *requests, *replies, *messages;
static void *library, *instance, *addresses[FUNCTION_COUNT];
static pthread_t here;
static pthread_mutex_t writing = PTHREAD_MUTEX_INITIALIZER;
static uint32_t answered;

typedef int64_t (*Uniform)(uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t, uint64_t,
    uint64_t, double, double, double, double);
typedef struct {
    void *logger, *allocate, *release, *step_finished, *environment;
} Callbacks; /* of FMI 2; the first four are those of FMI 1 */
typedef struct {
    void *logger, *allocate, *release, *step_finished;
} Callbacks1;
typedef void *(*InstantiateSlave)(const char *, const char *, const char *, const char *, double, char, char, Callbacks1, char);
typedef void *(*InstantiateModel)(const char *, const char *, Callbacks1, char);

static const Record *serve(void);

static void answer(uint32_t kind) {
    answering->kind = kind;
    answering->log_seen = atomic_load(&answering->log_end);
    post(&answering->number, answered, &asking->sleeps);
}

/* Ask the other side something in the middle of a call; what it returns. Only from the thread that was called. */
static const Record *ask(uint32_t kind) {
    answer(kind);
    return serve();
}

static void put(uint64_t *at, const void *bytes, size_t count) {
    for (size_t k = 0; k < count; k++)
        messages[(*at)++ % LOG_BYTES] = ((const char *)bytes)[k];
}

static void write_message(int kind, int status, const char *category, const char *text) {
    const size_t c = strnlen(category == NULL ? "" : category, 1024), t = strnlen(text == NULL ? "" : text, MOST_TEXT);
    const Message head = {(uint32_t)(sizeof head + c + t), status, kind, (uint32_t)c};
    pthread_mutex_lock(&writing);
    uint64_t end = atomic_load(&answering->log_end);
    if (end + head.bytes - asking->log_taken > LOG_BYTES && pthread_equal(pthread_self(), here)) {
        pthread_mutex_unlock(&writing);
        ask(LOG_FULL);
        pthread_mutex_lock(&writing);
        end = atomic_load(&answering->log_end);
    }
    if (end + head.bytes - asking->log_taken <= LOG_BYTES) {
        put(&end, &head, sizeof head);
        put(&end, category, c);
        put(&end, text, t);
        atomic_store(&answering->log_end, end);
    } else
        answering->log_lost++;
    pthread_mutex_unlock(&writing);
}

static void log12(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    (void)environment, (void)name;
    char text[MOST_TEXT];
    va_list values;
    va_start(values, format);
    if (format == NULL || vsnprintf(text, sizeof text, format, values) < 0)
        text[0] = '\0';
    va_end(values);
    write_message(0, status, category, text);
}

static void log3(void *environment, int status, const char *category, const char *text) {
    (void)environment;
    write_message(0, status, category, text);
}

static void step_finished(void *environment, int status) {
    (void)environment;
    write_message(1, status, "", "");
}

static void intermediate_update(void *environment, double time, bool set, bool get, bool finished, bool early, bool *requested, double *when) {
    (void)environment;
    if (requested != NULL)
        *requested = false;
    if (!pthread_equal(pthread_self(), here))
        return;
    answering->time = time;
    memcpy(answering->flags, (uint8_t[]){set, get, finished, early}, 4);
    const Record *said = ask(INTERMEDIATE_UPDATE);
    if (requested != NULL)
        *requested = said->arguments[0].value != 0;
    if (when != NULL && said->arguments[0].value != 0)
        memcpy(when, &said->arguments[1].value, sizeof *when);
}

static void clock_update(void *environment) {
    (void)environment;
    if (pthread_equal(pthread_self(), here))
        ask(CLOCK_UPDATE);
}

static void lock_preemption(void) {
    if (pthread_equal(pthread_self(), here))
        ask(LOCK_PREEMPTION);
}

static void unlock_preemption(void) {
    if (pthread_equal(pthread_self(), here))
        ask(UNLOCK_PREEMPTION);
}

static Callbacks callbacks = {(void *)log12, (void *)calloc, (void *)free, NULL, NULL};
static char environment[PAGE]; /* of zeros, for FMUs that read where it points to */

static void *callback(char code, uint64_t given) {
    switch (code) {
    case 'e': return given ? environment : NULL;
    case 'l': return (void *)log3;
    case 'u': return given ? (void *)intermediate_update : NULL;
    case 'C': return given ? (void *)clock_update : NULL;
    case 'L': return given ? (void *)lock_preemption : NULL;
    case 'U': return given ? (void *)unlock_preemption : NULL;
    default: /* 'k', bits: a finished step is heard, there is an environment */
        callbacks.step_finished = given & 1 ? (void *)step_finished : NULL;
        callbacks.environment = given & 2 ? environment : NULL;
        return &callbacks;
    }
}
