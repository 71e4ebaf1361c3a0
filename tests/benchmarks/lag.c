/* The smallest useful FMI 2.0 co-simulation FMU: dx = 1 + u - 2 x from 0, one explicit Euler step in each
 * communication step, y = x. Input 0, output 1. So little happens in it that a benchmark sees the master.
 */
#include <stdlib.h>

#include "fmi2Functions.h"

typedef struct {
    double u, x;
} Lag;

#define LAG(c) ((Lag *)(c))
#define NOT_HERE { return fmi2Error; }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)guid, (void)resources, (void)callbacks, (void)visible, (void)logging;
    return calloc(1, sizeof(Lag));
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return) {
    (void)t, (void)no_return;
    LAG(c)->x += h * (1.0 + LAG(c)->u - 2.0 * LAG(c)->x);
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        value[i] = vr[i] == 0 ? LAG(c)->u : LAG(c)->x;
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        *(vr[i] == 0 ? &LAG(c)->u : &LAG(c)->x) = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    LAG(c)->u = LAG(c)->x = 0.0;
    return fmi2OK;
}

#define STATE fmi2Component c, fmi2FMUstate
fmi2Status fmi2GetFMUstate(STATE *state) {
    if (*state == NULL) {
        *state = malloc(sizeof(Lag));
    }
    *LAG(*state) = *LAG(c);
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(STATE state) {
    *LAG(c) = *LAG(state);
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(STATE *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

#define SILENT { (void)c; return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) SILENT
fmi2Status fmi2ExitInitializationMode(fmi2Component c) SILENT
fmi2Status fmi2Terminate(fmi2Component c) SILENT
fmi2Status fmi2CancelStep(fmi2Component c) SILENT

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#define VARIABLES fmi2Component c, const fmi2ValueReference vr[], size_t n
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) SILENT
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start, fmi2Boolean stops,
                               fmi2Real stop) SILENT
fmi2Status fmi2GetInteger(VARIABLES, fmi2Integer value[]) NOT_HERE
fmi2Status fmi2GetBoolean(VARIABLES, fmi2Boolean value[]) NOT_HERE
fmi2Status fmi2GetString(VARIABLES, fmi2String value[]) NOT_HERE
fmi2Status fmi2SetInteger(VARIABLES, const fmi2Integer value[]) NOT_HERE
fmi2Status fmi2SetBoolean(VARIABLES, const fmi2Boolean value[]) NOT_HERE
fmi2Status fmi2SetString(VARIABLES, const fmi2String value[]) NOT_HERE
fmi2Status fmi2SerializedFMUstateSize(STATE state, size_t *size) NOT_HERE
fmi2Status fmi2SerializeFMUstate(STATE state, fmi2Byte bytes[], size_t size) NOT_HERE
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) NOT_HERE
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t m,
                                        const fmi2ValueReference known[], size_t n, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) NOT_HERE
fmi2Status fmi2SetRealInputDerivatives(VARIABLES, const fmi2Integer order[], const fmi2Real value[]) NOT_HERE
fmi2Status fmi2GetRealOutputDerivatives(VARIABLES, const fmi2Integer order[], fmi2Real value[]) NOT_HERE
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) NOT_HERE
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) NOT_HERE
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) NOT_HERE
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) NOT_HERE
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) NOT_HERE
