/* Telling: a receiver with event mode is stepped through one telegram. Part of `stepper.c`. */
#include "slave.c"

static bool move_alone(Program *program, int64_t which, double t, double until) {
    if (!send_inputs(program, which, t, until))
        return false;
    if (!do_step(program, which, t, until))
        return stopped(program, STOP_STEP, which, 0);
    return arrive(program, which, until);
}

/* One slave alone, with its gathered inputs, from `t` to `until` [s]; its outputs are read where that is wanted. Counts early returns
   alone. Returns 1 where that was ordinary, else 0 and says why in the program. */
EXPORTED int64_t stepper_move(Program *program, int64_t which, double t, double until, int64_t reads) {
    *program->last_time = t;
    program->slaves[which].returns_here = 0;
    return move_alone(program, which, t, until) && (!reads || read_outputs(program, which));
}

static bool succeeded(Program *program, int64_t which, int64_t call, int status) {
    program->status = status;
    if (program->journal.on)
        note(program, which, call, 0);
    return accepted(program, which, call);
}

static bool update(Program *program, int64_t which, Telegram *telegram) {
    bool flags[5] = {false, false, false, false, false};
    double next_event = 0.0;
    void *instance = program->slaves[which].instance;
    program->status = ((Update)telegram->update)(instance, flags, flags + 1, flags + 2, flags + 3, flags + 4, &next_event);
    if (program->journal.on) {
        Note *made = note(program, which, CALL_UPDATE, 0);
        for (int i = 0; i < 5; i++)
            made->flags[i] = flags[i];
        made->number = next_event;
    }
    bool again = flags[0], terminate = flags[1], next_defined = flags[4];
    return accepted(program, which, CALL_UPDATE) && !again && !terminate && !next_defined;
}

static bool copy_outputs(Program *program, int64_t which, double *target) {
    const Port *port = &program->slaves[which].reads[0];
    if (!read_outputs(program, which))
        return false;
    memcpy(target, port->raw, (size_t)port->raw_count * sizeof(double));
    return true;
}

/* The counts of what became of events: of those that have grown the one that says most tells of an event that was told and is not settled yet. */
static bool count(Program *program, int64_t which, Telegram *telegram, bool notified) {
    int32_t counts[OUTCOMES_AT_MOST];
    size_t number = (size_t)telegram->count_count;
    if (telegram->get_counts == NULL)
        return true;
    program->status = ((Counts)telegram->get_counts)(program->slaves[which].instance, telegram->count_references, number, counts, number);
    if (program->journal.on)
        note_bytes(program, note(program, which, CALL_COUNT, 0), counts, number * sizeof(int32_t));
    if (!accepted(program, which, CALL_COUNT))
        return false;
    const bool open = notified && telegram->outcome < 0;
    for (size_t i = 0; i < number; i++) {
        int64_t rank = telegram->count_ranks[i];
        if (open && rank >= 0 && counts[i] > telegram->seen[i] && (telegram->outcome < 0 || rank < telegram->outcome))
            telegram->outcome = rank;
        telegram->seen[i] = counts[i];
    }
    return true;
}

static bool notify_stage(Program *program, int64_t which, Telegram *telegram, const double times[3], int64_t stage) {
    const uint32_t clock = (uint32_t)telegram->clock;
    const bool on = true, arrives = times[1] > times[0], goes_on = times[2] > times[1];
    void *instance = program->slaves[which].instance;
    about_to(program, &program->slaves[which], LAST_EVENT);
    switch (stage) {
    case STAGE_SEND: return send_inputs(program, which, times[0], times[2]);
    case STAGE_ARRIVE: return !arrives || move_alone(program, which, times[0], times[1]);
    case STAGE_COUNT: return !arrives || count(program, which, telegram, false);
    case STAGE_BEFORE: return copy_outputs(program, which, telegram->before);
    case STAGE_ENTER: return succeeded(program, which, CALL_ENTER_EVENT, ((Enter)telegram->enter_event)(instance));
    case STAGE_CLOCK: return succeeded(program, which, CALL_SET_CLOCK, ((SetClock)telegram->set_clock)(instance, &clock, 1, &on));
    case STAGE_PAYLOAD: {
        size_t size = (size_t)telegram->payload_count;
        if (size == 0)
            return true;
        int status = ((SetReals)telegram->set_reals)(instance, telegram->references, size, telegram->payload, size);
        return succeeded(program, which, CALL_SET_REALS, status);
    }
    case STAGE_UPDATE: return update(program, which, telegram);
    case STAGE_LEAVE: return succeeded(program, which, CALL_ENTER_STEP, ((Enter)telegram->enter_step)(instance));
    case STAGE_COUNT_TOLD: return count(program, which, telegram, true);
    case STAGE_AFTER: return copy_outputs(program, which, telegram->after);
    case STAGE_GO_ON: return !goes_on || move_alone(program, which, times[1], times[2]);
    case STAGE_COUNT_LATE: return !goes_on || count(program, which, telegram, true);
    default: return !goes_on || read_outputs(program, which);
    }
}

static bool notify(Program *program, int64_t which, Telegram *telegram, const double times[3]) {
    telegram->outcome = -1;
    for (int64_t stage = STAGE_SEND; stage < STAGE_DONE; stage++)
        if (!notify_stage(program, which, telegram, times, stage))
            return false;
    return true;
}

/* Python has gathered the inputs of one slave for a step. */
static void begin_alone(const Slave *slave, double t, double until) {
    Followed *followed = slave->followed;
    if (followed == NULL)
        return;
    memcpy(followed->gathered, slave->inputs, (size_t)slave->input_count * sizeof(double));
    followed->begin = t;
    followed->end = until;
}

/* A receiver with event mode is stepped through one telegram: from times[0] to times[1], where it is told, and on to times[2] [s]. Its
   outputs there go to `before` and `after`. Returns 1 where all was ordinary, else 0: the calls are in the journal. Counts nothing. */
EXPORTED int64_t stepper_deliver(Program *program, int64_t which, Telegram *telegram, const double times[3]) {
    begin_alone(&program->slaves[which], times[0], times[2]);
    program->slaves[which].returns_here = 0;
    program->journal.count = program->journal.used = 0;
    program->journal.on = 1;
    bool ordinary = notify(program, which, telegram, times);
    program->journal.on = 0;
    return ordinary;
}
