/* Model exchange FMUs of FMI 1, 2 and 3 (VERSION), each a few lines of model (MODEL_...): what a solver and events must meet.
   Variables: 1 first state, 2 second state, 3 input, 4 and 5 their derivatives, 6 a count. Parameters: none. */
#include "config.h"
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#pragma GCC diagnostic ignored "-Wunused-parameter" /* of functions that FMI fixes */
#pragma GCC visibility push(default)

typedef struct {
    double t, x[2], u, due;
    int count, wants_event;
} Model;

#if defined(MODEL_DECAY) /* dx/dt = -x + u: closed form */
#define STATES 1
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 1.0; }
static int rates(Model *m, double *dx) { dx[0] = m->u - m->x[0]; return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }

#elif defined(MODEL_BALL) /* bounces off the floor with 0.7 of its speed, for ever */
#define STATES 2
#define INDICATORS 1
static void start(Model *m) { m->x[0] = 1.0; m->x[1] = 0.0; }
static int rates(Model *m, double *dx) { dx[0] = m->x[1]; dx[1] = m->u - 9.81; return 0; }
static void indicate(Model *m, double *z) { z[0] = m->x[0]; }
static bool iterate(Model *m) {
    if (m->x[0] <= 0.0 && m->x[1] < 0.0) { m->x[0] = 0.0; m->x[1] *= -0.7; m->count++; }
    return false;
}

#elif defined(MODEL_TRAIN) /* position and speed under an effort per mass: what balises are found on */
#define STATES 2
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 0.0; m->x[1] = 10.0; }
static int rates(Model *m, double *dx) { dx[0] = m->x[1]; dx[1] = m->u - 0.02 * m->x[1]; return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }

#elif defined(MODEL_STAIR) /* counts at 0.3 s, 0.6 s, ...; asks for the end at the tenth */
#define STATES 0
#define INDICATORS 0
static void start(Model *m) { m->due = 0.3; }
static int rates(Model *m, double *dx) { return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) {
    if (m->t >= m->due) { m->count++; m->due = 0.3 * (m->count + 1); }
    return false;
}
#define ENDS(m) ((m)->count >= 10)

#elif defined(MODEL_STEPS) /* wants an event after the first solver step behind 0.5 s: x jumps to 2 */
#define STATES 1
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 1.0; }
static int rates(Model *m, double *dx) { dx[0] = -m->x[0]; return 0; }
static void indicate(Model *m, double *z) {}
#define WANTS_EVENT(m) ((m)->t > 0.5 && (m)->count == 0)
static bool iterate(Model *m) {
    if (m->t > 0.5 && m->count == 0) { m->x[0] = 2.0; m->count = 1; }
    return false;
}

#elif defined(MODEL_CHATTERS) /* its event is due again at once, for ever */
#define STATES 0
#define INDICATORS 0
static void start(Model *m) { m->due = 0.25; }
static int rates(Model *m, double *dx) { return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { m->count++; m->due = m->t > 0.25 ? m->t : 0.25; return false; }

#elif defined(MODEL_UNSETTLED) /* every event iteration asks for another one, once the input is above 1 */
#define STATES 0
#define INDICATORS 0
static void start(Model *m) {}
static int rates(Model *m, double *dx) { return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return m->u > 1.0; }

#elif defined(MODEL_ESCAPES) /* dx/dt = x^2 is infinite at 1 s; the second state rests */
#define STATES 2
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 0.0; m->x[1] = 1.0; }
static int rates(Model *m, double *dx) { dx[0] = 0.0; dx[1] = m->x[1] * m->x[1]; return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }

#elif defined(MODEL_OSCILLATES) /* van der Pol, stiff: x'' = 1000 (1 - x^2) x' - x */
#define STATES 2
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 2.0; m->x[1] = 0.0; }
static int rates(Model *m, double *dx) {
    dx[0] = m->x[1];
    dx[1] = 1e3 * (1.0 - m->x[0] * m->x[0]) * m->x[1] - m->x[0];
    return 0;
}
#define SLOPES
static double slope(Model *m, unsigned rate, unsigned state) {
    if (rate == 4) return state == 2;
    double exact = state == 1 ? -2e3 * m->x[0] * m->x[1] - 1.0 : 1e3 * (1.0 - m->x[0] * m->x[0]);
#if defined(LIE_ALWAYS)
    return -exact;
#elif defined(LIE_LATER)
    return m->t > 0.5 ? 1e9 * exact : exact;
#else
    return exact;
#endif
}
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }

#elif defined(MODEL_REACTION) /* Robertson: slow, very fast and fast; the third is what the other two leave of one */
#define STATES 2
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 1.0; m->x[1] = 0.0; }
static int rates(Model *m, double *dx) {
    double a = m->x[0], b = m->x[1];
    dx[0] = -0.04 * a + 1e4 * b * (1.0 - a - b);
    dx[1] = -dx[0] - 3e7 * b * b;
    return 0;
}
#define SLOPES
static double slope(Model *m, unsigned rate, unsigned state) {
    double a = m->x[0], b = m->x[1], first = state == 1 ? -0.04 - 1e4 * b : 1e4 * (1.0 - a - 2.0 * b);
    return rate == 4 ? first : -first - (state == 2 ? 6e7 * b : 0.0);
}
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }

#elif defined(MODEL_REMEMBERS) /* dx/dt = -x + the largest input that it saw, which no variable shows */
#define STATES 1
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 1.0; }
static int rates(Model *m, double *dx) { dx[0] = m->count - m->x[0]; return 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) {
    if (m->u > m->count) m->count = (int)m->u;
    return false;
}

#else /* MODEL_REFUSES: its derivatives are an error from 0.5 s on */
#define STATES 1
#define INDICATORS 0
static void start(Model *m) { m->x[0] = 1.0; }
static int rates(Model *m, double *dx) { dx[0] = 1.0; return m->t > 0.5 ? 3 : 0; }
static void indicate(Model *m, double *z) {}
static bool iterate(Model *m) { return false; }
#endif

#ifndef WANTS_EVENT
#define WANTS_EVENT(m) false
#endif
#ifndef ENDS
#define ENDS(m) false
#endif

static double get(Model *m, unsigned vr) {
    double dx[2] = {0.0, 0.0};
    rates(m, dx);
    return vr == 1 ? m->x[0] : vr == 2 ? m->x[1] : vr == 3 ? m->u : vr == 4 ? dx[0] : dx[1];
}

static Model *make(void) {
    Model *m = calloc(1, sizeof(Model));
    m->due = INFINITY;
    start(m);
    return m;
}

#if defined(ARRAYS) /* both states are one variable, and both derivatives */
#define WIDTH(vr) ((vr) == 1 || (vr) == 4 ? 2u : 1u)
#else
#define WIDTH(vr) 1u
#endif

static int reals(Model *m, const unsigned *vr, size_t n, double *values) {
    for (size_t i = 0; i < n; i++)
        for (unsigned k = 0; k < WIDTH(vr[i]); k++) *values++ = get(m, vr[i] + k);
    return 0;
}

static int set_reals(Model *m, const unsigned *vr, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) {
        if (vr[i] == 3) m->u = values[i];
        else m->x[vr[i] - 1] = values[i];
    }
    return 0;
}

static int copy(double *to, const double *from, size_t n) {
    for (size_t i = 0; i < n; i++) to[i] = from[i];
    return 0;
}

static int slopes(Model *m, const unsigned *rate, size_t n, const unsigned *state, size_t k, const double *seed, double *out) {
#if defined(SLOPES)
    for (size_t i = 0; i < n; i++)
        for (unsigned at = 0; at < WIDTH(rate[i]); at++, out++) {
            const double *along = seed;
            *out = 0.0;
            for (size_t j = 0; j < k; j++) /* an output is a state, and nothing depends on the input */
                for (unsigned l = 0; l < WIDTH(state[j]); l++, along++) {
                    unsigned row = rate[i] + at, column = state[j] + l;
                    *out += column == 3 ? 0.0 : *along * (row < 3 ? row == column : slope(m, row, column));
                }
        }
    return 0;
#else
    return 3;
#endif
}

static int ones(double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return 0;
}

static int saved(Model *m, void **state) {
    if (*state == NULL) *state = malloc(sizeof(Model));
    *(Model *)*state = *m;
    return 0;
}

static int freed(void **state) { free(*state); *state = NULL; return 0; }

#define REFUSED(name, ...) int name(__VA_ARGS__) { return 3; }

#if VERSION == 1
#define F(name) fmu_fmi##name
typedef struct { char converged, references, values, terminate, upcoming; double next; } Info;
static int said(Model *m, Info *info) {
    info->converged = !iterate(m); info->terminate = ENDS(m); info->upcoming = isfinite(m->due); info->next = m->due;
    return 0;
}
const char *F(GetModelTypesPlatform)(void) { return "standard32"; }
const char *F(GetVersion)(void) { return "1.0"; }
void *F(InstantiateModel)(void) { return make(); }
void F(FreeModelInstance)(Model *m) { free(m); }
int F(SetDebugLogging)(Model *m, char on) { return 0; }
int F(SetTime)(Model *m, double t) { m->t = t; return 0; }
int F(SetContinuousStates)(Model *m, const double *x, size_t n) { return copy(m->x, x, n); }
int F(GetContinuousStates)(Model *m, double *x, size_t n) { return copy(x, m->x, n); }
int F(GetNominalContinuousStates)(Model *m, double *x, size_t n) { return ones(x, n); }
int F(GetDerivatives)(Model *m, double *dx, size_t n) { return rates(m, dx); }
int F(GetEventIndicators)(Model *m, double *z, size_t n) { indicate(m, z); return 0; }
int F(CompletedIntegratorStep)(Model *m, char *event) { *event = WANTS_EVENT(m); return 0; }
int F(Initialize)(Model *m, char controlled, double tolerance, Info *info) { return said(m, info); }
int F(EventUpdate)(Model *m, char intermediate, Info *info) { return said(m, info); }
int F(GetStateValueReferences)(Model *m, unsigned *vr, size_t n) { for (size_t i = 0; i < n; i++) vr[i] = (unsigned)i + 1; return 0; }
int F(Terminate)(Model *m) { return 0; }
int F(GetReal)(Model *m, const unsigned *vr, size_t n, double *v) { return reals(m, vr, n, v); }
int F(SetReal)(Model *m, const unsigned *vr, size_t n, const double *v) { return set_reals(m, vr, n, v); }
int F(GetInteger)(Model *m, const unsigned *vr, size_t n, int *v) { for (size_t i = 0; i < n; i++) v[i] = m->count; return 0; }
REFUSED(F(SetInteger), Model *m) REFUSED(F(GetBoolean), Model *m) REFUSED(F(SetBoolean), Model *m)
REFUSED(F(GetString), Model *m) REFUSED(F(SetString), Model *m)

#elif VERSION == 2
#define F(name) fmi2##name
typedef struct { int again, terminate, nominals, values, defined; double next; } Info;
const char *F(GetTypesPlatform)(void) { return "default"; }
const char *F(GetVersion)(void) { return "2.0"; }
void *F(Instantiate)(void) { return make(); }
void F(FreeInstance)(Model *m) { free(m); }
int F(SetDebugLogging)(Model *m) { return 0; }
int F(SetupExperiment)(Model *m, int defined, double tolerance, double t) { m->t = t; return 0; }
int F(EnterInitializationMode)(Model *m) { return 0; }
int F(ExitInitializationMode)(Model *m) { return 0; }
int F(Terminate)(Model *m) { return 0; }
int F(Reset)(Model *m) { *m = (Model){.due = INFINITY}; start(m); return 0; }
int F(EnterEventMode)(Model *m) { return 0; }
int F(EnterContinuousTimeMode)(Model *m) { return 0; }
int F(NewDiscreteStates)(Model *m, Info *info) {
    *info = (Info){.again = iterate(m), .values = 1, .terminate = ENDS(m), .defined = isfinite(m->due), .next = m->due};
    return 0;
}
int F(CompletedIntegratorStep)(Model *m, int past, int *event, int *end) { *event = WANTS_EVENT(m); *end = 0; return 0; }
int F(SetTime)(Model *m, double t) { m->t = t; return 0; }
int F(SetContinuousStates)(Model *m, const double *x, size_t n) { return copy(m->x, x, n); }
int F(GetContinuousStates)(Model *m, double *x, size_t n) { return copy(x, m->x, n); }
int F(GetNominalsOfContinuousStates)(Model *m, double *x, size_t n) { return ones(x, n); }
int F(GetDerivatives)(Model *m, double *dx, size_t n) { return rates(m, dx); }
int F(GetEventIndicators)(Model *m, double *z, size_t n) { indicate(m, z); return 0; }
int F(GetFMUstate)(Model *m, void **state) { return saved(m, state); }
int F(SetFMUstate)(Model *m, void *state) { *m = *(Model *)state; return 0; }
int F(FreeFMUstate)(Model *m, void **state) { return freed(state); }
int F(GetReal)(Model *m, const unsigned *vr, size_t n, double *v) { return reals(m, vr, n, v); }
int F(SetReal)(Model *m, const unsigned *vr, size_t n, const double *v) { return set_reals(m, vr, n, v); }
int F(GetInteger)(Model *m, const unsigned *vr, size_t n, int *v) { for (size_t i = 0; i < n; i++) v[i] = m->count; return 0; }
REFUSED(F(SetInteger), Model *m) REFUSED(F(GetBoolean), Model *m) REFUSED(F(SetBoolean), Model *m)
REFUSED(F(GetString), Model *m) REFUSED(F(SetString), Model *m) REFUSED(F(SerializedFMUstateSize), Model *m)
REFUSED(F(SerializeFMUstate), Model *m) REFUSED(F(DeSerializeFMUstate), Model *m)
int F(GetDirectionalDerivative)(Model *m, const unsigned *rate, size_t n, const unsigned *state, size_t k, const double *seed, double *out) {
    return slopes(m, rate, n, state, k, seed, out);
}

#else
#define F(name) fmi3##name
const char *F(GetVersion)(void) { return "3.0"; }
void *F(InstantiateModelExchange)(void) { return make(); }
REFUSED(F(InstantiateCoSimulation), void) REFUSED(F(InstantiateScheduledExecution), void)
void F(FreeInstance)(Model *m) { free(m); }
int F(SetDebugLogging)(Model *m) { return 0; }
int F(EnterInitializationMode)(Model *m, bool defined, double tolerance, double t) { m->t = t; return 0; }
int F(ExitInitializationMode)(Model *m) { return 0; }
int F(Terminate)(Model *m) { return 0; }
int F(Reset)(Model *m) { *m = (Model){.due = INFINITY}; start(m); return 0; }
int F(EnterEventMode)(Model *m) { return 0; }
int F(EnterContinuousTimeMode)(Model *m) { return 0; }
int F(UpdateDiscreteStates)(Model *m, bool *again, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *again = iterate(m); *end = ENDS(m); *nominals = false; *values = true; *defined = isfinite(m->due); *next = m->due;
    return 0;
}
int F(CompletedIntegratorStep)(Model *m, bool past, bool *event, bool *end) { *event = WANTS_EVENT(m); *end = false; return 0; }
int F(SetTime)(Model *m, double t) { m->t = t; return 0; }
int F(SetContinuousStates)(Model *m, const double *x, size_t n) { return copy(m->x, x, n); }
int F(GetContinuousStates)(Model *m, double *x, size_t n) { return copy(x, m->x, n); }
int F(GetNominalsOfContinuousStates)(Model *m, double *x, size_t n) { return ones(x, n); }
int F(GetContinuousStateDerivatives)(Model *m, double *dx, size_t n) { return rates(m, dx); }
int F(GetEventIndicators)(Model *m, double *z, size_t n) { indicate(m, z); return 0; }
int F(GetNumberOfEventIndicators)(Model *m, size_t *n) { *n = INDICATORS; return 0; }
int F(GetNumberOfContinuousStates)(Model *m, size_t *n) { *n = STATES; return 0; }
int F(GetFMUState)(Model *m, void **state) { return saved(m, state); }
int F(SetFMUState)(Model *m, void *state) { *m = *(Model *)state; return 0; }
int F(FreeFMUState)(Model *m, void **state) { return freed(state); }
int F(GetFloat64)(Model *m, const unsigned *vr, size_t n, double *v, size_t nv) { return reals(m, vr, n, v); }
int F(SetFloat64)(Model *m, const unsigned *vr, size_t n, const double *v, size_t nv) { return set_reals(m, vr, n, v); }
int F(GetInt32)(Model *m, const unsigned *vr, size_t n, int32_t *v, size_t nv) { for (size_t i = 0; i < n; i++) v[i] = m->count; return 0; }
#define PAIR(type) REFUSED(F(Get##type), Model *m) REFUSED(F(Set##type), Model *m)
PAIR(Float32) PAIR(Int8) PAIR(UInt8) PAIR(Int16) PAIR(UInt16) PAIR(UInt32) PAIR(Int64) PAIR(UInt64) PAIR(Boolean) PAIR(String)
PAIR(Binary) PAIR(Clock) PAIR(IntervalDecimal) PAIR(IntervalFraction) PAIR(ShiftDecimal) PAIR(ShiftFraction)
REFUSED(F(SetInt32), Model *m) REFUSED(F(GetNumberOfVariableDependencies), Model *m) REFUSED(F(GetVariableDependencies), Model *m)
REFUSED(F(SerializedFMUStateSize), Model *m) REFUSED(F(SerializeFMUState), Model *m) REFUSED(F(DeserializeFMUState), Model *m)
int F(GetDirectionalDerivative)(Model *m, const unsigned *rate, size_t n, const unsigned *state, size_t k, const double *seed,
                               size_t seeds, double *out, size_t outs) {
    return slopes(m, rate, n, state, k, seed, out);
}
REFUSED(F(GetAdjointDerivative), Model *m)
REFUSED(F(EnterConfigurationMode), Model *m) REFUSED(F(ExitConfigurationMode), Model *m) REFUSED(F(EvaluateDiscreteStates), Model *m)
REFUSED(F(EnterStepMode), Model *m) REFUSED(F(GetOutputDerivatives), Model *m) REFUSED(F(DoStep), Model *m)
REFUSED(F(ActivateModelPartition), Model *m)
#endif
