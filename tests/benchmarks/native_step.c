/* Timing loop over the raw functions of FMI 2: program LIBRARY GUID VR_EFFORT VR_ODOMETER VR_COUNT VR_STAMP VR_OUTPUT VR_POLICY. Prints microseconds. */
#define _POSIX_C_SOURCE 199309L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

#define STEPS 200000
#define H 0.001
#define HORIZON 10000 /* steps within replay_horizon */

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void quiet(fmi2ComponentEnvironment e, fmi2String n, fmi2Status s, fmi2String c, fmi2String m, ...) {
    (void)e, (void)n, (void)s, (void)c, (void)m;
}

static void *library;

#define FUNCTION(name) ((name##TYPE *)dlsym(library, #name))

static long first; /* number of the next step */

static void step(fmi2Component c, long count) {
    fmi2DoStepTYPE *do_step = FUNCTION(fmi2DoStep);
    for (long end = first + count; first < end; first++)
        if (do_step(c, (double)first * H, H, fmi2True) > fmi2Warning)
            exit(3);
}

static void report(const char *what, double begin, long count) {
    printf("  %-58s %8.3f us\n", what, (seconds() - begin) / (double)count * 1e6);
}

static void save_and_restore(fmi2Component c, const char *what) {
    fmi2FMUstate state = NULL;
    FUNCTION(fmi2GetFMUstate)(c, &state);
    double begin = seconds();
    for (int i = 0; i < 2000; i++) {
        FUNCTION(fmi2GetFMUstate)(c, &state);
        FUNCTION(fmi2SetFMUstate)(c, state);
    }
    report(what, begin, 2000);
    FUNCTION(fmi2FreeFMUstate)(c, &state);
}

static fmi2Component start(char **argv, const fmi2CallbackFunctions *callbacks, int policy) {
    fmi2Component c = FUNCTION(fmi2Instantiate)("benchmark", fmi2CoSimulation, argv[2], "", callbacks, fmi2False, fmi2False);
    fmi2ValueReference reference = (fmi2ValueReference)atoi(argv[8]);
    if (c == NULL || FUNCTION(fmi2SetInteger)(c, &reference, 1, &policy) != fmi2OK)
        exit(2);
    FUNCTION(fmi2SetupExperiment)(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
    FUNCTION(fmi2EnterInitializationMode)(c);
    FUNCTION(fmi2ExitInitializationMode)(c);
    first = 0;
    return c;
}

int main(int argc, char **argv) {
    if (argc < 9 || (library = dlopen(argv[1], RTLD_NOW)) == NULL)
        return 1;
    const fmi2CallbackFunctions callbacks = {quiet, calloc, free, NULL, NULL};
    const fmi2ValueReference inputs[] = {(fmi2ValueReference)atoi(argv[3]), (fmi2ValueReference)atoi(argv[4])};
    const fmi2ValueReference count = (fmi2ValueReference)atoi(argv[5]), stamp = (fmi2ValueReference)atoi(argv[6]);
    const fmi2ValueReference output = (fmi2ValueReference)atoi(argv[7]);
    fmi2Component c = start(argv, &callbacks, 1);
    save_and_restore(c, "save and restore, nothing remembered");
    step(c, 1000);
    save_and_restore(c, "save and restore, 1000 steps remembered");
    step(c, HORIZON);
    double begin = seconds();
    step(c, STEPS);
    report("doStep, 1 ms", begin, STEPS);
    begin = seconds();
    for (int i = 0; i < STEPS; i++) {
        const double values[] = {1e4, 12.0 + 1e-6 * i};
        double result;
        FUNCTION(fmi2SetReal)(c, inputs, 2, values);
        step(c, 1);
        FUNCTION(fmi2GetReal)(c, &output, 1, &result);
    }
    report("two inputs, doStep, one output (dlsym included)", begin, STEPS);
    int raised = 0;
    for (int back = 100; back <= 1000; back *= 10) {
        begin = seconds();
        for (int i = 0; i < 200; i++) {
            const double late = (double)(first - back) * H;
            raised++;
            FUNCTION(fmi2SetReal)(c, &stamp, 1, &late);
            FUNCTION(fmi2SetInteger)(c, &count, 1, &raised);
            step(c, 1);
        }
        report(back == 100 ? "doStep with an event that is 100 steps late" : "doStep with an event that is 1000 steps late", begin, 200);
    }
    FUNCTION(fmi2FreeInstance)(c);
    c = start(argv, &callbacks, 2);
    step(c, HORIZON);
    begin = seconds();
    step(c, STEPS);
    report("doStep, 1 ms, late_policy = reject (nothing remembered)", begin, STEPS);
    FUNCTION(fmi2FreeInstance)(c);
    return 0;
}
