/* The memory that a proxy of an FMU and its child share, what a call looks like in it, and how one waits for the other. Included by
   `proxy.c` and `child.c`, each compiled on its own.

   The calls of FMI are handed on by one prototype, integers and addresses first and doubles behind them: the two calling conventions
   below pass each kind in registers of its own, and further integers in words on the stack.
 */
#define _GNU_SOURCE
#if !defined(__linux__) || !(defined(__x86_64__) || defined(__aarch64__))
#error "processes of their own are for Linux on x86-64 and aarch64"
#endif

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/futex.h>
#include <sched.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "functions.h"

#define PAGE 4096
#define AREA_BYTES (64L << 20)       /* of requests, and of replies; memory is taken where it is touched first */
#define LOG_BYTES (1L << 20)
#define AHEAD_BYTES (1L << 20)       /* at their beginnings, of what is read ahead */
#define MOST_TEXT 65536              /* of one message */
#define PUT_AWAY 117                 /* exit code of a process whose FMU was freed and unloaded */
#define NONE UINT64_MAX              /* in place of an address: NULL */
enum { OK_STATUS, WARNING_STATUS, DISCARD_STATUS, ERROR_STATUS, FATAL_STATUS };

/* Where in the shared file: what the child must not write comes first, what it may write lies between guard pages in its memory. */
enum {
    AT_SUPERVISION = 0,
    AT_ASKING = PAGE,
    AT_REQUESTS = 2 * PAGE,
    READ_ONLY_BYTES = PAGE + AREA_BYTES,
    AT_ANSWERING = 2 * PAGE + AREA_BYTES,
    AT_REPLIES = AT_ANSWERING + PAGE,
    AT_LOG = AT_REPLIES + AREA_BYTES,
    WRITTEN_BYTES = PAGE + AREA_BYTES + LOG_BYTES,
    FILE_BYTES = AT_LOG + LOG_BYTES,
};

/* How the process ended that had the FMU, as the one sees it that watches it. */
enum { LIVES, EXITED, SIGNALLED, TOO_MANY_PROCESSES, TOO_MUCH_MEMORY, LEFT };
typedef struct {
    _Atomic uint32_t ended;
    int32_t code; /* exit code or signal */
    int32_t left; /* processes that it had started and left running */
    int32_t child; /* the process; 0 where it is not known */
} Supervision;

#define OWN_LINE _Alignas(64) /* of the cache: what one writes often does not delay who looks at what is beside it */

typedef struct { /* written by the proxy */
    _Atomic uint32_t number, sleeps;
    uint32_t first; /* where the request begins */
    uint32_t ahead; /* where the gets end that are made behind a step, from the beginning of the requests on */
    uint32_t wanted; /* whether some are to be made behind this one */
    int32_t looks; /* for the next request, before sleeping */
    OWN_LINE uint64_t log_taken; /* messages up to here have been taken */
} Asking;

enum { REPLY, LOG_FULL, INTERMEDIATE_UPDATE, CLOCK_UPDATE, LOCK_PREEMPTION, UNLOCK_PREEMPTION };
typedef struct { /* written by the child */
    _Atomic uint32_t number, sleeps;
    uint32_t kind;
    uint64_t log_seen; /* where the messages ended when this was said */
    OWN_LINE int32_t current; /* number of the function that is being called; -1 for none */
    uint8_t flags[4];
    double time; /* of an intermediate update [s] */
    _Atomic uint64_t log_end;
    uint32_t log_lost;
    uint8_t loaded, present[FUNCTION_COUNT];
    char why_not[1024];
} Answering;

typedef struct {
    uint64_t value; /* or where the content stands, from the record on */
    uint32_t bytes; /* of an array; how many texts */
    uint32_t reply; /* where it is filled in the replies */
} Passed;

typedef struct {
    uint32_t function, bytes; /* all of it; the next one is behind it */
    uint32_t reply;
    uint8_t kept, wanted; /* filled over what was there before; of those behind a step, whether it is to be made */
    uint8_t unused[2];
    Passed arguments[];
} Record;

typedef struct {
    int64_t value;    /* status, or an address */
    uint64_t log_end; /* the messages up to here were written until its end */
    uint32_t number;  /* of the request; where it is another one, this call did not come about */
} Reply;

typedef struct { /* a message: text of the category, text of the message; kind 0, or 1 where a step was finished */
    uint32_t bytes;
    int32_t status, kind;
    uint32_t category_bytes;
} Message;

static inline size_t aligned(size_t bytes) {
    return (bytes + 15) & ~(size_t)15;
}

static inline double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline void rest(void) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#else
    __asm__ volatile("yield");
#endif
}

/* Sleep while the word is `seen`, `seconds` at most. */
static inline void sleep_while(_Atomic uint32_t *word, uint32_t seen, double seconds) {
    struct timespec most = {(time_t)seconds, (long)((seconds - (double)(time_t)seconds) * 1e9)};
    syscall(SYS_futex, word, FUTEX_WAIT, seen, &most, NULL, 0);
}

static inline void wake(_Atomic uint32_t *word) {
    syscall(SYS_futex, word, FUTEX_WAKE, INT_MAX, NULL, NULL, 0);
}

/* A message goes out; whoever sleeps on it is woken. */
static inline void post(_Atomic uint32_t *word, uint32_t number, _Atomic uint32_t *sleeps) {
    atomic_store(word, number);
    if (atomic_load(sleeps))
        wake(word);
}

#define LOOKS 1500 /* some 50 microseconds: as long as it takes to wake somebody on another core */

/* Whether a message comes while one looks for it. */
static inline bool comes_soon(_Atomic uint32_t *word, uint32_t number, int looks) {
    for (int k = 0; k <= looks; k++) {
        if (atomic_load_explicit(word, memory_order_acquire) == number)
            return true;
        rest();
    }
    return false;
}
