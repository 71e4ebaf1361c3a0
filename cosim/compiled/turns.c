/* Slaves that take part in a way of their own: at a rate of their own, moved by Python, saved before each step, told of what others
   change. Part of `stepper.c`. */
#include "balises.c"

#define PART -1 /* in place of the number of a step */

/* Whether a slave takes a step that ends with step number `k` of the plan. */
static bool is_due(const Program *program, const Slave *slave, int64_t k) {
    return slave->every == 1 || (k + 1) % slave->every == 0 || k + 1 == program->step_count;
}

/* Where a slave stands when step number `k` begins [s]. */
static double stands_at(const Program *program, const Slave *slave, int64_t k) {
    return program->start + (double)(k - k % slave->every) * program->step;
}

/* Such a slave over step number `k`, as far as it takes part in it, or over a part of a step. */
static bool move_special(Program *program, int64_t which, int64_t k, double t, double until, bool timed) {
    Slave *slave = &program->slaves[which];
    if (k != PART && !is_due(program, slave, k))
        return true;
    if (k != PART)
        t = stands_at(program, slave, k);
    if (slave->in_python)
        return program->turn(which, t, until) != 0 || stopped(program, STOP_TURN, which, 0);
    gather(slave, program->values, t, until);
    return move(program, which, t, until, timed);
}

/* -- steps that may have to be taken back --------------------------------------------------------------------------- */

static bool save_all(Program *program) {
    for (int64_t i = 0; i < program->slave_count; i++) {
        Slave *slave = &program->slaves[i];
        if (slave->save_state == NULL)
            continue;
        slave->saved = NULL;
        program->status = ((SaveState)slave->save_state)(slave->instance, &slave->saved);
        *slave->no_way_back = 0;
        note(program, i, CALL_SAVE, 0)->state = slave->saved;
        if (!accepted(program, i, CALL_SAVE) || slave->saved == NULL)
            return false;
    }
    return true;
}

static bool release_all(Program *program) {
    for (int64_t i = 0; i < program->slave_count; i++) {
        Slave *slave = &program->slaves[i];
        if (slave->save_state == NULL)
            continue;
        program->status = ((RestoreState)slave->release_state)(slave->instance, &slave->saved);
        note(program, i, CALL_RELEASE, 0);
        if (!accepted(program, i, CALL_RELEASE))
            return false;
    }
    return true;
}

static bool drive_all(Program *program, int64_t k, double until, bool timed) {
    const int64_t watched = program->watch.slave;
    for (int64_t i = 0; i < program->slave_count; i++) {
        Slave *slave = &program->slaves[i];
        if (!is_due(program, slave, k))
            continue;
        double t = stands_at(program, slave, k);
        gather(slave, program->values, t, until);
        slave->now = t;
        double begin = timed ? now() : 0.0;
        if (!drive(program, i, t, until))
            return false;
        if (i == watched && !program->balises.by_instant && crossed(program))
            return false;
        if (timed)
            sample(slave, now() - begin);
    }
    return true;
}

/* Step number `k` with the state of all saved: where one meets an event, Python does it with what was said so far. */
static bool step_saved(Program *program, int64_t k, double t, double until, bool timed) {
    begin_noted(program, t);
    bool ordinary = save_all(program) && drive_all(program, k, until, timed) && release_all(program);
    program->journal.on = 0;
    if (!ordinary)
        return taken_back(program);
    count_noted(program);
    return true;
}

/* -- what others change --------------------------------------------------------------------------------------------- */

/* Whether an input that is an event for a slave is not what it was told last. */
static bool anybody_hears(const Program *program) {
    for (int64_t i = 0; i < program->listener_count; i++) {
        const Listener *listener = &program->listeners[i];
        for (int64_t j = 0; j < listener->count; j++) {
            double value = program->values[listener->sources[j]];
            if (listener->factors != NULL)
                value = value * listener->factors[j] + listener->offsets[j];
            if (memcmp(&value, &listener->told[j], sizeof value) != 0)
                return true;
        }
    }
    return false;
}
