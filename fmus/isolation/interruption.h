/* Ctrl-C while an FMU is waited for: Python hears of it only when the call has returned, so it is heard here as well. Part of `proxy.c`. */
#include "pacing.h"

#define STILL_SECONDS 0.5 /* how long a call may last after that */

static const int ENDING[] = {SIGINT, SIGTERM, SIGHUP};
enum { ENDINGS = sizeof ENDING / sizeof *ENDING };
static struct sigaction heard_before[ENDINGS];
static volatile sig_atomic_t interrupted;

/* Whoever heard it before hears it too. */
static void hear(int number) {
    interrupted = 1;
    for (int k = 0; k < ENDINGS; k++)
        if (ENDING[k] == number)
            heard_before[k].sa_handler(number);
}

/* From now on the signals that some handler waits for are heard here; whether they are. Only the main thread of Python hears signals. */
static bool listen_for_end(void) {
    if (getpid() != gettid())
        return false;
    interrupted = 0;
    for (int k = 0; k < ENDINGS; k++) {
        sigaction(ENDING[k], NULL, &heard_before[k]);
        struct sigaction here = heard_before[k];
        here.sa_handler = hear;
        if (!(here.sa_flags & SA_SIGINFO) && heard_before[k].sa_handler != SIG_DFL && heard_before[k].sa_handler != SIG_IGN)
            sigaction(ENDING[k], &here, NULL);
    }
    return true;
}

static void listen_no_longer(void) {
    for (int k = 0; k < ENDINGS; k++)
        sigaction(ENDING[k], &heard_before[k], NULL);
}
