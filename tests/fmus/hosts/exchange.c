/* Model exchange under a plain C program, for sanitizers: a short run by Euler's method, and damaged states.

   exchange WIRING STATES INDICATORS    a run with time events, state events, told events and directional derivatives; then words of a
                                        serialised state damaged one by one: refused, or set and used; prints how many of each

   A wiring with one slave, as for `life`: its `real` entries are inputs, its `event` is told with its two payloads, stamp and place. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "damage.h"
#include "exchange.h"
#include "slave.h"
#include "wiring.h"

#define STEP 0.001

typedef struct {
    const Wiring *wiring;
    Model *model;
    size_t states, indicators;
    double t, next_time;
    int notified;
    double x[MOST], dx[MOST], z[MOST], before[MOST];
} Run;

static void expect(const char *call, int status) {
    if (status > SLAVE_WARNING)
        die("%s returned status %d", call, status);
}

static void update(Run *r, bool notify) {
    const Event *e = &r->wiring->event[0];
    const double values[] = {r->t, 10.0 * r->t + 1.0};
    expect("EnterEventMode", r->model->enter_event_mode(r->model));
    if (notify && r->wiring->events > 0) {
        expect("SetReal", r->model->set_reals(r->model, e->to, 2, values));
        expect("tell", r->model->announce(r->model, r->wiring->slave[0].event_mode ? e->clock : e->count, ++r->notified));
    }
    expect("update", r->model->update(r->model, &r->next_time));
    expect("EnterContinuousTimeMode", r->model->enter_continuous_time_mode(r->model));
    expect("GetContinuousStates", r->model->get_states(r->model, r->x, r->states));
}

static void start(Run *r) {
    const Wiring *w = r->wiring;
    expect("initialisation", r->model->enter_initialization(r->model));
    for (int i = 0; i < w->starts; i++)
        expect("SetReal", r->model->set_reals(r->model, &w->start[i].reference, 1, &w->start[i].value));
    expect("ExitInitializationMode", r->model->exit_initialization(r->model));
    expect("update", r->model->update(r->model, &r->next_time));
    expect("EnterContinuousTimeMode", r->model->enter_continuous_time_mode(r->model));
    expect("GetContinuousStates", r->model->get_states(r->model, r->x, r->states));
    expect("GetEventIndicators", r->model->get_indicators(r->model, r->z, r->indicators));
}

static bool has_changed(Run *r) {
    memcpy(r->before, r->z, sizeof r->z);
    expect("GetEventIndicators", r->model->get_indicators(r->model, r->z, r->indicators));
    for (size_t i = 0; i < r->indicators; i++)
        if ((r->z[i] > 0.0) != (r->before[i] > 0.0))
            return true;
    return false;
}

static void go_on(Run *r, int steps) {
    const Wiring *w = r->wiring;
    for (int k = 0; k < steps; k++) {
        double end = fmin(r->t + STEP, fmax(r->next_time, r->t));
        for (int i = 0; i < w->starts; i++) {
            double value = w->start[i].value * sin(20.0 * r->t);
            expect("SetReal", r->model->set_reals(r->model, &w->start[i].reference, 1, &value));
        }
        expect("GetDerivatives", r->model->get_derivatives(r->model, r->dx, r->states));
        for (size_t i = 0; i < r->states; i++)
            r->x[i] += (end - r->t) * r->dx[i];
        r->t = end;
        expect("SetTime", r->model->set_time(r->model, end));
        expect("SetContinuousStates", r->model->set_states(r->model, r->x, r->states));
        bool notified = k % 40 == 20, changed = has_changed(r);
        if (notified || changed || end >= r->next_time)
            update(r, notified);
    }
}

/* By every input, of all that is looked at: what has no derivative is refused. Returns how many were given. */
static int differentiate(Run *r) {
    const Wiring *w = r->wiring;
    int stated = 0;
    for (int i = 0; i < w->starts; i++)
        for (int k = 0; k < w->records; k++) {
            double seed = 1.0, sensitivity;
            stated += r->model->directional(r->model, w->record[k].reference, w->start[i].reference, seed, &sensitivity) <= SLAVE_WARNING;
        }
    return stated;
}

/* Whatever the state is, all calls come back. */
static void use(Run *r) {
    double values[MOST], next;
    r->model->get_derivatives(r->model, values, r->states);
    r->model->get_indicators(r->model, values, r->indicators);
    r->model->get_states(r->model, values, r->states);
    differentiate(r);
    r->model->enter_event_mode(r->model);
    r->model->update(r->model, &next);
    r->model->enter_continuous_time_mode(r->model);
    r->model->set_time(r->model, r->t + STEP);
    r->model->do_step(r->model, r->t, STEP); /* not in model exchange, whatever the state says */
    r->model->get_derivatives(r->model, values, r->states);
}

static void damage(Run *r) {
    char *bytes;
    size_t size = r->model->save(r->model, &bytes);
    int tried = 0, accepted = 0;
    for (Damage d = damage_first(bytes, size); damage_next(&d); tried++)
        if (r->model->try_restore(r->model, bytes, size) <= SLAVE_WARNING) {
            accepted++;
            use(r);
        }
    expect("restore", r->model->try_restore(r->model, bytes, size));
    printf("%d %d\n", tried, accepted);
    free(bytes);
}

int main(int argc, char **argv) {
    if (argc < 4)
        die("usage: exchange WIRING STATES INDICATORS");
    Wiring *wiring = malloc(sizeof *wiring);
    read_wiring(wiring, argv[1]);
    const SlaveEntry *e = &wiring->slave[0];
    Run r = {.wiring = wiring, .states = (size_t)atoi(argv[2]), .indicators = (size_t)atoi(argv[3])};
    if (r.states > MOST || r.indicators > MOST)
        die("too many states");
    r.model = (e->version == 2 ? open_model2 : open_model3)(e->name, e->library, e->token, e->resources);
    if (r.model == NULL)
        die("%s could not be instantiated", e->name);
    start(&r);
    go_on(&r, 300);
    printf("%d\n", differentiate(&r));
    damage(&r);
    go_on(&r, 50);
    r.model->close(r.model);
    free(wiring->text);
    free(wiring);
    return 0;
}
