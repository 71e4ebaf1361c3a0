/* An integrator, y' = 1, that does harm to the process at the time `at` or at the end of its life; `deed` says what. FMI 2 and 3.
 */
#define _GNU_SOURCE
#include "test_fmus.h"

#include <fenv.h>
#include <signal.h>
#include <unistd.h>

enum { NOTHING, EXITS, EXITS_AT_ONCE, CRASHES, HANGS, CRASHES_FREED, CRASHES_TERMINATED, EXITS_FREED, MOVES, ROUNDS, PAINTS, INTERRUPTS };

typedef struct {
    double time, deed, at, y;
} Model;

typedef struct {
    char none;
} Scratch;

#include "host.h"

#define HAS_STRUCTURE 0
#define HAS_INTERVALS 0
#define LEAVING(event, model) leave(event, model)
enum { TIME = 0, DEED = 1, AT_TIME = 2, Y = 3 };
enum { TERMINATED, FREED };

static void model_start(Model *m) { m->at = 0.25; }
static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    switch (reference) {
    case TIME: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    case DEED: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->deed, .size = 1};
    case AT_TIME: return (Slot){.kind = F64, .role = PARAMETER, .at = &m->at, .size = 1};
    case Y: return (Slot){.kind = F64, .role = OUTPUT, .at = &m->y, .size = 1};
    default: return (Slot){0};
    }
}

static void model_refresh(Model *m) { (void)m; }

static void leave(int event, const Model *m) {
    int deed = (int)m->deed;
    if (deed == (event == FREED ? CRASHES_FREED : CRASHES_TERMINATED))
        raise(SIGSEGV);
    if (deed == EXITS_FREED && event == FREED)
        exit(0);
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
    case INTERRUPTS: kill(getpid(), SIGINT); break;
    default: break;
    }
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    if (t < m->at - 1e-12 && until >= m->at - 1e-12)
        do_harm(host, (int)m->deed);
    m->y += until - t;
    m->time = until;
    return (Outcome){.reached = until};
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
    return (Update){0};
}

#include "face.h"
