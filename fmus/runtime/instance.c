/* An instance: mode, log, variables and snapshots, the same for FMI 2 and FMI 3. */
#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "events.h"

#define MESSAGE_LENGTH 512

/* -- life -------------------------------------------------------------------------------------------------------- */

PRIVATE Instance *instance_create(const char *name, const Face *face) {
    size_t numbers = runtime_total_length() * sizeof(double);
    size_t integers = (size_t)model.integer_work * sizeof(int);
    size_t length = strlen(name) + 1;
    char *piece = calloc(1, sizeof(Instance) + numbers + integers + length);
    if (piece == NULL)
        return NULL;
    Instance *instance = (Instance *)piece;
    instance->face = face;
    instance->mode = MODE_INSTANTIATED;
    instance->outputs_outdated = true;
    instance->name = piece + sizeof(Instance) + numbers + integers;
    memcpy(instance->name, name, length);
    runtime_place(&instance->runtime, (double *)(piece + sizeof(Instance)), (int *)(piece + sizeof(Instance) + numbers));
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
    instance->mode = MODE_INSTANTIATED;
    instance->rejected = instance->lost = 0;
    instance->start_time = 0.0;
    instance->outputs_outdated = true;
    return STATUS_OK;
}

/* -- messages ---------------------------------------------------------------------------------------------------- */

static void log_message(const Instance *instance, Status status, const char *category, const char *format, va_list arguments) {
    char message[MESSAGE_LENGTH];
    vsnprintf(message, sizeof message, format, arguments);
    instance->face->log(instance, status, category, message);
}

PRIVATE Status instance_fail(const Instance *instance, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    log_message(instance, STATUS_ERROR, "logStatusError", format, arguments);
    va_end(arguments);
    return STATUS_ERROR;
}

PRIVATE Status instance_warn(const Instance *instance, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    log_message(instance, STATUS_WARNING, "logStatusWarning", format, arguments);
    va_end(arguments);
    return STATUS_WARNING;
}

PRIVATE void instance_note(const Instance *instance, const char *format, ...) {
    if (!instance->debug_logging)
        return;
    va_list arguments;
    va_start(arguments, format);
    log_message(instance, STATUS_OK, "logEvents", format, arguments);
    va_end(arguments);
}

PRIVATE Status instance_set_logging(Instance *instance, bool on, size_t count, const char *const categories[]) {
    bool wanted = count == 0;
    for (size_t i = 0; i < count && categories != NULL; i++)
        wanted = wanted || (categories[i] != NULL && strcmp(categories[i], "logEvents") == 0);
    instance->debug_logging = on && wanted;
    return STATUS_OK;
}

static const char *mode_name(int64_t mode) {
    switch (mode) {
    case MODE_INSTANTIATED: return "Instantiated";
    case MODE_INITIALIZATION: return "Initialization Mode";
    case MODE_EVENT: return "Event Mode";
    case MODE_STEP: return "Step Mode";
    default: return "Terminated";
    }
}

static void list_modes(char *text, size_t size, int modes) {
    text[0] = '\0';
    for (int mode = MODE_INSTANTIATED; mode <= MODE_TERMINATED; mode *= 2) {
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

/* -- variables --------------------------------------------------------------------------------------------------- */

static const Variable *find(const Instance *instance, const char *function, unsigned reference) {
    if (reference < model.variable_count)
        return &model.variables[reference];
    instance_fail(instance, "%s: there is no variable with value reference %u; the last one is %u", function, reference,
                  model.variable_count - 1);
    return NULL;
}

PRIVATE const Variable *instance_variable(const Instance *instance, const char *function, unsigned reference, Role role) {
    const Variable *variable = find(instance, function, reference);
    if (variable != NULL && variable->role != role) {
        instance_fail(instance, "%s: %s (value reference %u) is of another type", function, variable->name, reference);
        return NULL;
    }
    return variable;
}

static double *place_of(Instance *instance, const Variable *variable) {
    Runtime *runtime = &instance->runtime;
    switch (variable->role) {
    case ROLE_TIME: return &runtime->clock.t;
    case ROLE_INPUT:
    case ROLE_PAYLOAD: return &runtime->u[variable->index];
    case ROLE_OUTPUT: return &runtime->y[variable->index];
    case ROLE_STATE: return &runtime->x[variable->index];
    case ROLE_FIXED:
    case ROLE_TUNABLE: return &runtime->p[variable->index];
    case ROLE_STAMP: return &runtime->stamps[variable->index];
    default: return NULL;
    }
}

/* Modes in which a variable of this role may be set. */
static int settable_modes(const Instance *instance, Role role) {
    int before = MODE_INSTANTIATED | MODE_INITIALIZATION;
    switch (role) {
    case ROLE_INPUT:
    case ROLE_TUNABLE: return before | MODE_STEP | MODE_EVENT;
    case ROLE_PAYLOAD:
    case ROLE_STAMP: return before | (instance->face->counts_events ? MODE_STEP : MODE_EVENT);
    case ROLE_STATE:
    case ROLE_FIXED: return before;
    default: return 0;
    }
}

static Status check_settable(const Instance *instance, const char *function, unsigned reference) {
    const Variable *variable = find(instance, function, reference);
    if (variable == NULL)
        return STATUS_ERROR;
    if (variable->role == ROLE_COUNT || variable->role == ROLE_CLOCK)
        return instance_fail(instance, "%s: %s (value reference %u) is of another type", function, variable->name, reference);
    int modes = settable_modes(instance, variable->role);
    if (instance->mode & modes)
        return STATUS_OK;
    if (modes == 0)
        return instance_fail(instance, "%s: %s (value reference %u) is computed and cannot be set", function, variable->name, reference);
    char allowed[128];
    list_modes(allowed, sizeof allowed, modes);
    return instance_fail(instance, "%s: %s (value reference %u) cannot be set in %s, only in: %s", function, variable->name,
                         reference, mode_name(instance->mode), allowed);
}

PRIVATE Status instance_check_arrays(const Instance *instance, const char *function, const void *references, size_t count, const void *values) {
    if (count > 0 && (references == NULL || values == NULL))
        return instance_fail(instance, "%s: the array of value references or of values is missing", function);
    return STATUS_OK;
}

PRIVATE Status instance_no_variables(const Instance *instance, const char *function, size_t count) {
    return count == 0 ? STATUS_OK : instance_fail(instance, "%s: this model has no variables of this type", function);
}

PRIVATE Status instance_get_reals(Instance *instance, const char *function, const unsigned *references, size_t count, double *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = find(instance, function, references[i]);
        if (variable == NULL)
            return STATUS_ERROR;
        const double *place = place_of(instance, variable);
        if (place == NULL)
            return instance_fail(instance, "%s: %s (value reference %u) is of another type", function, variable->name, references[i]);
        if (variable->role == ROLE_OUTPUT && instance->outputs_outdated) {
            runtime_update_outputs(&instance->runtime);
            instance->outputs_outdated = false;
        }
        values[i] = *place;
    }
    return STATUS_OK;
}

PRIVATE Status instance_set_reals(Instance *instance, const char *function, const unsigned *references, size_t count, const double *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < count; i++)
        if (check_settable(instance, function, references[i]) != STATUS_OK)
            return STATUS_ERROR;
    for (size_t i = 0; i < count; i++)
        *place_of(instance, &model.variables[references[i]]) = values[i];
    instance->outputs_outdated = true;
    return STATUS_OK;
}

/* -- time -------------------------------------------------------------------------------------------------------- */

static const char *parameter_name(int index) {
    for (unsigned i = 0; i < model.variable_count; i++) {
        Role role = model.variables[i].role;
        if ((role == ROLE_FIXED || role == ROLE_TUNABLE) && model.variables[i].index == index)
            return model.variables[i].name;
    }
    return "?";
}

static const char *state_name(int index) {
    for (unsigned i = 0; i < model.variable_count; i++)
        if (model.variables[i].role == ROLE_STATE && model.variables[i].index == index)
            return model.variables[i].name;
    return "?";
}

PRIVATE Status instance_start(Instance *instance, Mode next) {
    int refused = runtime_start(&instance->runtime, instance->start_time);
    if (refused >= 0)
        return instance_fail(instance, "time cannot run with parameter %s = %.17g; set it to a legal value", parameter_name(refused),
                             instance->runtime.p[refused]);
    instance->mode = next;
    instance->outputs_outdated = true;
    return STATUS_OK;
}

PRIVATE Status instance_setup(Instance *instance, double start_time) {
    if (!isfinite(start_time))
        return instance_fail(instance, "the start time %g s is not a finite number", start_time);
    instance->start_time = instance->runtime.clock.t = instance->runtime.clock.t0 = start_time;
    instance->outputs_outdated = true;
    return STATUS_OK;
}

static Status check_step(const Instance *instance, const char *function, double current, double size) {
    double t = instance->runtime.clock.t;
    if (!(size > 0.0) || !isfinite(current + size))
        return instance_fail(instance, "%s: communicationStepSize = %.17g s is not a positive number", function, size);
    /* An importer may add its times up; what is forgiven here is not lost, the runtime goes on from its own time. */
    if (!(fabs(current - t) <= 1e-6 * size + runtime_tolerance(&instance->runtime, t)))
        return instance_fail(instance, "%s: currentCommunicationPoint = %.17g s, but the model stands at %.17g s", function, current, t);
    return STATUS_OK;
}

PRIVATE Status instance_do_step(Instance *instance, const char *function, double current, double size) {
    if (check_step(instance, function, current, size) != STATUS_OK)
        return STATUS_ERROR;
    instance->outputs_outdated = true;
    Status counts = instance->face->counts_events ? events_poll_counts(instance) : STATUS_OK;
    Status events = events_apply_until(instance, current + size);
    if (current + size > instance->runtime.clock.t)
        runtime_advance(&instance->runtime, current + size);
    int broken = runtime_first_broken_state(&instance->runtime);
    if (broken >= 0)
        return instance_fail(instance, "%s: state %s is not a finite number at %.17g s; check inputs, parameters and internal_step",
                             function, state_name(broken), instance->runtime.clock.t);
    return counts > events ? counts : events;
}

/* -- snapshots --------------------------------------------------------------------------------------------------- */

/* Members of eight bytes each, so that no padding with undefined content is serialised. */
typedef struct {
    uint64_t model; /* digest of the token, against bytes of another model */
    uint64_t size;
    int64_t mode;
    int64_t rejected, lost;
    double start_time;
    Clock clock;
    double memory[];
} Snapshot;

/* FNV-1a. */
static uint64_t token_digest(void) {
    uint64_t digest = UINT64_C(14695981039346656037);
    for (const char *c = model.token; *c != '\0'; c++)
        digest = (digest ^ (unsigned char)*c) * UINT64_C(1099511628211);
    return digest;
}

static size_t snapshot_size(void) {
    return sizeof(Snapshot) + runtime_memory_length() * sizeof(double);
}

/* Whether a state is one of this model; an importer may hand over anything but a wild pointer. */
static bool is_own(const Snapshot *snapshot) {
    return snapshot != NULL && snapshot->model == token_digest() && snapshot->size == snapshot_size();
}

static Status not_own(const Instance *instance, const char *function) {
    return instance_fail(instance, "%s: this is not a state of this model", function);
}

PRIVATE Status instance_save(const Instance *instance, const char *function, void **state) {
    if (state == NULL)
        return instance_fail(instance, "%s: no place for the state was given", function);
    if (*state != NULL && !is_own(*state))
        return not_own(instance, function);
    Snapshot *snapshot = *state != NULL ? *state : calloc(1, snapshot_size());
    if (snapshot == NULL)
        return instance_fail(instance, "%s: out of memory", function);
    snapshot->model = token_digest();
    snapshot->size = snapshot_size();
    snapshot->mode = instance->mode;
    snapshot->rejected = instance->rejected;
    snapshot->lost = instance->lost;
    snapshot->start_time = instance->start_time;
    snapshot->clock = instance->runtime.clock;
    memcpy(snapshot->memory, instance->runtime.memory, runtime_memory_length() * sizeof(double));
    *state = snapshot;
    return STATUS_OK;
}

PRIVATE Status instance_restore(Instance *instance, const char *function, const void *state) {
    const Snapshot *snapshot = state;
    if (!is_own(snapshot))
        return not_own(instance, function);
    instance->mode = snapshot->mode;
    instance->rejected = snapshot->rejected;
    instance->lost = snapshot->lost;
    instance->start_time = snapshot->start_time;
    instance->runtime.clock = snapshot->clock;
    memcpy(instance->runtime.memory, snapshot->memory, runtime_memory_length() * sizeof(double));
    instance->outputs_outdated = true;
    return STATUS_OK;
}

PRIVATE Status instance_forget(void **state) {
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return STATUS_OK;
}

PRIVATE Status instance_serialized_size(const Instance *instance, const char *function, const void *state, size_t *size) {
    if (size == NULL || !is_own(state))
        return not_own(instance, function);
    *size = snapshot_size();
    return STATUS_OK;
}

PRIVATE Status instance_serialize(const Instance *instance, const char *function, const void *state, void *bytes, size_t size) {
    if (bytes == NULL || !is_own(state))
        return not_own(instance, function);
    if (size < snapshot_size())
        return instance_fail(instance, "%s: %zu bytes are too few, %zu are needed", function, size, snapshot_size());
    memcpy(bytes, state, snapshot_size());
    return STATUS_OK;
}

/* Bytes that come from outside: everything that later serves as an index is checked. */
static bool is_sane(const Snapshot *head) {
    int64_t mode = head->mode;
    bool known = mode == MODE_INSTANTIATED || mode == MODE_INITIALIZATION || mode == MODE_EVENT || mode == MODE_STEP || mode == MODE_TERMINATED;
    return is_own(head) && known;
}

PRIVATE Status instance_deserialize(const Instance *instance, const char *function, const void *bytes, size_t size, void **state) {
    if (bytes == NULL || state == NULL || size != snapshot_size())
        return instance_fail(instance, "%s: %zu bytes are not a state of this model; it has %zu", function, size, snapshot_size());
    Snapshot *snapshot = malloc(snapshot_size());
    if (snapshot == NULL)
        return instance_fail(instance, "%s: out of memory", function);
    memcpy(snapshot, bytes, size);
    if (!is_sane(snapshot) || !runtime_memory_is_sane(snapshot->memory)) {
        free(snapshot);
        return not_own(instance, function);
    }
    *state = snapshot;
    return STATUS_OK;
}
