/* What a slave of FMI 2.0 and one of FMI 3.0 do with the same words; included where OWN is its own type, FMI the prefix of
   its functions and FUNCTIONS the file that lists them, REAL and INTEGER are FMI's words for both types of number and
   ONE(value) is how one value is handed over, STATE(before, after) names a function for a state, FMI_STATE(, ) the type of
   one and FMI_BYTE that of its bytes. */
#ifndef SLAVE_CALLS_H
#define SLAVE_CALLS_H

#define S ((OWN *)slave)
#define REQUIRE(function, arguments) REQUIRE_BY_NAME(function, arguments)
#define REQUIRE_BY_NAME(function, arguments) require(slave, FMI #function, (int)S->function arguments)
#define JOINED(verb, type) JOINED_NAMES(verb, type)
#define JOINED_NAMES(verb, type) verb##type

static double get_real(Slave *slave, unsigned reference) {
    double value;
    REQUIRE(JOINED(Get, REAL), (S->c, &reference, 1, ONE(&value)));
    return value;
}

static void set_real(Slave *slave, unsigned reference, double value) {
    REQUIRE(JOINED(Set, REAL), (S->c, &reference, 1, ONE(&value)));
}

static int get_integer(Slave *slave, unsigned reference) {
    int value;
    REQUIRE(JOINED(Get, INTEGER), (S->c, &reference, 1, ONE(&value)));
    return value;
}

static void set_integer(Slave *slave, unsigned reference, int value) {
    REQUIRE(JOINED(Set, INTEGER), (S->c, &reference, 1, ONE(&value)));
}

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
