/* What a model exchange instance of FMI 2.0 and of FMI 3.0 does with the same words; included where `M` is its own type. */
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

#endif
