/* One instance of an FMU in a process of its own, as the proxy sees it: how its process is started, waited for and ended, and what is
   known of its end. Part of `proxy.c`.
 */
#include "interruption.h"

#include <spawn.h>

#define EXPORT __attribute__((visibility("default")))
#define LOOK_SECONDS 0.1 /* how often is looked whether the process is still there, while it is waited for */
#define PUT_AWAY_SECONDS 6.0
#define READ_AHEAD 48
#define MOST_INPUTS 8
#define LINE_BYTES 400

extern char **environ;

typedef struct {
    char program[PATH_MAX], library[PATH_MAX], folder[PATH_MAX], identifier[256];
    long processes, memory, files, file_bytes, output_bytes;
    const double *limit;   /* longest time of a call [s]; 0 for any */
    _Atomic long *running; /* processes like this one that the program has */
} Options;

typedef struct { /* a get that is made ahead, right behind the step */
    Record *record;
    bool called;    /* behind the last step */
    uint32_t number; /* of the last request that it was made in */
} ReadAhead;

typedef struct Session {
    struct Session *next;
    char *shared;
    Supervision *supervision;
    Asking *asking;
    Answering *answering;
    char *requests, *replies, *messages;
    pid_t supervisor, owner;
    int console;
    uint32_t number;
    Pace pace;
    size_t base, used, reply_used; /* where the request under way begins, ends, and its replies end */
    int waiting;                   /* sets in it that wait for the next call */
    int depth;                     /* callbacks that are being answered */
    bool dead, free, running, strict, clean; /* strict: no set waits any more. clean: only gets since the last step */
    ReadAhead ahead[READ_AHEAD];
    int ahead_count;
    size_t ahead_replies;
    size_t filled;        /* bytes of the record that is being written */
    uint32_t sent, stepped; /* numbers of the last request, and of the last step */
    uint64_t log_told;
    char name[256], *texts;
    const char *outside; /* what is done where no function of FMI is called */
    void *logger, *step_finished, *environment, *intermediate_update, *clock_update, *lock, *unlock;
    int version, input_count, input_function;
    uint32_t input_references[MOST_INPUTS];
    double inputs[MOST_INPUTS];
} Session;

static Options options;
static Session *sessions; /* all that are not freed */
static char reason[2048]; /* how the last process ended that did so against the rules */
static char printed[LINE_BYTES];
static Session *last_dead;

static Record *request_at(Session *s, size_t at) {
    return (Record *)(s->requests + at);
}

/* The line that the FMU printed last, past its logger. */
static void note_printed(const Session *s) {
    const off_t end = lseek(s->console, 0, SEEK_CUR);
    const off_t from = end > LINE_BYTES - 1 ? end - (LINE_BYTES - 1) : 0;
    const ssize_t count = end > 0 ? pread(s->console, printed, (size_t)(end - from), from) : 0;
    printed[count > 0 ? count : 0] = '\0';
}

static void say(const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(reason, sizeof reason, format, values);
    va_end(values);
}

static const char *signal_name(int number) {
    static const char *const names[64] = {
        [SIGABRT] = "SIGABRT", [SIGALRM] = "SIGALRM", [SIGBUS] = "SIGBUS", [SIGFPE] = "SIGFPE", [SIGHUP] = "SIGHUP", [SIGILL] = "SIGILL",
        [SIGINT] = "SIGINT", [SIGKILL] = "SIGKILL", [SIGPIPE] = "SIGPIPE", [SIGQUIT] = "SIGQUIT", [SIGSEGV] = "SIGSEGV", [SIGSYS] = "SIGSYS",
        [SIGTERM] = "SIGTERM", [SIGTRAP] = "SIGTRAP", [SIGXCPU] = "SIGXCPU", [SIGXFSZ] = "SIGXFSZ",
    };
    static char other[24];
    if (number > 0 && number < 64 && names[number] != NULL)
        return names[number];
    snprintf(other, sizeof other, "signal %d", number);
    return other;
}

static const char *called_function(const Session *s) {
    const int32_t current = s->answering->current;
    if (current >= 0 && current < FUNCTION_COUNT)
        return FUNCTIONS[current].name;
    return s->outside;
}

/* The process is gone, or has to go: say why, and take it for dead. */
static void note_death(Session *s, const char *why) {
    if (s->dead)
        return;
    s->dead = true;
    last_dead = s;
    const int code = s->supervision->code;
    const char *where = called_function(s);
    const uint32_t ended = atomic_load(&s->supervision->ended);
    if (why != NULL)
        say("%s %s", where, why);
    else if (ended == SIGNALLED && code == SIGXFSZ)
        say("its process was ended in %s: a file became larger than %ld bytes", where, options.file_bytes);
    else if (ended == SIGNALLED)
        say("its process ended with %s in %s", signal_name(code), where);
    else if (ended == EXITED)
        say("it ended its process with exit code %d in %s, which an FMU must not do", code, where);
    else if (ended == TOO_MANY_PROCESSES)
        say("its process was ended in %s: it started more than %ld processes", where, options.processes);
    else if (ended == TOO_MUCH_MEMORY)
        say("its process was ended in %s: it took more than %.3g GB of memory", where, (double)options.memory / 1e9);
    else
        say("its process and the one that watched it were ended from outside in %s", where);
    note_printed(s);
}

/* Whether the supervisor is gone, waited for `seconds` at most. */
static bool reaped(pid_t supervisor, double seconds) {
    for (const double until = now() + seconds;; usleep(200)) {
        const pid_t gone = waitpid(supervisor, NULL, WNOHANG);
        if (gone == supervisor || (gone < 0 && errno == ECHILD))
            return true;
        if (now() >= until)
            return false;
    }
}

/* End the process of a session, with all that it started. */
static void stop(Session *s) {
    if (s->supervisor <= 0 || s->owner != getpid()) /* a forked copy leaves it alone */
        return;
    if (!reaped(s->supervisor, 0.0)) {
        kill(s->supervisor, SIGTERM);
        if (!reaped(s->supervisor, PUT_AWAY_SECONDS)) {
            kill(s->supervisor, SIGKILL);
            waitpid(s->supervisor, NULL, 0);
        }
    }
    s->supervisor = 0;
}

/* How long a call may last: a little less than the limit, past which somebody else ends the whole program. */
static double patience_seconds(void) {
    const double limit = options.limit == NULL ? 0.0 : *options.limit;
    const double margin = limit * 0.1 < 0.2 ? limit * 0.1 : 0.2;
    return limit > 0.0 && limit < 1e9 ? limit - margin : 1e9;
}

static void note_overdue(Session *s) {
    char why[128];
    snprintf(why, sizeof why, "has not returned for %g s, the limit of a call, which call_timeout sets", *options.limit);
    note_death(s, why);
}

static void note_interrupted(Session *s) {
    note_death(s, "did not return when the run was interrupted, and its process was ended");
}

/* Sleep until it says something, its end or ours has come. */
static void sleep_for_answer(Session *s) {
    double until = now() + patience_seconds();
    for (bool asked = false;;) {
        atomic_store(&s->asking->sleeps, 1);
        const uint32_t seen = atomic_load(&s->answering->number);
        if (seen == s->number)
            return;
        if (atomic_load(&s->supervision->ended) != LIVES) {
            note_death(s, NULL);
            return;
        }
        if (interrupted && !asked && now() + STILL_SECONDS < until)
            until = now() + STILL_SECONDS;
        asked = interrupted;
        const double left = until - now();
        if (left <= 0.0 && asked)
            note_interrupted(s);
        else if (left <= 0.0)
            note_overdue(s);
        if (left <= 0.0)
            return;
        sleep_while(&s->answering->number, seen, left < LOOK_SECONDS ? left : LOOK_SECONDS);
        siginfo_t gone = {0};
        if (waitid(P_PID, (id_t)s->supervisor, &gone, WEXITED | WNOHANG | WNOWAIT) != 0 || gone.si_pid != 0) {
            if (atomic_load(&s->answering->number) != s->number)
                note_death(s, NULL);
            return;
        }
    }
}

/* Wait for what the process says next. False where it has ended, or took too long and was ended. */
static bool await(Session *s) {
    if (came_at_once(&s->pace, &s->answering->number, s->number))
        return true;
    const bool listens = listen_for_end();
    sleep_for_answer(s);
    if (listens)
        listen_no_longer();
    atomic_store(&s->asking->sleeps, 0);
    if (s->dead)
        stop(s);
    return !s->dead;
}

static void map(Session *s, int memory) {
    char *shared = mmap(NULL, FILE_BYTES, PROT_READ | PROT_WRITE, MAP_SHARED, memory, 0);
    if (shared == MAP_FAILED)
        return;
    s->shared = shared;
    s->supervision = (Supervision *)(shared + AT_SUPERVISION);
    s->asking = (Asking *)(shared + AT_ASKING);
    s->requests = shared + AT_REQUESTS;
    s->answering = (Answering *)(shared + AT_ANSWERING);
    s->replies = shared + AT_REPLIES;
    s->messages = shared + AT_LOG;
}

static int spawn(Session *s, int memory) {
    char words[5][24];
    const long numbers[5] = {getpid(), options.processes, options.memory, options.files, options.file_bytes};
    for (int k = 0; k < 5; k++)
        snprintf(words[k], sizeof words[k], "%ld", numbers[k]);
    char *arguments[] = {options.program, options.library, options.folder, options.identifier, words[0], words[1], words[2], words[3], words[4], NULL};
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&files, s->console, 1);
    posix_spawn_file_actions_adddup2(&files, s->console, 2);
    posix_spawn_file_actions_adddup2(&files, memory, 3);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    const int error = posix_spawn(&s->supervisor, options.program, &files, &attributes, arguments, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (error != 0)
        s->supervisor = 0;
    return error;
}

/* A file in memory that keeps its size, under a number past those that the child uses for itself. */
static int memory_file(const char *name, long bytes) {
    const int made = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING), moved = made < 0 ? -1 : fcntl(made, F_DUPFD_CLOEXEC, 10);
    if (made >= 0)
        close(made);
    if (moved >= 0 && (ftruncate(moved, bytes) != 0 || fcntl(moved, F_ADD_SEALS, F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) != 0)) {
        close(moved);
        return -1;
    }
    return moved;
}

static void close_session(Session *s) {
    stop(s);
    for (Session **at = &sessions; *at != NULL; at = &(*at)->next)
        if (*at == s) {
            *at = s->next;
            break;
        }
    if (last_dead == s)
        last_dead = NULL;
    if (s->shared != NULL)
        munmap(s->shared, FILE_BYTES);
    if (s->console >= 0)
        close(s->console);
    free(s->texts);
    free(s);
    atomic_fetch_sub(options.running, 1);
}

/* A process that has loaded the FMU; NULL, with the reason, where there is none. */
static Session *open_session(void) {
    Session *s = calloc(1, sizeof *s);
    atomic_fetch_add(options.running, 1);
    s->owner = getpid();
    s->free = true;
    s->outside = "loading its library";
    s->next = sessions;
    sessions = s;
    const int memory = memory_file("fmu", FILE_BYTES);
    s->console = memory_file("fmu-console", options.output_bytes);
    if (memory >= 0)
        map(s, memory);
    int error = errno;
    if (s->console >= 0 && s->shared != NULL) {
        s->answering->current = -1;
        error = spawn(s, memory);
    }
    if (memory >= 0)
        close(memory);
    set_pace(&s->pace, options.running);
    s->number = 1;
    s->base = s->used = s->reply_used = AHEAD_BYTES;
    if (s->supervisor == 0)
        say("its process cannot be started: %s", strerror(error));
    else if (await(s) && !s->answering->loaded) {
        s->answering->why_not[sizeof s->answering->why_not - 1] = '\0';
        say("%s", s->answering->why_not);
    }
    if (s->supervisor != 0 && !s->dead && s->answering->loaded) {
        s->outside = "no call";
        return s;
    }
    close_session(s);
    return NULL;
}
