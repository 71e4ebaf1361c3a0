/* A model exchange instance of FMI 2.0. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "exchange.h"
#include "fmi2FunctionTypes.h"
#include "slave.h"

typedef struct {
    Model model;
    fmi2Component c;
    fmi2CallbackFunctions callbacks;
#define FUNCTION(name) fmi2##name##TYPE *name;
#include "exchange_functions_fmi2.h"
#undef FUNCTION
} Model2;

#define M ((Model2 *)model)

static void log_message(void *environment, const char *instance, fmi2Status status, const char *category, const char *message, ...) {
    (void)environment, (void)category;
    fprintf(stderr, "%s [%d]: %s\n", instance, (int)status, message);
}

static int enter_initialization(Model *model) {
    int status = M->SetupExperiment(M->c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    return status > SLAVE_WARNING ? status : (int)M->EnterInitializationMode(M->c);
}

static int set_reals(Model *model, const unsigned *references, size_t count, const double *values) {
    return (int)M->SetReal(M->c, references, count, values);
}

static int announce(Model *model, unsigned reference, int count) {
    return (int)M->SetInteger(M->c, &reference, 1, &count);
}

static int update(Model *model, double *next_time) {
    fmi2EventInfo info = {.newDiscreteStatesNeeded = fmi2True};
    int status = SLAVE_OK;
    while (info.newDiscreteStatesNeeded && status <= SLAVE_WARNING)
        status = (int)M->NewDiscreteStates(M->c, &info);
    *next_time = info.nextEventTimeDefined ? info.nextEventTime : INFINITY;
    return status;
}

static int get_derivatives(Model *model, double *dx, size_t count) {
    return (int)M->GetDerivatives(M->c, dx, count);
}

static int directional(Model *model, unsigned unknown, unsigned known, double seed, double *sensitivity) {
    return (int)M->GetDirectionalDerivative(M->c, &unknown, 1, &known, 1, &seed, sensitivity);
}

static int do_step(Model *model, double t, double h) {
    return (int)M->DoStep(M->c, t, h, fmi2True);
}

#define OWN Model2
#define FUNCTIONS "exchange_functions_fmi2.h"
#include "words_fmi2.h"
#include "exchange_calls.h"

Model *open_model2(const char *name, const char *library, const char *token, const char *resources) {
    Model2 *m = calloc(1, sizeof *m);
    load(m, library);
    memcpy(&m->callbacks, &(fmi2CallbackFunctions){log_message, calloc, free, NULL, NULL}, sizeof m->callbacks);
    m->c = m->Instantiate(name, fmi2ModelExchange, token, resources, &m->callbacks, fmi2False, fmi2False);
    memset(&m->callbacks, 0, sizeof m->callbacks); /* an importer may have had it on its stack */
    if (m->c != NULL)
        return &m->model;
    free(m);
    return NULL;
}
