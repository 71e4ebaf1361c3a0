/* One communication step. Mirrors `Instance.step` of the Python block. */
#include "step.h"

#include <math.h>
#include <string.h>

#include "events.h"
#include "replay.h"
#include "variables.h"

#define STEP_TOLERANCE 1e-6 /* so much of a step may the importer's time be off in addition, as in the Python block */

static Status check_step(const Instance *instance, const char *function, double current, double size) {
    double t = instance->runtime.clock.t;
    if (!(size > 0.0) || !isfinite(current + size))
        return instance_fail(instance, "%s: communicationStepSize = %.17g s is not a positive number", function, size);
    /* An importer may add its times up; what is forgiven here is not lost, the runtime goes on from its own time. */
    if (!(fabs(current - t) <= TIME_TOLERANCE + STEP_TOLERANCE * size))
        return instance_fail(instance, "%s: currentCommunicationPoint = %.17g s, but the model stands at %.17g s", function, current, t);
    return STATUS_OK;
}

/* -- undoing ----------------------------------------------------------------------------------------------------- */

static void remember(Instance *instance) {
    Undo *undo = &instance->undo;
    undo->clock = instance->runtime.clock;
    journal_guard(&instance->journal);
    memcpy(undo->memory, instance->runtime.memory, runtime_used_length(&instance->runtime) * sizeof(double));
}

static void undo_step(Instance *instance) {
    const Undo *undo = &instance->undo;
    Runtime *runtime = &instance->runtime;
    *runtime->queue_length = undo->memory[runtime->queue_length - runtime->memory];
    memcpy(runtime->memory, undo->memory, runtime_used_length(runtime) * sizeof(double));
    runtime->clock = undo->clock;
    journal_undo(&instance->journal);
}

/* -- moving ------------------------------------------------------------------------------------------------------ */

static Status move(Instance *instance, double end) {
    Status counts = model.counts_events ? events_poll_counts(instance) : STATUS_OK;
    Status events = events_apply_until(instance, end);
    move_advance(&instance->runtime, &instance->journal, end);
    move_communicate(&instance->runtime, &instance->journal);
    return status_worse(counts, events);
}

PRIVATE Status step_check_switches(Instance *instance, const char *function) {
    Runtime *runtime = &instance->runtime;
    int chattering = runtime->chattering;
    if (chattering < 0)
        return STATUS_OK;
    runtime->chattering = -1;
    return instance_discard(instance, "%s: %s changes its sign without end at %.17g s; check inputs and parameters", function,
                            variables_name(ROLES(ROLE_INDICATOR), model.friction_count + chattering), runtime->clock.t);
}

/* Not to be seen an end of is a step that cannot be done. */
static Status check_size(Instance *instance, const char *function, double size, double end) {
    instance->discarded = !(runtime_count_steps(&instance->runtime, end) <= MOST_INTERNAL_STEPS);
    if (!instance->discarded)
        return STATUS_OK;
    return instance_discard(instance, "%s: communicationStepSize = %.17g s holds more than %.0f internal steps or periods (internal_step = "
                            "%.17g s); make it smaller", function, size, MOST_INTERNAL_STEPS, instance->runtime.clock.h);
}

PRIVATE Status instance_do_step(Instance *instance, const char *function, double current, double size, bool *early) {
    if (instance->exchange)
        return instance_fail(instance, "%s: the instance was made for model exchange", function);
    if (check_step(instance, function, current, size) != STATUS_OK)
        return STATUS_ERROR;
    double end = current + size;
    double due = instance->early_return_allowed ? runtime_next_instant_before(&instance->runtime, end) : INFINITY;
    if (check_size(instance, function, size, fmin(due, end)) != STATUS_OK)
        return STATUS_DISCARD;
    remember(instance);
    instance->outdated = OUTDATED_ALL;
    Status status = move(instance, fmin(due, end));
    Status switches = step_check_switches(instance, function);
    int broken = runtime_first_broken_state(&instance->runtime);
    instance->discarded = switches != STATUS_OK || broken >= 0;
    if (early != NULL)
        *early = due < end && !instance->discarded;
    if (!instance->discarded) {
        journal_release(&instance->journal);
        return status;
    }
    undo_step(instance);
    if (switches != STATUS_OK)
        return switches;
    return instance_discard(instance, "%s: state %s is not a finite number at %.17g s; the step is undone; check inputs, parameters "
                            "and internal_step", function, variables_name(ROLES(ROLE_STATE), broken), fmin(due, end));
}
