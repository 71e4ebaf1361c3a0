/* The stepper: executes the plan of a run over the functions of the FMUs, many communication steps in one call. Mirrors `Master`,
   `GaussSeidel`, `Jacobi` (where every signal is held) and `PlannedComponent` of the Python stepper: the same calls with the same numbers in the same order.

   Nothing is allocated and nothing is kept here. Whatever is out of the ordinary is left to Python, which finishes the step. */
#include "turns.c"

#define SAMPLING 17 /* every so many steps the clock is read; prime, so as not to follow a rhythm of the model */

static bool step_plan(Program *program, int64_t k, double t, double until, bool timed) {
    const PlantMonitor *watch = &program->watch;
    bool watched = watch->slave >= 0 && !program->balises.by_instant;
    begin_step(program);
    for (int64_t i = 0; i < program->slave_count; i++) {
        Slave *slave = &program->slaves[i];
        if (slave->special) {
            if (!move_special(program, i, k, t, until, timed))
                return false;
            continue;
        }
        gather(slave, program->values, t, until);
        if (!move(program, i, t, until, timed))
            return false;
        if (watched && i == watch->slave && crossed(program)) {
            memcpy(program->values + watch->first_output, start_of(program) + watch->first_output, (size_t)watch->output_count * sizeof(double));
            return stopped(program, STOP_CROSSED, i, 0);
        }
    }
    return true;
}

/* Whether all values are finite, or missing where they can be: the difference of a number to itself is zero, else it is NaN. */
static bool all_finite(const Program *program) {
    const double *values = program->values;
    double sum = 0.0;
    for (int64_t i = 0; i < program->value_count; i++)
        if (program->can_be_missing == NULL || !program->can_be_missing[i] || !isnan(values[i]))
            sum += values[i] - values[i];
    return sum == 0.0;
}

/* Do the steps from number `first` up to `last`, at most, into at most `room` rows (time, values), one for each and those of events.
   Returns the number of steps. */
EXPORTED int64_t stepper_run(Program *program, int64_t first, int64_t last, double *rows, int64_t room) {
    size_t bytes = (size_t)program->value_count * sizeof(double);
    const int64_t width = 1 + program->value_count;
    double begin = now();
    program->balises.passed_count = 0;
    for (int64_t i = 0; i < program->slave_count; i++) {
        program->slaves[i].all_calls += program->slaves[i].calls;
        program->slaves[i].calls = 0;
    }
    stopped(program, STOP_DONE, 0, 0);
    int64_t k = first, used = 0;
    for (; k < last && used < room && program->stop == STOP_DONE; k++) {
        bool timed = (k - first) % SAMPLING == 0;
        if (timed && k > first && now() - begin > program->seconds_at_most) {
            stopped(program, STOP_TIME, 0, 0);
            break;
        }
        double t = program->start + (double)k * program->step, until = program->start + (double)(k + 1) * program->step;
        *program->last_time = t;
        if (is_over(program, t, until)) {
            int64_t events = step_over(program, t, until, rows + used * width, room - used);
            if (events < 0)
                break;
            used += events;
        } else {
            if (program->saves ? !step_saved(program, k, t, until, timed) : !step_plan(program, k, t, until, timed))
                break;
        }
        if (program->listener_count != 0 && anybody_hears(program)) {
            stopped(program, STOP_EVENTS, program->slave_count, 0);
            break;
        }
        double *row = rows + used++ * width;
        row[0] = until;
        memcpy(row + 1, program->values, bytes);
        *program->rows_reported = program->rows_before + used;
        if (!all_finite(program))
            stopped(program, STOP_NOT_FINITE, 0, 0);
    }
    program->rows_done = used;
    program->seconds = now() - begin;
    return k - first;
}

/* Bring all slaves from `t` to `until` [s], a part of a step; all have the same rate. Returns the number of rows of events, which has room for
   ROWS_AT_MOST, or -1: Python goes on from where the program stopped. */
EXPORTED int64_t stepper_part(Program *program, double t, double until, double *rows) {
    *program->last_time = t;
    program->balises.passed_count = 0;
    double begin = now();
    int64_t events = 0;
    stopped(program, STOP_DONE, 0, 0);
    if (is_over(program, t, until))
        events = step_over(program, t, until, rows, ROWS_AT_MOST);
    else if (!step_plan(program, PART, t, until, program->parts++ % SAMPLING == 0))
        events = -1;
    program->seconds = now() - begin;
    return events;
}
