/* Moving through time with a memory: see replay.h. */
#include "replay.h"

static bool remembers(const Runtime *runtime, const Journal *journal) {
    return journal->blocks != NULL && *runtime->late_policy == (double)LATE_REPLAY;
}

/* -- moving ------------------------------------------------------------------------------------------------------ */

static void swap(double *one, double *other, int count) {
    for (int i = 0; i < count; i++) {
        double kept = one[i];
        one[i] = other[i];
        other[i] = kept;
    }
}

static int jump_at(Runtime *runtime, int event, double *payload) {
    const TriggeredEvent *declared = &model.triggered[event];
    swap(runtime->u + declared->payload, payload, declared->payload_count);
    runtime_trigger(runtime, event);
    swap(runtime->u + declared->payload, payload, declared->payload_count);
    return declared->verdict < 0 ? VERDICT_USED : (int)runtime->x[declared->verdict];
}

PRIVATE void move_advance(Runtime *runtime, Journal *journal, double until) {
    if (!(until > runtime->clock.t))
        return;
    if (remembers(runtime, journal))
        journal_append(journal, runtime, until, RECORD_ADVANCE, NULL);
    runtime_advance(runtime, until);
}

PRIVATE int move_jump(Runtime *runtime, Journal *journal, int event, double *payload) {
    if (remembers(runtime, journal))
        journal_append(journal, runtime, runtime->clock.t, event, payload);
    return jump_at(runtime, event, payload);
}

PRIVATE void move_communicate(Runtime *runtime, Journal *journal) {
    if (model.communication_count == 0)
        return;
    if (remembers(runtime, journal))
        journal_append(journal, runtime, runtime->clock.t, RECORD_COMMUNICATION, NULL);
    runtime_communicate(runtime);
}

/* -- living again ------------------------------------------------------------------------------------------------ */

/* The state before a record, from the snapshot before it. */
static void return_to(Runtime *runtime, const Journal *journal, int64_t number) {
    for (int64_t i = journal_rewind(journal, runtime, number); i < number; i++) {
        Record record = journal_record(journal, i);
        journal_give(journal, runtime, record.stated);
        if (*record.kind >= 0.0)
            jump_at(runtime, (int)*record.kind, record.payload);
        else if (*record.kind == RECORD_COMMUNICATION)
            runtime_communicate(runtime);
        else
            runtime_advance(runtime, *record.until);
    }
    journal_give(journal, runtime, journal_record(journal, number).stated);
}

static void repeat(Runtime *runtime, Journal *journal, Record record) {
    journal_give(journal, runtime, record.stated);
    if (*record.kind >= 0.0)
        move_jump(runtime, journal, (int)*record.kind, record.payload);
    else if (*record.kind == RECORD_COMMUNICATION)
        move_communicate(runtime, journal);
    else
        move_advance(runtime, journal, *record.until);
}

PRIVATE int move_replay(Runtime *runtime, Journal *journal, int event, double stamp, double *payload) {
    if (!remembers(runtime, journal))
        return BEYOND_RECORDS;
    int64_t number = journal_find(journal, runtime, stamp), end = journal->range.end;
    if (number < 0)
        return (int)number;
    bool moving = *journal_record(journal, number).kind == RECORD_ADVANCE;
    int room = 2; /* the event, and the advance to it */
    journal_read_stated(journal, runtime, journal->present);
    return_to(runtime, journal, number);
    journal_make_room(journal, number, room);
    if (moving)
        move_advance(runtime, journal, stamp);
    int verdict = move_jump(runtime, journal, event, payload);
    for (int64_t i = number; i < end; i++)
        repeat(runtime, journal, journal_record(journal, i + room));
    journal_give(journal, runtime, journal->present);
    return verdict;
}
