/* What a model exchange instance of FMI 2.0 and of FMI 3.0 does with the same words, those of ``words_fmi2.h`` or
   ``words_fmi3.h``; included where OWN is its own type, `M` the instance as one, and FUNCTIONS the file that lists the functions
   that are called. */
#ifndef EXCHANGE_CALLS_H
#define EXCHANGE_CALLS_H

static int exit_initialization(Model *model) {
    return (int)M->ExitInitializationMode(M->c);
}

static int enter_event_mode(Model *model) {
    return (int)M->EnterEventMode(M->c);
}

static int enter_continuous_time_mode(Model *model) {
    return (int)M->EnterContinuousTimeMode(M->c);
}

static int set_time(Model *model, double t) {
    return (int)M->SetTime(M->c, t);
}

static int set_states(Model *model, const double *x, size_t count) {
    return (int)M->SetContinuousStates(M->c, x, count);
}

static int get_states(Model *model, double *x, size_t count) {
    return (int)M->GetContinuousStates(M->c, x, count);
}

static int get_indicators(Model *model, double *z, size_t count) {
    return (int)M->GetEventIndicators(M->c, z, count);
}

static void must(const char *call, int status) {
    if (status > SLAVE_WARNING)
        die("%s returned status %d", call, status);
}

static void close_model(Model *model) {
    M->FreeInstance(M->c);
    free(model);
}

static size_t save(Model *model, char **bytes) {
    FMI_STATE(, ) state = NULL;
    size_t size;
    must("getting a state", (int)M->STATE(Get, )(M->c, &state));
    must("asking for the size of a state", (int)M->STATE(Serialized, Size)(M->c, state, &size));
    *bytes = malloc(size);
    must("serialising a state", (int)M->STATE(Serialize, )(M->c, state, (FMI_BYTE *)*bytes, size));
    must("freeing a state", (int)M->STATE(Free, )(M->c, &state));
    return size;
}

static int try_restore(Model *model, const char *bytes, size_t size) {
    FMI_STATE(, ) state = NULL;
    int status = (int)M->DESERIALIZE(M->c, (const FMI_BYTE *)bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)M->STATE(Set, )(M->c, state);
    must("freeing a state", (int)M->STATE(Free, )(M->c, &state));
    return status;
}

#define CALLS                                                                                                                \
    (Model) {                                                                                                                \
        enter_initialization, exit_initialization, set_reals, announce, update, enter_event_mode, enter_continuous_time_mode, \
            set_time, set_states, get_states, get_derivatives, get_indicators, directional, do_step, save, try_restore,      \
            close_model                                                                                                      \
    }

/* The calls of the instance, and its functions from the library. */
static void load(OWN *m, const char *library) {
    m->model = CALLS;
    void *handle = load_library(library);
#define FUNCTION(name) find_function(handle, FMI #name, &m->name);
#include FUNCTIONS
#undef FUNCTION
}

#endif
