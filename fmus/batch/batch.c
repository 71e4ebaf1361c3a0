/* Many members of one model, stepped by one loop. A member is an instance of the runtime as it stands in an FMU: the same
   functions from the same sources, so the same numbers bit for bit. Its events are known in advance, so it keeps no journal.

   The library of a batch is this file alone; `model.c` is the one of the FMU. Members know nothing of each other, so neither
   their order nor the failure of one changes another. */
#include "model.c"

#include "noise.c"
#include "switching.c"
#include "runtime.c"
#include "log.c"
#include "journal.c"
#include "replay.c"
#include "instance.c"
#include "variables.c"
#include "events.c"
#include "resource.c"

#include <stdlib.h>

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define MESSAGE_LENGTH_KEPT 400

typedef struct {
    Instance *instance;
    char *failure;             /* why it stands still, or NULL */
    int64_t next_event, events; /* of `Batch.events`: the next one to come, and the end */
} Member;

/* Events of all members, sorted by member and then by stamp; the caller's memory. */
typedef struct {
    const int64_t *kind;   /* number of the triggered event */
    const double *stamp;   /* [s] */
    const double *payload; /* `stride` numbers each */
    int64_t stride;
} Events;

typedef struct {
    int64_t count;
    Member *members;
    Events events;
    double *before;                  /* memory of a member before its step, so that a step that cannot be done is undone */
    char message[MESSAGE_LENGTH_KEPT]; /* the last one of an instance that refused a call */
} Batch;

/* Values of variables: a row for each member and instant; a stride of zero repeats what stands there. */
typedef struct {
    const unsigned *references;
    int64_t count;
    double *values;
    int64_t member_stride, instant_stride;
} Columns;

/* -- messages and failures --------------------------------------------------------------------------------------- */

static void keep_message(const Instance *instance, Status status, const char *category, const char *message) {
    (void)category;
    Batch *batch = instance->environment;
    if (status >= STATUS_DISCARD)
        snprintf(batch->message, sizeof batch->message, "%s", message);
}

static const Face batch_face = {.solver_sets_reals = false, .log = keep_message};

static void fail(Batch *batch, Member *member) {
    member->failure = malloc(sizeof batch->message);
    if (member->failure != NULL)
        memcpy(member->failure, batch->message, sizeof batch->message);
}

EXPORT const char *batch_message(const Batch *batch) {
    return batch->message;
}

EXPORT const char *batch_failure(const Batch *batch, int64_t member) {
    return batch->members[member].failure;
}

/* -- life -------------------------------------------------------------------------------------------------------- */

EXPORT void batch_free(Batch *batch) {
    if (batch == NULL)
        return;
    for (int64_t i = 0; batch->members != NULL && i < batch->count; i++) {
        instance_free(batch->members[i].instance);
        free(batch->members[i].failure);
    }
    free(batch->members);
    free(batch->before);
    free(batch);
}

/* Members with the start values of the model, or NULL where there is not enough memory. */
EXPORT Batch *batch_create(int64_t count) {
    Batch *batch = calloc(1, sizeof *batch);
    if (batch == NULL)
        return NULL;
    batch->count = count;
    batch->members = calloc((size_t)count, sizeof *batch->members);
    batch->before = malloc(runtime_memory_length() * sizeof(double));
    bool whole = batch->members != NULL && batch->before != NULL;
    for (int64_t i = 0; whole && i < count; i++) {
        char name[256]; /* members draw numbers of their own where nobody gives them a seed */
        snprintf(name, sizeof name, "%.200s[%lld]", model.name, (long long)i);
        Instance *instance = batch->members[i].instance = instance_create(name, &batch_face, false);
        whole = instance != NULL;
        if (whole)
            instance->environment = batch;
    }
    if (whole)
        return batch;
    batch_free(batch);
    return NULL;
}

/* Back to the start values, before time has begun; nobody has failed and there are no events. */
EXPORT void batch_reset(Batch *batch) {
    for (int64_t i = 0; i < batch->count; i++) {
        Member *member = &batch->members[i];
        instance_reset(member->instance);
        free(member->failure);
        member->failure = NULL;
        member->next_event = member->events = 0;
    }
}

/* Let time begin at t0 [s] for the members that allow it. */
EXPORT void batch_start(Batch *batch, double t0) {
    for (int64_t i = 0; i < batch->count; i++) {
        Member *member = &batch->members[i];
        Status status = instance_setup(member->instance, t0);
        if (status == STATUS_OK)
            status = instance_start(member->instance, MODE_STEP);
        if (status != STATUS_OK)
            fail(batch, member);
    }
}

/* -- variables --------------------------------------------------------------------------------------------------- */

/* Number of the first member that refuses, which `batch_message` explains, or -1. Members that failed are passed over. */
EXPORT int64_t batch_set(Batch *batch, const Columns *columns) {
    for (int64_t i = 0; i < batch->count; i++) {
        const double *values = columns->values + i * columns->member_stride;
        Member *member = &batch->members[i];
        if (member->failure == NULL && instance_set_reals(member->instance, "set", columns->references, (size_t)columns->count, values) != STATUS_OK)
            return i;
    }
    return -1;
}

static void get_row(Instance *instance, const unsigned *references, int64_t count, double *values) {
    unsigned whole = ROLES(ROLE_OUTCOME) | ROLES(ROLE_INTEGER_OUTPUT);
    for (int64_t j = 0; j < count; j++) {
        int64_t held = 0;
        Status status = STATUS_OK;
        if (ROLES(variables_at(references[j])->role) & whole) {
            status = instance_get_integer(instance, "get", references[j], whole, &held);
            values[j] = (double)held;
        } else {
            status = instance_get_reals(instance, "get", &references[j], 1, &values[j]);
        }
        if (status != STATUS_OK)
            values[j] = NAN;
    }
}

static void get_or_nan(Member *member, const unsigned *references, int64_t count, double *values) {
    if (member->failure == NULL)
        get_row(member->instance, references, count, values);
    for (int64_t j = 0; member->failure != NULL && j < count; j++)
        values[j] = NAN;
}

/* Members that failed have no values: NaN. */
EXPORT void batch_get(Batch *batch, const Columns *columns) {
    for (int64_t i = 0; i < batch->count; i++)
        get_or_nan(&batch->members[i], columns->references, columns->count, columns->values + i * columns->member_stride);
}

/* -- events ------------------------------------------------------------------------------------------------------ */

/* The events to come: those of member i are `first[i]` to `first[i + 1]`. */
EXPORT void batch_schedule(Batch *batch, const int64_t *first, const Events *events) {
    batch->events = *events;
    for (int64_t i = 0; i < batch->count; i++) {
        batch->members[i].next_event = first[i];
        batch->members[i].events = first[i + 1];
    }
}

/* Position of the next event of a member. */
EXPORT int64_t batch_next_event(const Batch *batch, int64_t member) {
    return batch->members[member].next_event;
}

/* What is announced and what is done about it is the runtime's. */
static void announce_next(const Events *events, Member *member) {
    Instance *instance = member->instance;
    int64_t number = member->next_event++;
    const TriggeredEvent *event = &model.triggered[events->kind[number]];
    const double *payload = events->payload + number * events->stride;
    memcpy(instance->runtime.u + event->payload, payload, (size_t)event->payload_count * sizeof(double));
    instance->runtime.stamps[events->kind[number]] = events->stamp[number];
    events_announce(instance, (int)events->kind[number]);
}

static void apply_events(const Batch *batch, Member *member, double end) {
    while (member->next_event < member->events && batch->events.stamp[member->next_event] <= end + TIME_TOLERANCE) {
        double stamp = batch->events.stamp[member->next_event];
        announce_next(&batch->events, member);
        events_apply_until(member->instance, stamp);
    }
}

/* -- stepping ---------------------------------------------------------------------------------------------------- */

/* One communication step of one member, as `instance_do_step` of an FMU. */
static Status step(Batch *batch, Member *member, double end) {
    Instance *instance = member->instance;
    Runtime *runtime = &instance->runtime;
    Clock clock = runtime->clock;
    size_t length = runtime_used_length(runtime) * sizeof(double);
    if (!(runtime_count_steps(runtime, end) <= MOST_INTERNAL_STEPS))
        return instance_discard(instance, "the step from %.17g s to %.17g s holds more than %.0f internal steps or periods", clock.t, end,
                                MOST_INTERNAL_STEPS);
    memcpy(batch->before, runtime->memory, length);
    instance->outdated = OUTDATED_ALL;
    apply_events(batch, member, end);
    move_advance(runtime, &instance->journal, end);
    move_communicate(runtime, &instance->journal);
    int broken = runtime_first_broken_state(runtime);
    if (broken < 0)
        return STATUS_OK;
    memcpy(runtime->memory, batch->before, length);
    runtime->clock = clock;
    return instance_discard(instance, "state %s is not a finite number at %.17g s; check inputs, parameters and internal_step",
                            variables_name(ROLES(ROLE_STATE), broken), end);
}

/* Some members through all instants: inputs of row k hold from instant k to instant k + 1, and results of row k are those at
   instant k. A member that fails stays where it was, and its results are NaN from there on. Members one after the other, so
   that each stays in the processor's cache. */
EXPORT void batch_run(Batch *batch, int64_t first, int64_t last, const double *instants, int64_t count, const Columns *inputs, const Columns *results) {
    for (int64_t i = first; i < last; i++) {
        Member *member = &batch->members[i];
        double *fed = inputs->values + i * inputs->member_stride, *taken = results->values + i * results->member_stride;
        for (int64_t k = 0; k < count; k++) {
            if (member->failure == NULL && k > 0 && step(batch, member, instants[k]) != STATUS_OK)
                fail(batch, member);
            if (member->failure == NULL && inputs->count > 0 &&
                instance_set_reals(member->instance, "run", inputs->references, (size_t)inputs->count, fed + k * inputs->instant_stride) != STATUS_OK)
                fail(batch, member);
            get_or_nan(member, results->references, results->count, taken + k * results->instant_stride);
        }
    }
}
