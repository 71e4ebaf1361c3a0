/* A plain C program that loads a hosted FMU: library, GUID, resources URI, value references of input and output, value of the input.
   Prints the output after 100 steps of 10 ms, twice: the second time in a second instance. */
#include "fmi2Functions.h"

#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *library;

static void *symbol(const char *name) {
    void *found = dlsym(library, name);
    if (found == NULL)
        exit(4);
    return found;
}

#define LOAD(function) \
    fmi2##function##TYPE *function; \
    do { \
        void *found = symbol("fmi2" #function); \
        memcpy(&function, &found, sizeof found); \
    } while (0)

static void show(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)environment, (void)name, (void)category;
    printf("%d %s\n", (int)status, message);
}

int main(int count, char **words) {
    if (count < 7 || (library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL)) == NULL)
        return 5;
    LOAD(Instantiate);
    LOAD(SetReal);
    LOAD(SetupExperiment);
    LOAD(EnterInitializationMode);
    LOAD(ExitInitializationMode);
    LOAD(DoStep);
    LOAD(GetReal);
    LOAD(FreeInstance);
    fmi2CallbackFunctions callbacks = {show, calloc, free, NULL, NULL};
    fmi2ValueReference in = (fmi2ValueReference)atoi(words[4]), out = (fmi2ValueReference)atoi(words[5]);
    fmi2Real value = atof(words[6]);
    for (int turn = 0; turn < 2; turn++) {
        fmi2Component c = Instantiate("plain C", fmi2CoSimulation, words[2], words[3], &callbacks, fmi2False, fmi2False);
        if (c == NULL)
            return 2;
        SetReal(c, &in, 1, &value);
        SetupExperiment(c, fmi2False, 0.0, 0.0, fmi2False, 0.0);
        EnterInitializationMode(c);
        ExitInitializationMode(c);
        for (int k = 0; k < 100; k++)
            if (DoStep(c, k * 0.01, 0.01, fmi2True) != fmi2OK)
                return 3;
        fmi2Real result = 0.0;
        GetReal(c, &out, 1, &result);
        printf("%.17g\n", result);
        FreeInstance(c);
    }
    dlclose(library);
    return 0;
}
