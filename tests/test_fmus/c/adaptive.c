/* An oscillator, p'' = -W^2 (p - MIDDLE), with a solver of variable step: Heun's method against two half steps of it.
 *
 * It keeps the error of a step below the tolerance that it is told (else USUAL_TOLERANCE), relative to sizes above 1. How long its
 * last step was is no part of a saved state: what follows a restored state is the same to within the tolerance only. It refuses
 * tolerances below FINEST. With FORGETS the speed is no part of a saved state either.
 */
#include "test_fmus.h"

typedef struct {
    double time, tolerance, reported, p, v;
} Model;

typedef struct {
    double h, v;
} Scratch;

#include "host.h"

enum { TIME = 0, POSITION = 1, SPEED = 2, TOLD = 3 };

static void model_start(Model *m) {
    m->tolerance = USUAL_TOLERANCE;
    m->p = MIDDLE;
    m->v = W;
}

static void model_begin(Model *m, double t0) { m->time = t0; }

static Slot model_slot(Model *m, unsigned reference) {
    double *const places[] = {&m->time, &m->p, &m->v, &m->reported};
    if (reference > TOLD)
        return (Slot){0};
    return (Slot){.kind = F64, .role = OUTPUT, .at = places[reference], .size = 1};
}

static void model_refresh(Model *m) { (void)m; }

#if TAKES_TOLERANCE
static bool model_tolerance(Model *m, double tolerance) {
    m->reported = tolerance;
    if (tolerance > 0.0)
        m->tolerance = tolerance;
    return tolerance == 0.0 || tolerance >= FINEST;
}
#endif

static void heun(double h, const double *from, double *to) {
    const double a = -W * W * (from[0] - MIDDLE), p = from[0] + h * from[1], v = from[1] + h * a;
    to[0] = from[0] + 0.5 * h * (from[1] + v);
    to[1] = from[1] + 0.5 * h * (a - W * W * (p - MIDDLE));
}

/* Error of one step against two halves, in tolerances. */
static double error_of(const Model *m, const double *one, const double *two) {
    double worst = 0.0;
    for (int i = 0; i < 2; i++)
        worst = fmax(worst, fabs(two[i] - one[i]) / (m->tolerance * fmax(fabs(two[i]), 1.0)));
    return worst;
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    Scratch *own = &host->scratch;
    double x[2] = {m->p, m->v};
#if FORGETS
    if (own->h > 0.0)
        x[1] = own->v;
#endif
    double now = t;
    while (until - now > 1e-13) {
        const double longest = own->h > 0.0 ? own->h : 1e-3, h = fmin(longest, until - now);
        double one[2], half[2], two[2];
        heun(h, x, one);
        heun(0.5 * h, x, half);
        heun(0.5 * h, half, two);
        const double error = error_of(m, one, two);
        if (error <= 1.0) {
            memcpy(x, two, sizeof x);
            now += h;
        }
        own->h = h * fmin(fmax(0.9 * pow(fmax(error, 1e-9), -1.0 / 3.0), 0.2), 3.0);
        if (error <= 1.0 && own->h < longest && h < longest)
            own->h = longest; /* it was cut by the end of the communication step, not by its error */
    }
    m->p = x[0];
    m->v = own->v = x[1];
    m->time = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
    return (Update){0};
}

#include "face.h"
