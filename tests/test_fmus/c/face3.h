/* The FMI 3.0 functions, co-simulation; those of the other interfaces refuse. Included by face.h. */
#define STATUS(good) ((good) ? fmi3OK : fmi3Error)
#define REFUSE return fmi3Error

ACCESS(f64, F64, fmi3Float64, double)
ACCESS(f32, F32, fmi3Float32, float)
ACCESS(i8, I8, fmi3Int8, int8_t)
ACCESS(u8, U8, fmi3UInt8, uint8_t)
ACCESS(i16, I16, fmi3Int16, int16_t)
ACCESS(u16, U16, fmi3UInt16, uint16_t)
ACCESS(i32, I32, fmi3Int32, int32_t)
ACCESS(u32, U32, fmi3UInt32, uint32_t)
ACCESS(i64, I64, fmi3Int64, int64_t)
ACCESS(u64, U64, fmi3UInt64, uint64_t)
ACCESS(bool, BOOL, fmi3Boolean, bool)

/* -- life ---------------------------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[]) {
    return STATUS(set_categories(&((Instance *)c)->host, on, n, names));
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n_required, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback intermediate) {
    Instance *instance = create(name, token, environment, log, logging);
    if (instance != NULL) {
        instance->host.event_mode = event_mode && HAS_EVENT_MODE;
        instance->host.early_allowed = early && MIGHT_RETURN_EARLY;
        instance->host.intermediate = intermediate;
    }
    return instance;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    return NULL;
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

/* From one of `modes` to `next`. */
static fmi3Status go(Instance *instance, int modes, Mode next, const char *function) {
    if (!may(instance, modes, function))
        return fmi3Error;
    instance->now.mode = next;
    return fmi3OK;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return go(c, INSTANTIATED, CONFIGURATION, __func__); }

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    if (!may(c, CONFIGURATION, __func__))
        return fmi3Error;
#if HAS_STRUCTURE
    if (!model_resize(&((Instance *)c)->now.model))
        return fmi3Error;
#endif
    return go(c, CONFIGURATION, INSTANTIATED, __func__);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
    Instance *instance = c;
#if TAKES_TOLERANCE
    if (!model_tolerance(&instance->now.model, tolerance_defined ? tolerance : 0.0)) {
        SAY(&instance->host, ERROR, "logStatusError", "a tolerance of %g is too fine", tolerance);
        return fmi3Error;
    }
#endif
    instance->now.time = start;
    return go(c, INSTANTIATED, INITIALIZATION, __func__);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    if (!may(c, INITIALIZATION, __func__))
        return fmi3Error;
    begin(c);
    return fmi3OK;
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    if (!((Instance *)c)->host.event_mode) {
        SAY(&((Instance *)c)->host, ERROR, "logStatusError", "fmi3EnterEventMode: the instance was made without event mode");
        return fmi3Error;
    }
    return go(c, STEP_MODE, EVENT_MODE, __func__);
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) { return go(c, EVENT_MODE, STEP_MODE, __func__); }
fmi3Status fmi3Terminate(fmi3Instance c) { return go(c, RUNNING, STOPPED, __func__); }

fmi3Status fmi3Reset(fmi3Instance c) {
    restart(c);
    return fmi3OK;
}

/* -- values -------------------------------------------------------------------------------------------------------- */

#define VALUES(NAME, OWN)                                                                                                        \
    fmi3Status fmi3Get##NAME(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##NAME value[], size_t count) {        \
        return STATUS(get_##OWN(c, vr, n, value, count));                                                                        \
    }                                                                                                                            \
    fmi3Status fmi3Set##NAME(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##NAME value[], size_t count) {  \
        return STATUS(set_##OWN(c, vr, n, value, count));                                                                        \
    }
VALUES(Float64, f64)
VALUES(Float32, f32)
VALUES(Int8, i8)
VALUES(UInt8, u8)
VALUES(Int16, i16)
VALUES(UInt16, u16)
VALUES(Int32, i32)
VALUES(UInt32, u32)
VALUES(Int64, i64)
VALUES(UInt64, u64)
VALUES(Boolean, bool)
VALUES(String, text)

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[], size_t count) {
    size_t k = 0;
    refresh(c);
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], BLOB);
        if (slot.at == NULL || k + slot.size > count)
            return fmi3Error;
        for (size_t j = 0; j < slot.size; j++, k++) {
            sizes[k] = ((const Blob *)slot.at)[j].size;
            values[k] = ((const Blob *)slot.at)[j].bytes;
        }
    }
    return STATUS(k == count);
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary values[],
                         size_t count) {
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], BLOB);
        if (slot.at == NULL || k + slot.size > count || !settable(c, &slot, vr[i]))
            return fmi3Error;
        for (size_t j = 0; j < slot.size; j++, k++) {
            Blob *blob = (Blob *)slot.at + j;
            if (sizes[k] > sizeof blob->bytes)
                return fmi3Error;
            blob->size = sizes[k];
            if (sizes[k] > 0)
                memcpy(blob->bytes, values[k], sizes[k]);
        }
    }
    return STATUS(k == count);
}

/* -- clocks -------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock values[]) {
    if (!may(c, INITIALIZATION | EVENT_MODE, __func__))
        return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], CLOCK);
        if (slot.at == NULL)
            return fmi3Error;
        values[i] = *(const bool *)slot.at;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
    if (!may(c, INITIALIZATION | EVENT_MODE, __func__))
        return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], CLOCK);
        if (slot.at == NULL || slot.role != INPUT_CLOCK)
            return fmi3Error;
        *(bool *)slot.at = values[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
#if HAS_INTERVALS
    if (!may(c, INITIALIZATION | EVENT_MODE, __func__))
        return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        Qualifier qualifier;
        if (!model_interval(&((Instance *)c)->now.model, vr[i], &intervals[i], &qualifier))
            return fmi3Error;
        qualifiers[i] = (fmi3IntervalQualifier)qualifier;
    }
    return fmi3OK;
#else
    REFUSE;
#endif
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]) {
#if HAS_INTERVALS
    for (size_t i = 0; i < n; i++)
        if (!model_shift(&((Instance *)c)->now.model, vr[i], &shifts[i]))
            return fmi3Error;
    return fmi3OK;
#else
    REFUSE;
#endif
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                   fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) { REFUSE; }
fmi3Status fmi3GetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3UInt64 counters[],
                                fmi3UInt64 resolutions[]) { REFUSE; }
fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 intervals[]) { REFUSE; }
fmi3Status fmi3SetIntervalFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                   const fmi3UInt64 resolutions[]) { REFUSE; }
fmi3Status fmi3SetShiftDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[]) { REFUSE; }
fmi3Status fmi3SetShiftFraction(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 counters[],
                                const fmi3UInt64 resolutions[]) { REFUSE; }

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) { REFUSE; }

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next) {
    Instance *instance = c;
    if (!may(instance, EVENT_MODE, __func__))
        return fmi3Error;
    const Update update = model_update(&instance->now.model, &instance->host, instance->now.time);
    *again = update.again;
    *terminate = update.terminate;
    *nominals = *values = false;
    *has_next = update.has_next;
    *next = update.next;
    return fmi3OK;
}

/* -- steps --------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_return, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *reached) {
    Instance *instance = c;
    if (!may(instance, STEP_MODE, __func__))
        return fmi3Error;
    const Outcome outcome = advance(instance, t, h);
    *event = outcome.event;
    *terminate = outcome.terminate;
    *early = outcome.early;
    *reached = outcome.reached - outcome.lag;
    return (fmi3Status)(outcome.status > FATAL ? ERROR : outcome.status);
}

/* -- states -------------------------------------------------------------------------------------------------------- */

#if CAN_SAVE
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    Instance *instance = c;
    if (*state == NULL)
        *state = saved_copy(&instance->now);
    else
        memcpy(*state, &instance->now, sizeof instance->now);
    return STATUS(*state != NULL);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(&((Instance *)c)->now, state, sizeof(Saved));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    *size = sizeof(Saved);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    if (size != sizeof(Saved))
        return fmi3Error;
    memcpy(bytes, state, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    if (size != sizeof(Saved))
        return fmi3Error;
    *state = saved_copy((const Saved *)(const void *)bytes);
    return STATUS(*state != NULL);
}
#else
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { REFUSE; }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { REFUSE; }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { REFUSE; }
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) { REFUSE; }
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) { REFUSE; }
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) { REFUSE; }
#endif

/* -- derivatives --------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
                                        const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[], size_t n_seed,
                                        fmi3Float64 out[], size_t n_out) {
#if HAS_DIRECTIONAL
    for (size_t i = 0; i < unknowns; i++) {
        out[i] = 0.0;
        for (size_t j = 0; j < knowns; j++) {
            double partial;
            if (!model_sensitivity(&((Instance *)c)->now.model, unknown[i], known[j], &partial))
                return fmi3Error;
            out[i] += partial * seed[j];
        }
    }
    return fmi3OK;
#else
    REFUSE;
#endif
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
                                    const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[], size_t n_seed,
                                    fmi3Float64 out[], size_t n_out) { REFUSE; }

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 value[], size_t count) {
#if HAS_OUTPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++)
        if (order[i] != 1 || !model_rate(&((Instance *)c)->now.model, vr[i], &value[i]))
            return fmi3Error;
    return fmi3OK;
#else
    REFUSE;
#endif
}

/* -- what a co-simulation FMU need not do -------------------------------------------------------------------------- */

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n) { REFUSE; }
fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t dependent[], fmi3ValueReference independent[],
                                       size_t elements[], fmi3DependencyKind kinds[], size_t n) { REFUSE; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { REFUSE; }
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_return, fmi3Boolean *enter, fmi3Boolean *end) { REFUSE; }
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) { REFUSE; }
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) { REFUSE; }
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) { REFUSE; }
fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) { REFUSE; }
fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { REFUSE; }
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) { REFUSE; }
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) { REFUSE; }
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) { REFUSE; }
fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t) { REFUSE; }
