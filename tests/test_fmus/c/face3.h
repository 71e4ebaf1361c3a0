/* The FMI 3.0 functions, co-simulation; those of the other interfaces refuse. Included by face.h. */
#define FMI(name) fmi3##name
#define FMI_STATE(before, after) fmi3##before##FMUState##after
#define FMI_INSTANCE fmi3Instance
#define FMI_DESERIALIZE fmi3DeserializeFMUState
#include "face_both.h"

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
        REFUSE;
    instance->now.mode = next;
    return fmi3OK;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { return go(c, INSTANTIATED, CONFIGURATION, __func__); }

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    if (!may(c, CONFIGURATION, __func__))
        REFUSE;
#if HAS_STRUCTURE
    if (!model_resize(&((Instance *)c)->now.model))
        REFUSE;
#endif
    return go(c, CONFIGURATION, INSTANTIATED, __func__);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean stop_defined, fmi3Float64 stop) {
    Instance *instance = c;
    if (!tolerated(instance, tolerance_defined, tolerance))
        REFUSE;
    instance->now.time = start;
    return go(c, INSTANTIATED, INITIALIZATION, __func__);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    if (!((Instance *)c)->host.event_mode) {
        SAY(&((Instance *)c)->host, ERROR, "logStatusError", "fmi3EnterEventMode: the instance was made without event mode");
        REFUSE;
    }
    return go(c, STEP_MODE, EVENT_MODE, __func__);
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) { return go(c, EVENT_MODE, STEP_MODE, __func__); }
fmi3Status fmi3Terminate(fmi3Instance c) { return go(c, RUNNING, STOPPED, __func__); }

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
            REFUSE;
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
            REFUSE;
        for (size_t j = 0; j < slot.size; j++, k++) {
            Blob *blob = (Blob *)slot.at + j;
            if (sizes[k] > sizeof blob->bytes)
                REFUSE;
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
        REFUSE;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], CLOCK);
        if (slot.at == NULL)
            REFUSE;
        values[i] = *(const bool *)slot.at;
    }
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) {
    if (!may(c, INITIALIZATION | EVENT_MODE, __func__))
        REFUSE;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(c, vr[i], CLOCK);
        if (slot.at == NULL || slot.role != INPUT_CLOCK)
            REFUSE;
        *(bool *)slot.at = values[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
                                  fmi3IntervalQualifier qualifiers[]) {
#if HAS_INTERVALS
    if (!may(c, INITIALIZATION | EVENT_MODE, __func__))
        REFUSE;
    for (size_t i = 0; i < n; i++) {
        Qualifier qualifier;
        if (!model_interval(&((Instance *)c)->now.model, vr[i], &intervals[i], &qualifier))
            REFUSE;
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
            REFUSE;
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
        REFUSE;
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
        REFUSE;
    const Outcome outcome = advance(instance, t, h);
    *event = outcome.event;
    *terminate = outcome.terminate;
    *early = outcome.early;
    *reached = outcome.reached - outcome.lag;
    return (fmi3Status)(outcome.status > FATAL ? ERROR : outcome.status);
}

/* -- derivatives --------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
                                        const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[], size_t n_seed,
                                        fmi3Float64 out[], size_t n_out) {
    return STATUS(directional(c, unknown, unknowns, known, knowns, seed, out));
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t unknowns,
                                    const fmi3ValueReference known[], size_t knowns, const fmi3Float64 seed[], size_t n_seed,
                                    fmi3Float64 out[], size_t n_out) { REFUSE; }

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 value[], size_t count) {
    return STATUS(output_rates(c, vr, n, order, value));
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
