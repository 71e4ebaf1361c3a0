/* A step over a balise, or near one: the rules of `RollbackLocaliser`, `BaliseService` and `Receiver`. Part of `stepper.c`.

   Whatever is not ordinary (several balises, a train that turns, a call that fails) is handed to Python with all that was said so far. */
#include "notifying.c"

#define ROOT_TOLERANCE 1e-11 /* [s], as in Python */
#define MAX_ROOT_STEPS 60
#define SHORTEST_PART 0.1 /* [s] */
#define MAX_HALVINGS 200
#define ROWS_AT_MOST 3 /* before and after the telegram, and the communication point */

/* The step under way. */
typedef struct {
    Program *program;
    double *outputs; /* of the plant */
    size_t size;     /* theirs, in bytes */
    double t, until;
    double p0, v0, p1, v1; /* position and speed of the plant at both ends */
    bool found, read;      /* a balise is passed; the odometer was read */
    bool notified;         /* by somebody */
    int64_t which;
    double stamp, notified_at;
    double position, speed, reading; /* there */
} Over;

/* -- the plant ----------------------------------------------------------------------------------------------------- */

/* Put the cursor before the first place at or behind `position`. */
static void seek(PlantMonitor *watch, double position) {
    while (watch->cursor > 0 && !(watch->places[watch->cursor - 1] < position))
        watch->cursor--;
    while (watch->cursor < watch->place_count && watch->places[watch->cursor] < position)
        watch->cursor++;
}

static int64_t first_ahead(const PlantMonitor *watch, double position) {
    int64_t ahead = watch->cursor;
    while (ahead < watch->place_count && !(watch->places[ahead] > position))
        ahead++;
    return ahead;
}

static double position_of(const Program *program, const double *values) {
    return values[program->watch.position] * program->watch.position_factor + program->watch.position_offset;
}

static double speed_of(const Program *program, const double *values) {
    return values[program->watch.speed] * program->watch.speed_factor + program->watch.speed_offset;
}

static bool is_near(Program *program, double h) {
    PlantMonitor *watch = &program->watch;
    double position = position_of(program, program->values), speed = speed_of(program, program->values);
    seek(watch, position);
    int64_t ahead = first_ahead(watch, position);
    double behind_gap = watch->cursor > 0 ? position - watch->places[watch->cursor - 1] : INFINITY;
    double ahead_gap = ahead < watch->place_count ? watch->places[ahead] - position : INFINITY;
    return fmin(behind_gap, ahead_gap) <= fabs(speed) * h + watch->acceleration_limit * h * h;
}

static bool crossed(const Program *program) {
    const PlantMonitor *watch = &program->watch;
    double before = position_of(program, start_of(program)), after = position_of(program, program->values);
    if (after >= before) {
        int64_t ahead = first_ahead(watch, before);
        return ahead < watch->place_count && watch->places[ahead] <= after;
    }
    return watch->cursor > 0 && watch->places[watch->cursor - 1] >= after;
}

/* One more step of a slave within this one, sent, timed and counted; outputs are read. */
static bool drive(Program *program, int64_t which, double t, double until) {
    Slave *slave = &program->slaves[which];
    if (!send_inputs(program, which, t, until))
        return false;
    slave->calls_here++;
    if (!do_step(program, which, t, until))
        return false;
    slave->now = until;
    return arrive(program, which, until) && read_outputs(program, which);
}

/* Restore or release the state at the start of the step: the one takes the state, the other where it is kept. */
static bool state_call(Over *over, int64_t call, void *function, void *state) {
    Program *program = over->program;
    Slave *plant = &program->slaves[program->watch.slave];
    program->status = ((RestoreState)function)(plant->instance, state);
    if (call == CALL_RESTORE)
        *plant->left_at = plant->left_here;
    note(program, program->watch.slave, call, 0);
    return accepted(program, program->watch.slave, call);
}

/* The plant at `time` [s] within the step, as it was, with the inputs it had. */
static bool go(Over *over, void *state, double time) {
    Program *program = over->program;
    const PlantMonitor *watch = &program->watch;
    if (!state_call(over, CALL_RESTORE, program->balises.restore_state, state))
        return false;
    program->slaves[watch->slave].now = over->t;
    memcpy(program->values + watch->first_output, program->balises.start, (size_t)watch->output_count * sizeof(double));
    return !(time - over->t > TIME_TOLERANCE) || drive(program, watch->slave, over->t, time);
}

/* -- where a balise at a place is passed --------------------------------------------------------------------------- */

/* Position of the cubic at `s` [s] after the start, as `HermiteStep.position`. */
static double cubic_position(const Over *over, double s) {
    double h = over->until - over->t;
    double cubic = 2.0 * (over->p0 - over->p1) + h * (over->v0 + over->v1);
    double square = 3.0 * (over->p1 - over->p0) - h * (2.0 * over->v0 + over->v1);
    double x = s / h;
    return over->p0 + x * (h * over->v0 + x * (square + x * cubic));
}

/* Time after the start at which the cubic is at `target`, as `first_time`. */
static double guess_crossing(const Over *over, double target, bool rising) {
    double low = 0.0, high = over->until - over->t;
    for (int i = 0; i < MAX_HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        if (middle == low || middle == high)
            break;
        double ahead = cubic_position(over, middle) - target;
        if (rising ? ahead >= 0.0 : ahead <= 0.0)
            high = middle;
        else
            low = middle;
    }
    return high;
}

/* As `_Trial.search`: safeguarded Newton iteration on the plant's own steps. The result goes to the stamp. */
static bool search(Over *over, void *state, double target) {
    const Program *program = over->program;
    const bool rising = over->p1 >= over->p0;
    double low = 0.0, high = over->until - over->t;
    double guess = guess_crossing(over, target, rising);
    guess = low > guess ? low : guess;
    guess = high < guess ? high : guess;
    for (int i = 0; i < MAX_ROOT_STEPS; i++) {
        if (!go(over, state, over->t + guess))
            return false;
        double miss = position_of(program, program->values) - target, speed = speed_of(program, program->values);
        if (guess <= TIME_TOLERANCE) {
            if (speed != 0.0) {
                double rest = -miss / speed;
                rest = 0.0 > rest ? 0.0 : rest;
                guess = high < rest ? high : rest;
            }
            break;
        }
        if (rising ? miss >= 0.0 : miss <= 0.0)
            high = guess < high ? guess : high;
        else
            low = guess > low ? guess : low;
        double following = speed != 0.0 ? guess - miss / speed : 0.5 * (low + high);
        if (!(low <= following && following <= high))
            following = 0.5 * (low + high);
        bool done = fabs(following - guess) <= ROOT_TOLERANCE || high - low <= ROOT_TOLERANCE;
        guess = following;
        if (done)
            break;
    }
    over->stamp = over->t + guess;
    return true;
}

/* The first balise between both ends of the step, and how many there are. */
static int64_t count_crossed(Over *over) {
    PlantMonitor *watch = &over->program->watch;
    int64_t number = 0;
    seek(watch, over->p0);
    if (over->p1 >= over->p0) {
        over->which = first_ahead(watch, over->p0);
        for (int64_t i = over->which; i < watch->place_count && watch->places[i] <= over->p1; i++)
            number++;
    } else {
        over->which = watch->cursor - 1;
        for (int64_t i = over->which; i >= 0 && watch->places[i] >= over->p1; i--)
            number++;
    }
    return number;
}

static bool find_stamp(Over *over, void *state) {
    Balises *balises = &over->program->balises;
    if (balises->by_instant) {
        over->which = balises->next_instant;
        over->stamp = balises->instants[over->which];
        return over->found = true;
    }
    if (over->v0 * over->v1 < 0.0)
        return false; /* it turns */
    if (over->until - over->t > SHORTEST_PART && fabs(over->v0 + over->v1) <= over->program->watch.acceleration_limit * (over->until - over->t))
        return false; /* it may turn twice */
    int64_t number = count_crossed(over);
    over->found = number == 1;
    return number == 0 || (over->found && search(over, state, over->program->watch.places[over->which]));
}

static bool saved_plant(Over *over, void **state) {
    Program *program = over->program;
    const PlantMonitor *watch = &program->watch;
    memcpy(program->balises.start, over->outputs, over->size);
    program->status = ((SaveState)program->balises.save_state)(program->slaves[watch->slave].instance, state);
    *program->slaves[watch->slave].no_way_back = 0;
    note(program, watch->slave, CALL_SAVE, 0)->state = *state;
    return accepted(program, watch->slave, CALL_SAVE);
}

/* A plant that is played back, with its telegrams: it is looked at where one was sent, as `RecordedLocaliser` does. */
static bool play_plant(Over *over) {
    Program *program = over->program;
    Balises *balises = &program->balises;
    void *state = NULL;
    over->found = true;
    over->which = balises->next_instant;
    over->stamp = balises->instants[over->which];
    if (!saved_plant(over, &state) || !drive(program, program->watch.slave, over->t, over->stamp))
        return false;
    memcpy(balises->there, over->outputs, over->size);
    if (!state_call(over, CALL_RESTORE, balises->restore_state, state))
        return false;
    program->slaves[program->watch.slave].now = over->t;
    memcpy(over->outputs, balises->start, over->size);
    return drive(program, program->watch.slave, over->t, over->until);
}

static bool move_plant(Over *over) {
    Program *program = over->program;
    Balises *balises = &program->balises;
    void *state = NULL;
    over->p0 = position_of(program, program->values);
    over->v0 = speed_of(program, program->values);
    if (!saved_plant(over, &state) || !drive(program, program->watch.slave, over->t, over->until))
        return false;
    over->p1 = position_of(program, program->values);
    over->v1 = speed_of(program, program->values);
    memcpy(balises->final, over->outputs, over->size);
    if (!find_stamp(over, state))
        return false;
    if (over->found) {
        if (!go(over, state, over->stamp))
            return false;
        memcpy(balises->there, over->outputs, over->size);
        over->position = position_of(program, program->values);
        over->speed = speed_of(program, program->values);
        if (!go(over, state, over->until) || memcmp(over->outputs, balises->final, over->size) != 0)
            return false;
    }
    return state_call(over, CALL_RELEASE, balises->release_state, &state);
}

/* -- receivers ----------------------------------------------------------------------------------------------------- */

/* A value at an instant: on the line between the ends of the step, or held. */
static double mixed(const Over *over, double time, int64_t column, double end) {
    const Program *program = over->program;
    if (over->until - time <= TIME_TOLERANCE)
        return end;
    double start = start_of(program)[column], share = (time - over->t) / (over->until - over->t);
    share = 0.0 > share ? 0.0 : share;
    return program->balises.continuous[column] ? start + share * (end - start) : start;
}

/* The odometer at the crossing; it is read when the first receiver is due. */
static void read_odometer(Over *over) {
    int64_t column = over->program->balises.odometer;
    if (!over->read)
        over->reading = column < 0 ? NAN : mixed(over, over->stamp, column, over->program->values[column]);
    over->read = true;
}

static double snapped(const Over *over) {
    double notified_at = over->stamp < over->t ? over->t : over->stamp;
    notified_at = over->until < notified_at ? over->until : notified_at;
    if (over->until - notified_at <= TIME_TOLERANCE)
        return over->until;
    return notified_at - over->t <= TIME_TOLERANCE ? over->t : notified_at;
}

static void fill_in(const Over *over, double *fields) {
    const Program *program = over->program;
    const double *recorded = program->balises.recorded;
    const bool by_instant = program->balises.by_instant != 0;
    fields[FIELD_DELIVERED_AT] = fields[FIELD_STAMP] = over->stamp + 0.0; /* the latency */
    if (recorded != NULL) {
        recorded += 3 * over->which;
        fields[FIELD_POSITION] = recorded[0];
        fields[FIELD_LOCATION_ACCURACY] = recorded[1];
        fields[FIELD_ODOMETER_READING] = recorded[2];
        return;
    }
    fields[FIELD_POSITION] = (by_instant ? over->position : program->watch.places[over->which]) + 0.0; /* as noise of zero is added */
    fields[FIELD_LOCATION_ACCURACY] = by_instant ? 0.0 : program->balises.accuracies[over->which];
    fields[FIELD_ODOMETER_READING] = over->reading;
}

static bool notify_receiver(Over *over, int64_t which, Telegram *telegram) {
    read_odometer(over);
    over->notified_at = snapped(over);
    over->notified = true;
    double fields[FIELDS];
    fill_in(over, fields);
    for (int64_t i = 0; i < telegram->payload_count; i++)
        telegram->payload[i] = fields[telegram->fields[i]];
    const double times[3] = {over->t, over->notified_at, over->until};
    Slave *slave = &over->program->slaves[which];
    slave->calls_here = (times[1] > times[0]) + (times[2] > times[1]);
    if (!notify(over->program, which, telegram, times))
        return false;
    slave->now = over->until;
    return true;
}

static bool move_all(Over *over) {
    Program *program = over->program;
    for (int64_t i = 0; i < program->slave_count; i++) {
        Slave *slave = &program->slaves[i];
        Telegram *telegram = program->balises.telegrams[i];
        double begin = now();
        gather(slave, program->values, over->t, over->until);
        bool ordinary;
        if (i == program->watch.slave)
            ordinary = program->balises.recorded != NULL ? play_plant(over) : move_plant(over);
        else if (over->found && telegram != NULL)
            ordinary = notify_receiver(over, i, telegram);
        else
            ordinary = drive(program, i, over->t, over->until);
        slave->seconds_over += now() - begin;
        if (!ordinary)
            return false;
    }
    return true;
}

/* -- what is left of it -------------------------------------------------------------------------------------------- */

/* Rows before and after the telegram, as `BaliseService._pair`; the latter only where it is not the row of the communication point. */
static int64_t write_rows(Over *over, double *rows) {
    const Program *program = over->program;
    const PlantMonitor *watch = &program->watch;
    const Balises *balises = &program->balises;
    size_t width = (size_t)program->value_count + 1;
    double nominal = over->stamp < over->t ? over->t : over->stamp;
    nominal = over->until < nominal ? over->until : nominal;
    double time = over->notified ? over->notified_at : nominal, *before = rows + 1, *after = before + width;
    memcpy(balises->arrived, program->values, (size_t)program->value_count * sizeof(double));
    for (int64_t i = 0; i < program->slave_count; i++)
        if (balises->telegrams[i] != NULL && time == over->until) {
            const Port *port = &program->slaves[i].reads[0];
            memcpy(balises->arrived + (port->values - program->values), balises->telegrams[i]->before, (size_t)port->raw_bytes);
        }
    rows[0] = time;
    for (int64_t i = 0; i < program->value_count; i++)
        before[i] = mixed(over, time, i, balises->arrived[i]);
    if (time < over->until)
        memcpy(before + watch->first_output, balises->there, (size_t)watch->output_count * sizeof(double));
    bool two = over->until - time > TIME_TOLERANCE;
    if (two)
        memcpy(rows + width, rows, width * sizeof(double));
    for (int64_t i = 0; i < program->slave_count; i++)
        if (balises->telegrams[i] != NULL) {
            const Port *port = &program->slaves[i].reads[0];
            memcpy(before + (port->values - program->values), balises->telegrams[i]->before, (size_t)port->raw_bytes);
            if (two)
                memcpy(after + (port->values - program->values), balises->telegrams[i]->after, (size_t)port->raw_bytes);
        }
    return two ? 2 : 1;
}

static void log_crossing(Over *over) {
    Balises *balises = &over->program->balises;
    int64_t *outcomes = balises->outcomes + balises->passed_count * over->program->slave_count;
    balises->passed[balises->passed_count++] = (Passed){over->which, over->stamp, over->position, over->speed, over->reading};
    for (int64_t i = 0; i < over->program->slave_count; i++)
        outcomes[i] = balises->telegrams[i] == NULL ? -1 : balises->telegrams[i]->outcome;
}

/* Whether the step that ends at `until` is one of these. */
static bool is_over(Program *program, double t, double until) {
    Balises *balises = &program->balises;
    if (program->watch.slave < 0)
        return false;
    if (!balises->by_instant)
        return is_near(program, until - t);
    while (balises->next_instant > 0 && balises->instants[balises->next_instant - 1] > t)
        balises->next_instant--;
    while (balises->next_instant < balises->instant_count && !(balises->instants[balises->next_instant] > t))
        balises->next_instant++;
    return balises->next_instant < balises->instant_count && balises->instants[balises->next_instant] <= until;
}

static bool is_single(const Balises *balises, double until) {
    int64_t following = balises->next_instant + 1;
    return !balises->by_instant || following >= balises->instant_count || balises->instants[following] > until;
}

/* A step begins of which all calls are noted. */
static void begin_noted(Program *program, double t) {
    for (int64_t i = 0; i < program->slave_count; i++) {
        program->slaves[i].calls_here = program->slaves[i].returns_here = 0;
        program->slaves[i].now = t;
        program->slaves[i].left_here = *program->slaves[i].left_at;
    }
    begin_step(program);
    program->journal.count = program->journal.used = 0;
    program->journal.on = 1;
}

/* Such a step is Python's: the values are those at its start. */
static bool taken_back(Program *program) {
    memcpy(program->values, start_of(program), (size_t)program->value_count * sizeof(double));
    for (int64_t i = 0; i < program->slave_count; i++)
        *program->slaves[i].left_at = program->slaves[i].left_here;
    return stopped(program, STOP_HANDED, 0, 0);
}

/* Such a step is done. */
static void count_noted(Program *program) {
    for (int64_t i = 0; i < program->slave_count; i++) {
        if (program->slaves[i].calls_here == 0)
            continue;
        program->slaves[i].calls++;
        program->slaves[i].more_calls += program->slaves[i].calls_here - 1;
        program->slaves[i].returns += program->slaves[i].returns_here;
    }
}

/* Do such a step with its rows of events, at most two. Returns their number, or -1 where it is Python's: all of it (STOP_NEAR), or
   after what is in the journal (STOP_HANDED). */
static int64_t step_over(Program *program, double t, double until, double *rows, int64_t room) {
    Balises *balises = &program->balises;
    stopped(program, STOP_NEAR, 0, 0);
    if (!balises->on || room < ROWS_AT_MOST || balises->passed_count >= balises->passed_limit || !is_single(balises, until))
        return -1;
    Over over = {
        .program = program,
        .outputs = program->values + program->watch.first_output,
        .size = (size_t)program->watch.output_count * sizeof(double),
        .t = t,
        .until = until,
    };
    begin_noted(program, t);
    bool ordinary = move_all(&over);
    program->journal.on = 0;
    if (!ordinary) {
        taken_back(program);
        return -1;
    }
    count_noted(program);
    stopped(program, STOP_DONE, 0, 0);
    balises->steps++;
    if (!over.found)
        return 0;
    read_odometer(&over);
    log_crossing(&over);
    return write_rows(&over, rows);
}
