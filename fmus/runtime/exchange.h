/* Model exchange: the importer's solver moves time and continuous states; the model gives derivatives and event indicators, and
   says what happens at events. Knows no FMI version.

   Dry friction is resolved for the signs of the moving states (-1, 0, 1); on which side of a switching function the model is, is
   held as its switch (0, 1). Both are discrete states of the instance: set at the end of initialisation and at events, constant in between, so that a solver sees smooth equations. */
#ifndef EXCHANGE_H
#define EXCHANGE_H

#include "instance.h"

/* What is reported to the importer after an event. */
typedef struct {
    bool states_changed;
    bool next_defined;
    double next_time; /* [s] of the next time event */
} EventReport;

/* STATUS_OK, or STATUS_ERROR with a message for a model whose equations depend on communication steps. */
PRIVATE Status exchange_check_model(const Instance *instance, const char *function);

/* From initialisation mode to event mode: time begins to run. */
PRIVATE Status exchange_start(Instance *instance);

PRIVATE Status exchange_set_time(Instance *instance, const char *function, double t);
PRIVATE Status exchange_set_states(Instance *instance, const char *function, const double *states, size_t count);
PRIVATE Status exchange_get_states(Instance *instance, const char *function, double *states, size_t count);
PRIVATE Status exchange_get_nominals(Instance *instance, const char *function, double *nominals, size_t count);

/* STATUS_DISCARD with a message when one is not a finite number: a solver may try a smaller step. */
PRIVATE Status exchange_get_derivatives(Instance *instance, const char *function, double *derivatives, size_t count);
PRIVATE Status exchange_get_indicators(Instance *instance, const char *function, double *indicators, size_t count);

/* Everything that happens now: what comes to rest, time events, announced events, what breaks away. */
PRIVATE Status exchange_update(Instance *instance, EventReport *report);

#endif
