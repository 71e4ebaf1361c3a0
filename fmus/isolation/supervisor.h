/* The supervisor of an isolated FMU: it ends all that the FMU started. Part of `child.c`. */
#include "shared.h"

enum { LIBRARY = 1, FOLDER, IDENTIFIER, PARENT, PROCESSES, MEMORY, FILES, FILE_SIZE, ARGUMENT_COUNT };
enum { MEMORY_FILE = 3, MOST_LISTED = 4096 };
#define LOOK_EVERY 100000000L /* of the supervisor [ns] */
#define LAST_SECONDS 5.0

/* The descendants of a process, as far as there is room; how many were found. */
static int descendants(pid_t of, pid_t *found, int most) {
    char path[64];
    snprintf(path, sizeof path, "/proc/%d/task", (int)of);
    DIR *tasks = opendir(path);
    int count = 0;
    for (struct dirent *task; tasks != NULL && (task = readdir(tasks)) != NULL;) {
        if (task->d_name[0] == '.')
            continue;
        char name[352];
        snprintf(name, sizeof name, "%s/%s/children", path, task->d_name);
        FILE *children = fopen(name, "re");
        for (int number; children != NULL && count < most && fscanf(children, "%d", &number) == 1;) {
            found[count++] = number;
            count += descendants(number, found + count, most - count);
        }
        if (children != NULL)
            fclose(children);
    }
    if (tasks != NULL)
        closedir(tasks);
    return count;
}

static long resident_bytes(pid_t number) {
    char path[64];
    long pages = 0;
    snprintf(path, sizeof path, "/proc/%d/statm", (int)number);
    FILE *file = fopen(path, "re");
    if (file != NULL) {
        if (fscanf(file, "%*s %ld", &pages) != 1)
            pages = 0;
        fclose(file);
    }
    return pages * sysconf(_SC_PAGESIZE);
}

static uint32_t excess(char **words) {
    static pid_t found[MOST_LISTED];
    const int count = descendants(getpid(), found, MOST_LISTED);
    long bytes = 0;
    for (int k = 0; k < count; k++)
        bytes += resident_bytes(found[k]);
    if (count - 1 > atol(words[PROCESSES]))
        return TOO_MANY_PROCESSES;
    return bytes > atol(words[MEMORY]) ? TOO_MUCH_MEMORY : LIVES;
}

/* Kill every descendant, those they start meanwhile too; how many there were beside the child. */
static int end_all(pid_t child) {
    static pid_t found[MOST_LISTED];
    int left = 0;
    const double until = now() + LAST_SECONDS;
    for (bool first = true; now() < until; first = false) {
        const int count = descendants(getpid(), found, MOST_LISTED);
        for (int k = 0; k < count; k++) {
            left += first && found[k] != child;
            kill(found[k], SIGKILL);
        }
        while (waitpid(-1, NULL, WNOHANG) > 0)
            ;
        if (count == 0)
            break;
        usleep(500);
    }
    return left;
}

static void say_end(Supervision *said, Answering *answering, uint32_t ended, int code, int left) {
    said->code = code;
    said->child = 0;
    said->left = left;
    atomic_store(&said->ended, ended);
    atomic_fetch_xor(&answering->number, 1u << 30); /* nobody sleeps on a number that stays */
    wake(&answering->number);
}

static void supervise(pid_t child, char **words, Supervision *said, Answering *answering, const sigset_t *heard) {
    const struct timespec pause = {0, LOOK_EVERY};
    uint32_t ended = LIVES;
    int status = 0;
    while (ended == LIVES) {
        const int signal = sigtimedwait(heard, NULL, &pause);
        for (pid_t gone; (gone = waitpid(-1, &status, WNOHANG)) > 0;)
            if (gone == child) {
                ended = WIFSIGNALED(status) ? SIGNALLED : EXITED;
                break;
            }
        if (ended == LIVES && (signal == SIGTERM || getppid() != atoi(words[PARENT])))
            ended = LEFT;
        if (ended == LIVES && signal < 0)
            ended = excess(words);
    }
    const int left = end_all(child);
    say_end(said, answering, ended, ended == SIGNALLED ? WTERMSIG(status) : WEXITSTATUS(status), left);
    _exit(0);
}
