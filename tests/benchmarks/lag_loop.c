/* The floor: a fixed loop over instances of lag.c through the FMUs' own function pointers, written for nothing else.
 *
 * lag_loop LIBRARY... STEPS H CLOSED: a chain in the order given, each fed by its forerunner, and the first, where
 * CLOSED is 1, by the last. Every step is recorded in memory. Prints the seconds of the loop and the last row.
 */
#define _POSIX_C_SOURCE 199309L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi2Functions.h"

enum { MOST = 128 };

typedef struct {
    fmi2Component c;
    fmi2SetRealTYPE *set;
    fmi2GetRealTYPE *get;
    fmi2DoStepTYPE *step;
} Slave;

static const fmi2ValueReference INPUT[] = {0}, OUTPUT[] = {1};

static Slave load(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        fprintf(stderr, "%s\n", dlerror());
        exit(1);
    }
    fmi2InstantiateTYPE *instantiate = (fmi2InstantiateTYPE *)dlsym(library, "fmi2Instantiate");
    Slave slave = {instantiate("lag", fmi2CoSimulation, "", "", NULL, 0, 0), (fmi2SetRealTYPE *)dlsym(library, "fmi2SetReal"),
                   (fmi2GetRealTYPE *)dlsym(library, "fmi2GetReal"), (fmi2DoStepTYPE *)dlsym(library, "fmi2DoStep")};
    return slave;
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int argc, char **argv) {
    int n = argc - 4;
    long steps = atol(argv[argc - 3]);
    double h = atof(argv[argc - 2]), y[MOST] = {0};
    int closed = atoi(argv[argc - 1]);
    Slave slaves[MOST];
    if (n < 1 || n > MOST) {
        return 1;
    }
    for (int i = 0; i < n; i++) {
        slaves[i] = load(argv[1 + i]);
    }
    double *rows = malloc((size_t)steps * (size_t)(n + 1) * sizeof(double)), *row = rows;
    double begin = now();
    for (long k = 0; k < steps; k++) {
        for (int i = 0; i < n; i++) {
            if (i > 0 || closed) {
                slaves[i].set(slaves[i].c, INPUT, 1, &y[i > 0 ? i - 1 : n - 1]);
            }
            slaves[i].step(slaves[i].c, (double)k * h, h, fmi2True);
            slaves[i].get(slaves[i].c, OUTPUT, 1, &y[i]);
        }
        *row++ = (double)(k + 1) * h;
        for (int i = 0; i < n; i++) {
            *row++ = y[i];
        }
    }
    printf("%.9f", now() - begin);
    for (int i = 0; i <= n; i++) {
        printf(" %.17g", row[i - n - 1]);
    }
    printf("\n");
    return 0;
}
