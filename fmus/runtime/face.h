/* What the faces of FMI 2.0 and 3.0 have in common but for the names of functions and types. The file of a version says them first:

   FMI(name)               fmi2name, fmi3name
   FMI_STATE(before, after)  fmi2beforeFMUstateafter, fmi3beforeFMUStateafter
   FMI_INSTANCE, FMI_REAL  the types of an instance and of a floating-point number
   FMI_DESERIALIZE, FMI_GET_DERIVATIVES  names of functions
   FMI_SAYS_CATEGORIES     whether a log category that does not exist is refused */

#define REQUIRE(component, modes)                                                \
    do {                                                                         \
        if (instance_require((component), __func__, (modes)) != STATUS_OK)       \
            return FMI(Error);                                                   \
    } while (0)

#define REFUSE(component, reason)                                                        \
    do {                                                                                 \
        if ((component) != NULL)                                                         \
            instance_fail((component), "%s: not supported: %s", __func__, (reason));     \
        return FMI(Error);                                                               \
    } while (0)

#define EXCHANGING (MODE_EVENT | MODE_CONTINUOUS)
#define RUNNING (MODE_STEP | EXCHANGING)

/* What a solver asks for is there once initialisation has begun. */
#define REQUIRE_EXCHANGE(component)                                                                   \
    do {                                                                                              \
        REQUIRE(component, MODE_INITIALIZATION | EXCHANGING | MODE_TERMINATED);                       \
        if (!((Instance *)(component))->exchange)                                                     \
            REFUSE(component, "the instance was made for co-simulation");                             \
    } while (0)

/* The instance if token and resources fit the model; otherwise it is freed, after its reason is logged. */
static Instance *admit(Instance *instance, Status status, const char *function, const char *token_name, const char *token, const char *resources) {
    if (status == STATUS_OK && !instance_token_fits(token))
        status = instance_fail(instance, "%s: %s %s was expected, %s was given; library and modelDescription.xml do not belong together",
                               function, token_name, model.token, token != NULL ? token : "none");
    if (status == STATUS_OK)
        status = resource_load(instance, resources);
    if (status == STATUS_OK)
        return instance;
    instance_free(instance);
    return NULL;
}

/* -- life -------------------------------------------------------------------------------------------------------- */

const char *FMI(GetVersion)(void) {
    return FMI(Version);
}

FMI(Status) FMI(SetDebugLogging)(FMI_INSTANCE c, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[]) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_set_logging(c, __func__, FMI_SAYS_CATEGORIES, loggingOn, nCategories, categories);
}

void FMI(FreeInstance)(FMI_INSTANCE c) {
    instance_free(c);
}

FMI(Status) FMI(Terminate)(FMI_INSTANCE c) {
    REQUIRE(c, RUNNING);
    ((Instance *)c)->mode = MODE_TERMINATED;
    return FMI(OK);
}

FMI(Status) FMI(Reset)(FMI_INSTANCE c) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_reset(c);
}

/* -- state ------------------------------------------------------------------------------------------------------- */

FMI(Status) FMI_STATE(Get, )(FMI_INSTANCE c, FMI_STATE(, ) *state) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_save(c, __func__, state);
}

FMI(Status) FMI_STATE(Set, )(FMI_INSTANCE c, FMI_STATE(, ) state) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_restore(c, __func__, state);
}

FMI(Status) FMI_STATE(Free, )(FMI_INSTANCE c, FMI_STATE(, ) *state) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_forget(state);
}

FMI(Status) FMI_STATE(Serialized, Size)(FMI_INSTANCE c, FMI_STATE(, ) state, size_t *size) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_serialized_size(c, __func__, state, size);
}

FMI(Status) FMI_STATE(Serialize, )(FMI_INSTANCE c, FMI_STATE(, ) state, FMI(Byte) content[], size_t size) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_serialize(c, __func__, state, content, size);
}

FMI(Status) FMI_DESERIALIZE(FMI_INSTANCE c, const FMI(Byte) content[], size_t size, FMI_STATE(, ) *state) {
    REQUIRE(c, MODE_ANY);
    return (FMI(Status))instance_deserialize(c, __func__, content, size, state);
}

/* -- model exchange ----------------------------------------------------------------------------------------------- */

FMI(Status) FMI(SetContinuousStates)(FMI_INSTANCE c, const FMI_REAL states[], size_t count) {
    REQUIRE(c, MODE_CONTINUOUS);
    return (FMI(Status))exchange_set_states(c, __func__, states, count);
}

#define EXCHANGED(function, get)                                           \
    FMI(Status) function(FMI_INSTANCE c, FMI_REAL values[], size_t count) { \
        REQUIRE_EXCHANGE(c);                                               \
        return (FMI(Status))get(c, __func__, values, count);               \
    }

EXCHANGED(FMI_GET_DERIVATIVES, exchange_get_derivatives)
EXCHANGED(FMI(GetEventIndicators), exchange_get_indicators)
EXCHANGED(FMI(GetContinuousStates), exchange_get_states)
EXCHANGED(FMI(GetNominalsOfContinuousStates), exchange_get_nominals)
