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

#define FMI(name) fmi2##name
#define FMI_STATE(before, after) fmi2##before##FMUstate##after
#define FMI_INSTANCE fmi2Component
#define FMI_REAL fmi2Real
#define FMI_DESERIALIZE fmi2DeSerializeFMUstate
#define FMI_GET_DERIVATIVES fmi2GetDerivatives
#define FMI_SAYS_CATEGORIES false
#include "face.h"

#define READABLE (MODE_INSTANTIATED | MODE_INITIALIZATION | RUNNING | MODE_TERMINATED)

static void log_fmi2(const Instance *instance, Status status, const char *category, const char *message) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)instance->message_logger;
    if (logger == NULL)
        return;
    /* Many importers show the format as it is and never read the arguments after it. */
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
    return admit(instance, status, __func__, "GUID", fmuGUID, fmuResourceLocation);
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

/* The other types: no variable of this model has them. */
#define NO_VARIABLES(get_or_set, type, array)                                                                                 \
    fmi2Status fmi2##get_or_set##type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, array value[]) {            \
        (void)vr, (void)value;                                                                                                \
        REQUIRE(c, MODE_ANY);                                                                                                 \
        return (fmi2Status)instance_no_variables(c, __func__, nvr);                                                           \
    }

NO_VARIABLES(Get, Boolean, fmi2Boolean)
NO_VARIABLES(Set, Boolean, const fmi2Boolean)
NO_VARIABLES(Get, String, fmi2String)
NO_VARIABLES(Set, String, const fmi2String)

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

#define NO_STATUS(name, type, reason)                                                          \
    fmi2Status fmi2Get##name(fmi2Component c, const fmi2StatusKind s, type *value) {           \
        (void)s, (void)value;                                                                  \
        REFUSE(c, reason);                                                                     \
    }

NO_STATUS(Status, fmi2Status, "steps are synchronous")
NO_STATUS(IntegerStatus, fmi2Integer, "there is no status of this type")
NO_STATUS(StringStatus, fmi2String, "there is no status of this type")

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    REQUIRE(c, MODE_ANY);
    if (s != fmi2LastSuccessfulTime || value == NULL)
        REFUSE(c, "only fmi2LastSuccessfulTime is known");
    *value = ((Instance *)c)->runtime.clock.t;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    REQUIRE(c, MODE_ANY);
    if (s != fmi2Terminated || value == NULL)
        REFUSE(c, "only fmi2Terminated is known");
    *value = ((Instance *)c)->discarded;
    return fmi2OK;
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
