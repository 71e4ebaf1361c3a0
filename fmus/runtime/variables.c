/* The variables of an instance. The same rules as `variables.py` of the Python block. */
#include "variables.h"

#include <math.h>

/* -- finding ----------------------------------------------------------------------------------------------------- */

PRIVATE const Variable *variables_at(unsigned reference) {
    return &model.variables[reference - model.first_reference];
}

PRIVATE const Variable *variables_find(const Instance *instance, const char *function, unsigned reference) {
    if (reference - model.first_reference < model.variable_count) /* unsigned: what lies below wraps around */
        return variables_at(reference);
    instance_fail(instance, "%s: there is no variable with value reference %u; the last one is %u", function, reference,
                  model.first_reference + model.variable_count - 1);
    return NULL;
}

PRIVATE const char *variables_name(unsigned roles, int index) {
    for (unsigned i = 0; i < model.variable_count; i++)
        if ((ROLES(model.variables[i].role) & roles) && model.variables[i].index == index)
            return model.variables[i].name;
    return "?";
}

static Status other_type(const Instance *instance, const char *function, const Variable *variable, unsigned reference) {
    return instance_fail(instance, "%s: %s (value reference %u) is of another type", function, variable->name, reference);
}

PRIVATE const Variable *variables_find_among(const Instance *instance, const char *function, unsigned reference, unsigned roles) {
    const Variable *variable = variables_find(instance, function, reference);
    if (variable != NULL && !(ROLES(variable->role) & roles)) {
        other_type(instance, function, variable, reference);
        return NULL;
    }
    return variable;
}

static double *place_of(Instance *instance, const Variable *variable) {
    Runtime *runtime = &instance->runtime;
    switch (variable->role) {
    case ROLE_TIME: return &runtime->clock.t;
    case ROLE_INPUT:
    case ROLE_PAYLOAD: return &runtime->u[variable->index];
    case ROLE_OUTPUT:
    case ROLE_INTEGER_OUTPUT: return &runtime->y[variable->index];
    case ROLE_STATE: return &runtime->x[variable->index];
    case ROLE_FIXED:
    case ROLE_TUNABLE: return &runtime->p[variable->index];
    case ROLE_COUNT: return &runtime->raised[variable->index];
    case ROLE_CLOCK: return &runtime->active[variable->index];
    case ROLE_STAMP: return &runtime->stamps[variable->index];
    case ROLE_POLICY: return runtime->late_policy;
    case ROLE_HORIZON: return runtime->horizon;
    case ROLE_OUTCOME: return &runtime->outcomes[variable->index];
    case ROLE_DERIVATIVE: return &runtime->derivatives[variable->index];
    case ROLE_INDICATOR: return &runtime->indicators[variable->index];
    }
    return NULL;
}

static bool is_real(Role role) {
    unsigned others = ROLES(ROLE_COUNT) | ROLES(ROLE_CLOCK) | ROLES(ROLE_POLICY) | ROLES(ROLE_INTEGER_OUTPUT) | ROLES(ROLE_OUTCOME);
    return !(ROLES(role) & others);
}

/* -- computing --------------------------------------------------------------------------------------------------- */

PRIVATE void instance_refresh(Instance *instance, int wanted) {
    int due = instance->outdated & wanted;
    if (due & OUTDATED_OUTPUTS)
        runtime_update_outputs(&instance->runtime);
    if (due & OUTDATED_DERIVATIVES)
        runtime_update_derivatives(&instance->runtime);
    if (due & OUTDATED_INDICATORS)
        runtime_update_indicators(&instance->runtime);
    instance->outdated &= ~due;
}

static int computed_with(Role role) {
    switch (role) {
    case ROLE_OUTPUT:
    case ROLE_INTEGER_OUTPUT: return OUTDATED_OUTPUTS;
    case ROLE_DERIVATIVE: return OUTDATED_DERIVATIVES;
    case ROLE_INDICATOR: return OUTDATED_INDICATORS;
    default: return 0;
    }
}

/* -- when a variable may be set ------------------------------------------------------------------------------------- */

/* With counts an event is announced at any time and seen at the next step or event; with clocks in event mode only. */
static int settable_modes(const Instance *instance, const Variable *variable) {
    int before = MODE_INSTANTIATED | MODE_INITIALIZATION, announced = MODE_STEP | MODE_EVENT | MODE_CONTINUOUS;
    bool flows = variable->index < model.continuous;
    switch (variable->role) {
    case ROLE_INPUT: return before | MODE_STEP | MODE_EVENT | MODE_CONTINUOUS;
    case ROLE_TUNABLE: return before | MODE_STEP | MODE_EVENT;
    case ROLE_COUNT: return before | announced;
    case ROLE_PAYLOAD:
    case ROLE_STAMP: return before | (model.counts_events ? announced : MODE_EVENT);
    case ROLE_STATE: return before | (flows && instance->face->solver_sets_reals ? MODE_CONTINUOUS : 0);
    case ROLE_FIXED:
    case ROLE_POLICY:
    case ROLE_HORIZON: return before;
    default: return 0;
    }
}

static Status check_settable(const Instance *instance, const char *function, const Variable *variable, unsigned reference) {
    int modes = settable_modes(instance, variable);
    if (instance->mode & modes)
        return STATUS_OK;
    if (modes == 0)
        return instance_fail(instance, "%s: %s (value reference %u) is computed and cannot be set", function, variable->name, reference);
    char allowed[128];
    list_modes(allowed, sizeof allowed, modes);
    return instance_fail(instance, "%s: %s (value reference %u) cannot be set in %s, only in: %s", function, variable->name,
                         reference, mode_name(instance->mode), allowed);
}

/* -- arrays ------------------------------------------------------------------------------------------------------ */

PRIVATE Status instance_check_arrays(const Instance *instance, const char *function, const void *references, size_t count, const void *values) {
    if (count > 0 && (references == NULL || values == NULL))
        return instance_fail(instance, "%s: the array of value references or of values is missing", function);
    return STATUS_OK;
}

PRIVATE Status instance_no_variables(const Instance *instance, const char *function, size_t count) {
    return count == 0 ? STATUS_OK : instance_fail(instance, "%s: this model has no variables of this type", function);
}

/* -- reals ------------------------------------------------------------------------------------------------------- */

PRIVATE Status instance_get_reals(Instance *instance, const char *function, const unsigned *references, size_t count, double *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < count; i++) {
        const Variable *variable = variables_find(instance, function, references[i]);
        if (variable == NULL)
            return STATUS_ERROR;
        if (variable->role == ROLE_OUTPUT && !(instance->outdated & OUTDATED_OUTPUTS)) { /* most of what is ever read */
            values[i] = instance->runtime.y[variable->index];
            continue;
        }
        if (!is_real(variable->role))
            return other_type(instance, function, variable, references[i]);
        instance_refresh(instance, computed_with(variable->role));
        values[i] = *place_of(instance, variable);
    }
    return STATUS_OK;
}

static Status check_real(const Instance *instance, const char *function, unsigned reference) {
    const Variable *variable = variables_find(instance, function, reference);
    if (variable == NULL)
        return STATUS_ERROR;
    if (!is_real(variable->role))
        return other_type(instance, function, variable, reference);
    return check_settable(instance, function, variable, reference);
}

PRIVATE Status instance_set_reals(Instance *instance, const char *function, const unsigned *references, size_t count, const double *values) {
    if (instance_check_arrays(instance, function, references, count, values) != STATUS_OK)
        return STATUS_ERROR;
    for (size_t i = 0; i < count; i++)
        if (check_real(instance, function, references[i]) != STATUS_OK)
            return STATUS_ERROR;
    for (size_t i = 0; i < count; i++)
        *place_of(instance, variables_at(references[i])) = values[i];
    instance->outdated = OUTDATED_ALL;
    return STATUS_OK;
}

/* -- whole numbers ----------------------------------------------------------------------------------------------- */

PRIVATE Status instance_get_integer(Instance *instance, const char *function, unsigned reference, unsigned roles, int64_t *value) {
    const Variable *variable = variables_find_among(instance, function, reference, roles);
    if (variable == NULL)
        return STATUS_ERROR;
    instance_refresh(instance, computed_with(variable->role));
    double held = nearbyint(*place_of(instance, variable));
    if (!(held >= INT32_MIN && held <= INT32_MAX))
        return instance_fail(instance, "%s: %s = %g is not a whole number of 32 bits", function, variable->name, held);
    *value = (int64_t)held;
    return STATUS_OK;
}

PRIVATE Status instance_check_integer(const Instance *instance, const char *function, unsigned reference, unsigned roles, int64_t value) {
    const Variable *variable = variables_find_among(instance, function, reference, roles);
    if (variable == NULL)
        return STATUS_ERROR;
    if (variable->role == ROLE_POLICY && (value < LATE_REPLAY || value > LATE_LATE))
        return instance_fail(instance, "%s: late_policy = %lld is unknown; use 1 (replay), 2 (reject) or 3 (late)", function, (long long)value);
    return check_settable(instance, function, variable, reference);
}

PRIVATE void instance_put_integer(Instance *instance, unsigned reference, int64_t value) {
    *place_of(instance, variables_at(reference)) = (double)value;
}
