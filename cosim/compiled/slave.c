/* One slave: its functions, its variables, one step of it. Part of `stepper.c`. */
#include "recording.c"

/* -- the journal: calls that Python may have to repeat ---------------------------------------------------------------- */

/* What was called last, with the status in the program. */
static Note *note(Program *program, int64_t slave, int64_t call, int64_t port) {
    Journal *journal = &program->journal;
    Note *made = &journal->notes[journal->count++];
    *made = (Note){.slave = slave, .call = call, .port = port, .status = program->status, .number = INFINITY};
    return made;
}

static void note_bytes(Program *program, Note *made, const void *values, size_t bytes) {
    Journal *journal = &program->journal;
    made->first = journal->used;
    made->bytes = (int64_t)bytes;
    memcpy(journal->bytes + journal->used, values, bytes);
    journal->used += (int64_t)bytes;
}

/* Whether a call did what it was asked for, by the status in the program; a warning is counted. */
static bool accepted(Program *program, int64_t which, int64_t call) {
    Slave *slave = &program->slaves[which];
    if (program->status == STATUS_WARNING && slave->warnings[call]++ == 0)
        slave->first_warnings[call] = *program->last_time;
    return program->status <= STATUS_WARNING;
}

/* -- functions of FMI ---------------------------------------------------------------------------------------------- */

typedef int (*Transfer12)(void *instance, const uint32_t *references, size_t count, void *values);
typedef int (*Transfer3)(void *instance, const uint32_t *references, size_t count, void *values, size_t value_count);
typedef int (*DoStep1)(void *instance, double t, double h, char new_step);
typedef int (*DoStep2)(void *instance, double t, double h, int no_set_state);
typedef int (*Enter)(void *instance);
typedef int (*SetClock)(void *instance, const uint32_t *references, size_t count, const bool *values);
typedef int (*SetReals)(void *instance, const uint32_t *references, size_t count, const double *values, size_t value_count);
typedef int (*Update)(void *instance, bool *again, bool *terminate, bool *nominals, bool *values, bool *next_defined, double *next);
typedef int (*Counts)(void *instance, const uint32_t *references, size_t count, int32_t *values, size_t value_count);
typedef int (*SaveState)(void *instance, void **state);
typedef int (*RestoreState)(void *instance, void *state);
typedef int (*DoStep3)(void *instance, double t, double h, bool no_set_state, bool *event, bool *terminate, bool *early, double *reached);

static int transfer(const Slave *slave, const Port *port) {
    size_t count = (size_t)port->reference_count;
    if (slave->fmi_version == 3)
        return ((Transfer3)port->function)(port->instance, port->references, count, port->raw, (size_t)port->raw_count);
    return ((Transfer12)port->function)(port->instance, port->references, count, port->raw);
}

static bool called_step(Program *program, const Slave *slave, double t, double h) {
    if (slave->fmi_version == 1) {
        program->status = ((DoStep1)slave->do_step)(slave->stepped, t, h, 1);
        return program->status <= STATUS_WARNING;
    }
    if (slave->fmi_version == 2) {
        program->status = ((DoStep2)slave->do_step)(slave->stepped, t, h, *slave->no_way_back != 0);
        return program->status <= STATUS_WARNING;
    }
    bool event = false, terminate = false, early = false;
    double reached = t + h; /* for slaves that do not fill it in */
    program->status = ((DoStep3)slave->do_step)(slave->stepped, t, h, *slave->no_way_back != 0, &event, &terminate, &early, &reached);
    program->event = event;
    program->terminate = terminate;
    program->early = early;
    program->reached = reached;
    return program->status <= STATUS_WARNING && !terminate && !early && !(event && slave->heeds_events);
}

static void contradicts(Slave *slave, int64_t which, bool wrong, double t) {
    if (wrong && slave->contradictions[which]++ == 0)
        slave->first_contradictions[which] = t;
}

/* Count what the last step, from `t` to `until` [s], said that it must not; what is left to Python is counted there. */
static void note_contradictions(const Program *program, Slave *slave, double t, double until) {
    contradicts(slave, BEYOND_STEP, !program->early && program->reached > until + TIME_TOLERANCE && isfinite(program->reached), t);
    contradicts(slave, EARLY_RETURN, program->early && !slave->returns_early, t);
    contradicts(slave, EVENT_WITHOUT_MODE, program->event && !slave->heeds_events, t);
}

static void about_to(const Program *program, const Slave *slave, int64_t what) {
    *program->last_call = slave->numbers + what;
}

/* Whether a slave has only stopped on the way to `until` [s], as FMI 3 allows it, and nothing is to be seen to: it is stepped on, or has
   arrived but for a tolerance. */
static bool returned_early(const Program *program, const Slave *slave, double t, double until) {
    if (slave->fmi_version != 3 || program->status > STATUS_WARNING || !program->early || program->terminate || (program->event && slave->heeds_events))
        return false;
    return program->reached > t && program->reached <= until + TIME_TOLERANCE;
}

static void note_step(Program *program, int64_t which, bool ordinary) {
    Note *made = note(program, which, CALL_STEP, 0); /* nothing said: as far as it was asked to go */
    if (!ordinary && program->slaves[which].fmi_version == 3) {
        made->flags[0] = program->event;
        made->flags[1] = program->terminate;
        made->flags[2] = program->early;
        made->number = program->reached;
    }
}

/* As `Slave.step_length` in Python. */
static double step_length(const Slave *slave, double t, double until) {
    const double length = until - t, whole = rint(length / slave->usual_step) * slave->usual_step;
    return slave->rounding != 0.0 && fabs(length - whole) <= slave->rounding ? whole : length;
}

/* From `t` to `until` [s], in as many calls as the slave needs; the first begins where an early return left the last step. True where
   nothing is to be seen to. */
static bool do_step(Program *program, int64_t which, double t, double until) {
    Slave *slave = &program->slaves[which];
    about_to(program, slave, LAST_STEP);
    program->return_count = 0;
    if (*slave->left_at < t)
        t = *slave->left_at;
    for (;;) {
        bool ordinary = called_step(program, slave, t, step_length(slave, t, until));
        accepted(program, which, CALL_STEP);
        if (program->journal.on)
            note_step(program, which, ordinary);
        const bool goes_on = !ordinary && returned_early(program, slave, t, until);
        if (slave->fmi_version == 3 && (ordinary || goes_on))
            note_contradictions(program, slave, t, until);
        if (ordinary || (goes_on && program->reached >= until - TIME_TOLERANCE)) {
            *slave->left_at = goes_on ? fmin(program->reached, until) : INFINITY;
            return true;
        }
        if (!goes_on)
            return false;
        if (program->return_count == RETURNS_AT_MOST || (program->journal.on && program->journal.count >= program->journal.returns_up_to))
            return false;
        t = program->reached;
        program->returns[program->return_count++] = t;
        slave->returns_here++;
    }
}

/* -- variables ----------------------------------------------------------------------------------------------------- */

#define UNPACK(type) \
    for (int64_t i = 0; i < port->count; i++) \
        port->values[port->places[i]] = (double)((const type *)port->raw)[port->elements[i]]; \
    return

static void unpack(const Port *port) {
    switch (port->kind) {
    case KIND_FLOAT64: UNPACK(double);
    case KIND_FLOAT32: UNPACK(float);
    case KIND_INT8: UNPACK(int8_t);
    case KIND_UINT8: UNPACK(uint8_t);
    case KIND_INT16: UNPACK(int16_t);
    case KIND_UINT16: UNPACK(uint16_t);
    case KIND_INT32: UNPACK(int32_t);
    case KIND_UINT32: UNPACK(uint32_t);
    case KIND_INT64: UNPACK(int64_t);
    case KIND_UINT64: UNPACK(uint64_t);
    }
    bool narrow = port->kind == KIND_BOOLEAN8;
    for (int64_t i = 0; i < port->count; i++) { /* a slave may say 2 for true */
        int64_t at = port->elements[i];
        port->values[port->places[i]] = narrow ? ((const uint8_t *)port->raw)[at] != 0 : ((const int32_t *)port->raw)[at] != 0;
    }
}

/* Whole numbers are rounded to even, as in Python; what the type cannot hold is refused. The upper bound is the first double above. */
#define PACK(type, lowest, above) \
    for (int64_t i = 0; i < port->count; i++) { \
        double value = rint(port->values[port->places[i]]); \
        if (!(value >= (lowest) && value < (above))) \
            return false; \
        ((type *)port->raw)[port->elements[i]] = (type)value; \
    } \
    return true

static bool pack_float(const Port *port) {
    for (int64_t i = 0; i < port->count; i++) {
        double value = port->values[port->places[i]];
        float narrow = (float)value;
        if (isinf(narrow) && !isinf(value))
            return false;
        ((float *)port->raw)[port->elements[i]] = narrow;
    }
    return true;
}

static bool pack_double(const Port *port) {
    for (int64_t i = 0; i < port->count; i++)
        ((double *)port->raw)[port->elements[i]] = port->values[port->places[i]];
    return true;
}

static bool pack_boolean(const Port *port) {
    for (int64_t i = 0; i < port->count; i++) {
        double value = port->values[port->places[i]];
        if (!isfinite(value))
            return false;
        bool truth = rint(value) != 0.0;
        if (port->kind == KIND_BOOLEAN8)
            ((uint8_t *)port->raw)[port->elements[i]] = truth;
        else
            ((int32_t *)port->raw)[port->elements[i]] = truth;
    }
    return true;
}

static bool pack(const Port *port) {
    switch (port->kind) {
    case KIND_FLOAT64: return pack_double(port);
    case KIND_FLOAT32: return pack_float(port);
    case KIND_INT8: PACK(int8_t, -0x1p7, 0x1p7);
    case KIND_UINT8: PACK(uint8_t, 0.0, 0x1p8);
    case KIND_INT16: PACK(int16_t, -0x1p15, 0x1p15);
    case KIND_UINT16: PACK(uint16_t, 0.0, 0x1p16);
    case KIND_INT32: PACK(int32_t, -0x1p31, 0x1p31);
    case KIND_UINT32: PACK(uint32_t, 0.0, 0x1p32);
    case KIND_INT64: PACK(int64_t, -0x1p63, 0x1p63);
    case KIND_UINT64: PACK(uint64_t, 0.0, 0x1p64);
    default: return pack_boolean(port);
    }
}

/* The values at the start of the step, which held signals keep over it. */
static double *start_of(const Program *program) {
    return program->values + program->value_count;
}

static void begin_step(Program *program) {
    memcpy(start_of(program), program->values, (size_t)program->value_count * sizeof(double));
}

/* Take the inputs for a step from `t` to `until` [s]. */
static void gather(const Slave *slave, const double *values, double t, double until) {
    double *inputs = slave->followed == NULL ? slave->inputs : slave->followed->gathered;
    if (slave->followed != NULL) {
        slave->followed->begin = t;
        slave->followed->end = until;
    }
    if (slave->factors == NULL) {
        for (int64_t i = 0; i < slave->input_count; i++)
            inputs[i] = values[slave->sources[i]];
        return;
    }
    for (int64_t i = 0; i < slave->input_count; i++)
        inputs[i] = values[slave->sources[i]] * slave->factors[i] + slave->offsets[i];
}

/* Inputs of which some follow columns of recordings: for a part of a step from `t` to `until` [s] their means where they act on
   derivatives, else what they are at its end; as `MeanInterpolator`. */
static void follow(const Slave *slave, double t, double until, bool arrived) {
    const Followed *followed = slave->followed;
    for (int64_t i = 0; i < slave->input_count; i++) { /* a line of slope zero, as in Python to the sign of zero */
        double time = !arrived && followed->over[i] ? 0.5 * (t + until) : until;
        slave->inputs[i] = followed->gathered[i] + 0.0 * (time - (followed->held[i] ? followed->begin : followed->end));
    }
    for (int64_t i = 0; i < followed->column_count; i++) {
        const FollowedColumn *one = &followed->columns[i];
        bool mean = !arrived && followed->over[one->input];
        double value = mean ? column_mean(one->recording, one->column, t, until) : column_at(one->recording, one->column, until, true);
        slave->inputs[one->input] = one->factor * value + one->offset;
    }
}

/* -- one slave ----------------------------------------------------------------------------------------------------- */

static bool stopped(Program *program, int64_t stop, int64_t slave, int64_t port) {
    program->stop = stop;
    program->slave = slave;
    program->port = port;
    return false;
}

static bool send(Program *program, int64_t which) {
    const Slave *slave = &program->slaves[which];
    for (int64_t i = 0; i < slave->write_count; i++) /* first of all, so that a refused value touches nothing */
        if (slave->writes[i].places != NULL && !pack(&slave->writes[i]))
            return stopped(program, STOP_REFUSED, which, i);
    about_to(program, slave, LAST_WRITE);
    for (int64_t i = 0; i < slave->write_count; i++) {
        program->status = transfer(slave, &slave->writes[i]);
        if (program->journal.on)
            note(program, which, CALL_SET, i);
        if (!accepted(program, which, CALL_SET))
            return stopped(program, STOP_WRITE, which, i);
    }
    return true;
}

/* The gathered inputs for a step, or a part of one, from `t` to `until` [s]. */
static bool send_inputs(Program *program, int64_t which, double t, double until) {
    const Slave *slave = &program->slaves[which];
    if (slave->followed != NULL)
        follow(slave, t, until, false);
    return send(program, which);
}

/* It stands at `until` [s]: where only a mean was sent, outputs follow from the value there. */
static bool arrive(Program *program, int64_t which, double until) {
    const Slave *slave = &program->slaves[which];
    bool passes = false;
    for (int64_t i = 0; slave->followed != NULL && i < slave->input_count; i++)
        passes |= slave->followed->passes[i] != 0;
    if (!passes)
        return true;
    follow(slave, until, until, true);
    return send(program, which) || stopped(program, STOP_ARRIVE, which, 0);
}

static bool read_outputs(Program *program, int64_t which) {
    const Slave *slave = &program->slaves[which];
    about_to(program, slave, LAST_READ);
    for (int64_t i = 0; i < slave->read_count; i++) {
        program->status = transfer(slave, &slave->reads[i]);
        if (program->journal.on)
            note_bytes(program, note(program, which, CALL_GET, i), slave->reads[i].raw, (size_t)slave->reads[i].raw_bytes);
        if (!accepted(program, which, CALL_GET))
            return stopped(program, STOP_READ, which, i);
        if (slave->reads[i].places != NULL)
            unpack(&slave->reads[i]);
    }
    return true;
}

static double now(void) {
    struct timespec t;
#if defined(_WIN32)
    timespec_get(&t, TIME_UTC);
#else
    clock_gettime(CLOCK_MONOTONIC, &t);
#endif
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void sample(Slave *slave, double seconds) {
    int64_t bin = 0;
    for (int64_t left = (int64_t)(seconds * 1e9); left > 1 && bin < BINS - 1; left /= 2)
        bin++;
    slave->sampled_seconds[bin] += seconds;
    slave->sampled_calls[bin]++;
}

static bool move(Program *program, int64_t which, double t, double until, bool timed) {
    Slave *slave = &program->slaves[which];
    if (!send_inputs(program, which, t, until))
        return false;
    slave->calls++;
    slave->returns_here = 0;
    double begin = timed ? now() : 0.0;
    bool ordinary = do_step(program, which, t, until);
    if (timed)
        sample(slave, now() - begin);
    slave->returns += slave->returns_here;
    if (!ordinary)
        return stopped(program, STOP_STEP, which, 0);
    return arrive(program, which, until) && read_outputs(program, which);
}
