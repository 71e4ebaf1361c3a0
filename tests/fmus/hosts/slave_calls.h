/* What a slave of FMI 2.0 and one of FMI 3.0 do with the same words, those of ``words_fmi2.h`` or ``words_fmi3.h``; included
   where OWN is its own type and FUNCTIONS the file that lists the functions that are called. */
#ifndef SLAVE_CALLS_H
#define SLAVE_CALLS_H

#define S ((OWN *)slave)
#define REQUIRE(function, arguments) REQUIRE_BY_NAME(function, arguments)
#define REQUIRE_BY_NAME(function, arguments) require(slave, FMI #function, (int)S->function arguments)
#define JOINED(verb, type) JOINED_NAMES(verb, type)
#define JOINED_NAMES(verb, type) verb##type

#define ACCESS(name, type, NAME)                                                   \
    static type get_##name(Slave *slave, unsigned reference) {                     \
        type value;                                                                \
        REQUIRE(JOINED(Get, NAME), (S->c, &reference, 1, ONE(&value)));            \
        return value;                                                              \
    }                                                                              \
    static void set_##name(Slave *slave, unsigned reference, type value) {         \
        REQUIRE(JOINED(Set, NAME), (S->c, &reference, 1, ONE(&value)));            \
    }

ACCESS(real, double, REAL)
ACCESS(integer, int, INTEGER)

static void *save(Slave *slave) {
    FMI_STATE(, ) state = NULL;
    REQUIRE(STATE(Get, ), (S->c, &state));
    return state;
}

static void restore(Slave *slave, void *state) {
    REQUIRE(STATE(Set, ), (S->c, state));
}

static void forget(Slave *slave, void *state) {
    REQUIRE(STATE(Free, ), (S->c, &state));
}

static size_t serialize(Slave *slave, void *state, char **bytes) {
    size_t size;
    REQUIRE(STATE(Serialized, Size), (S->c, state, &size));
    *bytes = malloc(size);
    REQUIRE(STATE(Serialize, ), (S->c, state, (FMI_BYTE *)*bytes, size));
    return size;
}

static void *deserialize(Slave *slave, const char *bytes, size_t size) {
    FMI_STATE(, ) state = NULL;
    REQUIRE(DESERIALIZE, (S->c, (const FMI_BYTE *)bytes, size, &state));
    return state;
}

static int try_restore(Slave *slave, const char *bytes, size_t size) {
    FMI_STATE(, ) state = NULL;
    int status = (int)S->DESERIALIZE(S->c, (const FMI_BYTE *)bytes, size, &state);
    if (status > SLAVE_WARNING)
        return status;
    status = (int)S->STATE(Set, )(S->c, state);
    forget(slave, state);
    return status;
}

static void reset(Slave *slave) {
    REQUIRE(Reset, (S->c));
}

static void terminate(Slave *slave) {
    REQUIRE(Terminate, (S->c));
}

static void close_slave(Slave *slave) {
    S->FreeInstance(S->c);
    free(slave);
}

/* The calls of the slave, and its functions from the library. */
static void load(OWN *s, const char *name, const char *library) {
    s->slave = (Slave){name, enter_initialization, exit_initialization, get_real, set_real, get_integer, set_integer, do_step,
                       notify, save, restore, forget, serialize, deserialize, reset, terminate, try_restore, close_slave};
    void *handle = load_library(library);
#define FUNCTION(function) find_function(handle, FMI #function, &s->function);
#include FUNCTIONS
#undef FUNCTION
}

#endif
