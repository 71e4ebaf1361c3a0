/* The FMI 1.0 co-simulation functions; their names begin with the model identifier. Included by face.h. */
#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define FMI(name) JOIN(MODEL_IDENTIFIER, fmi##name)
#define EXPORT __attribute__((visibility("default")))
#define STATUS(good) ((good) ? fmi1OK : fmi1Error)

ACCESS(f64, F64, fmi1Real, double)
ACCESS(i32, I32, fmi1Integer, int32_t)
ACCESS(bool, BOOL, fmi1Boolean, bool)

EXPORT const char *FMI(GetTypesPlatform)(void) { return "standard32"; }
EXPORT const char *FMI(GetVersion)(void) { return "1.0"; }

EXPORT fmi1Status FMI(SetDebugLogging)(fmi1Component c, fmi1Boolean on) {
    ((Instance *)c)->host.logging = on;
    return fmi1OK;
}

EXPORT fmi1Component FMI(InstantiateSlave)(fmi1String name, fmi1String guid, fmi1String location, fmi1String mime, fmi1Real timeout,
                                           fmi1Boolean visible, fmi1Boolean interactive, fmi1CallbackFunctions functions,
                                           fmi1Boolean logging) {
    Instance *instance = create(name, guid, NULL, functions.logger, logging);
    if (instance != NULL)
        instance->host.environment = instance;
    return instance;
}

EXPORT fmi1Status FMI(InitializeSlave)(fmi1Component c, fmi1Real start, fmi1Boolean stop_defined, fmi1Real stop) {
    Instance *instance = c;
    if (!may(instance, INSTANTIATED, __func__))
        return fmi1Error;
    instance->now.time = start;
    begin(instance);
    return fmi1OK;
}

EXPORT fmi1Status FMI(TerminateSlave)(fmi1Component c) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE | STOPPED, __func__))
        return fmi1Error;
    instance->now.mode = STOPPED;
    return fmi1OK;
}

EXPORT fmi1Status FMI(ResetSlave)(fmi1Component c) {
    restart(c);
    return fmi1OK;
}

EXPORT void FMI(FreeSlaveInstance)(fmi1Component c) { free(c); }

#define VALUES(NAME, OWN, TYPE)                                                                                         \
    EXPORT fmi1Status FMI(Get##NAME)(fmi1Component c, const fmi1ValueReference vr[], size_t n, TYPE value[]) {          \
        return STATUS(get_##OWN(c, vr, n, value, n));                                                                   \
    }                                                                                                                   \
    EXPORT fmi1Status FMI(Set##NAME)(fmi1Component c, const fmi1ValueReference vr[], size_t n, const TYPE value[]) {    \
        return STATUS(set_##OWN(c, vr, n, value, n));                                                                   \
    }
VALUES(Real, f64, fmi1Real)
VALUES(Integer, i32, fmi1Integer)
VALUES(Boolean, bool, fmi1Boolean)
VALUES(String, text, fmi1String)

EXPORT fmi1Status FMI(SetRealInputDerivatives)(fmi1Component c, const fmi1ValueReference vr[], size_t n, const fmi1Integer order[],
                                               const fmi1Real value[]) {
#if HAS_INPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++) {
        double *slope = model_slope(&((Instance *)c)->now.model, vr[i]);
        if (slope == NULL || order[i] != 1)
            return fmi1Error;
        *slope = value[i];
    }
    return fmi1OK;
#else
    return fmi1Error;
#endif
}

EXPORT fmi1Status FMI(GetRealOutputDerivatives)(fmi1Component c, const fmi1ValueReference vr[], size_t n, const fmi1Integer order[],
                                                fmi1Real value[]) {
#if HAS_OUTPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++)
        if (order[i] != 1 || !model_rate(&((Instance *)c)->now.model, vr[i], &value[i]))
            return fmi1Error;
    return fmi1OK;
#else
    return fmi1Error;
#endif
}

EXPORT fmi1Status FMI(DoStep)(fmi1Component c, fmi1Real t, fmi1Real h, fmi1Boolean new_step) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE, __func__))
        return fmi1Error;
    const Outcome outcome = advance(instance, t, h);
    if (outcome.terminate)
        return fmi1Discard; /* FMI 1 has no other way to ask for the end */
    return outcome.status == PENDING ? (fmi1Status)5 : (fmi1Status)outcome.status;
}

EXPORT fmi1Status FMI(CancelStep)(fmi1Component c) { return fmi1Error; }

EXPORT fmi1Status FMI(GetStatus)(fmi1Component c, const fmi1StatusKind kind, fmi1Status *value) {
    if (kind != fmi1DoStepStatus)
        return fmi1Discard;
    *value = (fmi1Status)((Instance *)c)->now.last_status;
    return fmi1OK;
}

EXPORT fmi1Status FMI(GetRealStatus)(fmi1Component c, const fmi1StatusKind kind, fmi1Real *value) {
    if (kind != fmi1LastSuccessfulTime || HIDES_LAST_TIME)
        return fmi1Discard;
    *value = ((Instance *)c)->now.last;
    return fmi1OK;
}

EXPORT fmi1Status FMI(GetIntegerStatus)(fmi1Component c, const fmi1StatusKind kind, fmi1Integer *value) { return fmi1Discard; }
EXPORT fmi1Status FMI(GetBooleanStatus)(fmi1Component c, const fmi1StatusKind kind, fmi1Boolean *value) { return fmi1Discard; }
EXPORT fmi1Status FMI(GetStringStatus)(fmi1Component c, const fmi1StatusKind kind, fmi1String *value) { return fmi1Discard; }
