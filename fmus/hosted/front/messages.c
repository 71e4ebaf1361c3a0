/* Messages: to the importer's logger, from the front itself and from Python. */
#include "front.h"

static void send_message(const Front *front, fmi2Status status, const char *category, const char *text) {
    if (front->importer == NULL || front->importer->logger == NULL)
        return;
    /* Many importers show the format as it is and never read the arguments after it. */
    if (strchr(text, '%') == NULL)
        front->importer->logger(front->environment, front->name, status, category, text);
    else
        front->importer->logger(front->environment, front->name, status, category, "%s", text);
}

static fmi2Status fail(Front *front, const char *format, ...) {
    char text[TEXT_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    front->failed = true;
    send_message(front, fmi2Error, "logStatusError", text);
    return fmi2Error;
}

static void hear(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)name, (void)category;
    Front *front = environment;
    if (status >= fmi2Error)
        fail(front, "%s", message); /* pythonfmu hands over finished text, without arguments */
    else if (status != fmi2OK)
        send_message(front, status, status == fmi2Discard ? "logStatusDiscard" : "logStatusWarning", message);
    else if (front->on)
        send_message(front, status, "logEvents", message);
}
