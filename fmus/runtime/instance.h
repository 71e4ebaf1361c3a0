/* An instance: a runtime with a mode, a name, a log and access to its variables. What FMI 2 and FMI 3 have in common.

   Statuses have the numbers of fmi2Status and fmi3Status. A call that is refused has no effect. */
#ifndef INSTANCE_H
#define INSTANCE_H

#include <stdint.h>

#include "runtime.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status;

/* Modes are bits, so that a set of allowed modes is a number. */
typedef enum {
    MODE_INSTANTIATED = 1,
    MODE_INITIALIZATION = 2,
    MODE_EVENT = 4,
    MODE_STEP = 8,
    MODE_TERMINATED = 16,
    MODE_ANY = 31
} Mode;

typedef struct Instance Instance;
typedef void (*Callback)(void);

/* What differs between the FMI versions. */
typedef struct {
    bool counts_events; /* FMI 2: events are announced by counts; FMI 3: by clocks */
    void (*log)(const Instance *instance, Status status, const char *category, const char *message);
} Face;

struct Instance {
    Runtime runtime;
    const Face *face;
    int64_t mode;
    int64_t rejected; /* events that came too late */
    int64_t lost;     /* events announced but never seen */
    double start_time;
    bool outputs_outdated;
    bool event_mode_used;
    bool debug_logging;
    void *environment; /* of the importer, for its logger */
    const void *callbacks;   /* FMI 2: the importer's callback table */
    Callback message_logger; /* FMI 3: the importer's logger */
    char *name;
};

/* All memory of an instance in one piece, or NULL. The name is copied. */
PRIVATE Instance *instance_create(const char *name, const Face *face);
PRIVATE void instance_free(Instance *instance);

/* Whether the token of the importer's model description is the one this library was built with. */
PRIVATE bool instance_token_fits(const char *token);

PRIVATE Status instance_reset(Instance *instance);

/* From initialisation mode: time begins to run; `next` is the mode that follows. */
PRIVATE Status instance_start(Instance *instance, Mode next);

/* Before initialisation: where time will start [s]. */
PRIVATE Status instance_setup(Instance *instance, double start_time);

/* One communication step, events included. */
PRIVATE Status instance_do_step(Instance *instance, const char *function, double current, double size);

/* -- messages: each logs and returns its status ------------------------------------------------------------------ */

#if defined(__GNUC__)
#define PRINTF_LIKE __attribute__((format(printf, 2, 3)))
#else
#define PRINTF_LIKE
#endif

PRIVATE Status instance_fail(const Instance *instance, const char *format, ...) PRINTF_LIKE;
PRIVATE Status instance_warn(const Instance *instance, const char *format, ...) PRINTF_LIKE;
PRIVATE void instance_note(const Instance *instance, const char *format, ...) PRINTF_LIKE;

/* Errors and warnings are always logged; notes only where the category logEvents is switched on (no category: all). */
PRIVATE Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const categories[]);

/* STATUS_OK, or STATUS_ERROR with a message when the instance is in none of the allowed modes. */
PRIVATE Status instance_require(const Instance *instance, const char *function, int modes);

/* -- variables --------------------------------------------------------------------------------------------------- */

/* STATUS_ERROR with a message when there is something to read or write and an array is missing. */
PRIVATE Status instance_check_arrays(const Instance *instance, const char *function, const void *references, size_t count, const void *values);

/* For the types that no variable has: STATUS_OK for none, else STATUS_ERROR with a message. */
PRIVATE Status instance_no_variables(const Instance *instance, const char *function, size_t count);

/* Read or write the real variables `references`. Nothing is written unless everything may be. */
PRIVATE Status instance_get_reals(Instance *instance, const char *function, const unsigned *references, size_t count, double *values);
PRIVATE Status instance_set_reals(Instance *instance, const char *function, const unsigned *references, size_t count, const double *values);

/* The variable behind a reference if it has the wanted role, else NULL with a message. */
PRIVATE const Variable *instance_variable(const Instance *instance, const char *function, unsigned reference, Role role);

/* -- snapshots: everything that decides the future ----------------------------------------------------------------- */

/* Save into `*state`: allocated when it is NULL, else overwritten. */
PRIVATE Status instance_save(const Instance *instance, const char *function, void **state);
PRIVATE Status instance_restore(Instance *instance, const char *function, const void *state);
PRIVATE Status instance_forget(void **state);

PRIVATE Status instance_serialized_size(const Instance *instance, const char *function, const void *state, size_t *size);
PRIVATE Status instance_serialize(const Instance *instance, const char *function, const void *state, void *bytes, size_t size);
PRIVATE Status instance_deserialize(const Instance *instance, const char *function, const void *bytes, size_t size, void **state);

#endif
