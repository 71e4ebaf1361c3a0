/* The plan of a run as tables of plain numbers and pointers: what Python prepares and the stepper executes. No code.

   `program.py` mirrors every structure; change the two together. Arrays belong to Python and outlive the program. */
#ifndef STEPPER_H
#define STEPPER_H

#if !defined(_WIN32)
#define _POSIX_C_SOURCE 199309L /* clock_gettime */
#endif
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

#define STATUS_WARNING 1 /* in all versions of FMI: more than this is a failure */
#define STATUS_ERROR 3
#define TIME_TOLERANCE 1e-9 /* communication times closer than this are the same [s], as in the components */
#define BINS 40 /* of times of calls: 2 to 4 ns, 4 to 8 ns, ... as in sampled_times.py */

/* Types of variables, by what the function of the library takes. */
enum {
    KIND_FLOAT64, KIND_FLOAT32, KIND_INT8, KIND_UINT8, KIND_INT16, KIND_UINT16, KIND_INT32, KIND_UINT32, KIND_INT64, KIND_UINT64,
    KIND_BOOLEAN8,  /* one byte: FMI 1 and 3 */
    KIND_BOOLEAN32, /* an int: FMI 2 */
};

/* One call that reads or writes all variables of one type. */
typedef struct {
    void *function, *instance;
    const uint32_t *references; /* of whole variables */
    double *values;         /* outputs of the component, or its gathered inputs */
    void *raw;              /* what the function gets */
    const int64_t *places;  /* of the values that matter within `values`; NULL: `raw` lies there itself, and nothing is to be moved */
    const int64_t *elements; /* of the same values within `raw` */
    int64_t count;          /* of these */
    int64_t reference_count, raw_count, raw_bytes;
    int64_t kind;
} Port;

/* What is played back, with the surface of a slave. */
typedef struct {
    const double *time;      /* of the rows [s], not decreasing */
    const double *rows;      /* values, row by row */
    const uint8_t *held;     /* of each column; the others run on lines between rows */
    int64_t row_count, column_count;
    double *values;          /* where it stands */
    double *stands;          /* the time [s], and 1 where it stands before an event of this time */
    int64_t row;             /* near which the next search begins */
    double saved[2];         /* where it stood */
} Recording;

/* An input that follows a column of a recording within a step: factor * column + offset. */
typedef struct {
    Recording *recording;
    int64_t column, input;
    double factor, offset;
} FollowedColumn;

/* Inputs of which some follow columns. */
typedef struct {
    const FollowedColumn *columns;
    int64_t column_count;
    double *gathered;      /* all inputs, as they are at the end or the start of the step */
    const uint8_t *over;   /* of each input: it gets the mean over the step, not the value at the end */
    const uint8_t *held;   /* of each input: it is that of the start */
    const uint8_t *passes; /* of each input: its mean has direct feedthrough, so that the value at the end follows */
    double begin, end;     /* of the step [s] */
} Followed;

/* Functions in a journal, and those whose warnings are counted. */
enum {
    CALL_SET, CALL_STEP, CALL_GET, CALL_ENTER_EVENT, CALL_SET_CLOCK, CALL_SET_REALS, CALL_UPDATE, CALL_ENTER_STEP, CALL_COUNT, CALL_SAVE,
    CALL_RESTORE, CALL_RELEASE, CALLS,
};

/* What a step may say against the standard or the description, as in `call_warnings.py`. */
enum { BEYOND_STEP, EARLY_RETURN, EVENT_WITHOUT_MODE, CONTRADICTIONS };

typedef struct {
    void *instance;
    void *do_step, *stepped;           /* and what it takes in place of the instance */
    int *no_way_back;                  /* nothing was saved so far: no step leads back before the begin of this one */
    double *left_at;                   /* FMI 3: where an early return just before its end left the last step [s], else infinite */
    Port *writes, *reads;
    int64_t write_count, read_count;
    int64_t fmi_version;
    int64_t heeds_events;              /* FMI 3 with event mode: eventHandlingNeeded means something */
    double usual_step, rounding;       /* whole multiples of it are handed over where a step is as long to rounding [s]; 0: never */
    int64_t input_count;               /* inputs with a source */
    const int64_t *sources;            /* where they lie in the values of the plan, or in those at the start behind them */
    const double *factors, *offsets;   /* NULL: nothing is converted */
    double *inputs;                    /* gathered */
    Followed *followed;                /* NULL: inputs are sent as they are gathered */
    int64_t calls;                     /* of doStep in the present chunk */
    int64_t all_calls;                 /* in all chunks before */
    double sampled_seconds[BINS];      /* of sampled calls, by bins of their length, added up; see sampled_times.py */
    int64_t sampled_calls[BINS];
    /* in steps over balises, which are all timed */
    double now;                        /* where it stands [s] */
    double left_here;                  /* `left_at` at the start of the present step */
    int64_t calls_here, more_calls;    /* of doStep in the present step; in all of them, beyond one for each step */
    double seconds_over;
    int64_t returns_here, returns;     /* calls of doStep after an early return: in the present step; in all steps but those of events */
    int64_t numbers;                   /* of its calls, as `LastCall` counts them: the first one is that of setting inputs */
    int64_t returns_early;             /* FMI 3: it declares that a step may end early */
    int64_t contradictions[CONTRADICTIONS]; /* how often a step said what it must not */
    double first_contradictions[CONTRADICTIONS]; /* when first [s] */
    int64_t warnings[CALLS];           /* of each function: how often it returned a warning */
    double first_warnings[CALLS];      /* when first [s] */
    int64_t special;                   /* 0: the stepper moves it in each step */
    int64_t every;                     /* it takes one step for so many of the plan; the last one whatever is left */
    int64_t in_python;                 /* Python moves it, see `turn` */
    void *save_state, *release_state;  /* functions; NULL: its state is not saved before a step that may be taken back */
    void *saved;                       /* its state at the start of the step under way */
} Slave;

/* Inputs of a component that are events for it where they change, with what it was told last. */
typedef struct {
    int64_t count;
    const int64_t *sources; /* where they lie in the values of the plan */
    const double *factors, *offsets; /* NULL: nothing is converted */
    const double *told;
} Listener;

/* A plant that is watched: steps in which it may pass a balise are not for the stepper. */
typedef struct {
    int64_t slave;          /* its place in the plan, or -1 */
    int64_t first_output, output_count; /* columns */
    int64_t position, speed; /* columns */
    double position_factor, position_offset, speed_factor, speed_offset; /* to [m] and [m/s] */
    double acceleration_limit;          /* [m/s2] */
    const double *places;               /* of the balises [m], increasing */
    int64_t place_count;
    int64_t cursor;                     /* places[cursor - 1] < position <= places[cursor], kept from step to step */
} PlantMonitor;

enum { OUTCOMES_AT_MOST = 8, RETURNS_AT_MOST = 256 };

/* Fields of a telegram that a receiver may be told. */
enum { FIELD_POSITION, FIELD_LOCATION_ACCURACY, FIELD_ODOMETER_READING, FIELD_DELIVERED_AT, FIELD_STAMP, FIELDS };

/* A telegram for a receiver with event mode (FMI 3). */
typedef struct {
    void *enter_event, *set_clock, *set_reals, *update, *enter_step; /* functions */
    void *get_counts;                                                /* NULL: the receiver does not count outcomes */
    const uint32_t *references;                                      /* of the payload */
    double *payload;
    const int64_t *fields;                                           /* what goes where in the payload */
    int64_t payload_count;
    int64_t clock;
    double *before, *after;          /* outputs */
    const uint32_t *count_references; /* of the counts */
    int64_t count_count;
    int64_t count_ranks[OUTCOMES_AT_MOST]; /* the lowest says most; -1: says nothing */
    int64_t seen[OUTCOMES_AT_MOST];  /* what they were when they were read last */
    int64_t outcome;                 /* rank of the one that has grown; -1: none so far */
} Telegram;

/* Stages of telling: which calls have been made. */
enum {
    STAGE_SEND, STAGE_ARRIVE, STAGE_COUNT, STAGE_BEFORE, STAGE_ENTER, STAGE_CLOCK, STAGE_PAYLOAD, STAGE_UPDATE, STAGE_LEAVE,
    STAGE_COUNT_TOLD, STAGE_AFTER, STAGE_GO_ON, STAGE_COUNT_LATE, STAGE_END, STAGE_DONE,
};

/* A balise that was passed. */
typedef struct {
    int64_t which;          /* number of the place or the instant */
    double stamp, position, speed, reading; /* of plant and odometer at the stamp */
} Passed;

/* Steps over balises, which are found by rollback and told at once. */
typedef struct {
    int64_t on;             /* 0: they are not for the stepper in this chunk */
    int64_t by_instant;     /* else by the places of the watch */
    const double *instants; /* [s], increasing */
    int64_t instant_count, next_instant;
    const double *recorded; /* of each instant what its telegram said: position and accuracy [m], odometer reading; NULL: nobody recorded it */
    const double *accuracies; /* of the places [m] */
    void *save_state, *restore_state, *release_state; /* functions of the plant */
    int64_t odometer;       /* column, or -1 */
    const uint8_t *continuous; /* of each value */
    Telegram **telegrams;   /* of each slave; NULL: no receiver */
    double *start, *final, *there; /* outputs of the plant: at both ends, and at the stamp */
    double *arrived;        /* values at the end, before anything was told there */
    Passed *passed;
    int64_t *outcomes;      /* of each crossing at each slave */
    int64_t passed_count, passed_limit;
    int64_t steps;          /* done in all, also those that passed none */
} Balises;

/* What a slave is called for, counted from its `numbers`, as in `last_call.py`. */
enum { LAST_WRITE, LAST_READ, LAST_STEP, LAST_EVENT };

/* A call and what was said. */
typedef struct {
    int64_t slave, call, port, status;
    int64_t flags[5];
    double number;          /* time reached, or of the next event */
    void *state;
    int64_t first, bytes;   /* of the values read */
} Note;

/* All calls of a step over a balise: if it is not ordinary, Python does the whole step again with these answers. */
typedef struct {
    int64_t on;
    Note *notes;
    int64_t count, returns_up_to; /* early returns are followed while there are no more notes than this */
    uint8_t *bytes;
    int64_t used;
} Journal;

/* Why a chunk ended. */
enum {
    STOP_DONE,       /* all steps are done */
    STOP_TIME,       /* its time is up; all steps so far are done */
    STOP_NEAR,       /* the next step may pass a balise; nothing of it is done */
    STOP_REFUSED,    /* a value does not fit the type of its input; the slave has not been touched in this step */
    STOP_WRITE,      /* a function that sets variables failed */
    STOP_STEP,       /* doStep failed, or said something that must be seen to; nothing is read */
    STOP_READ,       /* a function that gets variables failed */
    STOP_CROSSED,    /* the plant passed a balise unforeseen; the slave is stepped, its outputs are those before the step */
    STOP_NOT_FINITE, /* a value is not finite; the step is done and recorded */
    STOP_SENT,       /* in Python only */
    STOP_ARRIVE,     /* a function that sets the inputs of the end of the step failed; the slave is stepped */
    STOP_HANDED,     /* a step is not ordinary, all of whose calls are noted: the values are those before it, the calls are in the journal */
    STOP_TURN,       /* Python has moved the slave: it failed, or asks for the end of the run */
    STOP_EVENTS,     /* all slaves are stepped; what changed is an event for one of them, and nothing is recorded */
};

typedef struct {
    double start, step;         /* t_k = start + k * step [s] */
    double *values;             /* of the plan; behind them the same at the start of the step */
    int64_t value_count;
    Slave *slaves;
    int64_t slave_count;
    PlantMonitor watch;
    Balises balises;
    Journal journal;
    double seconds_at_most;     /* a chunk is to last [s] */
    int64_t *last_call;         /* where the call that is being made is noted, and the time [s], for whoever watches */
    double *last_time;
    int64_t *rows_reported;     /* where the rows that are filled are counted, for the same */
    int64_t rows_before;        /* those that are filled before the chunk */
    const uint8_t *can_be_missing; /* values that may be NaN; NULL: none */
    int64_t step_count;         /* of the run */
    int64_t (*turn)(int64_t slave, double t, double until); /* Python moves a slave; 0: the step is Python's from here on */
    int64_t saves;              /* all who can are saved before each step, in which one may meet an event that takes all back */
    const Listener *listeners;
    int64_t listener_count;
    int64_t parts;              /* of steps, done so far */
    int64_t rows_done;          /* in the chunk: one for each step, and those of events */
    double seconds;             /* it lasted */
    /* where and why it ended */
    int64_t stop, slave, port, status;
    int64_t event, terminate, early; /* results of doStep */
    double reached;
    double returns[RETURNS_AT_MOST]; /* where the slave that was stepped last returned early on its way [s] */
    int64_t return_count;
} Program;

#endif
