/* A wiring: which FMUs run, in which order, and what is connected to what; read from a text file.

   Fields are separated by tabs; slaves are named by their number, from 0, variables by their value reference:
     slave <version 2|3> <event mode 0|1> <name> <library> <token> <resources>
     real <slave> <reference> <start value>
     integer <slave> <reference> <start value>
     connect <real|integer> <slave> <reference> <slave> <reference>
     event <slave> <reference of the count> <slave> <reference of the clock>     a clock ticks when the count has changed
     payload <slave> <reference> <reference at the slave of the clock>            of the last event
     record <real|integer> <slave> <reference>
     run <start> <step> <number of steps> */
#ifndef WIRING_H
#define WIRING_H

#include <stdbool.h>
#include <stddef.h>

#define MOST 64
#define MOST_PAYLOADS 4

typedef struct {
    int version;
    bool event_mode;
    char *name, *library, *token, *resources;
} SlaveEntry;

typedef struct {
    bool integer;
    int slave;
    unsigned reference;
    double value;
} StartEntry;

typedef struct {
    bool integer;
    int source, target;
    unsigned from, to;
} Connection;

typedef struct {
    int source, target;
    unsigned count, clock;
    size_t payloads;
    unsigned from[MOST_PAYLOADS], to[MOST_PAYLOADS];
} Event;

typedef struct {
    char *text;
    int slaves, starts, connections, events, records, steps;
    SlaveEntry slave[MOST];
    StartEntry start[MOST], record[MOST];
    Connection connection[MOST];
    Event event[MOST];
    double start_time, step;
} Wiring;

void read_wiring(Wiring *wiring, const char *path);

#endif
