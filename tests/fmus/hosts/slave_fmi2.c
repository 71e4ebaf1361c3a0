/* A slave of FMI 2.0. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"
#include "slave.h"

typedef struct {
    Slave slave;
    fmi2Component c;
    fmi2CallbackFunctions callbacks;
#define FUNCTION(name) fmi2##name##TYPE *name;
#include "functions_fmi2.h"
#undef FUNCTION
} Slave2;

static void log_message(void *environment, const char *instance, fmi2Status status, const char *category, const char *message, ...) {
    (void)environment;
    va_list arguments;
    va_start(arguments, message);
    fprintf(stderr, "%s [%d, %s]: ", instance, (int)status, category);
    vfprintf(stderr, message, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

static void enter_initialization(Slave *slave, double start_time) {
    Slave2 *s = (Slave2 *)slave;
    require(slave, "fmi2SetupExperiment", s->SetupExperiment(s->c, fmi2False, 0.0, start_time, fmi2False, 0.0));
    require(slave, "fmi2EnterInitializationMode", s->EnterInitializationMode(s->c));
}

static void exit_initialization(Slave *slave) {
    require(slave, "fmi2ExitInitializationMode", ((Slave2 *)slave)->ExitInitializationMode(((Slave2 *)slave)->c));
}

static double get_real(Slave *slave, unsigned reference) {
    double value;
    require(slave, "fmi2GetReal", ((Slave2 *)slave)->GetReal(((Slave2 *)slave)->c, &reference, 1, &value));
    return value;
}

static void set_real(Slave *slave, unsigned reference, double value) {
    require(slave, "fmi2SetReal", ((Slave2 *)slave)->SetReal(((Slave2 *)slave)->c, &reference, 1, &value));
}

static int get_integer(Slave *slave, unsigned reference) {
    int value;
    require(slave, "fmi2GetInteger", ((Slave2 *)slave)->GetInteger(((Slave2 *)slave)->c, &reference, 1, &value));
    return value;
}

static void set_integer(Slave *slave, unsigned reference, int value) {
    require(slave, "fmi2SetInteger", ((Slave2 *)slave)->SetInteger(((Slave2 *)slave)->c, &reference, 1, &value));
}

static int do_step(Slave *slave, double t, double h) {
    return ((Slave2 *)slave)->DoStep(((Slave2 *)slave)->c, t, h, fmi2True);
}

static void *save(Slave *slave) {
    fmi2FMUstate state = NULL;
    require(slave, "fmi2GetFMUstate", ((Slave2 *)slave)->GetFMUstate(((Slave2 *)slave)->c, &state));
    return state;
}

static void restore(Slave *slave, void *state) {
    require(slave, "fmi2SetFMUstate", ((Slave2 *)slave)->SetFMUstate(((Slave2 *)slave)->c, state));
}

static void forget(Slave *slave, void *state) {
    require(slave, "fmi2FreeFMUstate", ((Slave2 *)slave)->FreeFMUstate(((Slave2 *)slave)->c, &state));
}

static size_t serialize(Slave *slave, void *state, char **bytes) {
    Slave2 *s = (Slave2 *)slave;
    size_t size;
    require(slave, "fmi2SerializedFMUstateSize", s->SerializedFMUstateSize(s->c, state, &size));
    *bytes = malloc(size);
    require(slave, "fmi2SerializeFMUstate", s->SerializeFMUstate(s->c, state, *bytes, size));
    return size;
}

static void *deserialize(Slave *slave, const char *bytes, size_t size) {
    fmi2FMUstate state = NULL;
    require(slave, "fmi2DeSerializeFMUstate", ((Slave2 *)slave)->DeSerializeFMUstate(((Slave2 *)slave)->c, bytes, size, &state));
    return state;
}

static int try_restore(Slave *slave, const char *bytes, size_t size) {
    Slave2 *s = (Slave2 *)slave;
    fmi2FMUstate state = NULL;
    int status = (int)s->DeSerializeFMUstate(s->c, bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)s->SetFMUstate(s->c, state);
    require(slave, "fmi2FreeFMUstate", s->FreeFMUstate(s->c, &state));
    return status;
}

static void reset(Slave *slave) {
    require(slave, "fmi2Reset", ((Slave2 *)slave)->Reset(((Slave2 *)slave)->c));
}

static void terminate(Slave *slave) {
    require(slave, "fmi2Terminate", ((Slave2 *)slave)->Terminate(((Slave2 *)slave)->c));
}

static void close_slave(Slave *slave) {
    ((Slave2 *)slave)->FreeInstance(((Slave2 *)slave)->c);
    free(slave);
}

static void no_clocks(Slave *slave, unsigned clock, size_t count, const unsigned *references, const double *values) {
    (void)clock, (void)count, (void)references, (void)values;
    die("%s: FMI 2 has no clocks", slave->name);
}

Slave *open_fmi2(const char *name, const char *library, const char *token, const char *resources) {
    Slave2 *s = calloc(1, sizeof *s);
    s->slave = (Slave){name,      enter_initialization, exit_initialization, get_real, set_real, get_integer, set_integer, do_step,
                       no_clocks, save,                 restore,             forget,   serialize, deserialize, reset,      terminate,
                       try_restore, close_slave};
    void *handle = load_library(library);
#define FUNCTION(function) find_function(handle, "fmi2" #function, &s->function);
#include "functions_fmi2.h"
#undef FUNCTION
    memcpy(&s->callbacks, &(fmi2CallbackFunctions){log_message, calloc, free, NULL, NULL}, sizeof s->callbacks);
    s->c = s->Instantiate(name, fmi2CoSimulation, token, resources, &s->callbacks, fmi2False, fmi2False);
    if (s->c != NULL)
        return &s->slave;
    free(s);
    return NULL;
}
