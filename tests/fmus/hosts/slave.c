/* What slaves of both FMI versions share: libraries, functions by name, and the end of the program. */
#include "slave.h"

#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void die(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vfprintf(stderr, format, arguments);
    va_end(arguments);
    fputc('\n', stderr);
    exit(1);
}

void *load_library(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL)
        die("%s", dlerror());
    return library;
}

void find_function(void *library, const char *name, void *place) {
    void *symbol = dlsym(library, name);
    if (symbol == NULL)
        die("%s", dlerror());
    memcpy(place, &symbol, sizeof symbol); /* ISO C has no cast from a pointer to an object to one to a function */
}

void require(const Slave *slave, const char *call, int status) {
    if (status > SLAVE_WARNING)
        die("%s: %s returned status %d", slave->name, call, status);
}

Slave *open_slave(int version, bool event_mode, const char *name, const char *library, const char *token, const char *resources) {
    return version == 2 ? open_fmi2(name, library, token, resources) : open_fmi3(name, library, token, resources, event_mode);
}
