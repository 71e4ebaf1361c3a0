/* A library in place of that of an FMU, which does a deed in one function and else what the FMU does. The environment says which: HARM is
   the deed, HARM_IN the function, loading or unloading. The FMU's own library lies beside it under the name that REAL says.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "functions.h"

static void *real;

static bool is(const char *deed) {
    return strcmp(getenv("HARM"), deed) == 0;
}

static int deeper(volatile int *before) {
    volatile int here[4096] = {*before};
    return deeper(here) + here[1];
}

static void *crash(void *unused) {
    raise(SIGSEGV);
    return unused;
}

static void leave_a_process(void) {
    if (fork() == 0) {
        setsid();
        if (fork() == 0)
            sleep(60);
        _exit(0);
    }
}

/* Over all memory that is shared with somebody, and may be written. */
static void scribble(bool unmaps) {
    FILE *maps = fopen("/proc/self/maps", "r");
    char line[512], access[8];
    unsigned long from, to;
    while (fgets(line, sizeof line, maps) != NULL)
        if (sscanf(line, "%lx-%lx %7s", &from, &to, access) == 3 && access[1] == 'w' && access[3] == 's') {
            if (unmaps)
                munmap((void *)from, to - from);
            else
                memset((void *)from, 0xa5, 1 << 20);
        }
    fclose(maps);
}

static void fill_disk(void) {
    int file = fileno(tmpfile());
    static char block[1 << 16];
    for (int k = 0; k < 1000; k++)
        if (write(file, block, sizeof block) < 0)
            break;
}

static void harm(const char *where) {
    const char *asked = getenv("HARM_IN");
    if (asked == NULL || getenv("HARM") == NULL || strcmp(asked, where) != 0)
        return;
    pthread_t thread;
    if (is("segv")) raise(SIGSEGV);
    if (is("abort")) abort();
    if (is("exit")) exit(0);
    if (is("_exit")) _exit(3);
    if (is("spin")) for (volatile int k = 0;; k++);
    if (is("pause")) for (;;) pause();
    if (is("overflow")) deeper(&(volatile int){0});
    if (is("thread")) { pthread_create(&thread, NULL, crash, NULL); pause(); }
    if (is("group")) kill(0, SIGKILL);
    if (is("stop")) raise(SIGSTOP);
    if (is("processes")) for (int k = 0; k < 12; k++) if (fork() == 0) { sleep(60); _exit(0); }
    if (is("processes")) pause();
    if (is("memory")) for (;;) memset(malloc(1 << 26), 1, 1 << 26);
    if (is("file")) fill_disk();
    if (is("unmap")) scribble(true);
    if (is("scribble")) scribble(false);
    if (is("close")) for (int k = 0; k < 256; k++) close(k);
    if (is("print")) for (int k = 0; k < 20000; k++) printf("line %d\n", k);
    if (is("daemon")) leave_a_process();
    if (is("signals")) for (int k = 1; k < 32; k++) signal(k, SIG_IGN);
    if (is("parent")) kill(getppid(), SIGKILL);
}

__attribute__((constructor)) static void loaded(void) {
    char place[4096];
    Dl_info known;
    dladdr((void *)loaded, &known);
    snprintf(place, sizeof place, "%s", known.dli_fname);
    strcpy(strrchr(place, '/') + 1, REAL);
    real = dlopen(place, RTLD_NOW);
    harm("loading");
}

__attribute__((destructor)) static void unloaded(void) { harm("unloading"); }

#define QUOTED_(x) #x
#define QUOTED(x) QUOTED_(x)
#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#define WORDS uint64_t a0, uint64_t a1, uint64_t a2, uint64_t a3, uint64_t a4, uint64_t a5, uint64_t a6, uint64_t a7, uint64_t a8, uint64_t a9, uint64_t a10, uint64_t a11, double d0, double d1, double d2, double d3
typedef int64_t (*Any)(WORDS);
#define F(version, part, name, arguments) \
    __attribute__((visibility("default"))) int64_t JOINED(PREFIX, name)(WORDS) { \
        harm(#name + strlen(BEGIN)); \
        Any f = (Any)dlsym(real, QUOTED(PREFIX) #name); \
        return f(a0, a1, a2, a3, a4, a5, a6, a7, a8, a9, a10, a11, d0, d1, d2, d3); \
    }
FUNCTIONS_HERE
#undef F

#if VERSION == 1
typedef struct { void *logger, *allocate, *release, *step_finished; } Callbacks1;
typedef void *(*Slave)(const char *, const char *, const char *, const char *, double, char, char, Callbacks1, char);
__attribute__((visibility("default"))) void *JOINED(PREFIX, fmiInstantiateSlave)(const char *a, const char *b, const char *c, const char *d, double e, char f, char g, Callbacks1 h, char i) {
    harm("InstantiateSlave");
    return ((Slave)dlsym(real, QUOTED(PREFIX) "fmiInstantiateSlave"))(a, b, c, d, e, f, g, h, i);
}
#endif
