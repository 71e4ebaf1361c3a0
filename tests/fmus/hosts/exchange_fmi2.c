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
    fmi2InstantiateTYPE *Instantiate;
    fmi2FreeInstanceTYPE *FreeInstance;
    fmi2SetupExperimentTYPE *SetupExperiment;
    fmi2EnterInitializationModeTYPE *EnterInitializationMode;
    fmi2ExitInitializationModeTYPE *ExitInitializationMode;
    fmi2SetRealTYPE *SetReal;
    fmi2SetIntegerTYPE *SetInteger;
    fmi2EnterEventModeTYPE *EnterEventMode;
    fmi2NewDiscreteStatesTYPE *NewDiscreteStates;
    fmi2EnterContinuousTimeModeTYPE *EnterContinuousTimeMode;
    fmi2SetTimeTYPE *SetTime;
    fmi2SetContinuousStatesTYPE *SetContinuousStates;
    fmi2GetContinuousStatesTYPE *GetContinuousStates;
    fmi2GetDerivativesTYPE *GetDerivatives;
    fmi2GetEventIndicatorsTYPE *GetEventIndicators;
    fmi2GetDirectionalDerivativeTYPE *GetDirectionalDerivative;
    fmi2DoStepTYPE *DoStep;
    fmi2GetFMUstateTYPE *GetFMUstate;
    fmi2SetFMUstateTYPE *SetFMUstate;
    fmi2FreeFMUstateTYPE *FreeFMUstate;
    fmi2SerializedFMUstateSizeTYPE *SerializedFMUstateSize;
    fmi2SerializeFMUstateTYPE *SerializeFMUstate;
    fmi2DeSerializeFMUstateTYPE *DeSerializeFMUstate;
} Model2;

#define M ((Model2 *)model)

#include "exchange_calls.h"

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

static size_t save(Model *model, char **bytes) {
    fmi2FMUstate state = NULL;
    size_t size;
    must("fmi2GetFMUstate", (int)M->GetFMUstate(M->c, &state));
    must("fmi2SerializedFMUstateSize", (int)M->SerializedFMUstateSize(M->c, state, &size));
    *bytes = malloc(size);
    must("fmi2SerializeFMUstate", (int)M->SerializeFMUstate(M->c, state, *bytes, size));
    must("fmi2FreeFMUstate", (int)M->FreeFMUstate(M->c, &state));
    return size;
}

static int try_restore(Model *model, const char *bytes, size_t size) {
    fmi2FMUstate state = NULL;
    int status = (int)M->DeSerializeFMUstate(M->c, bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)M->SetFMUstate(M->c, state);
    must("fmi2FreeFMUstate", (int)M->FreeFMUstate(M->c, &state));
    return status;
}

Model *open_model2(const char *name, const char *library, const char *token, const char *resources) {
    Model2 *m = calloc(1, sizeof *m);
    m->model = (Model){enter_initialization, exit_initialization, set_reals,  announce,   update,          enter_event_mode,
                       enter_continuous_time_mode, set_time,      set_states, get_states, get_derivatives, get_indicators,
                       directional,          do_step,             save,       try_restore, close_model};
    void *handle = load_library(library);
    find_function(handle, "fmi2Instantiate", &m->Instantiate);
    find_function(handle, "fmi2FreeInstance", &m->FreeInstance);
    find_function(handle, "fmi2SetupExperiment", &m->SetupExperiment);
    find_function(handle, "fmi2EnterInitializationMode", &m->EnterInitializationMode);
    find_function(handle, "fmi2ExitInitializationMode", &m->ExitInitializationMode);
    find_function(handle, "fmi2SetReal", &m->SetReal);
    find_function(handle, "fmi2SetInteger", &m->SetInteger);
    find_function(handle, "fmi2EnterEventMode", &m->EnterEventMode);
    find_function(handle, "fmi2NewDiscreteStates", &m->NewDiscreteStates);
    find_function(handle, "fmi2EnterContinuousTimeMode", &m->EnterContinuousTimeMode);
    find_function(handle, "fmi2SetTime", &m->SetTime);
    find_function(handle, "fmi2SetContinuousStates", &m->SetContinuousStates);
    find_function(handle, "fmi2GetContinuousStates", &m->GetContinuousStates);
    find_function(handle, "fmi2GetDerivatives", &m->GetDerivatives);
    find_function(handle, "fmi2GetEventIndicators", &m->GetEventIndicators);
    find_function(handle, "fmi2GetDirectionalDerivative", &m->GetDirectionalDerivative);
    find_function(handle, "fmi2DoStep", &m->DoStep);
    find_function(handle, "fmi2GetFMUstate", &m->GetFMUstate);
    find_function(handle, "fmi2SetFMUstate", &m->SetFMUstate);
    find_function(handle, "fmi2FreeFMUstate", &m->FreeFMUstate);
    find_function(handle, "fmi2SerializedFMUstateSize", &m->SerializedFMUstateSize);
    find_function(handle, "fmi2SerializeFMUstate", &m->SerializeFMUstate);
    find_function(handle, "fmi2DeSerializeFMUstate", &m->DeSerializeFMUstate);
    memcpy(&m->callbacks, &(fmi2CallbackFunctions){log_message, calloc, free, NULL, NULL}, sizeof m->callbacks);
    m->c = m->Instantiate(name, fmi2ModelExchange, token, resources, &m->callbacks, fmi2False, fmi2False);
    memset(&m->callbacks, 0, sizeof m->callbacks); /* an importer may have had it on its stack */
    if (m->c != NULL)
        return &m->model;
    free(m);
    return NULL;
}
