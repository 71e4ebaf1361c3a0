/* A linear system x' = A x + B u, y = C x + D u, integrated exactly by the matrix exponential.
 *
 * The input is held over a step, or linear where its slope is known: from fmi[2]SetRealInputDerivatives, or from an FMI 3
 * intermediate update. `config.h` defines NX, NU, NY and A, B, C, D, X0, U0 as flat row-major arrays with one element to spare.
 * References: 0 the time, then inputs, outputs, start values x0, states x.
 */
#include "test_fmus.h"

#define NZ (NX + 2 * NU) /* states, inputs, slopes */
#define KEPT 8

enum { FIRST_U = 1, FIRST_Y = FIRST_U + NU, FIRST_X0 = FIRST_Y + NY, FIRST_X = FIRST_X0 + NX, VALUES_ = FIRST_X + NX };

typedef struct {
    double value[VALUES_]; /* by reference */
    double slope[NU + 1];
    bool begun;
} Model;

typedef struct {
    double h;
    double phi[NX * NX + 1], held[NX * NU + 1], ramp[NX * NU + 1];
} Transition; /* x(t + h) = phi x + held u + ramp u' */

typedef struct {
    Transition kept[KEPT]; /* of the last step sizes: a function of h alone, so no part of a state */
    int next;
} Scratch;

#include "host.h"


static void model_start(Model *m) {
    memcpy(m->value + FIRST_X0, X0, NX * sizeof(double));
    memcpy(m->value + FIRST_U, U0, NU * sizeof(double));
}

static void model_begin(Model *m, double t0) {
    m->value[0] = t0;
    memcpy(m->value + FIRST_X, m->value + FIRST_X0, NX * sizeof(double));
    m->begun = true;
}

static Slot model_slot(Model *m, unsigned reference) {
    if (reference >= VALUES_)
        return (Slot){0};
    Slot slot = {.kind = F64, .role = OUTPUT, .at = &m->value[reference], .size = 1};
    if (reference >= FIRST_U && reference < FIRST_Y)
        slot.role = INPUT;
    else if (reference >= FIRST_X0 && reference < FIRST_X)
        slot.role = PARAMETER;
    return slot;
}

static void model_refresh(Model *m) {
    const double *u = m->value + FIRST_U;
    if (!m->begun)
        memcpy(m->value + FIRST_X, m->value + FIRST_X0, NX * sizeof(double));
    const double *x = m->value + FIRST_X;
    for (int i = 0; i < NY; i++) {
        double sum = 0.0;
        for (int j = 0; j < NX; j++)
            sum += C[i * NX + j] * x[j];
        for (int j = 0; j < NU; j++)
            sum += D[i * NU + j] * u[j];
        m->value[FIRST_Y + i] = sum;
    }
}

#if NX > 0
static void multiply(const double *a, const double *b, double *out) {
    for (int i = 0; i < NZ; i++)
        for (int j = 0; j < NZ; j++) {
            double sum = 0.0;
            for (int k = 0; k < NZ; k++)
                sum += a[i * NZ + k] * b[k * NZ + j];
            out[i * NZ + j] = sum;
        }
}

/* exp(a) by Taylor's series of a / 2^s with norm at most 1/4, squared s times; a is destroyed. */
static void exponential(double *a, double *out) {
    double norm = 0.0, term[NZ * NZ], product[NZ * NZ];
    for (int i = 0; i < NZ; i++) {
        double sum = 0.0;
        for (int j = 0; j < NZ; j++)
            sum += fabs(a[i * NZ + j]);
        norm = fmax(norm, sum);
    }
    int squarings = 0;
    for (; norm > 0.25; norm *= 0.5)
        squarings++;
    for (int i = 0; i < NZ * NZ; i++)
        a[i] = ldexp(a[i], -squarings);
    for (int i = 0; i < NZ * NZ; i++)
        out[i] = term[i] = i % (NZ + 1) == 0;
    for (int k = 1; k <= 14; k++) { /* 0.25^15 / 15! < 1e-21 */
        multiply(term, a, product);
        for (int i = 0; i < NZ * NZ; i++)
            out[i] += term[i] = product[i] / k;
    }
    for (; squarings > 0; squarings--) {
        multiply(out, out, product);
        memcpy(out, product, sizeof product);
    }
}

static const Transition *transition(Scratch *scratch, double h) {
    for (int i = 0; i < KEPT; i++)
        if (scratch->kept[i].h == h)
            return &scratch->kept[i];
    double a[NZ * NZ] = {0}, e[NZ * NZ];
    for (int i = 0; i < NX; i++) {
        for (int j = 0; j < NX; j++)
            a[i * NZ + j] = h * A[i * NX + j];
        for (int j = 0; j < NU; j++)
            a[i * NZ + NX + j] = h * B[i * NU + j];
    }
    for (int j = 0; j < NU; j++)
        a[(NX + j) * NZ + NX + NU + j] = h;
    exponential(a, e);
    Transition *made = &scratch->kept[scratch->next];
    scratch->next = (scratch->next + 1) % KEPT;
    made->h = h;
    for (int i = 0; i < NX; i++) {
        for (int j = 0; j < NX; j++)
            made->phi[i * NX + j] = e[i * NZ + j];
        for (int j = 0; j < NU; j++) {
            made->held[i * NU + j] = e[i * NZ + NX + j];
            made->ramp[i * NU + j] = e[i * NZ + NX + NU + j];
        }
    }
    return made;
}
#endif

/* Over h, the input starting at u with its slope. */
static void flow(Model *m, Scratch *scratch, double h) {
    double *u = m->value + FIRST_U;
#if NX > 0
    const Transition *step = transition(scratch, h);
    double *x = m->value + FIRST_X, moved[NX];
    for (int i = 0; i < NX; i++) {
        double sum = 0.0;
        for (int j = 0; j < NX; j++)
            sum += step->phi[i * NX + j] * x[j];
        for (int j = 0; j < NU; j++)
            sum += step->held[i * NU + j] * u[j] + step->ramp[i * NU + j] * m->slope[j];
        moved[i] = sum;
    }
    memcpy(x, moved, sizeof moved);
#else
    (void)scratch;
#endif
    for (int j = 0; j < NU; j++)
        u[j] += m->slope[j] * h;
}

#if INNER_INSTANTS > 0
/* Asks the importer for the inputs at an inner instant; true where it wants the step to end there. */
static bool ask(Model *m, Host *host, double now, double until, double *stop) {
    bool requested = false;
    double when = until;
    model_refresh(m);
    host->intermediate(host->environment, now, true, true, true, CAN_RETURN_EARLY && host->early_allowed, &requested, &when);
    *stop = fmin(fmax(when, now), until);
    return requested && CAN_RETURN_EARLY && host->early_allowed;
}

/* A step with inner instants: the inputs are held in between, or linear between what was set at both ends. */
static Outcome inner_steps(Model *m, Host *host, double t, double until) {
    const int pieces = INNER_LINEAR ? INNER_INSTANTS : INNER_INSTANTS + 1;
    double now = t, stop;
    for (int i = 1; i <= pieces; i++) {
        const double next = i == pieces ? until : t + (until - t) * i / pieces;
#if INNER_LINEAR
        double from[NU + 1], *u = m->value + FIRST_U;
        memcpy(from, u, NU * sizeof(double));
        ask(m, host, next, until, &stop);
        for (int j = 0; j < NU; j++) {
            m->slope[j] = (u[j] - from[j]) / (next - now);
            const double end = u[j];
            u[j] = from[j];
            from[j] = end;
        }
        flow(m, &host->scratch, next - now);
        memcpy(u, from, NU * sizeof(double));
        memset(m->slope, 0, sizeof m->slope);
#else
        flow(m, &host->scratch, next - now);
        if (i < pieces && ask(m, host, next, until, &stop)) {
            if (stop > next)
                flow(m, &host->scratch, stop - next);
            m->value[0] = stop;
            return (Outcome){.status = OK, .reached = stop, .early = stop < until};
        }
#endif
        now = next;
        m->value[0] = now;
    }
    return arrived(until);
}
#endif

static Outcome model_step(Model *m, Host *host, double t, double until) {
#if INNER_INSTANTS > 0
    if (host->intermediate != NULL)
        return inner_steps(m, host, t, until);
#endif
    flow(m, &host->scratch, until - t);
    m->value[0] = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
    return (Update){0};
}

#if HAS_INPUT_DERIVATIVES
static double *model_slope(Model *m, unsigned reference) {
    return reference >= FIRST_U && reference < FIRST_Y ? &m->slope[reference - FIRST_U] : NULL;
}
#endif

#if HAS_OUTPUT_DERIVATIVES
/* y' = C (A x + B u) + D u' */
static bool model_rate(Model *m, unsigned reference, double *rate) {
    if (reference < FIRST_Y || reference >= FIRST_X0)
        return false;
    const double *x = m->value + FIRST_X, *u = m->value + FIRST_U;
    const int row = (int)reference - FIRST_Y;
    *rate = 0.0;
    for (int i = 0; i < NX; i++) {
        double dx = 0.0;
        for (int j = 0; j < NX; j++)
            dx += A[i * NX + j] * x[j];
        for (int j = 0; j < NU; j++)
            dx += B[i * NU + j] * u[j];
        *rate += C[row * NX + i] * dx;
    }
    for (int j = 0; j < NU; j++)
        *rate += D[row * NU + j] * m->slope[j];
    return true;
}
#endif

#if HAS_DIRECTIONAL
/* Of an output by an input: D; by a start value, before the first step: C. */
static bool model_sensitivity(Model *m, unsigned unknown, unsigned known, double *partial) {
    if (unknown < FIRST_Y || unknown >= FIRST_X0)
        return false;
    const int row = (int)unknown - FIRST_Y;
    if (known >= FIRST_U && known < FIRST_Y)
        *partial = D[row * NU + (int)known - FIRST_U];
    else if (known >= FIRST_X0 && known < FIRST_X && !m->begun)
        *partial = C[row * NX + (int)known - FIRST_X0];
    else
        return false;
    return true;
}
#endif

#include "face.h"
