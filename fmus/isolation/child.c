/* The program in which an FMU runs that is kept apart: a supervisor, and the process that has loaded the FMU. See `shared.h`.

   The supervisor never touches the FMU. It ends everything that the FMU started when it ends, when the program that asked is gone, or when
   there is too much of it, and says in memory that the FMU cannot write how the process ended.

   Arguments: library, its folder, modelIdentifier, process that asked, most processes, most memory [bytes], most open files, most
   bytes of a file. The shared memory is descriptor 3.
 */
#include "callbacks.h"

#include <dlfcn.h>
#include <sys/prctl.h>
#include <sys/resource.h>

/* -- calls ---------------------------------------------------------------------------------------------------------------- */

/* Addresses of texts that stand behind their offsets in a request, or of nothing where they are to be filled in. */
static const char **texts_at(const Record *r, const Passed *p, bool read) {
    const char **made = calloc(p->bytes + 1, sizeof *made);
    const uint64_t *offsets = (const uint64_t *)((const char *)r + p->value);
    for (uint64_t k = 0; read && k < p->bytes; k++)
        made[k] = offsets[k] == NONE ? NULL : (const char *)r + offsets[k];
    return made;
}

/* Put texts, or byte strings of the lengths given, where the other side reads them. */
static void put_texts(const Passed *p, const char **texts, const size_t *lengths) {
    uint64_t *entries = (uint64_t *)(replies + p->reply), at = p->reply + p->bytes * 16;
    for (uint64_t k = 0; k < p->bytes; k++) {
        const size_t length = texts[k] == NULL ? 0 : lengths == NULL ? strlen(texts[k]) : lengths[k];
        const bool fits = texts[k] != NULL && length < AREA_BYTES && at + length <= AREA_BYTES;
        entries[2 * k] = fits ? at : NONE;
        entries[2 * k + 1] = fits ? length : 0;
        if (fits) {
            memcpy(replies + at, texts[k], length);
            at += length;
        }
    }
}

static int64_t made_call(const Function *f, const uint64_t *a, const double *d) {
    void *to = addresses[f - FUNCTIONS];
    if (f - FUNCTIONS == N_fmiInstantiateSlave || f - FUNCTIONS == N_fmiInstantiateModel) {
        const Callbacks1 own = {callbacks.logger, callbacks.allocate, callbacks.release, callbacks.step_finished};
        if (f - FUNCTIONS == N_fmiInstantiateModel)
            return (int64_t)((InstantiateModel)to)((const char *)a[0], (const char *)a[1], own, (char)a[2]);
        return (int64_t)((InstantiateSlave)to)((const char *)a[0], (const char *)a[1], (const char *)a[2], (const char *)a[3], d[0], (char)a[4],
            (char)a[5], own, (char)a[6]);
    }
    const int64_t said = ((Uniform)to)(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11], d[0], d[1], d[2], d[3]);
    return f->part == INSTANTIATE || f->part == TEXT ? said : f->part == FREE ? OK_STATUS : (int32_t)said;
}

static uint64_t passed_word(const Record *r, const Passed *p, char code) {
    switch (code) {
    case 'c': return (uint64_t)instance;
    case 's': case '<': return p->value == NONE ? 0 : (uint64_t)((const char *)r + p->value);
    case '>': case 'H':
        if (p->value == NONE)
            return 0;
        if (!r->kept)
            memcpy(replies + p->reply, (const char *)r + p->value, p->bytes);
        return (uint64_t)(replies + p->reply);
    case 'S': case 'X': return (uint64_t)texts_at(r, p, true);
    case 'G': case 'Y': return (uint64_t)texts_at(r, p, false);
    case 'i': case 'b': case 'z': case 'h': return p->value;
    default: return (uint64_t)callback(code, p->value);
    }
}

static int64_t perform(const Record *r, uint32_t number) {
    const Function *f = &FUNCTIONS[r->function];
    uint64_t a[ARGUMENTS_AT_MOST] = {0};
    double d[DOUBLES_AT_MOST] = {0};
    Reply *reply = (Reply *)(replies + r->reply);
    for (int k = 0; k < f->argument_count; k++) {
        if (f->arguments[k].code == 'd')
            memcpy(&d[f->arguments[k].word], &r->arguments[k].value, sizeof *d);
        else
            a[f->arguments[k].word] = passed_word(r, &r->arguments[k], f->arguments[k].code);
    }
    answering->current = (int32_t)r->function;
    int64_t said = made_call(f, a, d);
    answering->current = -1;
    for (int k = 0; k < f->argument_count; k++) {
        const char code = f->arguments[k].code;
        const char **texts = (const char **)a[f->arguments[k].word];
        if (code == 'G' || code == 'Y')
            put_texts(&r->arguments[k], texts, code == 'G' ? NULL : (const size_t *)a[f->arguments[k - 1].word]);
        if (code == 'S' || code == 'X' || code == 'G' || code == 'Y')
            free(texts);
    }
    if (f->part == TEXT) {
        put_texts(&(Passed){.bytes = 1, .reply = r->reply + sizeof(Reply)}, (const char *[]){(const char *)said}, NULL);
        said = OK_STATUS;
    }
    if (f->part == INSTANTIATE)
        instance = (void *)said;
    reply->log_end = atomic_load(&answering->log_end);
    reply->number = number;
    return reply->value = said;
}

/* Whether a step did what it was asked for, and says nothing that must be seen to first. */
static bool quiet(const Record *r) {
    const Function *f = &FUNCTIONS[r->function];
    for (int k = 0; k < f->argument_count; k++)
        if (f->arguments[k].code == '>' && f->arguments[k].size == 1 && replies[r->arguments[k].reply] != 0)
            return false;
    return true;
}

static const Record *behind(const Record *r) {
    return (const Record *)((const char *)r + r->bytes);
}

static void perform_all(const Record *r) {
    const uint32_t number = answered; /* callbacks count on */
    for (; r->function != N_STOP; r = behind(r)) {
        const int64_t said = perform(r, number);
        const int part = FUNCTIONS[r->function].part;
        if (said > WARNING_STATUS && part != INSTANTIATE)
            return;
        if (part != STEP || !asking->wanted || !quiet(r))
            continue;
        const Record *end = (const Record *)(requests + asking->ahead);
        for (const Record *get = (const Record *)requests; get < end; get = behind(get))
            if (get->wanted)
                perform(get, number);
    }
}

/* Answer requests until the end, or until the other side returns from a callback: what it says. */
static const Record *serve(void) {
    for (;;) {
        const uint32_t next = answered + 1;
        for (bool came = comes_soon(&asking->number, next, asking->looks); !came;) {
            atomic_store(&answering->sleeps, 1);
            const uint32_t seen = atomic_load(&asking->number);
            came = seen == next;
            if (!came)
                sleep_while(&asking->number, seen, 3600.0);
            atomic_store(&answering->sleeps, 0);
        }
        answered = next;
        const Record *first = (const Record *)(requests + asking->first);
        if (first->function == N_RETURN)
            return first;
        if (first->function == N_END) {
            dlclose(library);
            _exit(PUT_AWAY);
        }
        perform_all(first);
        answer(REPLY);
    }
}

/* -- the beginning -------------------------------------------------------------------------------------------------------- */

/* A part of the shared memory between two pages that nobody may touch. */
static void *between_guards(size_t bytes, off_t at, int protection) {
    char *room = mmap(NULL, bytes + 2 * PAGE, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    void *part = room == MAP_FAILED ? room : mmap(room + PAGE, bytes, protection, MAP_SHARED | MAP_FIXED, MEMORY_FILE, at);
    if (part == MAP_FAILED)
        _exit(1);
    return part;
}

static void limit(int what, const char *word) {
    const rlim_t most = (rlim_t)atol(word);
    struct rlimit present;
    if (getrlimit(what, &present) == 0 && (present.rlim_max == RLIM_INFINITY || most < present.rlim_max))
        setrlimit(what, &(struct rlimit){most, most});
}

static void load(char **words) {
    char before[PATH_MAX], name[256], full[1400];
    const bool known = getcwd(before, sizeof before) != NULL;
    if (chdir(words[FOLDER]) != 0) /* some look for their own libraries there */
        _exit(1);
    library = dlopen(words[LIBRARY], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        const char *said = dlerror();
        snprintf(answering->why_not, sizeof answering->why_not, "%s", said == NULL ? "unknown error" : said);
    }
    if (known && chdir(before) != 0)
        _exit(1);
    for (int k = 0; library != NULL && k < FUNCTION_COUNT; k++) {
        snprintf(name, sizeof name, "%s", FUNCTIONS[k].name);
        snprintf(full, sizeof full, "%s_%s", words[IDENTIFIER], name);
        addresses[k] = dlsym(library, FUNCTIONS[k].version == 1 ? full : name);
        answering->present[k] = addresses[k] != NULL;
    }
    answering->loaded = library != NULL;
}

static void run_fmu(char **words, pid_t supervisor) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != supervisor)
        _exit(1);
    setpgid(0, 0);
    char *read = between_guards(READ_ONLY_BYTES, AT_ASKING, PROT_READ);
    char *written = between_guards(WRITTEN_BYTES, AT_ANSWERING, PROT_READ | PROT_WRITE);
    close(MEMORY_FILE);
    asking = (Asking *)read;
    requests = read + PAGE;
    answering = (Answering *)written;
    replies = written + PAGE;
    messages = replies + AREA_BYTES;
    here = pthread_self();
    limit(RLIMIT_CORE, "0");
    limit(RLIMIT_NOFILE, words[FILES]);
    limit(RLIMIT_FSIZE, words[FILE_SIZE]);
    parse_signatures();
    answering->current = -1;
    load(words);
    answered = 1;
    answer(REPLY);
    if (library == NULL)
        _exit(0);
    serve();
}

int main(int count, char **words) {
    if (count != ARGUMENT_COUNT)
        return 2;
    sigset_t heard, none;
    sigemptyset(&none);
    sigemptyset(&heard);
    sigaddset(&heard, SIGCHLD);
    sigaddset(&heard, SIGTERM);
    sigprocmask(SIG_BLOCK, &heard, NULL);
    setsid();
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    syscall(SYS_close_range, MEMORY_FILE + 1, ~0u, 0);
    Supervision *said = mmap(NULL, PAGE, PROT_READ | PROT_WRITE, MAP_SHARED, MEMORY_FILE, AT_SUPERVISION);
    Answering *watched = mmap(NULL, PAGE, PROT_READ | PROT_WRITE, MAP_SHARED, MEMORY_FILE, AT_ANSWERING);
    if (said == MAP_FAILED || watched == MAP_FAILED || getppid() != atoi(words[PARENT]))
        return 1;
    const pid_t self = getpid(), child = fork();
    if (child == 0) {
        sigprocmask(SIG_SETMASK, &none, NULL);
        munmap(said, PAGE);
        munmap(watched, PAGE);
        run_fmu(words, self);
        _exit(0);
    }
    if (child < 0) {
        say_end(said, watched, EXITED, 1, 0);
        return 1;
    }
    said->child = child;
    close(MEMORY_FILE);
    for (int k = 0; k < 3; k++)
        close(k);
    supervise(child, words, said, watched, &heard);
}
