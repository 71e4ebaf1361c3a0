/* The other side, as a model sees it: may it return early, is event mode used, the log, the intermediate update.
 *
 * Included by a model after it defined `Model` and `Scratch`.
 */
#ifndef HOST_H
#define HOST_H

#if FMI_VERSION == 1
#include "fmi1Functions.h"
typedef fmi1CallbackLogger Logger;
#elif FMI_VERSION == 2
#include "fmi2Functions.h"
typedef fmi2CallbackLogger Logger;
#else
#include "fmi3Functions.h"
typedef fmi3LogMessageCallback Logger;
#endif

#define NAME_SIZE 128

#ifndef LOG_CATEGORIES
#define LOG_CATEGORIES "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logAll"
#endif
static const char *const log_categories[] = {LOG_CATEGORIES};
enum { CATEGORIES = sizeof log_categories / sizeof *log_categories };

typedef enum { INSTANTIATED = 1, CONFIGURATION = 2, INITIALIZATION = 4, EVENT_MODE = 8, STEP_MODE = 16, STOPPED = 32 } Mode;
#define RUNNING (EVENT_MODE | STEP_MODE | STOPPED)

typedef struct {
    char name[NAME_SIZE];
    void *environment; /* of the FMI 1 face: the component */
    Logger log;
    bool logging, category_on[CATEGORIES];
    bool event_mode, early_allowed;
    double length; /* of the step under way [s], as it was handed over */
    Scratch scratch;
#if FMI_VERSION == 3
    fmi3IntermediateUpdateCallback intermediate;
#endif
} Host;

static inline bool wants(const Host *host, Status status, const char *category) {
    if (host->log == NULL)
        return false;
    if (status >= DISCARD)
        return true; /* what goes wrong is always said */
    for (int i = 0; host->logging && i < CATEGORIES; i++)
        if (strcmp(category, log_categories[i]) == 0)
            return host->category_on[i];
    return false;
}

/* One message, printf-style. FMI 1 and 2 hand the arguments over, FMI 3 has the finished text. */
#if FMI_VERSION == 3
#define SAY(host, status, category, ...)                                                     \
    do {                                                                                     \
        if (wants((host), (status), (category))) {                                           \
            char said_[512];                                                                 \
            snprintf(said_, sizeof said_, __VA_ARGS__);                                      \
            (host)->log((host)->environment, (fmi3Status)(status), (category), said_);       \
        }                                                                                    \
    } while (0)
#elif FMI_VERSION == 2
#define SAY(host, status, category, ...)                                                                             \
    do {                                                                                                             \
        if (wants((host), (status), (category)))                                                                     \
            (host)->log((host)->environment, (host)->name, (fmi2Status)(status), (category), __VA_ARGS__);           \
    } while (0)
#else
#define SAY(host, status, category, ...)                                                                             \
    do {                                                                                                             \
        if (wants((host), (status), (category)))                                                                     \
            (host)->log((host)->environment, (host)->name, (fmi1Status)(status), (category), __VA_ARGS__);           \
    } while (0)
#endif

static inline Outcome arrived(double until) {
    return (Outcome){.status = OK, .reached = until};
}

#endif
