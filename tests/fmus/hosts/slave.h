/* A co-simulation slave behind a table of functions, so that a host program steps FMI 2 and FMI 3 alike.

   The host programs of these tests use nothing of an FMU but its library and the functions of FMI: no Python, no XML. Which value
   reference is what is told to them in text files. A call that fails ends the program, except do_step and try_restore, whose status is returned. */
#ifndef SLAVE_H
#define SLAVE_H

#include <stdbool.h>
#include <stddef.h>

enum { SLAVE_OK, SLAVE_WARNING, SLAVE_DISCARD, SLAVE_ERROR };

typedef struct Slave Slave;

struct Slave {
    const char *name;
    void (*enter_initialization)(Slave *slave, double start_time);
    void (*exit_initialization)(Slave *slave);
    double (*get_real)(Slave *slave, unsigned reference);
    void (*set_real)(Slave *slave, unsigned reference, double value);
    int (*get_integer)(Slave *slave, unsigned reference);
    void (*set_integer)(Slave *slave, unsigned reference, int value);
    int (*do_step)(Slave *slave, double t, double h);
    void (*notify)(Slave *slave, unsigned clock, size_t count, const unsigned *references, const double *values); /* FMI 3 */
    void *(*save)(Slave *slave);
    void (*restore)(Slave *slave, void *state);
    void (*forget)(Slave *slave, void *state);
    size_t (*serialize)(Slave *slave, void *state, char **bytes); /* bytes: to be freed */
    void *(*deserialize)(Slave *slave, const char *bytes, size_t size);
    void (*reset)(Slave *slave);
    void (*terminate)(Slave *slave);
    int (*try_restore)(Slave *slave, const char *bytes, size_t size); /* deserialise, set, forget; the worst status */
    void (*close)(Slave *slave); /* frees instance and slave; the library stays loaded */
};

/* NULL where the FMU refuses to be instantiated; it has said why on stderr. */
Slave *open_fmi2(const char *name, const char *library, const char *token, const char *resources);
Slave *open_fmi3(const char *name, const char *library, const char *token, const char *resources, bool event_mode);

/* By version, 2 or 3; events by event mode where `event_mode` says so. */
Slave *open_slave(int version, bool event_mode, const char *name, const char *library, const char *token, const char *resources);

/* -- helpers (slave.c) --------------------------------------------------------------------------------------------- */

void *load_library(const char *path);
void find_function(void *library, const char *name, void *place);
void require(const Slave *slave, const char *call, int status);
void die(const char *format, ...);

#endif
