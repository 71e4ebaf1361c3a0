/* The FMI 2.0 functions, co-simulation; those of model exchange refuse. Included by face.h. */
#define STATUS(good) ((good) ? fmi2OK : fmi2Error)

ACCESS(f64, F64, fmi2Real, double)
ACCESS(i32, I32, fmi2Integer, int32_t)
ACCESS(bool, BOOL, fmi2Boolean, bool)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    return STATUS(set_categories(&((Instance *)c)->host, on, n, names));
}

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
#if TAKES_TOLERANCE
    if (!model_tolerance(&instance->now.model, tolerance_defined ? tolerance : 0.0)) {
        SAY(&instance->host, ERROR, "logStatusError", "a tolerance of %g is too fine", tolerance);
        return fmi2Error;
    }
#endif
    instance->now.time = start;
    return STATUS(may(instance, INSTANTIATED, __func__));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Instance *instance = c;
    if (!may(instance, INSTANTIATED, __func__))
        return fmi2Error;
    instance->now.mode = INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    if (!may(c, INITIALIZATION, __func__))
        return fmi2Error;
    begin(c);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE | STOPPED, __func__))
        return fmi2Error;
    LEAVING(TERMINATED, &instance->now.model);
    instance->now.mode = STOPPED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    restart(c);
    return fmi2OK;
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

/* -- states -------------------------------------------------------------------------------------------------------- */

#if CAN_SAVE
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    Instance *instance = c;
    if (*state == NULL)
        *state = saved_copy(&instance->now);
    else
        memcpy(*state, &instance->now, sizeof instance->now);
    return STATUS(*state != NULL);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(&((Instance *)c)->now, state, sizeof(Saved));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    *size = sizeof(Saved);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    if (size != sizeof(Saved))
        return fmi2Error;
    memcpy(bytes, state, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    if (size != sizeof(Saved))
        return fmi2Error;
    *state = saved_copy((const Saved *)(const void *)bytes);
    return STATUS(*state != NULL);
}
#else
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return fmi2Error; }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return fmi2Error; }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return fmi2Error; }
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) { return fmi2Error; }
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) { return fmi2Error; }
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) { return fmi2Error; }
#endif

/* -- derivatives --------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t unknowns,
                                        const fmi2ValueReference known[], size_t knowns, const fmi2Real seed[], fmi2Real out[]) {
#if HAS_DIRECTIONAL
    for (size_t i = 0; i < unknowns; i++) {
        out[i] = 0.0;
        for (size_t j = 0; j < knowns; j++) {
            double partial;
            if (!model_sensitivity(&((Instance *)c)->now.model, unknown[i], known[j], &partial))
                return fmi2Error;
            out[i] += partial * seed[j];
        }
    }
    return fmi2OK;
#else
    return fmi2Error;
#endif
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real value[]) {
#if HAS_INPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++) {
        double *slope = model_slope(&((Instance *)c)->now.model, vr[i]);
        if (slope == NULL || order[i] != 1)
            return fmi2Error;
        *slope = value[i];
    }
    return fmi2OK;
#else
    return fmi2Error;
#endif
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[]) {
#if HAS_OUTPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++)
        if (order[i] != 1 || !model_rate(&((Instance *)c)->now.model, vr[i], &value[i]))
            return fmi2Error;
    return fmi2OK;
#else
    return fmi2Error;
#endif
}

/* -- steps --------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE, __func__))
        return fmi2Error;
    const Outcome outcome = advance(instance, t, h);
    return outcome.terminate ? fmi2Discard : (fmi2Status)outcome.status;
}

fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }

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

fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) { return fmi2Error; }
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *enter, fmi2Boolean *end) {
    return fmi2Error;
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) { return fmi2Error; }
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) { return fmi2Error; }
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) { return fmi2Error; }
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { return fmi2Error; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { return fmi2Error; }
fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) { return fmi2Error; }
