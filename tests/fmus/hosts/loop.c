/* A sequential (Gauss-Seidel) master in plain C: loop WIRING CSV [WIRING CSV ...].

   Each pair is one simulation; more than one run at the same time, a thread each. Rows are the values at the communication
   points, the first after initialisation. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "slave.h"
#include "wiring.h"

typedef struct {
    Wiring wiring;
    const char *output;
    Slave *slave[MOST];
    int notified[MOST]; /* by event: the count that was told last */
} Simulation;

static void transfer(Simulation *s, int target) {
    for (int i = 0; i < s->wiring.connections; i++) {
        const Connection *c = &s->wiring.connection[i];
        if (c->target != target)
            continue;
        Slave *source = s->slave[c->source], *sink = s->slave[c->target];
        if (c->integer)
            sink->set_integer(sink, c->to, source->get_integer(source, c->from));
        else
            sink->set_real(sink, c->to, source->get_real(source, c->from));
    }
}

static void notify_events(Simulation *s, int target) {
    for (int i = 0; i < s->wiring.events; i++) {
        const Event *e = &s->wiring.event[i];
        if (e->target != target)
            continue;
        Slave *source = s->slave[e->source], *sink = s->slave[target];
        int count = source->get_integer(source, e->count);
        if (count == s->notified[i])
            continue;
        double values[MOST_PAYLOADS];
        for (size_t k = 0; k < e->payloads; k++)
            values[k] = source->get_real(source, e->from[k]);
        sink->notify(sink, e->clock, e->payloads, e->to, values);
        s->notified[i] = count;
    }
}

static void set_starts(Simulation *s) {
    for (int i = 0; i < s->wiring.starts; i++) {
        const StartEntry *e = &s->wiring.start[i];
        if (e->integer)
            s->slave[e->slave]->set_integer(s->slave[e->slave], e->reference, (int)e->value);
        else
            s->slave[e->slave]->set_real(s->slave[e->slave], e->reference, e->value);
    }
}

static void initialize(Simulation *s) {
    Wiring *w = &s->wiring;
    for (int i = 0; i < w->slaves; i++) {
        const SlaveEntry *e = &w->slave[i];
        s->slave[i] = open_slave(e->version, e->event_mode, e->name, e->library, e->token, e->resources);
        if (s->slave[i] == NULL)
            die("%s could not be instantiated", e->name);
    }
    set_starts(s);
    for (int i = 0; i < w->slaves; i++)
        s->slave[i]->enter_initialization(s->slave[i], w->start_time);
    for (int pass = 0; pass < w->slaves; pass++) /* the longest chain there can be */
        for (int i = 0; i < w->slaves; i++)
            transfer(s, i);
    for (int i = 0; i < w->slaves; i++)
        s->slave[i]->exit_initialization(s->slave[i]);
}

static void write_row(Simulation *s, FILE *csv, double t) {
    fprintf(csv, "%.17g", t);
    for (int i = 0; i < s->wiring.records; i++) {
        const StartEntry *e = &s->wiring.record[i];
        Slave *slave = s->slave[e->slave];
        fprintf(csv, ",%.17g", e->integer ? slave->get_integer(slave, e->reference) : slave->get_real(slave, e->reference));
    }
    fputc('\n', csv);
}

static void *run(void *argument) {
    Simulation *s = argument;
    const Wiring *w = &s->wiring;
    FILE *csv = fopen(s->output, "wb");
    if (csv == NULL)
        die("%s cannot be written", s->output);
    initialize(s);
    write_row(s, csv, w->start_time);
    for (int k = 0; k < w->steps; k++) {
        double t = w->start_time + k * w->step; /* time is an index; adding up would drift */
        for (int i = 0; i < w->slaves; i++) {
            transfer(s, i);
            notify_events(s, i);
            require(s->slave[i], "DoStep", s->slave[i]->do_step(s->slave[i], t, w->step));
        }
        write_row(s, csv, w->start_time + (k + 1) * w->step);
    }
    for (int i = 0; i < w->slaves; i++) {
        s->slave[i]->terminate(s->slave[i]);
        s->slave[i]->close(s->slave[i]);
    }
    fclose(csv);
    return NULL;
}

int main(int argc, char **argv) {
    int count = (argc - 1) / 2;
    if (count < 1 || argc != 1 + 2 * count)
        die("usage: loop WIRING CSV [WIRING CSV ...]");
    Simulation *simulations = calloc((size_t)count, sizeof *simulations);
    pthread_t *threads = calloc((size_t)count, sizeof *threads);
    for (int i = 0; i < count; i++) {
        read_wiring(&simulations[i].wiring, argv[1 + 2 * i]);
        simulations[i].output = argv[2 + 2 * i];
        if (pthread_create(&threads[i], NULL, run, &simulations[i]) != 0)
            die("no thread");
    }
    for (int i = 0; i < count; i++) {
        pthread_join(threads[i], NULL);
        free(simulations[i].wiring.text);
    }
    free(threads);
    free(simulations);
    return 0;
}
