/* The FMI 2.0 functions, co-simulation; those of model exchange refuse. Included by face.h. */
#define FMI(name) fmi2##name
#define FMI_STATE(before, after) fmi2##before##FMUstate##after
#define FMI_INSTANCE fmi2Component
#define FMI_DESERIALIZE fmi2DeSerializeFMUstate
#include "face_both.h"

ACCESS(f64, F64, fmi2Real, double)
ACCESS(i32, I32, fmi2Integer, int32_t)
ACCESS(bool, BOOL, fmi2Boolean, bool)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2CoSimulation)
        return NULL;
    return create(name, guid, functions->componentEnvironment, functions->logger, logging);
}

void fmi2FreeInstance(fmi2Component c) {
    LEAVING(FREED, &((Instance *)c)->now.model);
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop) {
    Instance *instance = c;
    if (!tolerated(instance, tolerance_defined, tolerance))
        REFUSE;
    instance->now.time = start;
    return STATUS(may(instance, INSTANTIATED, __func__));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Instance *instance = c;
    if (!may(instance, INSTANTIATED, __func__))
        REFUSE;
    instance->now.mode = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE | STOPPED, __func__))
        REFUSE;
    LEAVING(TERMINATED, &instance->now.model);
    instance->now.mode = STOPPED;
    return END_STATUS(&instance->now.model);
}

#define VALUES(NAME, OWN, TYPE)                                                                                      \
    fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n, TYPE value[]) {               \
        return STATUS(get_##OWN(c, vr, n, value, n));                                                                \
    }                                                                                                                \
    fmi2Status fmi2Set##NAME(fmi2Component c, const fmi2ValueReference vr[], size_t n, const TYPE value[]) {         \
        return STATUS(set_##OWN(c, vr, n, value, n));                                                                \
    }
VALUES(Real, f64, fmi2Real)
VALUES(Integer, i32, fmi2Integer)
VALUES(Boolean, bool, fmi2Boolean)
VALUES(String, text, fmi2String)

/* -- derivatives --------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                        const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[], fmi2Real out[]) {
    return STATUS(directional(c, unknown, unknowns, known, knowns, seed, out));
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real value[]) {
#if HAS_INPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++) {
        double *slope = model_slope(&((Instance *)c)->now.model, vr[i]);
        if (slope == NULL || order[i] != 1)
            REFUSE;
        *slope = value[i];
    }
    return fmi2OK;
#else
    REFUSE;
#endif
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[]) {
    return STATUS(output_rates(c, vr, n, order, value));
}

/* -- steps --------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE, __func__))
        REFUSE;
    const Outcome outcome = advance(instance, t, h);
    return outcome.terminate ? fmi2Discard : (fmi2Status)outcome.status;
}

fmi2Status fmi2CancelStep(fmi2Component c) { REFUSE; }

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    if (kind != fmi2DoStepStatus)
        return fmi2Discard;
    *value = (fmi2Status)((Instance *)c)->now.last_status;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (kind != fmi2LastSuccessfulTime || HIDES_LAST_TIME)
        return fmi2Discard;
    *value = ((Instance *)c)->now.last;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) { return fmi2Discard; }

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = ((Instance *)c)->now.ended;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) { return fmi2Discard; }

/* -- model exchange ------------------------------------------------------------------------------------------------ */

fmi2Status fmi2EnterEventMode(fmi2Component c) { REFUSE; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) { REFUSE; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { REFUSE; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *enter, fmi2Boolean *end) {
    REFUSE;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { REFUSE; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) { REFUSE; }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) { REFUSE; }
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { REFUSE; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { REFUSE; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { REFUSE; }
