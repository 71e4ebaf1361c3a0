/* A slave of FMI 3.0, with or without event mode. */
#include <stdio.h>
#include <stdlib.h>

#include "fmi3FunctionTypes.h"
#include "slave.h"

typedef struct {
    Slave slave;
    fmi3Instance c;
    bool event_mode;
#define FUNCTION(name) fmi3##name##TYPE *name;
#include "functions_fmi3.h"
#undef FUNCTION
} Slave3;

static void log_message(void *environment, fmi3Status status, const char *category, const char *message) {
    fprintf(stderr, "%s [%d, %s]: %s\n", ((Slave *)environment)->name, (int)status, category, message);
}

/* Event mode ends only when the FMU has nothing more to update. */
static void update_discrete_states(Slave3 *s) {
    fmi3Boolean more = fmi3True, terminate, nominals, values, defined;
    double next;
    while (more)
        require(&s->slave, "fmi3UpdateDiscreteStates",
                s->UpdateDiscreteStates(s->c, &more, &terminate, &nominals, &values, &defined, &next));
    require(&s->slave, "fmi3EnterStepMode", s->EnterStepMode(s->c));
}

static void enter_initialization(Slave *slave, double start_time) {
    Slave3 *s = (Slave3 *)slave;
    require(slave, "fmi3EnterInitializationMode",
            s->EnterInitializationMode(s->c, fmi3False, 0.0, start_time, fmi3False, 0.0));
}

static void exit_initialization(Slave *slave) {
    Slave3 *s = (Slave3 *)slave;
    require(slave, "fmi3ExitInitializationMode", s->ExitInitializationMode(s->c));
    if (s->event_mode)
        update_discrete_states(s);
}

static int do_step(Slave *slave, double t, double h) {
    Slave3 *s = (Slave3 *)slave;
    fmi3Boolean event, terminate, early;
    double last;
    fmi3Status status = s->DoStep(s->c, t, h, fmi3True, &event, &terminate, &early, &last);
    return status == fmi3OK && early ? SLAVE_ERROR : (int)status; /* early return was not allowed */
}

static void notify(Slave *slave, unsigned clock, size_t count, const unsigned *references, const double *values) {
    Slave3 *s = (Slave3 *)slave;
    const fmi3Clock active = fmi3ClockActive;
    require(slave, "fmi3EnterEventMode", s->EnterEventMode(s->c));
    require(slave, "fmi3SetClock", s->SetClock(s->c, &clock, 1, &active));
    require(slave, "fmi3SetFloat64", s->SetFloat64(s->c, references, count, values, count));
    update_discrete_states(s);
}

#define OWN Slave3
#define FUNCTIONS "functions_fmi3.h"
#include "words_fmi3.h"
#include "slave_calls.h"

Slave *open_fmi3(const char *name, const char *library, const char *token, const char *resources, bool event_mode) {
    Slave3 *s = calloc(1, sizeof *s);
    load(s, name, library);
    s->event_mode = event_mode;
    s->c = s->InstantiateCoSimulation(name, token, resources, fmi3False, fmi3False, event_mode, fmi3False, NULL, 0, s, log_message, NULL);
    if (s->c != NULL)
        return &s->slave;
    free(s);
    return NULL;
}
