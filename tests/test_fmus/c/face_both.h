/* What the functions of FMI 2.0 and 3.0 have in common. Included by face2.h and face3.h, which define FMI(name), FMI_STATE(before,
 * after), the name of that with the word for a state in the middle, FMI_INSTANCE and FMI_DESERIALIZE.
 */
#define STATUS(good) ((good) ? FMI(OK) : FMI(Error))
#define REFUSE return FMI(Error)

const char *FMI(GetVersion)(void) { return FMI(Version); }

FMI(Status) FMI(SetDebugLogging)(FMI_INSTANCE c, FMI(Boolean) on, size_t n, const FMI(String) names[]) {
    return STATUS(set_categories(&((Instance *)c)->host, on, n, names));
}

/* Whether the model takes the tolerance that it is told at set-up. */
static bool tolerated(Instance *instance, bool defined, double tolerance) {
#if TAKES_TOLERANCE
    if (!model_tolerance(&instance->now.model, defined ? tolerance : 0.0)) {
        SAY(&instance->host, ERROR, "logStatusError", "a tolerance of %g is too fine", tolerance);
        return false;
    }
#endif
    return true;
}

FMI(Status) FMI(ExitInitializationMode)(FMI_INSTANCE c) {
    if (!may(c, INITIALIZATION, __func__))
        REFUSE;
    begin(c);
    return FMI(OK);
}

FMI(Status) FMI(Reset)(FMI_INSTANCE c) {
    restart(c);
    return FMI(OK);
}

/* -- states -------------------------------------------------------------------------------------------------------- */

#if CAN_SAVE
#define SAVED(...) __VA_ARGS__
#else
#define SAVED(...) REFUSE;
#endif

FMI(Status) FMI_STATE(Get, )(FMI_INSTANCE c, FMI_STATE(, ) *state) {
    SAVED(
        Instance *instance = c;
        if (*state == NULL)
            *state = saved_copy(&instance->now);
        else
            memcpy(*state, &instance->now, sizeof instance->now);
        return STATUS(*state != NULL);
    )
}

FMI(Status) FMI_STATE(Set, )(FMI_INSTANCE c, FMI_STATE(, ) state) {
    SAVED(
        memcpy(&((Instance *)c)->now, state, sizeof(Saved));
        return FMI(OK);
    )
}

FMI(Status) FMI_STATE(Free, )(FMI_INSTANCE c, FMI_STATE(, ) *state) {
    SAVED(
        free(*state);
        *state = NULL;
        return FMI(OK);
    )
}

FMI(Status) FMI_STATE(Serialized, Size)(FMI_INSTANCE c, FMI_STATE(, ) state, size_t *size) {
    SAVED(
        *size = sizeof(Saved);
        return FMI(OK);
    )
}

FMI(Status) FMI_STATE(Serialize, )(FMI_INSTANCE c, FMI_STATE(, ) state, FMI(Byte) bytes[], size_t size) {
    SAVED(
        if (size != sizeof(Saved))
            REFUSE;
        memcpy(bytes, state, size);
        return FMI(OK);
    )
}

FMI(Status) FMI_DESERIALIZE(FMI_INSTANCE c, const FMI(Byte) bytes[], size_t size, FMI_STATE(, ) *state) {
    SAVED(
        if (size != sizeof(Saved))
            REFUSE;
        *state = saved_copy((const Saved *)(const void *)bytes);
        return STATUS(*state != NULL);
    )
}

/* -- derivatives --------------------------------------------------------------------------------------------------- */

static bool directional(Instance *instance, const unsigned *unknown, size_t unknowns, const unsigned *known, size_t knowns,
                        const double *seed, double *out) {
#if HAS_DIRECTIONAL
    for (size_t i = 0; i < unknowns; i++) {
        out[i] = 0.0;
        for (size_t j = 0; j < knowns; j++) {
            double partial;
            if (!model_sensitivity(&instance->now.model, unknown[i], known[j], &partial))
                return false;
            out[i] += partial * seed[j];
        }
    }
    return true;
#else
    return false;
#endif
}

static bool output_rates(Instance *instance, const unsigned *references, size_t n, const int32_t *orders, double *values) {
#if HAS_OUTPUT_DERIVATIVES
    for (size_t i = 0; i < n; i++)
        if (orders[i] != 1 || !model_rate(&instance->now.model, references[i], &values[i]))
            return false;
    return true;
#else
    return false;
#endif
}
