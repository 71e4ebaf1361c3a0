/* The location of the resources: from a file URI to a path. */
#include "front.h"

static int hex_digit(char c) {
    if (c >= '0' && c <= '9')
        return c - '0';
    c |= 32;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The path in a file URI: without scheme and host, %20 and the like decoded. */
static void path_of(const char *uri, char *path, size_t size) {
    if (strncmp(uri, "file:", 5) == 0) {
        uri += 5;
        if (strncmp(uri, "//", 2) == 0) {
            const char *root = strchr(uri + 2, '/');
            uri = root != NULL ? root : uri + 2;
        }
#ifdef _WIN32
        uri += *uri == '/'; /* file:///C:/folder */
#endif
    }
    size_t used = 0;
    for (; *uri != '\0' && used + 1 < size; uri++) {
        if (uri[0] == '%' && hex_digit(uri[1]) >= 0 && hex_digit(uri[2]) >= 0) {
            path[used++] = (char)(16 * hex_digit(uri[1]) + hex_digit(uri[2]));
            uri += 2;
        } else {
            path[used++] = *uri;
        }
    }
    path[used] = '\0';
}
