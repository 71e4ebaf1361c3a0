/* The runtime: a hybrid system moving through time. Mirrors `runtime.py`; change the two together. */
#include "runtime.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "noise.h"
#include "switching.h"

#define GRID_TOLERANCE 1e-9 /* of an internal step: closer to a grid point than this is on it */

/* -- places ------------------------------------------------------------------------------------------------------ */

PRIVATE size_t runtime_queue_stride(void) {
    int longest = 0;
    for (int i = 0; i < model.triggered_count; i++)
        if (model.triggered[i].payload_count > longest)
            longest = model.triggered[i].payload_count;
    return 2 + (size_t)longest;
}

static size_t queue_size(void) {
    return model.triggered_count > 0 ? QUEUE_CAPACITY * runtime_queue_stride() : 0;
}

static int balance_length(void) {
    return 2 * model.friction_count + model.switching_count;
}

PRIVATE int runtime_held_count(void) {
    return model.friction_count + model.switching_count;
}

PRIVATE size_t runtime_memory_length(void) {
    size_t length = (size_t)model.states + (size_t)model.inputs + (size_t)model.parameters;
    length += 3 * (size_t)model.periodic_count + 1 + (size_t)runtime_held_count();
    return length + 4 * (size_t)model.triggered_count + 3 + OUTCOMES + queue_size();
}

PRIVATE size_t runtime_used_length(const Runtime *runtime) {
    size_t waiting = (size_t)*runtime->queue_length * runtime_queue_stride();
    return (size_t)(runtime->queue - runtime->memory) + waiting;
}

PRIVATE size_t runtime_seed_length(void) {
    return 1 + (size_t)model.states + (size_t)model.inputs + (size_t)model.parameters;
}

PRIVATE size_t runtime_total_length(void) {
    size_t results = (size_t)model.outputs + (size_t)model.states + (size_t)model.continuous;
    results += 2 * (size_t)runtime_held_count() + (size_t)balance_length();
    results += 2 * (size_t)model.continuous + runtime_seed_length() + (size_t)model.outputs + (size_t)model.requirement_count;
    return runtime_memory_length() + results + (size_t)model.real_work;
}

static double *take(double **place, size_t count) {
    double *taken = *place;
    *place += count;
    return taken;
}

/* The arrays that lie in `memory`; what follows them. */
static double *place_memory(Runtime *runtime, double *numbers) {
    double *place = numbers;
    runtime->memory = numbers;
    runtime->x = take(&place, (size_t)model.states);
    runtime->u = take(&place, (size_t)model.inputs);
    runtime->p = take(&place, (size_t)model.parameters);
    runtime->periods = take(&place, (size_t)model.periodic_count);
    runtime->offsets = take(&place, (size_t)model.periodic_count);
    runtime->ticks = take(&place, (size_t)model.periodic_count);
    runtime->resolved = take(&place, 1);
    runtime->held = take(&place, (size_t)runtime_held_count());
    runtime->active = take(&place, (size_t)model.triggered_count);
    runtime->raised = take(&place, (size_t)model.triggered_count);
    runtime->seen = take(&place, (size_t)model.triggered_count);
    runtime->stamps = take(&place, (size_t)model.triggered_count);
    runtime->late_policy = take(&place, 1);
    runtime->horizon = take(&place, 1);
    runtime->outcomes = take(&place, OUTCOMES);
    runtime->queue_length = take(&place, 1);
    runtime->queue = take(&place, queue_size());
    return place;
}

PRIVATE void runtime_place(Runtime *runtime, double *numbers, int *integers) {
    double *place = place_memory(runtime, numbers);
    runtime->y = take(&place, (size_t)model.outputs);
    runtime->x_next = take(&place, (size_t)model.states);
    runtime->derivatives = take(&place, (size_t)model.continuous);
    runtime->indicators = take(&place, (size_t)runtime_held_count());
    runtime->held_now = take(&place, (size_t)runtime_held_count());
    runtime->balance = take(&place, (size_t)balance_length());
    runtime->required = take(&place, (size_t)model.requirement_count);
    runtime->x_before = take(&place, (size_t)model.continuous);
    runtime->seeds = take(&place, runtime_seed_length());
    runtime->tangent = take(&place, (size_t)model.outputs + (size_t)model.continuous);
    runtime->real_work = take(&place, (size_t)model.real_work);
    runtime->integer_work = integers;
    runtime_reset(runtime);
}

static void copy(double *target, const double *source, int count) {
    if (count > 0)
        memcpy(target, source, (size_t)count * sizeof(double));
}

PRIVATE void runtime_reset(Runtime *runtime) {
    memset(runtime->memory, 0, runtime_memory_length() * sizeof(double));
    copy(runtime->x, model.start_x, model.states);
    copy(runtime->u, model.start_u, model.inputs);
    copy(runtime->p, model.start_p, model.parameters);
    for (int i = 0; i < model.triggered_count; i++)
        runtime->stamps[i] = STAMP_NOW;
    *runtime->late_policy = model.late_policy;
    *runtime->horizon = model.replay_horizon;
    runtime->clock.t = runtime->clock.t0 = 0.0;
    runtime->clock.h = runtime->p[model.internal_step];
    runtime->chattering = -1;
}

/* -- evaluation (the kernel of `kernel.py`) ------------------------------------------------------------------------ */

/* The next number is the next pattern of bits: `nextafter` without a call, several times in every step. */
PRIVATE double runtime_resolution(double t) {
    double magnitude = fabs(t), next;
    uint64_t bits;
    memcpy(&bits, &magnitude, sizeof bits);
    bits++;
    memcpy(&next, &bits, sizeof next);
    return next - magnitude;
}

static void jump(Runtime *runtime, ModelFunction function) {
    const double *arguments[] = {&runtime->clock.t, runtime->x, runtime->u, runtime->p};
    double *results[] = {runtime->x_next};
    function(arguments, results, runtime->integer_work, runtime->real_work, 0);
    copy(runtime->x, runtime->x_next, model.states);
}

PRIVATE void runtime_update_outputs(Runtime *runtime) {
    if (model.output == NULL)
        return;
    const double *arguments[] = {&runtime->clock.t, runtime->x, runtime->u, runtime->p};
    double *results[] = {runtime->y};
    model.output(arguments, results, runtime->integer_work, runtime->real_work, 0);
}

static void evaluate_balance(Runtime *runtime, const double *held) {
    if (model.balance == NULL)
        return;
    const double *arguments[] = {&runtime->clock.t, runtime->x, runtime->u, runtime->p, held};
    double *results[] = {runtime->balance};
    model.balance(arguments, results, runtime->integer_work, runtime->real_work, 0);
}

PRIVATE const double *runtime_switching(const Runtime *runtime) {
    return runtime->balance + 2 * model.friction_count;
}

PRIVATE const double *runtime_held(Runtime *runtime) {
    if (*runtime->resolved != 0.0)
        return runtime->held;
    for (int i = 0; i < model.friction_count; i++) {
        double value = runtime->x[model.frictions[i]];
        runtime->held_now[i] = (double)((value > 0.0) - (value < 0.0));
    }
    if (model.switching_count > 0)
        evaluate_balance(runtime, runtime->held_now); /* the switching functions do not ask for switches */
    for (int i = 0; i < model.switching_count; i++)
        runtime->held_now[model.friction_count + i] = runtime_switching(runtime)[i] >= 0.0;
    return runtime->held_now;
}

PRIVATE void runtime_update_derivatives(Runtime *runtime) {
    if (model.derivative == NULL)
        return;
    const double *arguments[] = {&runtime->clock.t, runtime->x, runtime->u, runtime->p, runtime_held(runtime)};
    double *results[] = {runtime->derivatives};
    model.derivative(arguments, results, runtime->integer_work, runtime->real_work, 0);
}

PRIVATE void runtime_update_balance(Runtime *runtime) {
    evaluate_balance(runtime, runtime_held(runtime));
}

PRIVATE void runtime_update_indicators(Runtime *runtime) {
    const double *signs = runtime_held(runtime);
    evaluate_balance(runtime, signs);
    for (int i = 0; i < model.friction_count; i++) {
        double left = runtime->balance[model.friction_count + i] - fabs(runtime->balance[i]);
        runtime->indicators[i] = signs[i] == 0.0 ? left : signs[i] * runtime->x[model.frictions[i]];
    }
    copy(runtime->indicators + model.friction_count, runtime_switching(runtime), model.switching_count);
}

/* -- periodic events --------------------------------------------------------------------------------------------- */

PRIVATE double runtime_tolerance(const Runtime *runtime, double t) {
    return GRID_TOLERANCE * runtime->clock.h + 4.0 * runtime_resolution(t);
}

static double instant(const Runtime *runtime, int i) {
    return runtime->clock.t0 + runtime->offsets[i] + runtime->ticks[i] * runtime->periods[i];
}

PRIVATE double runtime_next_due(const Runtime *runtime) {
    double due = INFINITY;
    for (int i = 0; i < model.periodic_count; i++)
        due = fmin(due, instant(runtime, i));
    return due;
}

static void draw_noises(Runtime *runtime, int event, int position) {
    uint64_t seed = model.seed < 0 ? 0 : (uint64_t)runtime->p[model.seed];
    for (int j = 0; j < model.periodic[event].noises; j++) {
        uint64_t signal = (uint64_t)(position - model.noise_offset + j);
        runtime->u[position + j] = noise_standard_normal(seed, signal, (uint64_t)runtime->ticks[event], model.purpose);
    }
}

PRIVATE void runtime_fire_due(Runtime *runtime) {
    int position = model.noise_offset;
    for (int i = 0; i < model.periodic_count; i++) {
        if (instant(runtime, i) <= runtime->clock.t + runtime_tolerance(runtime, runtime->clock.t)) {
            draw_noises(runtime, i, position);
            jump(runtime, model.periodic[i].jump);
            runtime->ticks[i] += 1.0;
        }
        position += model.periodic[i].noises;
    }
}

/* -- time -------------------------------------------------------------------------------------------------------- */

static bool is_positive(double value) {
    return isfinite(value) && value > 0.0;
}

PRIVATE const Requirement *runtime_unfulfilled(const Runtime *runtime, bool starting) {
    if (model.fulfilled == NULL)
        return NULL;
    const double *arguments[] = {runtime->x, runtime->p};
    double *results[] = {runtime->required};
    model.fulfilled(arguments, results, runtime->integer_work, runtime->real_work, 0);
    int count = starting ? model.requirement_count : model.lasting_count;
    for (int i = 0; i < count; i++)
        if (runtime->required[i] == 0.0)
            return &model.requirements[i];
    return NULL;
}

static bool is_seed(double value) {
    return value >= 0.0 && value < LARGEST_WHOLE && value == floor(value);
}

PRIVATE void runtime_choose_seed(Runtime *runtime, const char *name) {
    if (model.seed >= 0 && runtime->p[model.seed] == SEED_FROM_NAME)
        runtime->p[model.seed] = noise_seed_of(RUN_SEED, name);
}

PRIVATE int runtime_start(Runtime *runtime, double t0) {
    if (!is_positive(runtime->p[model.internal_step]))
        return model.internal_step;
    for (int i = 0; i < model.periodic_count; i++) {
        int offset = model.periodic[i].offset;
        runtime->periods[i] = runtime->p[model.periodic[i].period];
        runtime->offsets[i] = offset < 0 ? 0.0 : runtime->p[offset];
        runtime->ticks[i] = 0.0;
        if (!is_positive(runtime->periods[i]))
            return model.periodic[i].period;
        if (!isfinite(runtime->offsets[i]))
            return offset;
    }
    if (model.seed >= 0 && !is_seed(runtime->p[model.seed]))
        return model.seed;
    runtime->clock.t = runtime->clock.t0 = t0;
    runtime->clock.h = runtime->p[model.internal_step];
    copy(runtime->seen, runtime->raised, model.triggered_count); /* what stands there already is no event */
    runtime_fire_due(runtime);
    runtime_communicate(runtime);
    return -1;
}

/* Time stands at `target`, unless it stands where a switch chatters. */
static void arrive(Runtime *runtime, double target) {
    if (runtime->chattering < 0)
        runtime->clock.t = target;
}

/* Move to `target` through whole cells of the grid, with a part of a cell at either end. */
static void integrate(Runtime *runtime, double target) {
    double t = runtime->clock.t, t0 = runtime->clock.t0, h = runtime->clock.h;
    double tolerance = runtime_tolerance(runtime, target);
    runtime->divisions = 0;
    if (target - t <= tolerance || model.step == NULL) { /* where nothing flows there is no grid */
        runtime->clock.t = fmax(t, target);
        return;
    }
    double cell = (t - t0) / h;
    double k = floor(cell + tolerance / h);
    if ((cell - k) * h > tolerance) { /* inside a cell: finish it, or stop within it */
        double boundary = t0 + (k + 1.0) * h;
        if (boundary >= target - tolerance) {
            /* a target on the boundary but for rounding is the boundary */
            switching_step(runtime, t, (boundary <= target + tolerance ? boundary : target) - t);
            arrive(runtime, target);
            return;
        }
        switching_step(runtime, t, boundary - t);
        k += 1.0;
    }
    double whole = floor((target - t0) / h + tolerance / h) - k;
    if (whole > 0.0) {
        for (double i = 0.0; i < whole && runtime->chattering < 0; i += 1.0)
            switching_step(runtime, t0 + (k + i) * h, h);
        k += whole;
    }
    double rest = target - (t0 + k * h);
    if (rest > tolerance)
        switching_step(runtime, t0 + k * h, rest);
    arrive(runtime, target);
}

PRIVATE void runtime_advance(Runtime *runtime, double t_end) {
    for (;;) {
        double due = runtime_next_due(runtime);
        if (due > t_end + runtime_tolerance(runtime, t_end))
            break;
        integrate(runtime, due);
        if (runtime->chattering >= 0)
            return;
        runtime_fire_due(runtime);
    }
    integrate(runtime, t_end);
}

PRIVATE double runtime_count_steps(const Runtime *runtime, double t_end) {
    double count = (t_end - runtime->clock.t) / runtime->clock.h;
    for (int i = 0; i < model.periodic_count; i++)
        count = fmax(count, (t_end + runtime_tolerance(runtime, t_end) - instant(runtime, i)) / runtime->periods[i]);
    return count;
}

PRIVATE double runtime_next_instant_before(const Runtime *runtime, double t_end) {
    double due = runtime_next_due(runtime), now = runtime->clock.t;
    bool between = due > now + runtime_tolerance(runtime, now) && due < t_end - runtime_tolerance(runtime, t_end);
    return between ? due : INFINITY;
}

PRIVATE void runtime_communicate(Runtime *runtime) {
    for (int i = 0; i < model.communication_count; i++)
        jump(runtime, model.communications[i]);
}

PRIVATE void runtime_trigger(Runtime *runtime, int event) {
    jump(runtime, model.triggered[event].jump);
}

/* -- from outside ------------------------------------------------------------------------------------------------ */

static bool is_whole(double value, double from, double to) {
    return value >= from && value <= to && value == floor(value);
}

static bool queue_is_sane(const Runtime *runtime) {
    if (!is_whole(*runtime->queue_length, 0.0, model.triggered_count > 0 ? QUEUE_CAPACITY : 0))
        return false;
    for (int i = 0; i < (int)*runtime->queue_length; i++) {
        const double *entry = runtime->queue + (size_t)i * runtime_queue_stride();
        if (!is_whole(entry[0], 0.0, model.triggered_count - 1) || !isfinite(entry[1]))
            return false;
    }
    return true;
}

static bool events_are_sane(const Runtime *runtime) {
    for (int i = 0; i < model.triggered_count; i++) {
        bool counts = is_whole(runtime->raised[i], INT32_MIN, INT32_MAX) && is_whole(runtime->seen[i], INT32_MIN, INT32_MAX);
        if (!counts || !is_whole(runtime->active[i], 0.0, 1.0))
            return false;
    }
    for (int i = 0; i < OUTCOMES; i++)
        if (!is_whole(runtime->outcomes[i], 0.0, LARGEST_WHOLE - 1.0))
            return false;
    return is_whole(*runtime->late_policy, LATE_REPLAY, LATE_LATE) && queue_is_sane(runtime);
}

/* With which time runs on; before it has started these are not what it will run with. */
static bool timing_is_sane(const Runtime *runtime) {
    for (int i = 0; i < model.periodic_count; i++)
        if (!is_positive(runtime->periods[i]) || !isfinite(runtime->offsets[i]) || !is_whole(runtime->ticks[i], 0.0, LARGEST_WHOLE - 1.0))
            return false;
    if (runtime_unfulfilled(runtime, false) != NULL)
        return false;
    if (model.seed >= 0 && !is_seed(runtime->p[model.seed]))
        return false;
    bool horizon = *runtime->horizon >= 0.0 && isfinite(*runtime->horizon);
    return horizon && runtime_count_steps(runtime, runtime->clock.t) <= MOST_INTERNAL_STEPS;
}

PRIVATE bool runtime_is_sane(const Runtime *runtime, const Clock *clock, const double *memory, bool started) {
    Runtime view = *runtime;
    place_memory(&view, (double *)memory); /* only read */
    view.clock = *clock;
    if (!isfinite(clock->t) || !isfinite(clock->t0) || !is_positive(clock->h))
        return false;
    for (int i = 0; i < runtime_held_count(); i++)
        if (!is_whole(view.held[i], -1.0, 1.0))
            return false;
    if (!is_whole(*view.resolved, 0.0, started ? 1.0 : 0.0) || !events_are_sane(&view))
        return false;
    return !started || timing_is_sane(&view);
}

PRIVATE int runtime_first_broken_state(const Runtime *runtime) {
    for (int i = 0; i < model.states; i++)
        if (!isfinite(runtime->x[i]))
            return i;
    return -1;
}
