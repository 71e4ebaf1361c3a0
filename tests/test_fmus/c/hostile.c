/* An integrator, y' = 1, that does harm to the process at the time `at` or at the end of its life; `deed` says what. FMI 2 and 3.
   A variable of the environment lets it hang where its library is loaded, before anything can be set.
 */
#define _GNU_SOURCE
#include "test_fmus.h"

#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    NOTHING, EXITS, EXITS_AT_ONCE, CRASHES, HANGS, CRASHES_FREED, CRASHES_TERMINATED, EXITS_FREED, MOVES, ROUNDS, PAINTS, INTERRUPTS,
    BOUNDS, OVERWRITES, WARNS, HANGS_FREED, HANGS_TERMINATED, FAILS_TERMINATED, CLOSES, DEAFENS, LOCALISES,
    SETS_VARIABLE, HANDLES, LOWERS_LIMITS, MASKS, CLOSES_OPENED, CLOSES_ALL,
};
#define BOUND 0.3 /* of BOUNDS: `at` is no later */

typedef struct {
    double time, deed, at, y;
} Model;

#include "plain.h"

#define LEAVING(event, model) leave(event, model)
#define END_STATUS(model) ((int)(model)->deed == FAILS_TERMINATED ? fmi2Error : fmi2OK)
enum { TIME = 0, DEED = 1, AT_TIME = 2, Y = 3 };
enum { TERMINATED, FREED };

__attribute__((constructor)) static void loaded(void) {
    if (getenv("HOSTILE_HANGS_WHERE_IT_IS_LOADED") != NULL)
        for (;;)
            pause();
}

static void model_start(Model *m) { m->at = 0.25; }

static void model_begin(Model *m, double t0) {
    m->time = t0;
    if ((int)m->deed == BOUNDS && m->at > BOUND)
        m->at = BOUND;
}

VARIABLES(
    VARIABLE(DEED, F64, PARAMETER, deed)
    VARIABLE(AT_TIME, F64, PARAMETER, at)
    VARIABLE(Y, F64, OUTPUT, y))

NOTHING_TO_REFRESH

static void leave(int event, const Model *m) {
    int deed = (int)m->deed;
    if (deed == (event == FREED ? CRASHES_FREED : CRASHES_TERMINATED))
        raise(SIGSEGV);
    if (deed == (event == FREED ? HANGS_FREED : HANGS_TERMINATED))
        for (;;)
            pause();
    if (deed == EXITS_FREED && event == FREED)
        exit(0);
}

static void lower_limit(void) {
    struct rlimit limit;
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = 200;
    setrlimit(RLIMIT_NOFILE, &limit);
}

static void close_from(int first) {
    for (int i = first; i < 1024; i++)
        close(i);
}

static void do_harm(Host *host, int deed) {
    switch (deed) {
    case EXITS: exit(0);
    case EXITS_AT_ONCE: _exit(0);
    case CRASHES: raise(SIGSEGV); break;
    case HANGS: for (;;) pause();
    case MOVES: if (chdir("/") != 0) abort(); break;
    case ROUNDS: fesetround(FE_UPWARD); break;
    case PAINTS: SAY(host, WARNING, "logStatusWarning", "\033]0;owned\007\033[31mred"); break;
    case CLOSES: close(1); break;
    case DEAFENS: signal(SIGINT, SIG_IGN); break;
    case LOCALISES: setlocale(LC_ALL, "C"); break;
    case SETS_VARIABLE: setenv("TEST_FMUS_HOSTILE", "1", 1); break;
    case HANDLES: signal(SIGUSR2, SIG_IGN); break;
    case LOWERS_LIMITS: lower_limit(); break;
    case MASKS: umask(0777); break;
    case CLOSES_OPENED: close_from(3); break;
    case CLOSES_ALL: close_from(0); break;
    case INTERRUPTS: kill(getpid(), SIGINT); break;
    default: break;
    }
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    if (t < m->at - SAME && until >= m->at - SAME)
        do_harm(host, (int)m->deed);
    if ((int)m->deed == OVERWRITES)
        m->at = BOUND;
    m->y += until - t;
    m->time = until;
    return (Outcome){.status = (int)m->deed == WARNS && t >= m->at - SAME ? WARNING : OK, .reached = until};
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
    return (Update){0};
}

#include "face.h"
