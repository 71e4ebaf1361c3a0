/* The FMI 3.0 face, co-simulation and model exchange. All functions of the standard are exported; those of scheduled execution refuse. */
#include "fmi3Functions.h"

#include "events.h"
#include "exchange.h"
#include "instance.h"
#include "resource.h"
#include "sensitivity.h"
#include "snapshot.h"
#include "step.h"
#include "variables.h"

#define FMI(name) fmi3##name
#define FMI_STATE(before, after) fmi3##before##FMUState##after
#define FMI_INSTANCE fmi3Instance
#define FMI_REAL fmi3Float64
#define FMI_DESERIALIZE fmi3DeserializeFMUState
#define FMI_GET_DERIVATIVES fmi3GetContinuousStateDerivatives
#define FMI_SAYS_CATEGORIES true
#include "face.h"

#define REFUSE_SCHEDULED_EXECUTION(component) REFUSE(component, "there is no scheduled execution of this model")

typedef void (*LogMessage)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);

static void log_fmi3(const Instance *instance, Status status, const char *category, const char *message) {
    if (instance->message_logger != NULL)
        ((LogMessage)instance->message_logger)(instance->environment, (fmi3Status)status, category, message);
}

static const Face face = {.solver_sets_reals = true, .log = log_fmi3};

/* -- life -------------------------------------------------------------------------------------------------------- */

static Instance *create(fmi3String name, bool co_simulation, fmi3Boolean loggingOn, fmi3InstanceEnvironment environment,
                        fmi3LogMessageCallback logMessage) {
    Instance *instance = instance_create(name != NULL && *name != '\0' ? name : model.name, &face, co_simulation);
    if (instance != NULL) {
        instance->environment = environment;
        instance->message_logger = (Callback)logMessage;
        instance->debug_logging = loggingOn;
    }
    return instance;
}

/* Log why there will be no instance. */
static fmi3Instance refuse_type(fmi3String name, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logMessage) {
    Instance *instance = create(name, false, false, environment, logMessage);
    if (instance != NULL)
        instance_fail(instance, "fmi3InstantiateScheduledExecution: there is no scheduled execution of this model");
    instance_free(instance);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                          fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)visible;
    Instance *instance = create(instanceName, false, loggingOn, instanceEnvironment, logMessage);
    if (instance == NULL)
        return NULL;
    instance->exchange = true;
    return admit(instance, exchange_check_model(instance, __func__), __func__, "instantiation token", instantiationToken, resourcePath);
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
    (void)visible, (void)requiredIntermediateVariables, (void)intermediateUpdate;
    Instance *instance = create(instanceName, true, loggingOn, instanceEnvironment, logMessage);
    if (instance == NULL)
        return NULL;
    instance->event_mode_used = eventModeUsed;
    instance->early_return_allowed = earlyReturnAllowed;
    Status status = STATUS_OK;
    if (nRequiredIntermediateVariables > 0)
        status = instance_fail(instance, "fmi3InstantiateCoSimulation: intermediate variables are not provided (providesIntermediateUpdate = false)");
    return admit(instance, status, __func__, "instantiation token", instantiationToken, resourcePath);
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

/* Time begins to run. Where the importer has given away the only way to announce events, the log says so; nothing went wrong, and
   some importers end a run at a status other than OK. */
static Status start(Instance *instance) {
    if (instance->exchange)
        return exchange_start(instance);
    Status status = instance_start(instance, instance->event_mode_used ? MODE_EVENT : MODE_STEP);
    if (status == STATUS_OK && !instance->event_mode_used && model.triggered_count > 0 && !model.counts_events)
        instance_warn(instance, "eventModeUsed is false, but the events of this model (%s, ...) are announced by clocks: none can be told; "
                         "an FMU built with `--events counts` is for importers without event mode", model.triggered[0].name);
    return status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_INITIALIZATION);
    return (fmi3Status)start(instance);
}

/* -- events ------------------------------------------------------------------------------------------------------ */

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_STEP | MODE_CONTINUOUS);
    if (((Instance *)instance)->mode == MODE_STEP && !((Instance *)instance)->event_mode_used)
        return (fmi3Status)instance_fail(instance, "%s: the instance was created with eventModeUsed = false", __func__);
    ((Instance *)instance)->mode = MODE_EVENT;
    return fmi3OK;
}

static Status leave_event_mode(Instance *instance, const char *function, bool exchange, Mode next) {
    if (instance->exchange != exchange)
        return instance_fail(instance, "%s: the instance was made for %s", function, exchange ? "co-simulation" : "model exchange");
    for (int i = 0; i < model.triggered_count; i++)
        if (instance->runtime.active[i] != 0.0)
            return instance_fail(instance, "%s: clock %s is active; call fmi3UpdateDiscreteStates first, or the event is lost", function,
                                 model.triggered[i].name);
    instance->mode = next;
    return STATUS_OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_EVENT);
    return (fmi3Status)leave_event_mode(instance, __func__, false, MODE_STEP);
}

static fmi3Status check_clocks(Instance *instance, const char *function, const fmi3ValueReference references[], size_t count, const void *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return fmi3Error;
    for (size_t i = 0; i < count; i++)
        if (variables_find_among(instance, function, references[i], ROLES(ROLE_CLOCK)) == NULL)
            return fmi3Error;
    return fmi3OK;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, fmi3Clock values[]) {
    REQUIRE(instance, MODE_ANY);
    if (check_clocks(instance, __func__, valueReferences, nValueReferences, values) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        values[i] = ((Instance *)instance)->runtime.active[variables_at(valueReferences[i])->index] != 0.0;
    return fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, const fmi3Clock values[]) {
    REQUIRE(instance, MODE_EVENT);
    if (check_clocks(instance, __func__, valueReferences, nValueReferences, values) != fmi3OK)
        return fmi3Error;
    for (size_t i = 0; i < nValueReferences; i++)
        ((Instance *)instance)->runtime.active[variables_at(valueReferences[i])->index] = values[i] ? 1.0 : 0.0;
    return fmi3OK;
}

static bool any_clock_is_active(const Instance *instance) {
    for (int i = 0; i < model.triggered_count; i++)
        if (instance->runtime.active[i] != 0.0)
            return true;
    return false;
}

static void put(fmi3Boolean *place, fmi3Boolean value) {
    if (place != NULL)
        *place = value;
}

static fmi3Status update_exchange(Instance *instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
                                  fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
                                  fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    EventReport report;
    Status status = exchange_update(instance, &report);
    put(discreteStatesNeedUpdate, fmi3False);
    put(terminateSimulation, fmi3False);
    put(nominalsOfContinuousStatesChanged, fmi3False);
    put(valuesOfContinuousStatesChanged, report.states_changed);
    put(nextEventTimeDefined, report.next_defined);
    if (nextEventTime != NULL)
        *nextEventTime = report.next_time;
    return (fmi3Status)status;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate, fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged, fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined, fmi3Float64 *nextEventTime) {
    REQUIRE(instance, MODE_EVENT);
    if (((Instance *)instance)->exchange)
        return update_exchange(instance, discreteStatesNeedUpdate, terminateSimulation, nominalsOfContinuousStatesChanged,
                               valuesOfContinuousStatesChanged, nextEventTimeDefined, nextEventTime);
    bool ticked = any_clock_is_active(instance);
    Status status = events_poll_clocks(instance);
    status = status_worse(status, events_apply_until(instance, ((Instance *)instance)->runtime.clock.t));
    if (step_check_switches(instance, __func__) != STATUS_OK)
        status = STATUS_ERROR; /* in what a late event repeats */
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

static Status check_scalars(const Instance *instance, const char *function, const void *references, size_t count, const void *values, size_t value_count) {
    if (value_count != count)
        return instance_fail(instance, "%s: all variables are scalars; %zu references but %zu values", function, count, value_count);
    return instance_check_arrays(instance, function, references, count, values);
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues) {
    REQUIRE(instance, MODE_ANY);
    if (check_scalars(instance, __func__, valueReferences, nValueReferences, values, nValues) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_get_reals(instance, __func__, valueReferences, nValueReferences, values);
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues) {
    REQUIRE(instance, MODE_ANY & ~MODE_TERMINATED);
    if (check_scalars(instance, __func__, valueReferences, nValueReferences, values, nValues) != STATUS_OK)
        return fmi3Error;
    return (fmi3Status)instance_set_reals(instance, __func__, valueReferences, nValueReferences, values);
}

/* Whole numbers: an enumeration is an Int64, all others are Int32. */
#define WHOLE_NUMBERS(type, roles)                                                                                          \
    fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,    \
                             fmi3##type values[], size_t nValues) {                                                         \
        REQUIRE(instance, MODE_ANY);                                                                                        \
        if (check_scalars(instance, __func__, valueReferences, nValueReferences, values, nValues) != STATUS_OK)             \
            return fmi3Error;                                                                                               \
        for (size_t i = 0; i < nValueReferences; i++) {                                                                     \
            int64_t held = 0;                                                                                               \
            if (instance_get_integer(instance, __func__, valueReferences[i], (roles), &held) != STATUS_OK)                  \
                return fmi3Error;                                                                                           \
            values[i] = (fmi3##type)held;                                                                                   \
        }                                                                                                                   \
        return fmi3OK;                                                                                                      \
    }                                                                                                                       \
    fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,    \
                             const fmi3##type values[], size_t nValues) {                                                   \
        REQUIRE(instance, MODE_ANY & ~MODE_TERMINATED);                                                                     \
        if (check_scalars(instance, __func__, valueReferences, nValueReferences, values, nValues) != STATUS_OK)             \
            return fmi3Error;                                                                                               \
        for (size_t i = 0; i < nValueReferences; i++)                                                                       \
            if (instance_check_integer(instance, __func__, valueReferences[i], (roles), values[i]) != STATUS_OK)            \
                return fmi3Error;                                                                                           \
        for (size_t i = 0; i < nValueReferences; i++)                                                                       \
            instance_put_integer(instance, valueReferences[i], values[i]);                                                  \
        return fmi3OK;                                                                                                      \
    }

WHOLE_NUMBERS(Int32, ROLES(ROLE_COUNT) | ROLES(ROLE_INTEGER_OUTPUT) | ROLES(ROLE_OUTCOME))
WHOLE_NUMBERS(Int64, ROLES(ROLE_POLICY))

/* The other types: no variable of this model has them. */
#define NO_VARIABLES(get_or_set, type, array)                                                                             \
    fmi3Status fmi3##get_or_set##type(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                                      array values[], size_t nValues) {                                                   \
        (void)valueReferences, (void)values, (void)nValues;                                                               \
        REQUIRE(instance, MODE_ANY);                                                                                      \
        return (fmi3Status)instance_no_variables(instance, __func__, nValueReferences);                                   \
    }

#define NO_VARIABLES_OF(type)              \
    NO_VARIABLES(Get, type, fmi3##type)    \
    NO_VARIABLES(Set, type, const fmi3##type)

NO_VARIABLES_OF(Float32)
NO_VARIABLES_OF(Int8) NO_VARIABLES_OF(UInt8)
NO_VARIABLES_OF(Int16) NO_VARIABLES_OF(UInt16)
NO_VARIABLES_OF(UInt32) NO_VARIABLES_OF(UInt64)
NO_VARIABLES_OF(Boolean) NO_VARIABLES_OF(String)

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

/* -- co-simulation ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(instance, MODE_STEP);
    bool early = false;
    Status status = instance_do_step(instance, __func__, currentCommunicationPoint, communicationStepSize, &early);
    put(eventHandlingNeeded, fmi3False);
    put(terminateSimulation, ((Instance *)instance)->discarded);
    put(earlyReturn, early);
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
    REQUIRE(instance, MODE_ANY & ~MODE_INSTANTIATED);
    if (nSeed != nKnowns || nSensitivity != nUnknowns)
        return (fmi3Status)instance_fail(instance, "%s: all variables are scalars; %zu knowns but %zu seeds, %zu unknowns but room for %zu sensitivities",
                                         __func__, nKnowns, nSeed, nUnknowns, nSensitivity);
    return (fmi3Status)sensitivity_directional(instance, __func__, unknowns, nUnknowns, knowns, nKnowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance instance, const fmi3ValueReference unknowns[], size_t nUnknowns,
                                    const fmi3ValueReference knowns[], size_t nKnowns, const fmi3Float64 seed[], size_t nSeed,
                                    fmi3Float64 sensitivity[], size_t nSensitivity) {
    (void)unknowns, (void)nUnknowns, (void)knowns, (void)nKnowns, (void)seed, (void)nSeed, (void)sensitivity, (void)nSensitivity;
    REFUSE(instance, "providesAdjointDerivatives = false");
}

#define NO_CONFIGURATION(function)                                       \
    fmi3Status fmi3##function(fmi3Instance instance) {                   \
        REFUSE(instance, "there are no structural parameters");          \
    }

NO_CONFIGURATION(EnterConfigurationMode)
NO_CONFIGURATION(ExitConfigurationMode)

#define NO_INTERVALS "the clocks of this model are triggered, they have no interval"

fmi3Status fmi3GetIntervalDecimal(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                  fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)intervals, (void)qualifiers;
    REFUSE(instance, NO_INTERVALS);
}

fmi3Status fmi3GetIntervalFraction(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                                   fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]) {
    (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions, (void)qualifiers;
    REFUSE(instance, NO_INTERVALS);
}

#define NO_DECIMALS(function, type)                                                                                       \
    fmi3Status fmi3##function(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                              type values[]) {                                                                            \
        (void)valueReferences, (void)nValueReferences, (void)values;                                                      \
        REFUSE(instance, NO_INTERVALS);                                                                                   \
    }

NO_DECIMALS(GetShiftDecimal, fmi3Float64)
NO_DECIMALS(SetIntervalDecimal, const fmi3Float64)
NO_DECIMALS(SetShiftDecimal, const fmi3Float64)

#define NO_FRACTIONS(function, type)                                                                                      \
    fmi3Status fmi3##function(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences, \
                              type counters[], type resolutions[]) {                                                      \
        (void)valueReferences, (void)nValueReferences, (void)counters, (void)resolutions;                                 \
        REFUSE(instance, NO_INTERVALS);                                                                                   \
    }

NO_FRACTIONS(GetShiftFraction, fmi3UInt64)
NO_FRACTIONS(SetIntervalFraction, const fmi3UInt64)
NO_FRACTIONS(SetShiftFraction, const fmi3UInt64)

/* -- model exchange ----------------------------------------------------------------------------------------------- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance) {
    REQUIRE(instance, MODE_EVENT);
    return (fmi3Status)leave_event_mode(instance, __func__, true, MODE_CONTINUOUS);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                                       fmi3Boolean *enterEventMode, fmi3Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(instance, MODE_CONTINUOUS);
    put(enterEventMode, fmi3False);
    put(terminateSimulation, fmi3False);
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time) {
    REQUIRE_EXCHANGE(instance);
    REQUIRE(instance, EXCHANGING);
    return (fmi3Status)exchange_set_time(instance, __func__, time);
}

static fmi3Status count(Instance *instance, const char *function, size_t *place, int value) {
    if (instance_require(instance, function, MODE_ANY) != STATUS_OK)
        return fmi3Error;
    if (!instance->exchange || place == NULL)
        return (fmi3Status)instance_fail(instance, "%s: %s", function, place == NULL ? "no place for the number was given" : "the instance was made for co-simulation");
    *place = (size_t)value;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *nEventIndicators) {
    return count(instance, __func__, nEventIndicators, runtime_held_count());
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *nContinuousStates) {
    return count(instance, __func__, nContinuousStates, model.continuous);
}

fmi3Status fmi3ActivateModelPartition(fmi3Instance instance, fmi3ValueReference clockReference, fmi3Float64 activationTime) {
    (void)clockReference, (void)activationTime;
    REFUSE_SCHEDULED_EXECUTION(instance);
}
