/* The log of an instance. Messages are made on the stack; nothing is allocated. */
#include "log.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "instance.h"

#define MESSAGE_LENGTH 512

static const char *const category_names[] = {"logStatusError", "logStatusDiscard", "logStatusWarning", "logEvents"};
enum { CATEGORY_ERROR, CATEGORY_DISCARD, CATEGORY_WARNING, CATEGORY_EVENTS, CATEGORY_COUNT };

static void log_message(const Instance *instance, Status status, int category, const char *format, va_list arguments) {
    char message[MESSAGE_LENGTH];
    vsnprintf(message, sizeof message, format, arguments);
    instance->face->log(instance, status, category_names[category], message);
}

#define LOGGED(function, status, category)                                                  \
    PRIVATE Status function(const Instance *instance, const char *format, ...) {            \
        va_list arguments;                                                                  \
        va_start(arguments, format);                                                        \
        log_message(instance, status, category, format, arguments);                         \
        va_end(arguments);                                                                  \
        return status;                                                                      \
    }

LOGGED(instance_fail, STATUS_ERROR, CATEGORY_ERROR)
LOGGED(instance_discard, STATUS_DISCARD, CATEGORY_DISCARD)
LOGGED(instance_warn, STATUS_WARNING, CATEGORY_WARNING)

PRIVATE void instance_note(const Instance *instance, const char *format, ...) {
    if (!instance->debug_logging)
        return;
    va_list arguments;
    va_start(arguments, format);
    log_message(instance, STATUS_OK, CATEGORY_EVENTS, format, arguments);
    va_end(arguments);
}

static bool is_category(const char *name) {
    for (int i = 0; i < CATEGORY_COUNT; i++)
        if (strcmp(name, category_names[i]) == 0)
            return true;
    return false;
}

PRIVATE Status instance_set_logging(Instance *instance, const char *function, bool strict, bool on, size_t count, const char *const categories[]) {
    bool wanted = count == 0;
    for (size_t i = 0; i < count; i++) {
        const char *name = categories != NULL && categories[i] != NULL ? categories[i] : "(none)";
        if (strict && !is_category(name))
            return instance_fail(instance, "%s: there is no log category %s", function, name);
        wanted = wanted || strcmp(name, category_names[CATEGORY_EVENTS]) == 0;
    }
    instance->debug_logging = on && wanted;
    return STATUS_OK;
}

PRIVATE Status status_worse(Status one, Status other) {
    return one > other ? one : other;
}
