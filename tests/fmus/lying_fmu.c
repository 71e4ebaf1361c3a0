/* A small FMI 2.0 FMU, co-simulation and model exchange, honest unless a LIE_... macro says otherwise: dp = v, dv = force - v / 2.
 *
 * A counted event `pulse` raises the speed by one at its stamp. The tests of `fmus check` compile it once for each lie.
 */
#define _GNU_SOURCE
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#if defined LIE_FLUSHES
#include <xmmintrin.h>
#endif

#include "fmi2Functions.h"

enum { FORCE = 1, POSITION = 2, SPEED = 3, RATE = 4, PULSE_TIME = 5, PULSE_COUNT = 6, NUMBER = 7 };

typedef struct {
    double value[NUMBER]; /* by value reference; 0 is not used */
    double late;         /* LIE_INPUT_LATE: the force of the step before */
    double hidden[2];    /* forces on their way: each acts a step later */
    double time;
    double pulses; /* counted events that have happened: each adds one to the speed */
    double latched; /* LIE_LATCHES: a force of more than 5 was there, and all forces act by half from then on */
} Data;

typedef struct {
    Data data;
    double own_time; /* LIE_OWN_STEP: how far it has really come */
    double spoiled;  /* LIE_RESET_KEEPS: survives a reset */
    int logging;
    int has_thread;     /* LIE_THREAD: one writes its outputs between the calls, */
    pthread_t thread;
    volatile int freed; /* until this is set */
    int initialised;    /* LIE_REFUSES_EARLY_READING */
} Instance;

static double announced_end; /* LIE_STRICT_END, which is no lie: no step goes beyond it, not by a rounding */
static double shared; /* LIE_SHARED: the steps of all instances since one of them began */

#define DATA(c) (((Instance *)(c))->data)

static void begin(Instance *instance) {
    memset(&instance->data, 0, sizeof instance->data);
    instance->data.value[SPEED] = 1.0;
#ifdef LIE_OTHER_START
    instance->data.value[SPEED] = 2.0;
#endif
    instance->own_time = shared = 0.0;
#ifdef LIE_NAN_AT_START
    instance->data.value[POSITION] = NAN;
#endif
#ifdef LIE_RESET_KEEPS
    instance->data.value[SPEED] += instance->spoiled;
#endif
}

static void flow(Instance *instance, double h) {
    Data *d = &instance->data;
    double force = d->value[FORCE];
#ifdef LIE_SHARED
    force += 1e-3 * shared++;
#endif
#ifdef LIE_INPUT_LATE
    const double now = force;
    force = d->late;
    d->late = now;
#endif
#if defined LIE_HALF_RESTORED
    double held = d->hidden[0];
    d->hidden[0] = d->hidden[1];
    d->hidden[1] = force;
    force = held;
#endif
#ifdef LIE_LOGGING_CHANGES
    force += instance->logging ? 1e-6 : 0.0;
#endif
#ifdef LIE_LATCHES
    d->latched = d->latched || force > 5.0;
    force *= d->latched ? 0.5 : 1.0;
#endif
    const double decay = exp(-0.5 * h), limit = 2.0 * force, v = d->value[SPEED];
    d->value[POSITION] += limit * h + (v - limit) * (1.0 - decay) * 2.0;
    d->value[SPEED] = limit + (v - limit) * decay;
#ifdef LIE_NAN_MUCH_LATER
    if (d->time > 0.7)
        d->value[SPEED] = NAN;
#endif
#ifdef LIE_NAN_LATER
    if (d->time > 0.2)
        d->value[SPEED] = NAN;
#endif
}

/* By h, with the event that is announced, if there is one, at its stamp. */
static void move(Instance *instance, double h) {
    Data *d = &instance->data;
    double until = d->value[PULSE_COUNT] > d->pulses ? d->value[PULSE_TIME] - d->time : 0.0;
#ifdef LIE_LATE_EVENT
    until = h;
#endif
    if (d->value[PULSE_COUNT] > d->pulses) {
        flow(instance, until);
        d->value[SPEED] += 1.0;
        d->pulses = d->value[PULSE_COUNT];
        h -= until;
    }
    flow(instance, h);
}

/* -- life ---------------------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) { return fmi2OK; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
#ifdef LIE_READS_ENVIRONMENT /* no lie: it may be NULL, or memory that it may read */
    if (functions->componentEnvironment != NULL && *(volatile int *)functions->componentEnvironment != 0)
        return NULL;
#endif
#ifdef LIE_CRASH_AT_START
    abort();
#endif
#ifdef LIE_LEAKS_FILES
    if (fopen("/dev/null", "r") == NULL)
        return NULL;
#endif
#ifdef LIE_LEAKS_MEMORY
    memset(malloc(100000), 1, 100000);
#endif
#ifdef LIE_LEAKS_LITTLE
    memset(malloc(30000), 1, 30000);
#endif
#ifdef LIE_DAEMON
    if (fork() == 0) {
        setsid();
        if (fork() == 0)
            for (;;)
                pause();
        _exit(0);
    }
#endif
    Instance *instance = calloc(1, sizeof *instance);
    instance->logging = logging;
#ifdef LIE_ESCAPES
    functions->logger(functions->componentEnvironment, name, fmi2Error, "log", "\033]0;owned\007\033[31mred\302\233 and\nforged");
#endif
    begin(instance);
    return instance;
}

void fmi2FreeInstance(fmi2Component c) {
#ifdef LIE_CRASH_FREED
    *(volatile int *)(size_t)8 = 1;
#endif
    Instance *instance = c;
    instance->freed = 1;
    if (instance->has_thread) /* it runs no code of a library that is unloaded */
        pthread_join(instance->thread, NULL);
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real start, fmi2Boolean sd, fmi2Real stop) {
    DATA(c).time = start;
    announced_end = sd ? stop : INFINITY;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
#if defined LIE_REFUSES_START || defined LIE_ESCAPES
    return fmi2Error;
#endif
    ((Instance *)c)->initialised = 1;
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) {
#ifdef LIE_HANG_TERMINATED
    for (;;)
        pause();
#endif
#ifdef LIE_REFUSES_END
    return fmi2Error;
#endif
    return fmi2OK;
}
fmi2Status fmi2Reset(fmi2Component c) {
    Instance *instance = c;
    instance->spoiled = 0.1;
    instance->initialised = 0;
    begin(instance);
    return fmi2OK;
}

/* -- values -------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    Data *d = &DATA(c);
#ifdef LIE_REFUSES_EARLY_READING
    if (!((Instance *)c)->initialised)
        return fmi2Error;
#endif
    for (size_t i = 0; i < n; i++) {
#ifdef LIE_GETTER
        if (vr[i] == RATE)
            return fmi2Error;
#endif
        d->value[RATE] = d->value[FORCE] - 0.5 * d->value[SPEED];
        value[i] = d->value[vr[i]];
    }
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
#ifdef LIE_BOUNDS_INPUT
        DATA(c).value[vr[i]] = value[i] > 0.125 ? 0.125 : value[i];
#else
        DATA(c).value[vr[i]] = value[i];
#endif
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++)
        value[i] = (int)DATA(c).value[vr[i]];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++)
        DATA(c).value[vr[i]] = value[i];
    return fmi2OK;
}

#define VALUES(Kind, Type)                                                                                                  \
    fmi2Status fmi2Get##Kind(fmi2Component c, const fmi2ValueReference vr[], size_t n, Type value[]) { return fmi2Error; } \
    fmi2Status fmi2Set##Kind(fmi2Component c, const fmi2ValueReference vr[], size_t n, const Type value[]) { return fmi2Error; }
VALUES(Boolean, fmi2Boolean)
VALUES(String, fmi2String)

/* -- state --------------------------------------------------------------------------------------------------------- */

#ifndef LIE_NO_STATE_SYMBOLS
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    *state = malloc(sizeof(Data));
    memcpy(*state, &DATA(c), sizeof(Data));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    Data *d = &DATA(c);
#ifdef LIE_HALF_RESTORED
    memcpy(((Data *)state)->hidden, d->hidden, sizeof d->hidden);
#endif
    memcpy(d, state, sizeof *d);
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}
#endif
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    *size = sizeof(Data);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    memcpy(bytes, state, sizeof(Data));
#ifdef LIE_SERIALISES_HALF
    memset(bytes, 0, sizeof(double) * (SPEED + 1));
#endif
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    *state = malloc(sizeof(Data));
    memcpy(*state, bytes, sizeof(Data));
    return fmi2OK;
}

/* Outputs along the force are zero between steps, the derivative of the speed is one; speed: see move. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t nu,
                                        const fmi2ValueReference known[], size_t nk, const fmi2Real dk[], fmi2Real du[]) {
    for (size_t i = 0; i < nu; i++) {
        du[i] = 0.0;
        for (size_t j = 0; j < nk; j++) {
            const int rate = unknown[i] == RATE;
            du[i] += dk[j] * (unknown[i] == known[j] ? 1.0 : rate && known[j] == FORCE ? 1.0 : rate && known[j] == SPEED ? -0.5 : 0.0);
        }
#ifdef LIE_DERIVATIVE
        if (unknown[i] == RATE)
            du[i] *= 1.01;
#endif
    }
    return fmi2OK;
}

/* -- harm to the process, in each step --------------------------------------------------------------------------------- */

static void handle(int number) { (void)number; }

static void *write_on(void *instance) { /* as long as there is the instance, so that no load of the machine hides it */
    while (!((Instance *)instance)->freed) {
        usleep(5000);
        DATA(instance).value[SPEED] += 1e-3;
    }
    return NULL;
}

static void do_harm(Instance *instance) {
    (void)instance;
#ifdef LIE_MOVES
    if (chdir("/") != 0)
        abort();
#endif
#ifdef LIE_ROUNDS
    fesetround(FE_UPWARD);
#endif
#ifdef LIE_FLUSHES
    _mm_setcsr(_mm_getcsr() | 0x8040);
#endif
#ifdef LIE_LOCALISES
    setlocale(LC_ALL, "C");
#endif
#ifdef LIE_TAKES_INTERRUPTS
    signal(SIGINT, handle);
#endif
#ifdef LIE_HANDLES_SIGNALS
    signal(SIGTERM, handle);
#endif
#ifdef LIE_LOWERS_LIMITS
    struct rlimit limit;
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = 100;
    setrlimit(RLIMIT_NOFILE, &limit);
#endif
#ifdef LIE_SETS_ENVIRONMENT
    setenv("LIAR_HOME", "/tmp", 1);
#endif
#ifdef LIE_FORGETS_ENVIRONMENT
    unsetenv("HOME");
#endif
#ifdef LIE_CLOSES_OUTPUT
    close(1);
#endif
#ifdef LIE_CLOSES_INPUT
    close(0);
#endif
#ifdef LIE_CLOSES_ALL
    for (int i = 3; i < 256; i++)
        close(i);
#endif
#ifdef LIE_MASKS
    umask(0777);
#endif
#ifdef LIE_LEAKS_STEPS
    memset(malloc(100000000), 1, 100000000);
#endif
#ifdef LIE_LEAKS_QUIETLY
    ((char *)malloc(100000000))[0] = 1;
#endif
#ifdef LIE_THREAD
    if (!instance->has_thread)
        instance->has_thread = pthread_create(&instance->thread, NULL, write_on, instance) == 0;
#endif
}

/* -- co-simulation ------------------------------------------------------------------------------------------------- */

#define STEP 0.01

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Instance *instance = c;
#ifdef LIE_STRICT_END
    if (t + h > announced_end)
        return fmi2Error;
#endif
#ifdef LIE_FORKS
    if (fork() == 0)
        for (;;)
            pause();
#endif
#ifdef LIE_FORKS_COPIES
    fork();
#endif
#ifdef LIE_EATS_MEMORY
    memset(malloc(20000000), 1, 20000000);
#endif
#ifdef LIE_ENDS
    if (t + h > 0.305)
        return fmi2Discard;
#endif
#ifdef LIE_OPENS_FILES
    if (fopen("/dev/null", "r") == NULL)
        return fmi2Error;
#endif
#ifdef LIE_WRITES_FILE
    FILE *file = fopen("own.log", "a");
    fprintf(file, "%g\n", t);
    fclose(file);
#endif
    do_harm(instance);
#ifdef LIE_STEPS_ONLY_AHEAD
    if (!no_set_state) {
        instance->data.time = t + h;
        return fmi2OK;
    }
#endif
#ifdef LIE_FIRST_STEP_LOST
    if (instance->data.time < 1e-9) {
        instance->data.time = t + h;
        return fmi2OK;
    }
#endif
#ifdef LIE_CRASH_IN_STEP
    *(volatile int *)(size_t)8 = 1;
#endif
#ifdef LIE_HANG
    for (;;)
        sleep(1);
#endif
#ifdef LIE_EXITS
    exit(3);
#endif
#ifdef LIE_PRINTS
    printf("stepping to %g\n", t + h);
    fflush(stdout);
#endif
#ifdef LIE_CRASH_ON_ZERO
    if (h == 0.0)
        abort();
#endif
#ifndef LIE_ACCEPTS_ANYTHING
    if (h <= 0.0 || fabs(t - instance->data.time) > 1e-9 * (1.0 + fabs(t)))
        return fmi2Error;
#endif
#if defined LIE_UNSHORTENED
    move(instance, h < STEP ? STEP : h);
#elif defined LIE_OWN_STEP
    for (; instance->own_time < t + h - 1e-9; instance->own_time += STEP)
        move(instance, STEP);
#else
    move(instance, h);
#endif
    instance->data.time = t + h;
#ifdef LIE_WARNS
    if (t > 0.1)
        return fmi2Warning;
#endif
    return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real value[]) {
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[]) {
    return fmi2Error;
}
#define STATUS(Kind, Type) \
    fmi2Status fmi2Get##Kind(fmi2Component c, const fmi2StatusKind kind, Type *value) { return fmi2Error; }
STATUS(Status, fmi2Status)
STATUS(RealStatus, fmi2Real)
STATUS(IntegerStatus, fmi2Integer)
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    *value = kind == fmi2Terminated;
    return fmi2OK;
}
STATUS(StringStatus, fmi2String)

/* -- model exchange ------------------------------------------------------------------------------------------------ */

fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    return fmi2OK;
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state, fmi2Boolean *event, fmi2Boolean *end) {
    *event = *end = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    DATA(c).time = time;
    return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
#ifndef LIE_STATES_NOT_SET
    DATA(c).value[POSITION] = x[0];
    DATA(c).value[SPEED] = x[1];
#endif
    return fmi2OK;
}
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    x[0] = DATA(c).value[POSITION];
    x[1] = DATA(c).value[SPEED];
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    dx[0] = DATA(c).value[SPEED];
    dx[1] = DATA(c).value[FORCE] - 0.5 * DATA(c).value[SPEED];
#ifdef LIE_DERIVATIVES_DRIFT
    DATA(c).value[FORCE] += 1e-9;
#endif
#ifdef LIE_NAN_DERIVATIVE
    dx[1] = NAN;
#endif
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { return fmi2OK; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; i++)
        x[i] = 1.0;
    return fmi2OK;
}
