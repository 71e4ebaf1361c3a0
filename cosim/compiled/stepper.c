/* The stepper: executes the plan of a run over the functions of the FMUs, many communication steps in one call. Mirrors `Master`,
   `GaussSeidel`, `Jacobi` and `PlannedComponent` of the Python stepper: the same calls with the same numbers in the same order.

   Nothing is allocated and nothing is kept here. Whatever is out of the ordinary is left to Python, which finishes the step. */
#if !defined(_WIN32)
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#endif
#include "stepper.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <time.h>

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

#define STATUS_WARNING 1 /* in all versions of FMI: more than this is a failure */
#define TIME_TOLERANCE 1e-9 /* communication times closer than this are the same [s], as in the components */
#define TIME_TOLERANCE 1e-9 /* [s] closer than this is the same time, as in Python */
#define SAMPLING 17      /* every so many steps the clock is read; prime, so as not to follow a rhythm of the model */

/* -- functions of FMI ---------------------------------------------------------------------------------------------- */

typedef int (*Transfer12)(void *instance, const uint32_t *references, size_t count, void *values);
typedef int (*Transfer3)(void *instance, const uint32_t *references, size_t count, void *values, size_t value_count);
typedef int (*DoStep1)(void *instance, double t, double h, char new_step);
typedef int (*DoStep2)(void *instance, double t, double h, int no_set_state);
typedef int (*Enter)(void *instance);
typedef int (*SetClock)(void *instance, const uint32_t *references, size_t count, const bool *values);
typedef int (*SetReals)(void *instance, const uint32_t *references, size_t count, const double *values, size_t value_count);
typedef int (*Update)(void *instance, bool *again, bool *terminate, bool *nominals, bool *values, bool *next_defined, double *next);
typedef int (*DoStep3)(void *instance, double t, double h, bool no_set_state, bool *event, bool *terminate, bool *early, double *reached);

static int transfer(const Slave *slave, const Port *port) {
    size_t count = (size_t)port->reference_count;
    if (slave->fmi_version == 3)
        return ((Transfer3)port->function)(slave->instance, port->references, count, port->raw, (size_t)port->raw_count);
    return ((Transfer12)port->function)(slave->instance, port->references, count, port->raw);
}

/* True where the step was taken as asked and nothing is to be seen to. */
static bool do_step(Program *program, const Slave *slave, double t, double h) {
    if (slave->fmi_version == 1) {
        program->status = ((DoStep1)slave->do_step)(slave->instance, t, h, 1);
        return program->status <= STATUS_WARNING;
    }
    if (slave->fmi_version == 2) {
        program->status = ((DoStep2)slave->do_step)(slave->instance, t, h, 0);
        return program->status <= STATUS_WARNING;
    }
    bool event = false, terminate = false, early = false;
    double reached = t + h; /* for slaves that do not fill it in */
    program->status = ((DoStep3)slave->do_step)(slave->instance, t, h, false, &event, &terminate, &early, &reached);
    const bool came_short = t + TIME_TOLERANCE < reached && reached < t + h - TIME_TOLERANCE;
    if (program->status <= STATUS_WARNING && !terminate && !early && !came_short && !(event && slave->heeds_events))
        return true;
    program->event = event;
    program->terminate = terminate;
    program->early = early;
    program->reached = reached;
    return false;
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

static void gather(const Slave *slave, const double *values) {
    if (slave->factors == NULL) {
        for (int64_t i = 0; i < slave->input_count; i++)
            slave->inputs[i] = values[slave->sources[i]];
        return;
    }
    for (int64_t i = 0; i < slave->input_count; i++)
        slave->inputs[i] = values[slave->sources[i]] * slave->factors[i] + slave->offsets[i];
}

/* -- one slave ----------------------------------------------------------------------------------------------------- */

static bool stopped(Program *program, int64_t stop, int64_t slave, int64_t port) {
    program->stop = stop;
    program->slave = slave;
    program->port = port;
    return false;
}

static bool send_inputs(Program *program, int64_t which) {
    const Slave *slave = &program->slaves[which];
    for (int64_t i = 0; i < slave->write_count; i++) /* first of all, so that a refused value touches nothing */
        if (slave->writes[i].places != NULL && !pack(&slave->writes[i]))
            return stopped(program, STOP_REFUSED, which, i);
    for (int64_t i = 0; i < slave->write_count; i++) {
        program->status = transfer(slave, &slave->writes[i]);
        if (program->status > STATUS_WARNING)
            return stopped(program, STOP_WRITE, which, i);
    }
    return true;
}

static bool read_outputs(Program *program, int64_t which) {
    const Slave *slave = &program->slaves[which];
    for (int64_t i = 0; i < slave->read_count; i++) {
        program->status = transfer(slave, &slave->reads[i]);
        if (program->status > STATUS_WARNING)
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

static bool move(Program *program, int64_t which, double t, double h, bool timed) {
    Slave *slave = &program->slaves[which];
    if (!send_inputs(program, which))
        return false;
    slave->calls++;
    double begin = timed ? now() : 0.0;
    bool ordinary = do_step(program, slave, t, h);
    if (timed)
        slave->seconds += now() - begin;
    if (!ordinary)
        return stopped(program, STOP_STEP, which, 0);
    return read_outputs(program, which);
}

/* -- balises: the rules of `TrackLayout` and `RollbackLocaliser` ----------------------------------------------------- */

/* Put the cursor before the first place at or behind `position`. */
static void seek(Watch *watch, double position) {
    while (watch->cursor > 0 && !(watch->places[watch->cursor - 1] < position))
        watch->cursor--;
    while (watch->cursor < watch->place_count && watch->places[watch->cursor] < position)
        watch->cursor++;
}

static int64_t first_ahead(const Watch *watch, double position) {
    int64_t ahead = watch->cursor;
    while (ahead < watch->place_count && !(watch->places[ahead] > position))
        ahead++;
    return ahead;
}

static bool is_near(Program *program, double h) {
    Watch *watch = &program->watch;
    double position = program->values[watch->position] * watch->position_scale;
    double speed = program->values[watch->speed] * watch->speed_scale;
    seek(watch, position);
    int64_t ahead = first_ahead(watch, position);
    double behind_gap = watch->cursor > 0 ? position - watch->places[watch->cursor - 1] : INFINITY;
    double ahead_gap = ahead < watch->place_count ? watch->places[ahead] - position : INFINITY;
    return fmin(behind_gap, ahead_gap) <= fabs(speed) * h + watch->acceleration_limit * h * h;
}

static bool crossed(const Program *program) {
    const Watch *watch = &program->watch;
    double before = program->before[watch->position] * watch->position_scale;
    double after = program->values[watch->position] * watch->position_scale;
    if (after >= before) {
        int64_t ahead = first_ahead(watch, before);
        return ahead < watch->place_count && watch->places[ahead] <= after;
    }
    return watch->cursor > 0 && watch->places[watch->cursor - 1] >= after;
}

/* -- the whole plan ------------------------------------------------------------------------------------------------ */

static bool step_plan(Program *program, double t, double h, bool timed) {
    const Watch *watch = &program->watch;
    bool watched = watch->slave >= 0;
    if (watched && is_near(program, h))
        return stopped(program, STOP_NEAR, 0, 0);
    if (program->gathers_first)
        for (int64_t i = 0; i < program->slave_count; i++)
            gather(&program->slaves[i], program->values);
    for (int64_t i = 0; i < program->slave_count; i++) {
        if (!program->gathers_first)
            gather(&program->slaves[i], program->values);
        if (!move(program, i, t, h, timed))
            return false;
        if (watched && i == watch->slave && crossed(program)) {
            memcpy(program->values + watch->first_output, program->before + watch->first_output, (size_t)watch->output_count * sizeof(double));
            return stopped(program, STOP_CROSSED, i, 0);
        }
    }
    return true;
}

/* One slave alone, with its gathered inputs, from t by h [s]; its outputs are read where that is wanted. Counts nothing. Returns 1
   where that was ordinary, else 0 and says why in the program. */
EXPORTED int64_t stepper_move(Program *program, int64_t which, double t, double h, int64_t reads) {
    if (!send_inputs(program, which))
        return 0;
    if (!do_step(program, &program->slaves[which], t, h))
        return stopped(program, STOP_STEP, which, 0);
    return reads ? read_outputs(program, which) : true;
}

static bool simple_move(Program *program, int64_t which, double t, double h) {
    return stepper_move(program, which, t, h, 0) != 0;
}

static bool succeeded(Program *program, int status) {
    program->status = status;
    return status <= STATUS_WARNING;
}

static bool update(Program *program, const Slave *slave, Telegram *telegram) {
    bool flags[5] = {false, false, false, false, false};
    int status = ((Update)telegram->update)(slave->instance, flags, flags + 1, flags + 2, flags + 3, flags + 4, &telegram->next_event);
    for (int i = 0; i < 5; i++)
        telegram->flags[i] = flags[i];
    bool again = flags[0], terminate = flags[1], next_defined = flags[4];
    return succeeded(program, status) && !again && !terminate && !next_defined;
}

static bool copy_outputs(Program *program, int64_t which, double *target) {
    const Port *port = &program->slaves[which].reads[0];
    if (!read_outputs(program, which))
        return false;
    memcpy(target, port->raw, (size_t)port->raw_count * sizeof(double));
    return true;
}

static bool tell_stage(Program *program, int64_t which, Telegram *telegram, const double times[3], double *before, double *after) {
    const Slave *slave = &program->slaves[which];
    const uint32_t clock = (uint32_t)telegram->clock;
    const bool on = true;
    switch (telegram->stage) {
    case STAGE_SEND: return send_inputs(program, which);
    case STAGE_ARRIVE: return times[1] <= times[0] || simple_move(program, which, times[0], times[1] - times[0]);
    case STAGE_BEFORE: return copy_outputs(program, which, before);
    case STAGE_ENTER: return succeeded(program, ((Enter)telegram->enter_event)(slave->instance));
    case STAGE_CLOCK: return succeeded(program, ((SetClock)telegram->set_clock)(slave->instance, &clock, 1, &on));
    case STAGE_PAYLOAD: {
        size_t count = (size_t)telegram->payload_count;
        if (count == 0)
            return true;
        return succeeded(program, ((SetReals)telegram->set_reals)(slave->instance, telegram->references, count, telegram->payload, count));
    }
    case STAGE_UPDATE: return update(program, slave, telegram);
    case STAGE_LEAVE: return succeeded(program, ((Enter)telegram->enter_step)(slave->instance));
    case STAGE_AFTER: return copy_outputs(program, which, after);
    case STAGE_GO_ON: return times[2] <= times[1] || simple_move(program, which, times[1], times[2] - times[1]);
    default: return times[2] <= times[1] || read_outputs(program, which);
    }
}

/* A receiver with event mode is stepped through one telegram: from times[0] to times[1], where it is told, and on to times[2] [s]. Its
   outputs there go to `before` and `after`. Returns 1 where all was ordinary, else 0, with the stage and the status. Counts nothing. */
EXPORTED int64_t stepper_tell(Program *program, int64_t which, Telegram *telegram, const double times[3], double *before, double *after) {
    for (telegram->stage = STAGE_SEND; telegram->stage < STAGE_DONE; telegram->stage++)
        if (!tell_stage(program, which, telegram, times, before, after))
            return 0;
    return 1;
}

/* Whether all values are finite: the difference of a number to itself is zero, else it is NaN. */
static bool all_finite(const double *values, int64_t count) {
    double sum = 0.0;
    for (int64_t i = 0; i < count; i++)
        sum += values[i] - values[i];
    return sum == 0.0;
}

/* Do the steps from number `first` up to `last`, at most, with one row (time, values) each; `before` has room for the values.
   Returns the number of rows. */
EXPORTED int64_t stepper_run(Program *program, int64_t first, int64_t last, double *rows, double *before) {
    size_t bytes = (size_t)program->value_count * sizeof(double);
    double begin = now();
    memcpy(before, program->values, bytes);
    program->before = before;
    program->sampled = 0.0;
    stopped(program, STOP_DONE, 0, 0);
    int64_t k = first;
    for (; k < last && program->stop == STOP_DONE; k++) {
        bool timed = (k - first) % SAMPLING == 0;
        if (timed && k > first && now() - begin > program->seconds_at_most) {
            stopped(program, STOP_TIME, 0, 0);
            break;
        }
        double t = program->start + (double)k * program->step, until = program->start + (double)(k + 1) * program->step;
        if (!step_plan(program, t, until - t, timed))
            break;
        program->sampled += timed;
        rows[0] = until;
        memcpy(rows + 1, program->values, bytes);
        program->before = rows + 1;
        if (!all_finite(program->values, program->value_count))
            stopped(program, STOP_NOT_FINITE, 0, 0);
        rows += 1 + program->value_count;
    }
    program->seconds = now() - begin;
    return k - first;
}
