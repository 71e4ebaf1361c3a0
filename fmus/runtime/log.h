/* The log of an instance: four categories, as in modelDescription.xml. Each function logs a message and returns its status. */
#ifndef LOG_H
#define LOG_H

#include <stdbool.h>
#include <stddef.h>

#include "private.h"

/* Statuses have the numbers of fmi2Status and fmi3Status. */
typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status;

typedef struct Instance Instance;

#if defined(__GNUC__)
#define PRINTF_LIKE __attribute__((format(printf, 2, 3)))
#else
#define PRINTF_LIKE
#endif

PRIVATE Status instance_fail(const Instance *instance, const char *format, ...) PRINTF_LIKE;    /* logStatusError */
PRIVATE Status instance_discard(const Instance *instance, const char *format, ...) PRINTF_LIKE; /* logStatusDiscard */
PRIVATE Status instance_warn(const Instance *instance, const char *format, ...) PRINTF_LIKE;    /* logStatusWarning */
PRIVATE void instance_note(const Instance *instance, const char *format, ...) PRINTF_LIKE;      /* logEvents */

/* What is wrong is always logged; notes only where the category logEvents is switched on (no category: all). STATUS_ERROR
   for an unknown category, where the version of FMI is strict about it. */
PRIVATE Status instance_set_logging(Instance *instance, const char *function, bool strict, bool on, size_t count, const char *const categories[]);

/* The worse of two statuses. */
PRIVATE Status status_worse(Status one, Status other);

#endif
