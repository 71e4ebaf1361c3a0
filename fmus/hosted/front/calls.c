/* Calls handed on to pythonfmu, one by one; an error that Python reported meanwhile becomes the status. */
#include "front.h"

static fmi2Status status_of(const Front *front, fmi2Status status) {
    return front->failed || status > fmi2Error ? fmi2Error : status;
}

#define HAND_ON(c, call)                          \
    do {                                          \
        Front *front = (c);                       \
        if (front == NULL)                        \
            return fmi2Error;                     \
        front->failed = false;                    \
        fmi2Status status = front->library.call;  \
        return status_of(front, status);          \
    } while (0)

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    HAND_ON(c, SetupExperiment(front->component, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    HAND_ON(c, EnterInitializationMode(front->component));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    HAND_ON(c, ExitInitializationMode(front->component));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    HAND_ON(c, Terminate(front->component));
}

fmi2Status fmi2Reset(fmi2Component c) {
    Front *front = c;
    if (front == NULL)
        return fmi2Error;
    front->failed = front->discarded = false;
    fmi2Status status = front->library.Reset(front->component);
    return status == fmi2OK ? reported(front) : fmi2Error;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    HAND_ON(c, GetReal(front->component, vr, nvr, value));
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    HAND_ON(c, GetInteger(front->component, vr, nvr, value));
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    HAND_ON(c, GetBoolean(front->component, vr, nvr, value));
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    HAND_ON(c, GetString(front->component, vr, nvr, value));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    HAND_ON(c, SetReal(front->component, vr, nvr, value));
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    HAND_ON(c, SetInteger(front->component, vr, nvr, value));
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    HAND_ON(c, SetBoolean(front->component, vr, nvr, value));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    HAND_ON(c, SetString(front->component, vr, nvr, value));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    Front *front = c;
    if (front == NULL)
        return fmi2Error;
    front->failed = false;
    fmi2Status status = status_of(front, front->library.DoStep(front->component, currentCommunicationPoint, communicationStepSize,
                                                               noSetFMUStatePriorToCurrentPoint));
    front->discarded = status == fmi2Discard;
    return status;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    HAND_ON(c, GetRealStatus(front->component, s, value));
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (c == NULL || value == NULL || s != fmi2Terminated)
        return fmi2Error;
    *value = ((Front *)c)->discarded;
    return fmi2OK;
}
