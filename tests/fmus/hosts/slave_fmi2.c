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

static int do_step(Slave *slave, double t, double h) {
    return ((Slave2 *)slave)->DoStep(((Slave2 *)slave)->c, t, h, fmi2True);
}

static void notify(Slave *slave, unsigned clock, size_t count, const unsigned *references, const double *values) {
    (void)clock, (void)count, (void)references, (void)values;
    die("%s: FMI 2 has no clocks", slave->name);
}

#define OWN Slave2
#define FUNCTIONS "functions_fmi2.h"
#include "words_fmi2.h"
#include "slave_calls.h"

Slave *open_fmi2(const char *name, const char *library, const char *token, const char *resources) {
    Slave2 *s = calloc(1, sizeof *s);
    load(s, name, library);
    memcpy(&s->callbacks, &(fmi2CallbackFunctions){log_message, calloc, free, NULL, NULL}, sizeof s->callbacks);
    s->c = s->Instantiate(name, fmi2CoSimulation, token, resources, &s->callbacks, fmi2False, fmi2False);
    if (s->c != NULL)
        return &s->slave;
    free(s);
    return NULL;
}
