/* The functions of FMI around a model: what the three versions share. Ends by including the face of FMI_VERSION. */
#ifndef FACE_H
#define FACE_H

/* The functions have the parameters of the standard, whether a small model needs them or not. */
#pragma GCC diagnostic ignored "-Wunused-parameter"

#define TIME_SLACK 1e-9

#ifndef LEAVING
#define LEAVING(event, model) /* fmi2Terminate and fmi2FreeInstance of one that does not go in peace */
#endif
#ifndef END_STATUS
#define END_STATUS(model) fmi2OK /* of fmi2Terminate */
#endif

typedef struct {
    Model model;
    double time;
    double last;  /* FMI 1 and 2: how far the last doStep came */
    Status last_status;
    bool ended;   /* FMI 2: the last doStep asked for the end */
    Mode mode;
    bool set; /* an input was set since the last step */
} Saved; /* all that a state holds */

typedef struct {
    Saved now;
    Host host;
} Instance;

static Instance *create(const char *name, const char *token, void *environment, Logger log, bool logging) {
    Instance *instance = calloc(1, sizeof *instance);
    if (instance == NULL)
        return NULL;
    Host *host = &instance->host;
    snprintf(host->name, sizeof host->name, "%s", name != NULL ? name : "");
    host->environment = environment;
    host->log = log;
    host->logging = logging;
    for (int i = 0; i < CATEGORIES; i++)
        host->category_on[i] = true;
    instance->now.mode = INSTANTIATED;
    if (token == NULL || strcmp(token, TOKEN) != 0) {
        SAY(host, ERROR, "logStatusError", "%s: the token of the instance is not that of the FMU", host->name);
        free(instance);
        return NULL;
    }
    model_start(&instance->now.model);
    return instance;
}

/* Whether a function may be called now; the message says what the importer did wrong. */
static bool may(Instance *instance, int modes, const char *function) {
    if (instance->now.mode & modes)
        return true;
    SAY(&instance->host, ERROR, "logStatusError", "%s must not be called in mode %d of 1 instantiated, 2 configuration, "
        "4 initialization, 8 event, 16 step, 32 stopped", function, (int)instance->now.mode);
    return false;
}

static void restart(Instance *instance) {
    memset(&instance->now, 0, sizeof instance->now);
    model_start(&instance->now.model);
    instance->now.mode = INSTANTIATED;
}

static bool set_categories(Host *host, bool on, size_t count, const char *const names[]) {
    host->logging = on;
    for (int i = 0; i < CATEGORIES; i++)
        host->category_on[i] = count == 0;
    for (size_t k = 0; k < count; k++) {
        bool known = false;
        for (int i = 0; i < CATEGORIES; i++)
            if (strcmp(names[k], log_categories[i]) == 0)
                known = host->category_on[i] = true;
        if (!known) {
            SAY(host, ERROR, "logStatusError", "there is no log category '%s'", names[k]);
            return false;
        }
    }
    return true;
}

/* Whether variables may be read now (FMI 2.0.5, 4.2.4); an instance that was read when they may not be is lost. */
static bool gettable(Instance *instance) {
    if (REFUSES_GET_AT_START && instance->now.mode == INITIALIZATION)
        return false;
    if (!REFUSES_GET_AFTER_SET || instance->now.mode != STEP_MODE || !instance->now.set)
        return true;
    SAY(&instance->host, ERROR, "logStatusError", "a get after a set without a step between them");
    instance->now.mode = STOPPED;
    return false;
}

/* -- values -------------------------------------------------------------------------------------------------------- */

static Slot find(Instance *instance, unsigned reference, Kind kind) {
    Slot slot = model_slot(&instance->now.model, reference);
    if (slot.at == NULL || slot.kind != kind) {
        SAY(&instance->host, ERROR, "logStatusError", "value reference %u: no variable of this type", reference);
        slot.at = NULL;
    }
    return slot;
}

/* Whether a variable may be set now. */
static bool settable(Instance *instance, const Slot *slot, unsigned reference) {
    const Mode mode = instance->now.mode;
    int modes = INSTANTIATED | INITIALIZATION;
    if (slot->role == INPUT)
        modes |= EVENT_MODE | STEP_MODE;
    else if (slot->role == CLOCKED_INPUT)
        modes = EVENT_MODE;
    else if (slot->role == STRUCTURAL)
        modes = CONFIGURATION;
    else if (slot->role != PARAMETER)
        modes = 0;
    const bool ticking = slot->role != CLOCKED_INPUT || slot->clock == NULL || *slot->clock;
    if ((mode & modes) && ticking) {
        instance->now.set = mode == STEP_MODE;
        return true;
    }
    SAY(&instance->host, ERROR, "logStatusError", "value reference %u cannot be set in mode %d%s", reference, (int)mode,
        ticking ? "" : ": its clock is not active");
    return false;
}

static void refresh(Instance *instance) {
#if FROZEN_OUTPUTS
    if (instance->now.mode & (STEP_MODE | STOPPED))
        return; /* they were computed at the end of the last step */
#endif
    model_refresh(&instance->now.model);
}

/* A getter and a setter for one type: `TYPE` as FMI has it, `KIND` and `OWN` as the model has it. */
#define GETTER(NAME, KIND, TYPE, OWN)                                                                        \
    static bool NAME(Instance *instance, const unsigned *references, size_t n, TYPE *values, size_t count) { \
        size_t k = 0;                                                                                        \
        if (!gettable(instance))                                                                             \
            return false;                                                                                    \
        refresh(instance);                                                                                   \
        for (size_t i = 0; i < n; i++) {                                                                     \
            const Slot slot = find(instance, references[i], KIND);                                           \
            if (slot.at == NULL || k + slot.size > count)                                                    \
                return false;                                                                                \
            for (size_t j = 0; j < slot.size; j++)                                                           \
                values[k++] = (TYPE)((const OWN *)slot.at)[j];                                               \
        }                                                                                                    \
        return k == count;                                                                                   \
    }

#define SETTER(NAME, KIND, TYPE, OWN)                                                                              \
    static bool NAME(Instance *instance, const unsigned *references, size_t n, const TYPE *values, size_t count) { \
        size_t k = 0;                                                                                              \
        for (size_t i = 0; i < n; i++) {                                                                           \
            const Slot slot = find(instance, references[i], KIND);                                                 \
            if (slot.at == NULL || k + slot.size > count || !settable(instance, &slot, references[i]))             \
                return false;                                                                                      \
            for (size_t j = 0; j < slot.size; j++)                                                                 \
                ((OWN *)slot.at)[j] = (OWN)values[k++];                                                            \
        }                                                                                                          \
        return k == count;                                                                                         \
    }

#define ACCESS(NAME, KIND, TYPE, OWN)    \
    GETTER(get_##NAME, KIND, TYPE, OWN)  \
    SETTER(set_##NAME, KIND, TYPE, OWN)

static bool get_text(Instance *instance, const unsigned *references, size_t n, const char **values, size_t count) {
    size_t k = 0;
    refresh(instance);
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(instance, references[i], TEXT);
        if (slot.at == NULL || k + slot.size > count)
            return false;
        for (size_t j = 0; j < slot.size; j++)
            values[k++] = ((const Text *)slot.at)[j].text;
    }
    return k == count;
}

static bool set_text(Instance *instance, const unsigned *references, size_t n, const char *const *values, size_t count) {
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        const Slot slot = find(instance, references[i], TEXT);
        if (slot.at == NULL || k + slot.size > count || !settable(instance, &slot, references[i]))
            return false;
        for (size_t j = 0; j < slot.size; j++, k++) {
            if (values[k] == NULL || strlen(values[k]) >= sizeof(Text))
                return false;
            memcpy(((Text *)slot.at)[j].text, values[k], strlen(values[k]) + 1);
        }
    }
    return k == count;
}

/* -- steps --------------------------------------------------------------------------------------------------------- */

static bool here(Instance *instance, double t, double h) {
    const double slack = TIME_SLACK * (1.0 + fabs(t));
    if (fabs(t - instance->now.time) <= slack && h > 0.0)
        return true;
    SAY(&instance->host, ERROR, "logStatusError", "doStep(%.17g, %.17g): the FMU stands at %.17g and steps forward only", t, h,
        instance->now.time);
    return false;
}

/* Without event mode the model handles its own events, at the communication point. */
static bool settle_alone(Instance *instance, Outcome *outcome) {
    for (int i = 0; i < 100; i++) {
        const Update update = model_update(&instance->now.model, &instance->host, outcome->reached);
        outcome->terminate = outcome->terminate || update.terminate;
        if (!update.again)
            return true;
    }
    SAY(&instance->host, ERROR, "logStatusError", "the discrete states do not settle");
    return false;
}

static Outcome advance(Instance *instance, double t, double h) {
    Saved *now = &instance->now;
    if (!here(instance, t, h))
        return (Outcome){.status = ERROR, .reached = now->time};
    instance->host.length = h;
    now->set = false;
    Outcome outcome = model_step(&now->model, &instance->host, t, t + h);
    if (outcome.status <= DISCARD)
        now->time = outcome.reached;
    if (outcome.status <= WARNING) {
        if (!instance->host.event_mode && !settle_alone(instance, &outcome))
            outcome.status = ERROR;
        model_refresh(&now->model);
    }
    now->last = outcome.reached;
    now->last_status = outcome.status;
    now->ended = outcome.terminate;
    return outcome;
}

static void begin(Instance *instance) {
    model_begin(&instance->now.model, instance->now.time);
    if (!instance->host.event_mode) {
        Outcome outcome = arrived(instance->now.time);
        settle_alone(instance, &outcome);
    }
    model_refresh(&instance->now.model);
    instance->now.mode = instance->host.event_mode ? EVENT_MODE : STEP_MODE;
}

#if CAN_SAVE
static Saved *saved_copy(const Saved *state) {
    Saved *copy = malloc(sizeof *copy);
    if (copy != NULL)
        memcpy(copy, state, sizeof *copy);
    return copy;
}
#endif

#if FMI_VERSION == 1
#include "face1.h"
#elif FMI_VERSION == 2
#include "face2.h"
#else
#include "face3.h"
#endif

#endif
