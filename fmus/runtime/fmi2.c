/* The FMI 2.0 face, co-simulation and model exchange. All functions of the standard are exported. */
#include "fmi2Functions.h"

#include <string.h>

#include "exchange.h"
#include "instance.h"
#include "resource.h"
#include "sensitivity.h"
#include "snapshot.h"
#include "step.h"
#include "variables.h"

#define REQUIRE(component, modes)                                                \
    do {                                                                         \
        if (instance_require((component), __func__, (modes)) != STATUS_OK)       \
            return fmi2Error;                                                    \
    } while (0)

#define REFUSE(component, reason)                                                        \
    do {                                                                                 \
        if ((component) != NULL)                                                         \
            instance_fail((component), "%s: not supported: %s", __func__, (reason));     \
        return fmi2Error;                                                                \
    } while (0)

/* What a solver asks for is there once initialisation has begun. */
#define REQUIRE_EXCHANGE(component)                                                                   \
    do {                                                                                              \
        REQUIRE(component, MODE_INITIALIZATION | EXCHANGING | MODE_TERMINATED);                       \
        if (!((Instance *)(component))->exchange)                                                     \
            REFUSE(component, "the instance was made for co-simulation");                             \
    } while (0)

#define EXCHANGING (MODE_EVENT | MODE_CONTINUOUS)
#define RUNNING (MODE_STEP | EXCHANGING)
#define READABLE (MODE_INSTANTIATED | MODE_INITIALIZATION | RUNNING | MODE_TERMINATED)

static void log_fmi2(const Instance *instance, Status status, const char *category, const char *message) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)instance->message_logger;
    if (logger == NULL)
        return;
    /* Many importers show the format as it is and never look at the arguments after it. */
    if (strchr(message, '%') == NULL)
        logger(instance->environment, instance->name, (fmi2Status)status, category, message);
    else
        logger(instance->environment, instance->name, (fmi2Status)status, category, "%s", message);
}

static const Face face = {.solver_sets_reals = false, .log = log_fmi2};

/* -- life -------------------------------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[]) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_set_logging(c, __func__, false, loggingOn, nCategories, categories);
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    (void)visible;
    Instance *instance = instance_create(instanceName != NULL && *instanceName != '\0' ? instanceName : model.name, &face, fmuType == fmi2CoSimulation);
    if (instance == NULL)
        return NULL;
    instance->message_logger = functions != NULL ? (Callback)functions->logger : NULL;
    instance->environment = functions != NULL ? functions->componentEnvironment : NULL;
    instance->debug_logging = loggingOn;
    Status status = STATUS_OK;
    instance->exchange = fmuType == fmi2ModelExchange;
    if (instance->exchange)
        status = exchange_check_model(instance, __func__);
    if (status == STATUS_OK && !instance_token_fits(fmuGUID))
        status = instance_fail(instance, "fmi2Instantiate: GUID %s was expected, %s was given; library and modelDescription.xml do not belong together",
                               model.token, fmuGUID != NULL ? fmuGUID : "none");
    if (status == STATUS_OK)
        status = resource_load(instance, fmuResourceLocation);
    if (status == STATUS_OK)
        return instance;
    instance_free(instance);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) {
    instance_free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    REQUIRE(c, MODE_INSTANTIATED);
    return (fmi2Status)instance_setup(c, startTime);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    REQUIRE(c, MODE_INSTANTIATED);
    ((Instance *)c)->mode = MODE_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    REQUIRE(c, MODE_INITIALIZATION);
    return (fmi2Status)(((Instance *)c)->exchange ? exchange_start(c) : instance_start(c, MODE_STEP));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    REQUIRE(c, RUNNING);
    ((Instance *)c)->mode = MODE_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_reset(c);
}

/* -- variables --------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    REQUIRE(c, READABLE);
    return (fmi2Status)instance_get_reals(c, __func__, vr, nvr, value);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    REQUIRE(c, MODE_INSTANTIATED | MODE_INITIALIZATION | RUNNING);
    return (fmi2Status)instance_set_reals(c, __func__, vr, nvr, value);
}

#define INTEGERS (ROLES(ROLE_COUNT) | ROLES(ROLE_INTEGER_OUTPUT) | ROLES(ROLE_OUTCOME) | ROLES(ROLE_POLICY))

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    REQUIRE(c, READABLE);
    if (instance_check_arrays(c, __func__, vr, nvr, value) != STATUS_OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++) {
        int64_t held = 0;
        if (instance_get_integer(c, __func__, vr[i], INTEGERS, &held) != STATUS_OK)
            return fmi2Error;
        value[i] = (fmi2Integer)held;
    }
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    REQUIRE(c, MODE_INSTANTIATED | MODE_INITIALIZATION | RUNNING);
    if (instance_check_arrays(c, __func__, vr, nvr, value) != STATUS_OK)
        return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        if (instance_check_integer(c, __func__, vr[i], INTEGERS, value[i]) != STATUS_OK)
            return fmi2Error;
    for (size_t i = 0; i < nvr; i++)
        instance_put_integer(c, vr[i], value[i]);
    return fmi2OK;
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    (void)vr, (void)value;
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_no_variables(c, __func__, nvr);
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    (void)vr, (void)value;
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_no_variables(c, __func__, nvr);
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    (void)vr, (void)value;
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_no_variables(c, __func__, nvr);
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    (void)vr, (void)value;
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_no_variables(c, __func__, nvr);
}

/* -- state ------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_save(c, __func__, FMUstate);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_restore(c, __func__, FMUstate);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_forget(FMUstate);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_serialized_size(c, __func__, FMUstate, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_serialize(c, __func__, FMUstate, serializedState, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate) {
    REQUIRE(c, MODE_ANY);
    return (fmi2Status)instance_deserialize(c, __func__, serializedState, size, FMUstate);
}

/* -- co-simulation ----------------------------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(c, MODE_STEP);
    return (fmi2Status)instance_do_step(c, __func__, currentCommunicationPoint, communicationStepSize, NULL);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    REFUSE(c, "steps are synchronous, there is nothing to cancel");
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    REFUSE(c, "inputs are held over a step (canInterpolateInputs = false)");
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    REFUSE(c, "maxOutputDerivativeOrder = 0");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    (void)s, (void)value;
    REFUSE(c, "steps are synchronous");
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    REQUIRE(c, MODE_ANY);
    if (s != fmi2LastSuccessfulTime || value == NULL)
        REFUSE(c, "only fmi2LastSuccessfulTime is known");
    *value = ((Instance *)c)->runtime.clock.t;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s, (void)value;
    REFUSE(c, "there is no status of this type");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    REQUIRE(c, MODE_ANY);
    if (s != fmi2Terminated || value == NULL)
        REFUSE(c, "only fmi2Terminated is known");
    *value = ((Instance *)c)->discarded;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s, (void)value;
    REFUSE(c, "there is no status of this type");
}

/* -- directional derivatives ----------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    REQUIRE(c, MODE_ANY & ~MODE_INSTANTIATED);
    return (fmi2Status)sensitivity_directional(c, __func__, vUnknown_ref, nUnknown, vKnown_ref, nKnown, dvKnown, dvUnknown);
}

/* -- model exchange ----------------------------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    REQUIRE(c, MODE_CONTINUOUS);
    ((Instance *)c)->mode = MODE_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *fmi2eventInfo) {
    REQUIRE(c, MODE_EVENT);
    if (fmi2eventInfo == NULL)
        return (fmi2Status)instance_fail(c, "%s: no place for the event information was given", __func__);
    EventReport report;
    Status status = exchange_update(c, &report);
    fmi2eventInfo->newDiscreteStatesNeeded = fmi2False;
    fmi2eventInfo->terminateSimulation = fmi2False;
    fmi2eventInfo->nominalsOfContinuousStatesChanged = fmi2False;
    fmi2eventInfo->valuesOfContinuousStatesChanged = report.states_changed;
    fmi2eventInfo->nextEventTimeDefined = report.next_defined;
    fmi2eventInfo->nextEventTime = report.next_time;
    return (fmi2Status)status;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    REQUIRE(c, MODE_EVENT);
    ((Instance *)c)->mode = MODE_CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean noSetFMUStatePriorToCurrentPoint, fmi2Boolean *enterEventMode,
                                       fmi2Boolean *terminateSimulation) {
    (void)noSetFMUStatePriorToCurrentPoint;
    REQUIRE(c, MODE_CONTINUOUS);
    if (enterEventMode != NULL)
        *enterEventMode = fmi2False;
    if (terminateSimulation != NULL)
        *terminateSimulation = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    REQUIRE(c, EXCHANGING);
    return (fmi2Status)exchange_set_time(c, __func__, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    REQUIRE(c, MODE_CONTINUOUS);
    return (fmi2Status)exchange_set_states(c, __func__, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    REQUIRE_EXCHANGE(c);
    return (fmi2Status)exchange_get_derivatives(c, __func__, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real eventIndicators[], size_t ni) {
    REQUIRE_EXCHANGE(c);
    return (fmi2Status)exchange_get_indicators(c, __func__, eventIndicators, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    REQUIRE_EXCHANGE(c);
    return (fmi2Status)exchange_get_states(c, __func__, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x_nominal[], size_t nx) {
    REQUIRE_EXCHANGE(c);
    return (fmi2Status)exchange_get_nominals(c, __func__, x_nominal, nx);
}
