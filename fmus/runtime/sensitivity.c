/* Directional derivatives: one evaluation of the generated tangent with the whole seed vector. */
#include "sensitivity.h"

#include <math.h>
#include <string.h>

#include "variables.h"

/* The seeds of t, x, u and p stand one after the other. */
static double *seeds_of_x(const Runtime *runtime) {
    return runtime->seeds + 1;
}

static double *seeds_of_u(const Runtime *runtime) {
    return seeds_of_x(runtime) + model.states;
}

static double *seeds_of_p(const Runtime *runtime) {
    return seeds_of_u(runtime) + model.inputs;
}

static double *seed_place(const Runtime *runtime, const Variable *known) {
    switch (known->role) {
    case ROLE_TIME: return runtime->seeds;
    case ROLE_STATE: return seeds_of_x(runtime) + known->index;
    case ROLE_INPUT:
    case ROLE_PAYLOAD: return seeds_of_u(runtime) + known->index;
    case ROLE_FIXED:
    case ROLE_TUNABLE: return seeds_of_p(runtime) + known->index;
    default: return NULL;
    }
}

static const double *result_place(const Runtime *runtime, const Variable *unknown) {
    switch (unknown->role) {
    case ROLE_OUTPUT: return runtime->tangent + unknown->index;
    case ROLE_DERIVATIVE: return runtime->tangent + model.outputs + unknown->index;
    default: return NULL;
    }
}

static void evaluate_tangent(Instance *instance) {
    Runtime *runtime = &instance->runtime;
    if (model.tangent == NULL)
        return;
    const double *arguments[] = {&runtime->clock.t, runtime->x, runtime->u, runtime->p, runtime_held(runtime),
                                 runtime->seeds, seeds_of_x(runtime), seeds_of_u(runtime), seeds_of_p(runtime)};
    double *results[] = {runtime->tangent};
    model.tangent(arguments, results, runtime->integer_work, runtime->real_work, 0);
}

static Status check_unknowns(const Instance *instance, const char *function, const unsigned *unknowns, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const Variable *unknown = variables_find(instance, function, unknowns[i]);
        if (unknown == NULL)
            return STATUS_ERROR;
        if (result_place(&instance->runtime, unknown) == NULL)
            return instance_fail(instance, "%s: %s (value reference %u) is no unknown of a directional derivative; expected a real output or the derivative of a state",
                                 function, unknown->name, unknowns[i]);
    }
    return STATUS_OK;
}

static Status plant_seeds(Instance *instance, const char *function, const unsigned *knowns, size_t count, const double *seed) {
    Runtime *runtime = &instance->runtime;
    memset(runtime->seeds, 0, runtime_seed_length() * sizeof(double));
    for (size_t i = 0; i < count; i++) {
        const Variable *known = variables_find(instance, function, knowns[i]);
        if (known == NULL)
            return STATUS_ERROR;
        double *place = seed_place(runtime, known);
        if (place == NULL)
            return instance_fail(instance, "%s: %s (value reference %u) is no known of a directional derivative; expected time, a real input, a state or a parameter",
                                 function, known->name, knowns[i]);
        *place += seed[i];
    }
    return STATUS_OK;
}

static Status check_finite(const Instance *instance, const char *function, const unsigned *unknowns, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return instance_discard(instance, "%s: the directional derivative of %s is not a finite number at %.17g s; the equations have none here",
                                    function, variables_at(unknowns[i])->name, instance->runtime.clock.t);
    return STATUS_OK;
}

PRIVATE Status sensitivity_directional(Instance *instance, const char *function, const unsigned *unknowns, size_t unknown_count,
                                       const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity) {
    if (instance_check_arrays(instance, function, unknowns, unknown_count, sensitivity) != STATUS_OK ||
        instance_check_arrays(instance, function, knowns, known_count, seed) != STATUS_OK ||
        check_unknowns(instance, function, unknowns, unknown_count) != STATUS_OK ||
        plant_seeds(instance, function, knowns, known_count, seed) != STATUS_OK)
        return STATUS_ERROR;
    evaluate_tangent(instance);
    for (size_t i = 0; i < unknown_count; i++)
        sensitivity[i] = *result_place(&instance->runtime, variables_at(unknowns[i]));
    return check_finite(instance, function, unknowns, unknown_count, sensitivity);
}
