/* A model exchange instance of FMI 3.0. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "exchange.h"
#include "fmi3FunctionTypes.h"
#include "slave.h"

typedef struct {
    Model model;
    fmi3Instance c;
#define FUNCTION(name) fmi3##name##TYPE *name;
#include "exchange_functions_fmi3.h"
#undef FUNCTION
} Model3;

#define M ((Model3 *)model)

static void log_message(void *environment, fmi3Status status, const char *category, const char *message) {
    (void)environment, (void)category;
    fprintf(stderr, "[%d]: %s\n", (int)status, message);
}

static int enter_initialization(Model *model) {
    return (int)M->EnterInitializationMode(M->c, fmi3False, 0.0, 0.0, fmi3False, 0.0);
}

static int set_reals(Model *model, const unsigned *references, size_t count, const double *values) {
    return (int)M->SetFloat64(M->c, references, count, values, count);
}

static int announce(Model *model, unsigned reference, int count) {
    const fmi3Clock active = fmi3ClockActive;
    (void)count;
    return (int)M->SetClock(M->c, &reference, 1, &active);
}

static int update(Model *model, double *next_time) {
    fmi3Boolean more = fmi3True, terminate, nominals, values, defined = fmi3False;
    int status = SLAVE_OK;
    while (more && status <= SLAVE_WARNING)
        status = (int)M->UpdateDiscreteStates(M->c, &more, &terminate, &nominals, &values, &defined, next_time);
    if (!defined)
        *next_time = INFINITY;
    return status;
}

static int get_derivatives(Model *model, double *dx, size_t count) {
    return (int)M->GetContinuousStateDerivatives(M->c, dx, count);
}

static int directional(Model *model, unsigned unknown, unsigned known, double seed, double *sensitivity) {
    return (int)M->GetDirectionalDerivative(M->c, &unknown, 1, &known, 1, &seed, 1, sensitivity, 1);
}

static int do_step(Model *model, double t, double h) {
    fmi3Boolean event, terminate, early;
    double last;
    return (int)M->DoStep(M->c, t, h, fmi3True, &event, &terminate, &early, &last);
}

#define OWN Model3
#define FUNCTIONS "exchange_functions_fmi3.h"
#include "words_fmi3.h"
#include "exchange_calls.h"

Model *open_model3(const char *name, const char *library, const char *token, const char *resources) {
    Model3 *m = calloc(1, sizeof *m);
    load(m, library);
    m->c = m->InstantiateModelExchange(name, token, resources, fmi3False, fmi3False, m, log_message);
    if (m->c != NULL)
        return &m->model;
    free(m);
    return NULL;
}
