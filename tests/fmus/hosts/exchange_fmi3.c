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
    fmi3InstantiateModelExchangeTYPE *InstantiateModelExchange;
    fmi3FreeInstanceTYPE *FreeInstance;
    fmi3EnterInitializationModeTYPE *EnterInitializationMode;
    fmi3ExitInitializationModeTYPE *ExitInitializationMode;
    fmi3SetFloat64TYPE *SetFloat64;
    fmi3SetClockTYPE *SetClock;
    fmi3EnterEventModeTYPE *EnterEventMode;
    fmi3UpdateDiscreteStatesTYPE *UpdateDiscreteStates;
    fmi3EnterContinuousTimeModeTYPE *EnterContinuousTimeMode;
    fmi3SetTimeTYPE *SetTime;
    fmi3SetContinuousStatesTYPE *SetContinuousStates;
    fmi3GetContinuousStatesTYPE *GetContinuousStates;
    fmi3GetContinuousStateDerivativesTYPE *GetContinuousStateDerivatives;
    fmi3GetEventIndicatorsTYPE *GetEventIndicators;
    fmi3GetDirectionalDerivativeTYPE *GetDirectionalDerivative;
    fmi3DoStepTYPE *DoStep;
    fmi3GetFMUStateTYPE *GetFMUState;
    fmi3SetFMUStateTYPE *SetFMUState;
    fmi3FreeFMUStateTYPE *FreeFMUState;
    fmi3SerializedFMUStateSizeTYPE *SerializedFMUStateSize;
    fmi3SerializeFMUStateTYPE *SerializeFMUState;
    fmi3DeserializeFMUStateTYPE *DeserializeFMUState;
} Model3;

#define M ((Model3 *)model)

#include "exchange_calls.h"

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

static size_t save(Model *model, char **bytes) {
    fmi3FMUState state = NULL;
    size_t size;
    must("fmi3GetFMUState", (int)M->GetFMUState(M->c, &state));
    must("fmi3SerializedFMUStateSize", (int)M->SerializedFMUStateSize(M->c, state, &size));
    *bytes = malloc(size);
    must("fmi3SerializeFMUState", (int)M->SerializeFMUState(M->c, state, (fmi3Byte *)*bytes, size));
    must("fmi3FreeFMUState", (int)M->FreeFMUState(M->c, &state));
    return size;
}

static int try_restore(Model *model, const char *bytes, size_t size) {
    fmi3FMUState state = NULL;
    int status = (int)M->DeserializeFMUState(M->c, (const fmi3Byte *)bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)M->SetFMUState(M->c, state);
    must("fmi3FreeFMUState", (int)M->FreeFMUState(M->c, &state));
    return status;
}

Model *open_model3(const char *name, const char *library, const char *token, const char *resources) {
    Model3 *m = calloc(1, sizeof *m);
    m->model = (Model){enter_initialization, exit_initialization, set_reals,  announce,   update,          enter_event_mode,
                       enter_continuous_time_mode, set_time,      set_states, get_states, get_derivatives, get_indicators,
                       directional,          do_step,             save,       try_restore, close_model};
    void *handle = load_library(library);
    find_function(handle, "fmi3InstantiateModelExchange", &m->InstantiateModelExchange);
    find_function(handle, "fmi3FreeInstance", &m->FreeInstance);
    find_function(handle, "fmi3EnterInitializationMode", &m->EnterInitializationMode);
    find_function(handle, "fmi3ExitInitializationMode", &m->ExitInitializationMode);
    find_function(handle, "fmi3SetFloat64", &m->SetFloat64);
    find_function(handle, "fmi3SetClock", &m->SetClock);
    find_function(handle, "fmi3EnterEventMode", &m->EnterEventMode);
    find_function(handle, "fmi3UpdateDiscreteStates", &m->UpdateDiscreteStates);
    find_function(handle, "fmi3EnterContinuousTimeMode", &m->EnterContinuousTimeMode);
    find_function(handle, "fmi3SetTime", &m->SetTime);
    find_function(handle, "fmi3SetContinuousStates", &m->SetContinuousStates);
    find_function(handle, "fmi3GetContinuousStates", &m->GetContinuousStates);
    find_function(handle, "fmi3GetContinuousStateDerivatives", &m->GetContinuousStateDerivatives);
    find_function(handle, "fmi3GetEventIndicators", &m->GetEventIndicators);
    find_function(handle, "fmi3GetDirectionalDerivative", &m->GetDirectionalDerivative);
    find_function(handle, "fmi3DoStep", &m->DoStep);
    find_function(handle, "fmi3GetFMUState", &m->GetFMUState);
    find_function(handle, "fmi3SetFMUState", &m->SetFMUState);
    find_function(handle, "fmi3FreeFMUState", &m->FreeFMUState);
    find_function(handle, "fmi3SerializedFMUStateSize", &m->SerializedFMUStateSize);
    find_function(handle, "fmi3SerializeFMUState", &m->SerializeFMUState);
    find_function(handle, "fmi3DeserializeFMUState", &m->DeserializeFMUState);
    m->c = m->InstantiateModelExchange(name, token, resources, fmi3False, fmi3False, m, log_message);
    if (m->c != NULL)
        return &m->model;
    free(m);
    return NULL;
}
