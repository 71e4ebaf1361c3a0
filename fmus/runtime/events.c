/* Triggered events with a stamp. The one place that decides what becomes of an event that is announced too late. */
#include "events.h"

#include <math.h>
#include <string.h>

#include "replay.h"

/* -- the queue: entries (event, stamp, payload) in the order of their stamps ----------------------------------------- */

static double *entry(const Runtime *runtime, int position) {
    return runtime->queue + (size_t)position * runtime_queue_stride();
}

static size_t payload_bytes(int event) {
    return (size_t)model.triggered[event].payload_count * sizeof(double);
}

/* Sorted by stamp; of equal stamps the one announced first stays first. */
static void insert(Runtime *runtime, int event, double stamp) {
    size_t stride = runtime_queue_stride();
    int length = (int)*runtime->queue_length, position = length;
    while (position > 0 && entry(runtime, position - 1)[1] > stamp)
        position--;
    double *place = entry(runtime, position);
    memmove(place + stride, place, (size_t)(length - position) * stride * sizeof(double));
    memset(place, 0, stride * sizeof(double));
    place[0] = event;
    place[1] = stamp;
    memcpy(place + 2, runtime->u + model.triggered[event].payload, payload_bytes(event));
    *runtime->queue_length += 1.0;
}

static void remove_first(Runtime *runtime) {
    size_t stride = runtime_queue_stride();
    int rest = (int)*runtime->queue_length - 1;
    memmove(runtime->queue, runtime->queue + stride, (size_t)rest * stride * sizeof(double));
    memset(entry(runtime, rest), 0, stride * sizeof(double));
    *runtime->queue_length = rest;
}

/* -- announcing -------------------------------------------------------------------------------------------------- */

static void count_outcome(Runtime *runtime, Outcome outcome) {
    runtime->outcomes[outcome] += 1.0;
}

/* An event that was applied, late in the way of `late` or on time where that is accepted; whether it took effect. */
static bool count_applied(Instance *instance, int event, int verdict, Outcome late) {
    Runtime *runtime = &instance->runtime;
    const char *name = model.triggered[event].name;
    if (verdict == VERDICT_IGNORED) {
        count_outcome(runtime, OUTCOME_IGNORED);
        instance_note(instance, "event %s is doubted and ignored at %.17g s (%.0f so far)", name, runtime->clock.t,
                      runtime->outcomes[OUTCOME_IGNORED]);
        return false;
    }
    if (verdict == VERDICT_DOUBTED)
        count_outcome(runtime, OUTCOME_DOUBTED);
    if (late != OUTCOME_ACCEPTED)
        count_outcome(runtime, late);
    count_outcome(runtime, OUTCOME_ACCEPTED);
    return true;
}

static Status reject(Instance *instance, int event, double stamp, const char *reason) {
    count_outcome(&instance->runtime, OUTCOME_REJECTED);
    return instance_warn(instance, "event %s: its stamp %.17g s lies before the current time %.17g s; it is rejected (%.0f so far): %s",
                         model.triggered[event].name, stamp, instance->runtime.clock.t, instance->runtime.outcomes[OUTCOME_REJECTED], reason);
}

/* In model exchange an event is late when it is announced late; one that waits is not, wherever the solver stops. */
static Status check_exchange(Instance *instance, int event, double *stamp) {
    const Runtime *runtime = &instance->runtime;
    if (!instance->exchange || *stamp >= runtime->clock.t - TIME_TOLERANCE)
        return STATUS_OK;
    if (*runtime->late_policy == (double)LATE_REJECT)
        return reject(instance, event, *stamp, "late_policy is reject");
    if (*runtime->late_policy == (double)LATE_REPLAY)
        return reject(instance, event, *stamp, "in model exchange the past is the solver's and cannot be replayed");
    *stamp = runtime->clock.t;
    return STATUS_OK;
}

PRIVATE Status events_announce(Instance *instance, int event) {
    Runtime *runtime = &instance->runtime;
    double stamp = runtime->stamps[event] <= STAMP_NOW ? runtime->clock.t : runtime->stamps[event];
    runtime->stamps[event] = STAMP_NOW;
    if (!isfinite(stamp)) {
        count_outcome(runtime, OUTCOME_LOST);
        return instance_warn(instance, "event %s: its stamp %g s is not a finite number; it is lost", model.triggered[event].name, stamp);
    }
    double announced = stamp;
    Status late = check_exchange(instance, event, &stamp);
    if (late != STATUS_OK)
        return late;
    if (*runtime->queue_length >= QUEUE_CAPACITY) {
        count_outcome(runtime, OUTCOME_LOST);
        return instance_warn(instance, "event %s at %.17g s: %d events are waiting already; this one is lost",
                             model.triggered[event].name, stamp, QUEUE_CAPACITY);
    }
    insert(runtime, event, stamp);
    if (stamp != announced)
        count_outcome(runtime, OUTCOME_LATE);
    return STATUS_OK;
}

static Status poll_count(Instance *instance, int event) {
    Runtime *runtime = &instance->runtime;
    const char *name = model.triggered[event].name;
    double before = runtime->seen[event], now = runtime->raised[event];
    Status status = STATUS_OK;
    runtime->seen[event] = now;
    if (now > before)
        status = events_announce(instance, event);
    if (now > before + 1.0) {
        runtime->outcomes[OUTCOME_LOST] += now - before - 1.0;
        status = instance_warn(instance, "event %s: the count rose from %.0f to %.0f at once; only the last payload is known", name, before, now);
    }
    if (now < before)
        status = instance_warn(instance, "event %s: the count went down from %.0f to %.0f; no event is taken from that", name, before, now);
    return status;
}

PRIVATE Status events_poll_counts(Instance *instance) {
    Status status = STATUS_OK;
    for (int i = 0; i < model.triggered_count; i++)
        status = status_worse(status, poll_count(instance, i));
    return status;
}

/* -- applying ---------------------------------------------------------------------------------------------------- */

/* An event whose stamp lies in the past goes by the policy. */
static Status take_late(Instance *instance, int event, double stamp, double *payload) {
    Runtime *runtime = &instance->runtime;
    const char *name = model.triggered[event].name;
    if (*runtime->late_policy == (double)LATE_REJECT)
        return reject(instance, event, stamp, "late_policy is reject");
    if (*runtime->late_policy == (double)LATE_LATE) {
        if (count_applied(instance, event, move_jump(runtime, &instance->journal, event, payload), OUTCOME_LATE))
            instance_note(instance, "event %s of %.17g s applied late at %.17g s", name, stamp, runtime->clock.t);
        return STATUS_OK;
    }
    int reach = move_replay(runtime, &instance->journal, event, stamp, payload);
    if (reach == BEYOND_HORIZON)
        return reject(instance, event, stamp, "it lies further back than replay_horizon");
    if (reach == BEYOND_RECORDS)
        return reject(instance, event, stamp, "it lies before the first of the steps that are remembered");
    if (count_applied(instance, event, reach, OUTCOME_REPLAYED))
        instance_note(instance, "event %s applied at %.17g s, from %.17g s", name, stamp, runtime->clock.t);
    return STATUS_OK;
}

static Status apply_first(Instance *instance) {
    Runtime *runtime = &instance->runtime;
    double *first = entry(runtime, 0);
    int event = (int)first[0];
    double stamp = first[1];
    Status status = STATUS_OK;
    instance->outdated = OUTDATED_ALL;
    if (stamp < runtime->clock.t - TIME_TOLERANCE) {
        status = take_late(instance, event, stamp, first + 2);
    } else {
        move_advance(runtime, &instance->journal, stamp);
        if (count_applied(instance, event, move_jump(runtime, &instance->journal, event, first + 2), OUTCOME_ACCEPTED))
            instance_note(instance, "event %s applied at %.17g s", model.triggered[event].name, runtime->clock.t);
    }
    remove_first(runtime);
    return status;
}

PRIVATE Status events_apply_until(Instance *instance, double t_end) {
    Runtime *runtime = &instance->runtime;
    Status status = STATUS_OK;
    while (*runtime->queue_length > 0.0 && entry(runtime, 0)[1] <= t_end + TIME_TOLERANCE)
        status = status_worse(status, apply_first(instance));
    return status;
}

PRIVATE Status events_poll_clocks(Instance *instance) {
    Runtime *runtime = &instance->runtime;
    Status status = STATUS_OK;
    for (int i = 0; i < model.triggered_count; i++) {
        if (runtime->active[i] == 0.0)
            continue;
        runtime->active[i] = 0.0;
        status = status_worse(status, events_announce(instance, i));
    }
    return status;
}

PRIVATE double events_first_stamp(const Runtime *runtime) {
    return *runtime->queue_length > 0.0 ? entry(runtime, 0)[1] : INFINITY;
}

PRIVATE void events_apply_here(Instance *instance) {
    Runtime *runtime = &instance->runtime;
    double *first = entry(runtime, 0);
    int event = (int)first[0];
    if (count_applied(instance, event, move_jump(runtime, &instance->journal, event, first + 2), OUTCOME_ACCEPTED))
        instance_note(instance, "event %s applied at %.17g s", model.triggered[event].name, runtime->clock.t);
    remove_first(runtime);
    instance->outdated = OUTDATED_ALL;
}
