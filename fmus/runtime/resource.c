/* Resources: see resource.h. The only file that opens files, and only while an instance is made. */
#include "resource.h"

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <wchar.h>
#endif

#define LINE_LENGTH 1024
#define NUMBER_LENGTH 64
#define UNUSED_ENTRY 1e30 /* where the file has no row for an entry */

PRIVATE size_t resource_length(void) {
    size_t length = 0;
    for (int i = 0; i < model.resource_count; i++)
        length += (size_t)model.resources[i].count;
    return length;
}

PRIVATE void resource_apply(Instance *instance) {
    const double *values = instance->resource_values;
    for (int i = 0; i < model.resource_count; i++) {
        memcpy(&instance->runtime.p[model.resources[i].parameter], values, (size_t)model.resources[i].count * sizeof(double));
        values += model.resources[i].count;
    }
}

/* -- where the file lies ----------------------------------------------------------------------------------------- */

static bool begins_with_scheme(const char *location) {
    const char *colon = strstr(location, "://");
    return colon != NULL && strcspn(location, "/\\") == (size_t)(colon + 1 - location);
}

static bool is_file_uri(const char *location) {
    const char *scheme = "file:";
    for (size_t i = 0; scheme[i] != '\0'; i++)
        if ((location[i] | 0x20) != scheme[i] && location[i] != scheme[i])
            return false;
    return true;
}

static int hexadecimal(char c) {
    const char *digits = "0123456789abcdef";
    const char *digit = c != '\0' ? strchr(digits, c >= 'A' && c <= 'F' ? c - 'A' + 'a' : c) : NULL;
    return digit != NULL ? (int)(digit - digits) : -1;
}

static void decode_escapes(char *text) {
    char *out = text;
    for (const char *in = text; *in != '\0'; in++) {
        int high = *in == '%' ? hexadecimal(in[1]) : -1;
        int low = high >= 0 ? hexadecimal(in[2]) : -1;
        if (low >= 0 && high + low > 0) {
            *out++ = (char)(16 * high + low);
            in += 2;
        } else {
            *out++ = *in;
        }
    }
    *out = '\0';
}

static bool is_drive(const char *text) {
    return ((text[0] | 0x20) >= 'a' && (text[0] | 0x20) <= 'z') && text[1] == ':';
}

/* The path within a file URI: `file:/path`, `file:///path`, `file://localhost/path`, `file://host/share`, `file:///C:/path`. */
static const char *path_of_uri(const char *uri) {
    const char *path = uri + strlen("file:");
    if (strncmp(path, "//", 2) == 0) {
        if (path[2] == '/' || is_drive(path + 2))
            path += 2;
        else if (strncmp(path, "//localhost/", 12) == 0)
            path += 11;
    }
#ifdef _WIN32
    if (path[0] == '/' && is_drive(path + 1))
        path++;
#endif
    return path;
}

/* Path of a file in the folder of resources, to be freed; NULL where there is no such folder or no memory. */
static char *path_of(const char *location, const char *file) {
    if (location == NULL || *location == '\0' || (begins_with_scheme(location) && !is_file_uri(location)))
        return NULL;
    char *path = malloc(strlen(location) + strlen(file) + 2);
    if (path == NULL)
        return NULL;
    strcpy(path, is_file_uri(location) ? path_of_uri(location) : location);
    if (is_file_uri(location))
        decode_escapes(path);
    size_t length = strlen(path);
    if (length == 0 || (path[length - 1] != '/' && path[length - 1] != '\\'))
        path[length++] = '/';
    strcpy(path + length, file);
    return path;
}

#ifdef _WIN32
/* The path is UTF-8; Windows wants UTF-16. */
static FILE *open_file(const char *path) {
    wchar_t wide[LINE_LENGTH];
    size_t n = 0;
    for (const unsigned char *c = (const unsigned char *)path; *c != '\0' && n + 2 < LINE_LENGTH;) {
        int more = *c < 0xC0 ? 0 : *c < 0xE0 ? 1 : *c < 0xF0 ? 2 : 3;
        unsigned long point = more == 0 ? *c : *c & (0x3Fu >> more);
        for (c++; more > 0 && (*c & 0xC0) == 0x80; more--)
            point = (point << 6) | (*c++ & 0x3F);
        if (point >= 0x10000) {
            wide[n++] = (wchar_t)(0xD800 + ((point - 0x10000) >> 10));
            point = 0xDC00 + ((point - 0x10000) & 0x3FF);
        }
        wide[n++] = (wchar_t)point;
    }
    wide[n] = L'\0';
    return _wfopen(wide, L"rb");
}
#else
static FILE *open_file(const char *path) {
    return fopen(path, "rb");
}
#endif

/* -- a CSV file, line by line ------------------------------------------------------------------------------------ */

typedef struct {
    const Instance *instance;
    const char *path;
    FILE *stream;
    int line_number;
    char line[LINE_LENGTH];
} Table;

/* The next line that is not blank: 1, or 0 at the end, or -1 with a message. */
static int read_line(Table *table) {
    while (fgets(table->line, sizeof table->line, table->stream) != NULL) {
        table->line_number++;
        size_t length = strlen(table->line);
        if (length + 1 == sizeof table->line && table->line[length - 1] != '\n') {
            instance_fail(table->instance, "%s, line %d: longer than %d characters", table->path, table->line_number, LINE_LENGTH - 2);
            return -1;
        }
        while (length > 0 && strchr("\r\n", table->line[length - 1]) != NULL)
            table->line[--length] = '\0';
        if (table->line_number == 1 && strncmp(table->line, "\xEF\xBB\xBF", 3) == 0) /* byte order mark of spreadsheets */
            memmove(table->line, table->line + 3, length - 2);
        if (table->line[strspn(table->line, " \t")] != '\0')
            return 1;
    }
    if (!ferror(table->stream))
        return 0;
    instance_fail(table->instance, "%s: cannot be read after line %d", table->path, table->line_number);
    return -1;
}

/* Cut the next field out of a line: blanks around it and quotes are taken off. NULL after the last one. */
static char *next_field(char **cursor) {
    if (*cursor == NULL)
        return NULL;
    char *in = *cursor + strspn(*cursor, " \t"), *field = in, *out = in;
    bool quoted = *in == '"';
    in += quoted;
    for (; *in != '\0' && (quoted || *in != ','); in++) {
        if (quoted && *in == '"' && in[1] != '"')
            quoted = false; /* the closing quote */
        else {
            in += quoted && *in == '"'; /* a doubled quote is one */
            *out++ = *in;
        }
    }
    *cursor = *in == ',' ? in + 1 : NULL;
    while (out > field && strchr(" \t", out[-1]) != NULL)
        out--;
    *out = '\0';
    return field;
}

/* The field in a column (counted from 0), or NULL where the line has fewer. */
static char *field_at(char *line, int column) {
    char *field = next_field(&line);
    for (int i = 0; i < column && field != NULL; i++)
        field = next_field(&line);
    return field;
}

static int find_column(char *line, const char *name) {
    int column = 0;
    for (char *field = next_field(&line); field != NULL; field = next_field(&line), column++)
        if (strcmp(field, name) == 0)
            return column;
    return -1;
}

/* A finite number with a decimal point, whatever the locale of the importer. */
static bool parse_number(const char *text, double *value) {
    char copy[NUMBER_LENGTH];
    size_t length = strlen(text);
    if (length == 0 || length >= sizeof copy || strspn(text, "0123456789+-.eE") != length)
        return false;
    memcpy(copy, text, length + 1);
    char *point = strchr(copy, '.');
    if (point != NULL)
        *point = *localeconv()->decimal_point;
    char *end;
    *value = strtod(copy, &end);
    return *end == '\0' && isfinite(*value);
}

static Status read_row(Table *table, const Resource *resource, int column, int row, double *values) {
    const char *field = field_at(table->line, column);
    if (row >= resource->count)
        return instance_fail(table->instance, "%s, line %d: more rows than the %d this FMU has room for", table->path,
                             table->line_number, resource->count);
    if (field == NULL || !parse_number(field, &values[row]))
        return instance_fail(table->instance, "%s, line %d: '%s' in column '%s' is not a finite number", table->path,
                             table->line_number, field != NULL ? field : "", resource->column);
    if (row > 0 && !(values[row] > values[row - 1]))
        return instance_fail(table->instance, "%s, line %d: %s %.17g follows %.17g; list them in increasing order, each once",
                             table->path, table->line_number, resource->column, values[row], values[row - 1]);
    return STATUS_OK;
}

static Status read_table(Table *table, const Resource *resource, double *values) {
    int found = read_line(table);
    if (found < 0)
        return STATUS_ERROR;
    int column = found > 0 ? find_column(table->line, resource->column) : -1;
    if (column < 0)
        return instance_fail(table->instance, "%s, line %d: the header has no column '%s'", table->path,
                             table->line_number > 0 ? table->line_number : 1, resource->column);
    for (int i = 0; i < resource->count; i++)
        values[i] = UNUSED_ENTRY;
    int row = 0;
    while ((found = read_line(table)) > 0)
        if (read_row(table, resource, column, row++, values) != STATUS_OK)
            return STATUS_ERROR;
    return found < 0 ? STATUS_ERROR : STATUS_OK;
}

static Status load_one(Instance *instance, const Resource *resource, const char *location, double *values) {
    memcpy(values, &model.start_p[resource->parameter], (size_t)resource->count * sizeof(double));
    char *path = path_of(location, resource->file);
    if (path == NULL)
        return STATUS_OK;
    Status status = STATUS_OK;
    Table table = {.instance = instance, .path = path, .stream = open_file(path)};
    if (table.stream != NULL) {
        status = read_table(&table, resource, values);
        fclose(table.stream);
    } else if (errno == ENOENT || errno == ENOTDIR)
        instance_note(instance, "%s is not there; the start values stand", path);
    else
        status = instance_fail(instance, "%s: cannot be opened: %s", path, strerror(errno));
    free(path);
    return status;
}

PRIVATE Status resource_load(Instance *instance, const char *location) {
    double *values = instance->resource_values;
    for (int i = 0; i < model.resource_count; i++) {
        if (load_one(instance, &model.resources[i], location, values) != STATUS_OK)
            return STATUS_ERROR;
        values += model.resources[i].count;
    }
    resource_apply(instance);
    return STATUS_OK;
}
