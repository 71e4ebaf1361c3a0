/* Snapshots: everything that decides the future of an instance, as a state of FMI and as bytes. */
#ifndef SNAPSHOT_H
#define SNAPSHOT_H

#include "instance.h"

/* Save into `*state`: allocated when it is NULL, else overwritten. */
PRIVATE Status instance_save(const Instance *instance, const char *function, void **state);
PRIVATE Status instance_restore(Instance *instance, const char *function, const void *state);
PRIVATE Status instance_forget(void **state);

PRIVATE Status instance_serialized_size(const Instance *instance, const char *function, const void *state, size_t *size);
PRIVATE Status instance_serialize(const Instance *instance, const char *function, const void *state, void *bytes, size_t size);
PRIVATE Status instance_deserialize(const Instance *instance, const char *function, const void *bytes, size_t size, void **state);

#endif
