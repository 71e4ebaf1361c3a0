/* An instance: its life, its modes, and the beginning of time. The same for FMI 2 and FMI 3. */
#include "instance.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "resource.h"
#include "variables.h"

/* -- life -------------------------------------------------------------------------------------------------------- */

PRIVATE Instance *instance_create(const char *name, const Face *face, bool co_simulation) {
    size_t undo = co_simulation ? runtime_memory_length() : 0;
    size_t past = co_simulation ? journal_length() : 0;
    size_t numbers = (runtime_total_length() + resource_length() + undo + past) * sizeof(double);
    size_t integers = (size_t)model.integer_work * sizeof(int);
    size_t length = strlen(name) + 1;
    char *piece = calloc(1, sizeof(Instance) + numbers + integers + length);
    if (piece == NULL)
        return NULL;
    Instance *instance = (Instance *)piece;
    double *place = (double *)(piece + sizeof(Instance));
    instance->face = face;
    instance->resource_values = place + runtime_total_length();
    instance->undo.memory = instance->resource_values + resource_length();
    journal_place(&instance->journal, past > 0 ? instance->undo.memory + undo : NULL);
    instance->name = piece + sizeof(Instance) + numbers + integers;
    memcpy(instance->name, name, length);
    instance->mode = MODE_INSTANTIATED;
    instance->outdated = OUTDATED_ALL;
    runtime_place(&instance->runtime, place, (int *)(piece + sizeof(Instance) + numbers));
    return instance;
}

PRIVATE void instance_free(Instance *instance) {
    free(instance);
}

PRIVATE bool instance_token_fits(const char *token) {
    return token != NULL && strcmp(token, model.token) == 0;
}

PRIVATE Status instance_reset(Instance *instance) {
    runtime_reset(&instance->runtime);
    resource_apply(instance);
    journal_clear(&instance->journal);
    instance->mode = MODE_INSTANTIATED;
    instance->start_time = 0.0;
    instance->discarded = false;
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

/* -- modes ------------------------------------------------------------------------------------------------------- */

PRIVATE const char *mode_name(int64_t mode) {
    switch (mode) {
    case MODE_INSTANTIATED: return "Instantiated";
    case MODE_INITIALIZATION: return "Initialization Mode";
    case MODE_EVENT: return "Event Mode";
    case MODE_STEP: return "Step Mode";
    case MODE_CONTINUOUS: return "Continuous-Time Mode";
    default: return "Terminated";
    }
}

PRIVATE void list_modes(char *text, size_t size, int modes) {
    text[0] = '\0';
    for (int mode = MODE_INSTANTIATED; mode < MODE_ANY; mode *= 2) {
        if (modes & mode) {
            size_t used = strlen(text);
            snprintf(text + used, size - used, "%s%s", used ? ", " : "", mode_name(mode));
        }
    }
}

PRIVATE Status instance_require(const Instance *instance, const char *function, int modes) {
    if (instance == NULL)
        return STATUS_ERROR;
    if (instance->mode & modes)
        return STATUS_OK;
    char allowed[128];
    list_modes(allowed, sizeof allowed, modes);
    return instance_fail(instance, "%s: not allowed in %s; allowed in: %s", function, mode_name(instance->mode), allowed);
}

/* -- the beginning of time --------------------------------------------------------------------------------------- */

static const char *parameter_name(int position) {
    return variables_name(ROLES(ROLE_FIXED) | ROLES(ROLE_TUNABLE), position);
}

static Status cannot_run(const Instance *instance, const char *name, double value) {
    return instance_fail(instance, "time cannot run with parameter %s = %.17g; set it to a legal value", name, value);
}

/* With the values of the parameters and states that the requirement names. */
static Status not_fulfilled(const Instance *instance, const Requirement *requirement) {
    char values[MOST_NAMED * 128] = "";
    for (int i = 0; i < requirement->named_count; i++) {
        size_t used = strlen(values);
        int place = requirement->named[i], state = place - model.parameters;
        const char *name = state < 0 ? parameter_name(place) : variables_name(ROLES(ROLE_STATE), state);
        double value = state < 0 ? instance->runtime.p[place] : instance->runtime.x[state];
        snprintf(values + used, sizeof values - used, "%s%s = %.17g", used ? ", " : " (", name, value);
    }
    return instance_fail(instance, "time cannot run with these values: %s%s%s", requirement->text, values, values[0] ? ")" : "");
}

PRIVATE Status instance_start(Instance *instance, Mode next) {
    double horizon = *instance->runtime.horizon;
    if (!(horizon >= 0.0 && isfinite(horizon)))
        return cannot_run(instance, "replay_horizon", horizon);
    const Requirement *unfulfilled = runtime_unfulfilled(&instance->runtime, true);
    if (unfulfilled != NULL)
        return not_fulfilled(instance, unfulfilled);
    runtime_choose_seed(&instance->runtime, instance->name);
    int refused = runtime_start(&instance->runtime, instance->start_time);
    if (refused >= 0)
        return cannot_run(instance, parameter_name(refused), instance->runtime.p[refused]);
    instance->mode = next;
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

PRIVATE Status instance_setup(Instance *instance, double start_time) {
    if (!isfinite(start_time))
        return instance_fail(instance, "the start time %g s is not a finite number", start_time);
    instance->start_time = instance->runtime.clock.t = instance->runtime.clock.t0 = start_time;
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}
