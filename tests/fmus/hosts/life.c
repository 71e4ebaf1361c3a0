/* The life of one FMU, for sanitizers and for counting what it leaves behind.

   life cover WIRING            everything once: refusal, run, events, late events, states, a bad step, reset, free
   life damage WIRING           words of a serialised state damaged one by one: refused, or set and stepped from; prints how many of each
   life many WIRING COUNT       COUNT short lives; prints resident memory [kB] and open files after a tenth of them and at the end
   life save WIRING FILE        run, write the state to FILE, run on, print what follows
   life continue WIRING FILE    another process: read the state, run on, print what follows

   A wiring with one slave: its `real` entries are inputs, moved around their values; its `event` is told with its two payloads,
   stamp and place, if there is one. */
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "damage.h"
#include "slave.h"
#include "wiring.h"

#define STEP 0.01

static Slave *open_first(const Wiring *w, const char *token) {
    const SlaveEntry *e = &w->slave[0];
    return open_slave(e->version, e->event_mode, e->name, e->library, token, e->resources);
}

static Slave *start(const Wiring *w) {
    Slave *slave = open_first(w, w->slave[0].token);
    if (slave == NULL)
        die("%s could not be instantiated", w->slave[0].name);
    slave->enter_initialization(slave, 0.0);
    for (int i = 0; i < w->starts; i++)
        slave->set_real(slave, w->start[i].reference, w->start[i].value);
    slave->exit_initialization(slave);
    return slave;
}

static void notify(const Wiring *w, Slave *slave, int count, double stamp, double place) {
    const Event *e = &w->event[0];
    const double values[] = {stamp, place};
    if (w->slave[0].event_mode) {
        slave->notify(slave, e->clock, 2, e->to, values);
        return;
    }
    slave->set_real(slave, e->to[0], stamp);
    slave->set_real(slave, e->to[1], place);
    slave->set_integer(slave, e->count, count);
}

/* Steps first ... last - 1, each with its inputs and perhaps an event: in the step, at its start, or late. */
static void run(const Wiring *w, Slave *slave, int first, int last) {
    for (int k = first; k < last; k++) {
        double t = k * STEP;
        for (int i = 0; i < w->starts; i++)
            slave->set_real(slave, w->start[i].reference, w->start[i].value * (1.0 + 0.3 * sin(3.0 * t + i)));
        const double delays[] = {0.4 * STEP, 0.0, -2.5 * STEP};
        if (w->events > 0 && k % 5 == 4)
            notify(w, slave, k / 5 + 1, t + delays[(k / 5) % 3], 10.0 * t);
        require(slave, "DoStep", slave->do_step(slave, t, STEP));
    }
}

static void print_outputs(const Wiring *w, Slave *slave) {
    for (int i = 0; i < w->records; i++)
        printf("%a\n", slave->get_real(slave, w->record[i].reference));
}

static double checksum(const Wiring *w, Slave *slave) {
    double sum = 0.0;
    for (int i = 0; i < w->records; i++)
        sum += (i + 1) * slave->get_real(slave, w->record[i].reference);
    return sum;
}

static void expect_equal(const char *what, double a, double b) {
    if (memcmp(&a, &b, sizeof a) != 0)
        die("%s: %.17g is not %.17g", what, a, b);
}

static void cover_states(const Wiring *w, Slave *slave) {
    void *state = slave->save(slave);
    run(w, slave, 40, 60);
    double expected = checksum(w, slave);
    slave->restore(slave, state);
    run(w, slave, 40, 60);
    expect_equal("after a restore", checksum(w, slave), expected);
    char *bytes;
    size_t size = slave->serialize(slave, state, &bytes);
    void *copy = slave->deserialize(slave, bytes, size);
    slave->restore(slave, copy);
    run(w, slave, 40, 60);
    expect_equal("after a serialised restore", checksum(w, slave), expected);
    slave->forget(slave, copy);
    slave->forget(slave, state);
    free(bytes);
}

static void cover(const Wiring *w) {
    if (open_first(w, "not the token") != NULL)
        die("a wrong token was accepted");
    Slave *slave = start(w), *other = start(w);
    run(w, slave, 0, 40);
    run(w, other, 0, 3);
    cover_states(w, slave);
    double expected = checksum(w, slave);
    if (slave->do_step(slave, 60 * STEP, -STEP) < SLAVE_DISCARD)
        die("a step backwards was accepted");
    slave->terminate(slave);
    slave->reset(slave);
    slave->enter_initialization(slave, 0.0);
    for (int i = 0; i < w->starts; i++)
        slave->set_real(slave, w->start[i].reference, w->start[i].value);
    slave->exit_initialization(slave);
    run(w, slave, 0, 60);
    expect_equal("after a reset", checksum(w, slave), expected);
    slave->close(slave);
    other->close(other); /* without terminate */
}

/* With an event that waits for the next step, and late ones in the past. */
static void damage(const Wiring *w) {
    Slave *slave = start(w);
    run(w, slave, 0, 24);
    if (w->events > 0)
        notify(w, slave, 5, 24.4 * STEP, 2.0);
    void *state = slave->save(slave);
    char *bytes;
    size_t size = slave->serialize(slave, state, &bytes);
    slave->forget(slave, state);
    require(slave, "DoStep", slave->do_step(slave, 24 * STEP, STEP));
    double expected = checksum(w, slave);
    int tried = 0, accepted = 0;
    for (Damage d = damage_first(bytes, size); damage_next(&d); tried++) {
        if (slave->try_restore(slave, bytes, size) <= SLAVE_WARNING) {
            accepted++;
            slave->do_step(slave, 24 * STEP, STEP); /* any status will do, if it comes */
            slave->do_step(slave, 25 * STEP, STEP);
        }
    }
    require(slave, "restore", slave->try_restore(slave, bytes, size));
    require(slave, "DoStep", slave->do_step(slave, 24 * STEP, STEP));
    expect_equal("after damaged states", checksum(w, slave), expected);
    printf("%d %d\n", tried, accepted);
    free(bytes);
    slave->close(slave);
}

static long resident_kilobytes(void) {
    FILE *file = fopen("/proc/self/status", "r");
    char line[256];
    long value = -1;
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, "VmRSS:", 6) == 0)
            value = atol(line + 6);
    if (file != NULL)
        fclose(file);
    return value;
}

static int open_files(void) {
    DIR *folder = opendir("/proc/self/fd");
    int count = 0;
    while (folder != NULL && readdir(folder) != NULL)
        count++;
    if (folder != NULL)
        closedir(folder);
    return count;
}

static void many(const Wiring *w, int count) {
    for (int i = 1; i <= count; i++) {
        Slave *slave = start(w);
        run(w, slave, 0, 12);
        void *state = slave->save(slave);
        slave->forget(slave, state);
        slave->close(slave);
        if (i == count / 10 || i == count)
            printf("%ld %d\n", resident_kilobytes(), open_files());
    }
}

static void save_to(const Wiring *w, const char *path) {
    Slave *slave = start(w);
    run(w, slave, 0, 53); /* between a told event and the next, with late ones in the past */
    void *state = slave->save(slave);
    char *bytes;
    size_t size = slave->serialize(slave, state, &bytes);
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(bytes, 1, size, file) != size)
        die("%s cannot be written", path);
    fclose(file);
    free(bytes);
    slave->forget(slave, state);
    run(w, slave, 53, 120);
    print_outputs(w, slave);
    slave->close(slave);
}

static void continue_from(const Wiring *w, const char *path) {
    static char bytes[1 << 24];
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        die("%s cannot be read", path);
    size_t size = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    Slave *slave = start(w);
    void *state = slave->deserialize(slave, bytes, size);
    slave->restore(slave, state);
    slave->forget(slave, state);
    run(w, slave, 53, 120);
    print_outputs(w, slave);
    slave->close(slave);
}

int main(int argc, char **argv) {
    if (argc < 3)
        die("usage: life cover|damage|many|save|continue WIRING [COUNT|FILE]");
    Wiring *wiring = malloc(sizeof *wiring);
    read_wiring(wiring, argv[2]);
    if (strcmp(argv[1], "cover") == 0)
        cover(wiring);
    else if (strcmp(argv[1], "damage") == 0)
        damage(wiring);
    else if (strcmp(argv[1], "many") == 0)
        many(wiring, atoi(argv[3]));
    else if (strcmp(argv[1], "save") == 0)
        save_to(wiring, argv[3]);
    else
        continue_from(wiring, argv[3]);
    free(wiring->text);
    free(wiring);
    return 0;
}
