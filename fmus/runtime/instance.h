/* An instance: a runtime with a mode, a name, a log and access to its variables. What FMI 2 and FMI 3 have in common.

   A call that is refused has no effect. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdint.h>

#include "journal.h"
#include "log.h"
#include "runtime.h"

/* Modes are bits, so that a set of allowed modes is a number. */
typedef enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALIZATION = 2,
    MODE_EVENT = 4,
    MODE_STEP = 8,
    MODE_TERMINATED = 16,
    MODE_CONTINUOUS = 32, /* model exchange: the importer's solver is at work */
    MODE_ANY = 63
} Mode;

/* What is computed when it is read and has not been since something changed; bits. */
typedef enum { OUTDATED_OUTPUTS = 1, OUTDATED_DERIVATIVES = 2, OUTDATED_INDICATORS = 4, OUTDATED_ALL = 7 } Outdated;

typedef void (*Callback)(void);

/* What differs between the FMI versions. */
typedef struct {
    bool solver_sets_reals; /* FMI 3: a solver may set states one by one, as variables */
    void (*log)(const Instance *instance, Status status, const char *category, const char *message);
} Face;

/* The runtime as it was before the present step, so that a step that cannot be done is undone. */
typedef struct {
    Clock clock;
    double *memory;
} Undo;

struct Instance {
    Runtime runtime;
    Undo undo;
    Journal journal; /* the recent past, for events that are announced late */
    const Face *face;
    int64_t mode;
    double start_time;
    bool exchange; /* model exchange, else co-simulation */
    int outdated; /* bits of `Outdated` */
    bool event_mode_used;
    bool early_return_allowed; /* FMI 3: a step may end at a periodic instant inside it */
    bool discarded;            /* the last step was */
    bool debug_logging;
    void *environment; /* of the importer, for its logger */
    Callback message_logger; /* the importer's; a copy, as the table in which FMI 2 hands it over may be gone */
    double *resource_values; /* parameters as they were read from the FMU's resources */
    char *name;
};

/* All memory of an instance in one piece, or NULL. The name is copied. Only in co-simulation is there a past to remember. */
PRIVATE Instance *instance_create(const char *name, const Face *face, bool co_simulation);
PRIVATE void instance_free(Instance *instance);

/* Whether the token of the importer's model description is the one this library was built with. */
PRIVATE bool instance_token_fits(const char *token);

PRIVATE Status instance_reset(Instance *instance);

/* From initialisation mode: time begins to run; `next` is the mode that follows. */
PRIVATE Status instance_start(Instance *instance, Mode next);

/* Before initialisation: where time will start [s]. */
PRIVATE Status instance_setup(Instance *instance, double start_time);

/* STATUS_OK, or STATUS_ERROR with a message when the instance is in none of the allowed modes. */
PRIVATE Status instance_require(const Instance *instance, const char *function, int modes);

/* "Step Mode" and the like; a list of them in `text`. */
PRIVATE const char *mode_name(int64_t mode);
PRIVATE void list_modes(char *text, size_t size, int modes);

#endif
