/* Snapshots of an instance: a head, the memory of the runtime, then the part of the journal that is within reach. */
#include "snapshot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Members of eight bytes each, so that no padding with undefined content is serialised. */
typedef struct {
    uint64_t model; /* digest of the token, against bytes of another model */
    uint64_t size;  /* in bytes, as a whole */
    int64_t mode;
    double start_time;
    Clock clock;
    JournalMark past;
    double memory[];
} Snapshot;

/* FNV-1a. */
static uint64_t token_digest(void) {
    uint64_t digest = UINT64_C(14695981039346656037);
    for (const char *c = model.token; *c != '\0'; c++)
        digest = (digest ^ (unsigned char)*c) * UINT64_C(1099511628211);
    return digest;
}

static size_t snapshot_size(JournalMark past) {
    return sizeof(Snapshot) + (runtime_memory_length() + journal_saved_length(past)) * sizeof(double);
}

/* Whether a state is one of this model; an importer may hand over anything but a wild pointer. */
static bool is_own(const Snapshot *snapshot) {
    return snapshot != NULL && snapshot->model == token_digest() && snapshot->size == snapshot_size(snapshot->past);
}

static Status not_own(const Instance *instance, const char *function) {
    return instance_fail(instance, "%s: this is not a state of this model", function);
}

#define BEFORE_TIME (MODE_INSTANTIATED | MODE_INITIALIZATION)

/* -- states ------------------------------------------------------------------------------------------------------ */

static void fill(Snapshot *snapshot, const Instance *instance, JournalMark past) {
    snapshot->model = token_digest();
    snapshot->size = snapshot_size(past);
    snapshot->mode = instance->mode;
    snapshot->start_time = instance->start_time;
    snapshot->clock = instance->runtime.clock;
    snapshot->past = past;
    memcpy(snapshot->memory, instance->runtime.memory, runtime_memory_length() * sizeof(double));
    journal_save(&instance->journal, past, snapshot->memory + runtime_memory_length());
}

PRIVATE Status instance_save(const Instance *instance, const char *function, void **state) {
    if (state == NULL)
        return instance_fail(instance, "%s: no place for the state was given", function);
    if (*state != NULL && !is_own(*state))
        return not_own(instance, function);
    JournalMark past = journal_saved_range(&instance->journal, &instance->runtime);
    size_t size = snapshot_size(past);
    Snapshot *snapshot = *state;
    if (snapshot == NULL || snapshot->size != size)
        snapshot = realloc(*state, size);
    if (snapshot == NULL)
        return instance_fail(instance, "%s: out of memory", function);
    fill(snapshot, instance, past);
    *state = snapshot;
    return STATUS_OK;
}

/* Once time runs, a state of co-simulation is of no use in model exchange, nor the other way round. */
static bool fits_type(const Instance *instance, const Snapshot *snapshot) {
    const Runtime *runtime = &instance->runtime;
    bool exchange = snapshot->memory[runtime->resolved - runtime->memory] != 0.0;
    return snapshot->mode & BEFORE_TIME || exchange == instance->exchange;
}

/* Modes in which an instance can be: a step needs the memory by which it is undone, which only co-simulation has. */
static int modes_of(const Instance *instance) {
    if (instance->exchange)
        return MODE_ANY & ~MODE_STEP;
    return MODE_ANY & ~(MODE_CONTINUOUS | (instance->event_mode_used ? 0 : MODE_EVENT));
}

PRIVATE Status instance_restore(Instance *instance, const char *function, const void *state) {
    const Snapshot *snapshot = state;
    if (!is_own(snapshot))
        return not_own(instance, function);
    if (!fits_type(instance, snapshot))
        return instance_fail(instance, "%s: the state was saved in %s, the instance was made for %s", function,
                             instance->exchange ? "co-simulation" : "model exchange", instance->exchange ? "model exchange" : "co-simulation");
    if (!(snapshot->mode & modes_of(instance)))
        return instance_fail(instance, "%s: the state is one of %s, in which this instance for %s cannot be", function, mode_name(snapshot->mode),
                             instance->exchange ? "model exchange" : instance->event_mode_used ? "co-simulation" : "co-simulation without event mode");
    instance->mode = snapshot->mode;
    instance->start_time = snapshot->start_time;
    instance->runtime.clock = snapshot->clock;
    memcpy(instance->runtime.memory, snapshot->memory, runtime_memory_length() * sizeof(double));
    journal_load(&instance->journal, snapshot->past, snapshot->memory + runtime_memory_length());
    instance->discarded = false;
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

PRIVATE Status instance_forget(void **state) {
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return STATUS_OK;
}

/* -- bytes ------------------------------------------------------------------------------------------------------- */

PRIVATE Status instance_serialized_size(const Instance *instance, const char *function, const void *state, size_t *size) {
    if (size == NULL || !is_own(state))
        return not_own(instance, function);
    *size = (size_t)((const Snapshot *)state)->size;
    return STATUS_OK;
}

PRIVATE Status instance_serialize(const Instance *instance, const char *function, const void *state, void *bytes, size_t size) {
    if (bytes == NULL || !is_own(state))
        return not_own(instance, function);
    size_t needed = (size_t)((const Snapshot *)state)->size;
    if (size < needed)
        return instance_fail(instance, "%s: %zu bytes are too few, %zu are needed", function, size, needed);
    memcpy(bytes, state, needed);
    return STATUS_OK;
}

/* Bytes that come from outside: everything that later serves as an index or decides how time runs is checked, the lengths before
   all else. */
static bool is_sane(const Instance *instance, const Snapshot *snapshot, size_t size) {
    JournalMark past = snapshot->past;
    bool within = past.first >= 0 && past.first < JOURNAL_SPACING && past.end >= past.first && past.end - past.first <= JOURNAL_CAPACITY;
    if (!within || (past.end > 0 && model.triggered_count == 0) || snapshot->size != size || !is_own(snapshot))
        return false;
    int64_t mode = snapshot->mode;
    bool known = mode > 0 && mode <= MODE_ANY && (mode & (mode - 1)) == 0;
    if (!known || !isfinite(snapshot->start_time))
        return false;
    return runtime_is_sane(&instance->runtime, &snapshot->clock, snapshot->memory, !(mode & BEFORE_TIME)) &&
           journal_is_sane(past, snapshot->memory + runtime_memory_length(), &snapshot->clock);
}

PRIVATE Status instance_deserialize(const Instance *instance, const char *function, const void *bytes, size_t size, void **state) {
    if (bytes == NULL || state == NULL || size < snapshot_size((JournalMark){0, 0}))
        return instance_fail(instance, "%s: %zu bytes are not a state of this model", function, size);
    Snapshot *snapshot = malloc(size);
    if (snapshot == NULL)
        return instance_fail(instance, "%s: out of memory", function);
    memcpy(snapshot, bytes, size);
    if (!is_sane(instance, snapshot, size)) {
        free(snapshot);
        return not_own(instance, function);
    }
    *state = snapshot;
    return STATUS_OK;
}
