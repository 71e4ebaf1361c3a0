/* Model exchange: derivatives, event indicators, and what happens at events. */
#include "exchange.h"

#include <math.h>
#include <string.h>

#include "events.h"
#include "variables.h"

#define JUST_POSITIVE 1e-100 /* products with other indicators are still far from underflow */
#define NOMINAL 1.0 /* of every continuous state; the model description gives none */

/* -- state events ------------------------------------------------------------------------------------------------ */

static double sign_of(double value) {
    return (double)((value > 0.0) - (value < 0.0));
}

/* A moving state that has come to zero, or by the width of an event beyond, rests. One at rest is at exactly zero, whatever a
   solver's rounding has made of it, but for what it has crept since the flow became more than the friction can hold. */
static void settle(Runtime *runtime) {
    runtime_update_balance(runtime);
    for (int i = 0; i < model.friction_count; i++) {
        double *state = &runtime->x[model.frictions[i]], sign = runtime->held[i], flow = runtime->balance[i];
        bool creeps = fabs(flow) > runtime->balance[model.friction_count + i] && flow * *state > 0.0;
        if (sign != 0.0 ? sign * *state <= 0.0 : !creeps) {
            *state = 0.0;
            runtime->held[i] = 0.0;
        }
    }
}

/* What is not zero moves; what is breaks away where the flow is more than the friction can hold. The switches come first, for the
   flow depends on them. */
static void resolve(Runtime *runtime) {
    runtime_update_balance(runtime);
    for (int i = 0; i < model.switching_count; i++)
        runtime->held[model.friction_count + i] = runtime_switching(runtime)[i] >= 0.0;
    if (model.switching_count > 0)
        runtime_update_balance(runtime);
    for (int i = 0; i < model.friction_count; i++) {
        double state = runtime->x[model.frictions[i]];
        double flow = runtime->balance[i], friction = runtime->balance[model.friction_count + i];
        runtime->held[i] = state != 0.0 ? sign_of(state) : fabs(flow) > friction ? sign_of(flow) : 0.0;
    }
    *runtime->resolved = 1.0;
}

/* -- what a solver asks for ---------------------------------------------------------------------------------------- */

static Status check_length(const Instance *instance, const char *function, const void *values, size_t count, int expected) {
    if (count != (size_t)expected)
        return instance_fail(instance, "%s: %zu values, expected %d", function, count, expected);
    if (count > 0 && values == NULL)
        return instance_fail(instance, "%s: the array of values is missing", function);
    return STATUS_OK;
}

static int first_broken(const double *values, int count) {
    for (int i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return i;
    return -1;
}

static void copy_out(double *target, const double *source, size_t count) {
    if (count > 0)
        memcpy(target, source, count * sizeof(double));
}

PRIVATE Status exchange_set_time(Instance *instance, const char *function, double t) {
    if (!isfinite(t))
        return instance_fail(instance, "%s: the time %g s is not a finite number", function, t);
    instance->runtime.clock.t = t;
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

PRIVATE Status exchange_set_states(Instance *instance, const char *function, const double *states, size_t count) {
    if (check_length(instance, function, states, count, model.continuous) != STATUS_OK)
        return STATUS_ERROR;
    copy_out(instance->runtime.x, states, count);
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

PRIVATE Status exchange_get_states(Instance *instance, const char *function, double *states, size_t count) {
    if (check_length(instance, function, states, count, model.continuous) != STATUS_OK)
        return STATUS_ERROR;
    copy_out(states, instance->runtime.x, count);
    return STATUS_OK;
}

PRIVATE Status exchange_get_nominals(Instance *instance, const char *function, double *nominals, size_t count) {
    if (check_length(instance, function, nominals, count, model.continuous) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < count; i++)
        nominals[i] = NOMINAL;
    return STATUS_OK;
}

PRIVATE Status exchange_get_derivatives(Instance *instance, const char *function, double *derivatives, size_t count) {
    if (check_length(instance, function, derivatives, count, model.continuous) != STATUS_OK)
        return STATUS_ERROR;
    instance_refresh(instance, OUTDATED_DERIVATIVES);
    int broken = first_broken(instance->runtime.derivatives, model.continuous);
    if (broken >= 0)
        return instance_discard(instance, "%s: the derivative of %s is not a finite number at %.17g s; check states, inputs and parameters",
                                function, variables_name(ROLES(ROLE_STATE), broken), instance->runtime.clock.t);
    copy_out(derivatives, instance->runtime.derivatives, count);
    return STATUS_OK;
}

/* Zero is still on this side of a change: a state moves on unless it goes beyond, and rests while the friction just holds it. A
   switch is on where its function is zero. An importer that sees a zero could take it for either side. */
static double unchanged(double indicator) {
    return indicator == 0.0 ? JUST_POSITIVE : indicator;
}

PRIVATE Status exchange_get_indicators(Instance *instance, const char *function, double *indicators, size_t count) {
    if (check_length(instance, function, indicators, count, runtime_held_count()) != STATUS_OK)
        return STATUS_ERROR;
    instance_refresh(instance, OUTDATED_INDICATORS);
    int broken = first_broken(instance->runtime.indicators, runtime_held_count());
    if (broken >= 0)
        return instance_discard(instance, "%s: %s is not a finite number at %.17g s; check states, inputs and parameters",
                                function, variables_name(ROLES(ROLE_INDICATOR), broken), instance->runtime.clock.t);
    for (size_t i = 0; i < count; i++)
        indicators[i] = unchanged(instance->runtime.indicators[i]);
    return STATUS_OK;
}

/* -- events ------------------------------------------------------------------------------------------------------ */

/* The time events and announced events that are due, in the order of their instants; at the same instant time events first. */
static void happen(Instance *instance) {
    Runtime *runtime = &instance->runtime;
    for (;;) {
        double due = runtime_next_due(runtime), stamp = events_first_stamp(runtime), now = runtime->clock.t;
        bool is_due = due <= now + runtime_tolerance(runtime, now);
        bool is_notified = stamp <= now + TIME_TOLERANCE;
        if (is_due && !(is_notified && stamp < due - TIME_TOLERANCE))
            runtime_fire_due(runtime);
        else if (is_notified)
            events_apply_here(instance);
        else
            return;
    }
}

static void report_next(const Runtime *runtime, EventReport *report) {
    report->next_time = fmin(runtime_next_due(runtime), events_first_stamp(runtime));
    report->next_defined = isfinite(report->next_time);
    if (!report->next_defined)
        report->next_time = 0.0;
}

PRIVATE Status exchange_update(Instance *instance, EventReport *report) {
    Runtime *runtime = &instance->runtime;
    copy_out(runtime->x_before, runtime->x, (size_t)model.continuous);
    settle(runtime); /* before jumps, which may turn a motion round without stopping it */
    Status status = model.counts_events ? events_poll_counts(instance) : events_poll_clocks(instance);
    happen(instance);
    resolve(runtime);
    instance->outdated = OUTDATED_ALL;
    report->states_changed = model.continuous > 0 && memcmp(runtime->x_before, runtime->x, (size_t)model.continuous * sizeof(double)) != 0;
    report_next(runtime, report);
    return status;
}

/* -- life -------------------------------------------------------------------------------------------------------- */

PRIVATE Status exchange_check_model(const Instance *instance, const char *function) {
    if (model.communication_count == 0)
        return STATUS_OK;
    return instance_fail(instance, "%s: %s works on communication steps, so it has no model exchange; use it in co-simulation", function, model.name);
}

PRIVATE Status exchange_start(Instance *instance) {
    if (instance_start(instance, MODE_EVENT) != STATUS_OK)
        return STATUS_ERROR;
    resolve(&instance->runtime);
    return STATUS_OK;
}
