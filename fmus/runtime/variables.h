/* The variables of an instance by value reference: where each value lies, and in which modes it may be set. */
#ifndef VARIABLES_H
#define VARIABLES_H

#include "instance.h"

#define ROLES(role) (1u << (role)) /* a set of roles is a number */

/* STATUS_ERROR with a message when there is something to read or write and an array is missing. */
PRIVATE Status instance_check_arrays(const Instance *instance, const char *function, const void *references, size_t count, const void *values);

/* For the types that no variable has: STATUS_OK for none, else STATUS_ERROR with a message. */
PRIVATE Status instance_no_variables(const Instance *instance, const char *function, size_t count);

/* Read or write the real variables `references`. Nothing is written unless everything may be. */
PRIVATE Status instance_get_reals(Instance *instance, const char *function, const unsigned *references, size_t count, double *values);
PRIVATE Status instance_set_reals(Instance *instance, const char *function, const unsigned *references, size_t count, const double *values);

/* Read one variable that is a whole number and has one of these roles. */
PRIVATE Status instance_get_integer(Instance *instance, const char *function, unsigned reference, unsigned roles, int64_t *value);

/* Whether a whole number may be set now to this value; and set it, which then cannot fail. */
PRIVATE Status instance_check_integer(const Instance *instance, const char *function, unsigned reference, unsigned roles, int64_t value);
PRIVATE void instance_put_integer(Instance *instance, unsigned reference, int64_t value);

/* The variable behind a reference that has been checked. */
PRIVATE const Variable *variables_at(unsigned reference);

/* The variable behind a reference, or NULL with a message; and the name of the one with one of these roles and this index. */
PRIVATE const Variable *variables_find(const Instance *instance, const char *function, unsigned reference);
PRIVATE const char *variables_name(unsigned roles, int index);

/* The variable behind a reference if it has one of these roles, else NULL with a message. */
PRIVATE const Variable *variables_find_among(const Instance *instance, const char *function, unsigned reference, unsigned roles);

/* Compute what is outdated of these (bits of `Outdated`). */
PRIVATE void instance_refresh(Instance *instance, int wanted);

#endif
