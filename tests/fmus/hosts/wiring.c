/* Reading a wiring; see wiring.h. A wrong file ends the program. */
#include "wiring.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "slave.h"

static char *field(char **line) {
    char *start = *line, *end = start != NULL ? strchr(start, '\t') : NULL;
    if (start == NULL)
        die("wiring: a field is missing");
    if (end != NULL)
        *end++ = '\0';
    *line = end;
    return start;
}

static int number(char **line) {
    return atoi(field(line));
}

static StartEntry entry(char **line, bool integer, bool with_value) {
    StartEntry e = {.integer = integer, .slave = number(line)};
    e.reference = (unsigned)number(line);
    if (with_value)
        e.value = strtod(field(line), NULL);
    return e;
}

static void read_line(Wiring *w, char *line) {
    const char *word = field(&line);
    if (strcmp(word, "slave") == 0) {
        SlaveEntry *s = &w->slave[w->slaves++];
        s->version = number(&line), s->event_mode = number(&line);
        s->name = field(&line), s->library = field(&line), s->token = field(&line), s->resources = field(&line);
    } else if (strcmp(word, "real") == 0 || strcmp(word, "integer") == 0) {
        w->start[w->starts++] = entry(&line, word[0] == 'i', true);
    } else if (strcmp(word, "record") == 0) {
        bool integer = field(&line)[0] == 'i';
        w->record[w->records++] = entry(&line, integer, false);
    } else if (strcmp(word, "connect") == 0) {
        Connection *c = &w->connection[w->connections++];
        c->integer = field(&line)[0] == 'i';
        c->source = number(&line), c->from = (unsigned)number(&line);
        c->target = number(&line), c->to = (unsigned)number(&line);
    } else if (strcmp(word, "event") == 0) {
        Event *e = &w->event[w->events++];
        e->source = number(&line), e->count = (unsigned)number(&line);
        e->target = number(&line), e->clock = (unsigned)number(&line);
    } else if (strcmp(word, "payload") == 0) {
        Event *e = &w->event[w->events - 1];
        if (number(&line) != e->source || e->payloads == MOST_PAYLOADS)
            die("wiring: a payload that does not fit its event");
        e->from[e->payloads] = (unsigned)number(&line), e->to[e->payloads++] = (unsigned)number(&line);
    } else if (strcmp(word, "run") == 0) {
        w->start_time = strtod(field(&line), NULL), w->step = strtod(field(&line), NULL), w->steps = number(&line);
    } else {
        die("wiring: unknown word '%s'", word);
    }
}

void read_wiring(Wiring *wiring, const char *path) {
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        die("%s cannot be read", path);
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    memset(wiring, 0, sizeof *wiring);
    wiring->text = calloc(1, size + 1);
    if (fread(wiring->text, 1, size, file) != size)
        die("%s cannot be read", path);
    fclose(file);
    char *rest;
    for (char *line = strtok_r(wiring->text, "\n", &rest); line != NULL; line = strtok_r(NULL, "\n", &rest)) {
        if (wiring->slaves == MOST || wiring->starts == MOST || wiring->connections == MOST || wiring->records == MOST || wiring->events == MOST)
            die("%s: too long", path);
        read_line(wiring, line);
    }
}
