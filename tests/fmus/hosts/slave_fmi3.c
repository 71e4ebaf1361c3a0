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

static double get_real(Slave *slave, unsigned reference) {
    double value;
    require(slave, "fmi3GetFloat64", ((Slave3 *)slave)->GetFloat64(((Slave3 *)slave)->c, &reference, 1, &value, 1));
    return value;
}

static void set_real(Slave *slave, unsigned reference, double value) {
    require(slave, "fmi3SetFloat64", ((Slave3 *)slave)->SetFloat64(((Slave3 *)slave)->c, &reference, 1, &value, 1));
}

static int get_integer(Slave *slave, unsigned reference) {
    fmi3Int32 value;
    require(slave, "fmi3GetInt32", ((Slave3 *)slave)->GetInt32(((Slave3 *)slave)->c, &reference, 1, &value, 1));
    return value;
}

static void set_integer(Slave *slave, unsigned reference, int value) {
    require(slave, "fmi3SetInt32", ((Slave3 *)slave)->SetInt32(((Slave3 *)slave)->c, &reference, 1, &value, 1));
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

static void *save(Slave *slave) {
    fmi3FMUState state = NULL;
    require(slave, "fmi3GetFMUState", ((Slave3 *)slave)->GetFMUState(((Slave3 *)slave)->c, &state));
    return state;
}

static void restore(Slave *slave, void *state) {
    require(slave, "fmi3SetFMUState", ((Slave3 *)slave)->SetFMUState(((Slave3 *)slave)->c, state));
}

static void forget(Slave *slave, void *state) {
    require(slave, "fmi3FreeFMUState", ((Slave3 *)slave)->FreeFMUState(((Slave3 *)slave)->c, &state));
}

static size_t serialize(Slave *slave, void *state, char **bytes) {
    Slave3 *s = (Slave3 *)slave;
    size_t size;
    require(slave, "fmi3SerializedFMUStateSize", s->SerializedFMUStateSize(s->c, state, &size));
    *bytes = malloc(size);
    require(slave, "fmi3SerializeFMUState", s->SerializeFMUState(s->c, state, (fmi3Byte *)*bytes, size));
    return size;
}

static void *deserialize(Slave *slave, const char *bytes, size_t size) {
    Slave3 *s = (Slave3 *)slave;
    fmi3FMUState state = NULL;
    require(slave, "fmi3DeserializeFMUState", s->DeserializeFMUState(s->c, (const fmi3Byte *)bytes, size, &state));
    return state;
}

static int try_restore(Slave *slave, const char *bytes, size_t size) {
    Slave3 *s = (Slave3 *)slave;
    fmi3FMUState state = NULL;
    int status = (int)s->DeserializeFMUState(s->c, (const fmi3Byte *)bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)s->SetFMUState(s->c, state);
    require(slave, "fmi3FreeFMUState", s->FreeFMUState(s->c, &state));
    return status;
}

static void reset(Slave *slave) {
    require(slave, "fmi3Reset", ((Slave3 *)slave)->Reset(((Slave3 *)slave)->c));
}

static void terminate(Slave *slave) {
    require(slave, "fmi3Terminate", ((Slave3 *)slave)->Terminate(((Slave3 *)slave)->c));
}

static void close_slave(Slave *slave) {
    ((Slave3 *)slave)->FreeInstance(((Slave3 *)slave)->c);
    free(slave);
}

Slave *open_fmi3(const char *name, const char *library, const char *token, const char *resources, bool event_mode) {
    Slave3 *s = calloc(1, sizeof *s);
    s->slave = (Slave){name, enter_initialization, exit_initialization, get_real, set_real, get_integer, set_integer, do_step,
                       notify, save,                 restore,             forget,   serialize, deserialize, reset,      terminate,
                       try_restore, close_slave};
    s->event_mode = event_mode;
    void *handle = load_library(library);
#define FUNCTION(function) find_function(handle, "fmi3" #function, &s->function);
#include "functions_fmi3.h"
#undef FUNCTION
    s->c = s->InstantiateCoSimulation(name, token, resources, fmi3False, fmi3False, event_mode, fmi3False, NULL, 0, s, log_message, NULL);
    if (s->c != NULL)
        return &s->slave;
    free(s);
    return NULL;
}
