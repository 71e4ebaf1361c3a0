/* Where a process works while it is asked, and how it is waited for. Part of `proxy.c`.

   Either on another core: each looks for the other's message, and a call costs less than half a microsecond. Or in turns on the core of who
   asks: one sleeps while the other works, which costs a switch each way, two microseconds in all; to wake somebody who sleeps on another core
   costs some 50. With more FMUs than cores to spare they take turns. Else it depends on what other programs do, and on how much time lies between
   two calls: both are tried, another core first for as long as it costs no more than taking turns; then thousands of calls have to show it.
 */
#include "shared.h"

#define WINDOW 32 /* calls, each of them measured */
#define FIRST_CALLS 2 /* at another place: they include the change */
#define FIRST_PAUSE 512
#define SHORTEST_PAUSE 4096 /* calls that are measured as one */
#define LONGEST_PAUSE 262144
#define CAPPED 1e-3  /* of one call [s]: what else delays it says nothing of the place */
#define LONG_CALL 5e-4 /* where the place does not matter, threads of the FMU may use all cores */
#define YIELDS 20

enum { ANY_CORE, THIS_CORE, OTHER_CORE }; /* this one is the one of who asks */
enum { PAUSE, PRESENT_PLACE, OTHER_PLACE };
typedef struct {
    int place, placed, core; /* of the process: where it should be, where it is, beside or on which core */
    cpu_set_t cores;       /* all */
    long spare;            /* cores beside the one of who asks */
    const _Atomic long *processes; /* of isolated FMUs of this program */
    bool proving;          /* this pause shows whether the new place is better than the one before */
    int phase, calls;      /* calls: of this phase */
    int pause;             /* how many calls the next pause lasts */
    double since, seconds; /* of this window; since: when the present call began, or the pause [s] */
    double turns, call;    /* seconds of the window of turns; of a call at the place before, with all that is done between two */
} Pace;

static void enter(Pace *p, int phase, int place) {
    p->phase = phase;
    p->place = place;
    p->calls = 0;
    p->seconds = 0.0;
    p->since = now();
}

static void set_pace(Pace *p, const _Atomic long *processes) {
    p->processes = processes;
    p->spare = sched_getaffinity(0, sizeof p->cores, &p->cores) != 0 ? 0 : CPU_COUNT(&p->cores) - 1;
    p->placed = ANY_CORE;
    p->place = p->spare > 0 ? ANY_CORE : THIS_CORE;
}

static bool may_choose(const Pace *p) {
    return atomic_load_explicit(p->processes, memory_order_relaxed) <= p->spare;
}

/* Have the process work at its place from now on; while it sleeps that costs little. */
static void put_in_place(Pace *p, pid_t process) {
    const int core = p->place == ANY_CORE ? 0 : sched_getcpu();
    if ((p->place == p->placed && core == p->core) || process == 0 || p->spare == 0)
        return;
    cpu_set_t cores = p->cores;
    if (p->place == OTHER_CORE)
        CPU_CLR((size_t)core, &cores);
    if (p->place == THIS_CORE) {
        CPU_ZERO(&cores);
        CPU_SET((size_t)core, &cores);
    }
    sched_setaffinity(process, sizeof cores, &cores);
    p->placed = p->place;
    p->core = core;
}

/* From the first step on. */
static void begin_pace(Pace *p) {
    p->pause = FIRST_PAUSE;
    enter(p, PAUSE, THIS_CORE);
}

/* Whether a message comes while one looks for it, or lets others have this core. */
static inline bool came_at_once(const Pace *p, _Atomic uint32_t *word, uint32_t number) {
    if (p->place != THIS_CORE)
        return comes_soon(word, number, LOOKS);
    for (int k = 0; k < YIELDS; k++) {
        if (atomic_load_explicit(word, memory_order_acquire) == number)
            return true;
        sched_yield();
    }
    return false;
}

static void prove(Pace *p, int place) {
    p->proving = true;
    enter(p, PAUSE, place);
}

/* Back to the place of before, for longer than the last time. */
static void go_back(Pace *p) {
    p->pause = p->pause < SHORTEST_PAUSE ? SHORTEST_PAUSE : p->pause < LONGEST_PAUSE ? 4 * p->pause : p->pause;
    enter(p, PAUSE, p->place == OTHER_CORE ? THIS_CORE : OTHER_CORE);
}

static void end_pause(Pace *p) {
    const double call = (now() - p->since) / p->calls;
    const bool proved = p->proving && call < p->call;
    if (p->proving && !proved) {
        p->proving = false;
        go_back(p);
        return;
    }
    p->proving = false;
    p->pause = proved ? SHORTEST_PAUSE : p->pause;
    p->call = call;
    if (!may_choose(p) && p->place != ANY_CORE)
        enter(p, PAUSE, THIS_CORE);
    else if (p->place == OTHER_CORE)
        prove(p, THIS_CORE);
    else
        enter(p, PRESENT_PLACE, p->place);
}

static void end_measured_call(Pace *p, double lasted) {
    if (p->calls > FIRST_CALLS || lasted > CAPPED)
        p->seconds += lasted < CAPPED ? lasted : CAPPED;
    const bool full = p->calls == FIRST_CALLS + WINDOW;
    if (p->phase == OTHER_PLACE && p->seconds > p->turns)
        go_back(p);
    else if (p->phase == OTHER_PLACE && full)
        prove(p, OTHER_CORE);
    else if (full && p->seconds > WINDOW * LONG_CALL)
        enter(p, PAUSE, ANY_CORE);
    else if (full && p->place == ANY_CORE)
        enter(p, PAUSE, THIS_CORE);
    else if (full) {
        p->turns = p->seconds;
        enter(p, OTHER_PLACE, OTHER_CORE);
    }
}

static inline void begin_call(Pace *p) {
    if (p->phase != PAUSE)
        p->since = now();
}

static inline void end_call(Pace *p) {
    p->calls++;
    if (p->place == OTHER_CORE && !may_choose(p))
        enter(p, PAUSE, THIS_CORE); /* others came meanwhile */
    else if (p->phase != PAUSE)
        end_measured_call(p, now() - p->since);
    else if (p->calls >= (p->proving ? SHORTEST_PAUSE : p->pause))
        end_pause(p);
}
