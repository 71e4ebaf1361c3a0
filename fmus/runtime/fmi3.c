/* The FMI 3.0 co-simulation face. All functions of the standard are exported; those of other interface types refuse. */
#include "fmi3Functions.h"

#include "events.h"
#include "instance.h"

#define REQUIRE(component, modes)                                          \
    do {                                                                   \
        if (instance_require((component), __func__, (modes)) != STATUS_OK) \
            return fmi3Error;                                              \
    } while (0)

#define REFUSE(component, reason)                                                    \
    do {                                                                             \
        if ((component) != NULL)                                                     \
            instance_fail((component), "%s: not supported: %s", __func__, (reason)); \
        return fmi3Error;                                                            \
    } while (0)

#define REFUSE_OTHER_TYPES(component) REFUSE(component, "this FMU was exported for co-simulation only")
#define REFUSE_INTERVALS(component) REFUSE(component, "the clocks of this model are triggered, they have no interval")

typedef void (*LogMessage)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);

static void log_fmi3(const Instance *instance, Status status, const char *category, const char *message) {
    if (instance->message_logger != NULL)
        ((LogMessage)instance->message_logger)(instance->environment, (fmi3Status)status, category, message);
}

static const Face face = {.counts_events = false, .log = log_fmi3};

/* -- life -------------------------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void) {
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories, const fmi3String categories[]) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_set_logging(instance, loggingOn, nCategories, categories);
}

static Instance *create(fmi3String name, fmi3Boolean loggingOn, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    Instance *instance = instance_create(name != NULL && *name != '\0' ? name : model.name, &face);
    if (instance != NULL) {
        instance->environment = environment;
        instance->message_logger = (Callback)logMessage;
        instance->debug_logging = loggingOn;
    }
    return instance;
}

/* Log why there will be no instance. */
static fmi3Instance refuse_type(fmi3String name, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    Instance *instance = create(name, false, environment, logMessage);
    if (instance != NULL)
        instance_fail(instance, "this FMU was exported for co-simulation only");
    instance_free(instance);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    return refuse_type(instanceName, instanceEnvironment, logMessage);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                               fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
                                               fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
                                               fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible, (void)loggingOn;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return refuse_type(instanceName, instanceEnvironment, logMessage);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
                                         fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)resourcePath, (void)visible, (void)earlyReturnAllowed, (void)requiredIntermediateVariables, (void)intermediateUpdate;
    Instance *instance = create(instanceName, loggingOn, instanceEnvironment, logMessage);
    if (instance == NULL)
        return NULL;
    instance->event_mode_used = eventModeUsed;
    Status status = STATUS_OK;
    if (nRequiredIntermediateVariables > 0)
        status = instance_fail(instance, "fmi3InstantiateCoSimulation: intermediate variables are not provided (providesIntermediateUpdate = false)");
    else if (!instance_token_fits(instantiationToken))
        status = instance_fail(instance, "fmi3InstantiateCoSimulation: instantiation token %s was expected, %s was given; library and modelDescription.xml do not belong together",
                               model.token, instantiationToken != NULL ? instantiationToken : "none");
    if (status == STATUS_OK)
        return instance;
    instance_free(instance);
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance) {
    instance_free(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    REQUIRE(instance, MODE_INSTANTIATED);
    Status status = instance_setup(instance, startTime);
    if (status == STATUS_OK)
        ((Instance *)instance)->mode = MODE_INITIALIZATION;
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_INITIALIZATION);
    return (fmi3Status)instance_start(instance, ((Instance *)instance)->event_mode_used ? MODE_EVENT : MODE_STEP);
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    REQUIRE(instance, MODE_STEP | MODE_EVENT);
    ((Instance *)instance)->mode = MODE_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_reset(instance);
}

/* -- events ------------------------------------------------------------------------------------------------------ */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_STEP);
    if (!((Instance *)instance)->event_mode_used)
        return (fmi3Status)instance_fail(instance, "%s: the instance was created with eventModeUsed = false", __func__);
    ((Instance *)instance)->mode = MODE_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_EVENT);
    Instance *self = instance;
    for (int i = 0; i < model.triggered_count; i++)
        if (self->runtime.active[i] != 0.0)
            return (fmi3Status)instance_fail(self, "%s: clock %s is active; call fmi3UpdateDiscreteStates first, or the event is lost",
                                             __func__, model.triggered[i].name);
    self->mode = MODE_STEP;
    return fmi3OK;
}

static fmi3Status check_clocks(Instance *instance, const char *function, const fmi3ValueReference references[], size_t count, const void *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return fmi3Error;
    for (size_t i = 0; i < count; i++)
        if (instance_variable(instance, function, references[i], ROLE_CLOCK) == NULL)
            return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Clock values[]) {
    REQUIRE(instance, MODE_ANY);
    if (check_clocks(instance, __func__, valueReferences, nValueReferences, values) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        values[i] = ((Instance *)instance)->runtime.active[model.variables[valueReferences[i]].index] != 0.0;
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Clock values[]) {
    REQUIRE(instance, MODE_EVENT);
    if (check_clocks(instance, __func__, valueReferences, nValueReferences, values) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        ((Instance *)instance)->runtime.active[model.variables[valueReferences[i]].index] = values[i] ? 1.0 : 0.0;
    return fmi3OK;
}

/* The active clocks tick, in declared order. */
static Status tick(Instance *instance, bool *ticked) {
    Status status = STATUS_OK;
    for (int i = 0; i < model.triggered_count; i++) {
        if (instance->runtime.active[i] == 0.0)
            continue;
        *ticked = true;
        instance->runtime.active[i] = 0.0;
        Status announced = events_announce(instance, i);
        Status applied = events_apply_until(instance, instance->runtime.clock.t);
        status = announced > status ? announced : status;
        status = applied > status ? applied : status;
    }
    return status;
}

static void put(fmi3Boolean *place, fmi3Boolean value) {
    if (place != NULL)
        *place = value;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    REQUIRE(instance, MODE_EVENT);
    bool ticked = false;
    Status status = tick(instance, &ticked);
    put(discreteStatesNeedUpdate, fmi3False);
    put(terminateSimulation, fmi3False);
    put(nominalsOfContinuousStatesChanged, fmi3False);
    put(valuesOfContinuousStatesChanged, ticked);
    put(nextEventTimeDefined, fmi3False);
    if (nextEventTime != NULL)
        *nextEventTime = 0.0;
    return (fmi3Status)status;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    REFUSE(instance, "providesEvaluateDiscreteStates = false");
}

/* -- variables --------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    REQUIRE(instance, MODE_ANY);
    if (nValues != nValueReferences)
        return (fmi3Status)instance_fail(instance, "%s: all variables are scalars; %zu references but %zu values", __func__, nValueReferences, nValues);
    return (fmi3Status)instance_get_reals(instance, __func__, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    REQUIRE(instance, MODE_ANY & ~MODE_TERMINATED);
    if (nValues != nValueReferences)
        return (fmi3Status)instance_fail(instance, "%s: all variables are scalars; %zu references but %zu values", __func__, nValueReferences, nValues);
    return (fmi3Status)instance_set_reals(instance, __func__, valueReferences, nValueReferences, values);
}

/* The other types: no variable of this model has them. */
#define NO_VARIABLES(get_or_set, type, array)                                                                             \
    fmi3Status fmi3##get_or_set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                                      array values[], size_t nValues) {                                                   \
        (void)valueReferences, (void)values, (void)nValues;                                                               \
        REQUIRE(instance, MODE_ANY);                                                                                      \
        return (fmi3Status)instance_no_variables(instance, __func__, nValueReferences);                                   \
    }

NO_VARIABLES(Get, Float32, fmi3Float32)
NO_VARIABLES(Set, Float32, const fmi3Float32)
NO_VARIABLES(Get, Int8, fmi3Int8)
NO_VARIABLES(Set, Int8, const fmi3Int8)
NO_VARIABLES(Get, UInt8, fmi3UInt8)
NO_VARIABLES(Set, UInt8, const fmi3UInt8)
NO_VARIABLES(Get, Int16, fmi3Int16)
NO_VARIABLES(Set, Int16, const fmi3Int16)
NO_VARIABLES(Get, UInt16, fmi3UInt16)
NO_VARIABLES(Set, UInt16, const fmi3UInt16)
NO_VARIABLES(Get, Int32, fmi3Int32)
NO_VARIABLES(Set, Int32, const fmi3Int32)
NO_VARIABLES(Get, UInt32, fmi3UInt32)
NO_VARIABLES(Set, UInt32, const fmi3UInt32)
NO_VARIABLES(Get, Int64, fmi3Int64)
NO_VARIABLES(Set, Int64, const fmi3Int64)
NO_VARIABLES(Get, UInt64, fmi3UInt64)
NO_VARIABLES(Set, UInt64, const fmi3UInt64)
NO_VARIABLES(Get, Boolean, fmi3Boolean)
NO_VARIABLES(Set, Boolean, const fmi3Boolean)
NO_VARIABLES(Get, String, fmi3String)
NO_VARIABLES(Set, String, const fmi3String)

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         size_t valueSizes[], fmi3Binary values[], size_t nValues) {
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_no_variables(instance, __func__, nValueReferences);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                         const size_t valueSizes[], const fmi3Binary values[], size_t nValues) {
    (void)valueReferences, (void)valueSizes, (void)values, (void)nValues;
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_no_variables(instance, __func__, nValueReferences);
}

/* -- state ------------------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_save(instance, __func__, FMUState);
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_restore(instance, __func__, FMUState);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_forget(FMUState);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_serialized_size(instance, __func__, FMUState, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_serialize(instance, __func__, FMUState, serializedState, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size, fmi3FMUState *FMUState) {
    REQUIRE(instance, MODE_ANY);
    return (fmi3Status)instance_deserialize(instance, __func__, serializedState, size, FMUState);
}

/* -- co-simulation ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(instance, MODE_STEP);
    Status status = instance_do_step(instance, __func__, currentCommunicationPoint, communicationStepSize);
    put(eventHandlingNeeded, fmi3False);
    put(terminateSimulation, fmi3False);
    put(earlyReturn, fmi3False);
    if (lastSuccessfulTime != NULL)
        *lastSuccessfulTime = ((Instance *)instance)->runtime.clock.t;
    return (fmi3Status)status;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t nValues) {
    (void)valueReferences, (void)nValueReferences, (void)orders, (void)values, (void)nValues;
    REFUSE(instance, "maxOutputDerivativeOrder = 0");
}

/* -- not supported ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance, fmi3ValueReference valueReference, size_t *nDependencies) {
    (void)valueReference, (void)nDependencies;
    REFUSE(instance, "providesPerElementDependencies = false");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent, size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[], size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[], size_t nDependencies) {
    (void)dependent, (void)elementIndicesOfDependent, (void)independents, (void)elementIndicesOfIndependents, (void)dependencyKinds, (void)nDependencies;
    REFUSE(instance, "providesPerElementDependencies = false");
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                        const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[],
                                        size_t nSeed, fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    REFUSE(instance, "providesDirectionalDerivatives = false");
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                    fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    REFUSE(instance, "providesAdjointDerivatives = false");
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance) {
    REFUSE(instance, "there are no structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance) {
    REFUSE(instance, "there are no structural parameters");
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                   fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions, (void)qualifiers;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3GetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                               fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3GetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3SetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  const fmi3Float64 intervals[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3SetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                   const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3SetShiftDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                               const fmi3Float64 shifts[]) {
    (void)valueReferences, (void)nValueReferences, (void)shifts;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3SetShiftFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;
    REFUSE_INTERVALS(instance);
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint, (void)enterEventMode, (void)terminateSimulation;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    (void)time;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 continuousStates[], size_t nContinuousStates) {
    (void)continuousStates, (void)nContinuousStates;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[], size_t nContinuousStates) {
    (void)derivatives, (void)nContinuousStates;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 eventIndicators[], size_t nEventIndicators) {
    (void)eventIndicators, (void)nEventIndicators;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 continuousStates[], size_t nContinuousStates) {
    (void)continuousStates, (void)nContinuousStates;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[], size_t nContinuousStates) {
    (void)nominals, (void)nContinuousStates;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    (void)nEventIndicators;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    (void)nContinuousStates;
    REFUSE_OTHER_TYPES(instance);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    REFUSE_OTHER_TYPES(instance);
}
