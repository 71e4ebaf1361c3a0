/* The plan of a run as tables of plain numbers and pointers: what Python prepares and the stepper executes. No code.

   `program.py` mirrors every structure; change the two together. Arrays belong to Python and outlive the program. */
#ifndef STEPPER_H
#define STEPPER_H

#include <stdint.h>

/* Types of variables, by what the function of the library takes. */
enum {
    KIND_FLOAT64, KIND_FLOAT32, KIND_INT8, KIND_UINT8, KIND_INT16, KIND_UINT16, KIND_INT32, KIND_UINT32, KIND_INT64, KIND_UINT64,
    KIND_BOOLEAN8,  /* one byte: FMI 1 and 3 */
    KIND_BOOLEAN32, /* an int: FMI 2 */
};

/* One call that reads or writes all variables of one type. */
typedef struct {
    void *function;
    const uint32_t *references; /* of whole variables */
    double *values;         /* outputs of the component, or its gathered inputs */
    void *raw;              /* what the function gets */
    const int64_t *places;  /* of the values that matter within `values`; NULL: `raw` lies there itself, and nothing is to be moved */
    const int64_t *elements; /* of the same values within `raw` */
    int64_t count;          /* of these */
    int64_t reference_count, raw_count;
    int64_t kind;
} Port;

typedef struct {
    void *instance;
    void *do_step;
    Port *writes, *reads;
    int64_t write_count, read_count;
    int64_t fmi_version;
    int64_t heeds_events;              /* FMI 3 with event mode: eventHandlingNeeded means something */
    int64_t input_count;               /* inputs with a source */
    const int64_t *sources;            /* their columns in the values of the plan */
    const double *factors, *offsets;   /* NULL: nothing is converted */
    double *inputs;                    /* gathered */
    int64_t calls;                     /* of doStep, counted up */
    double seconds;                    /* in the sampled ones, added up */
} Slave;

/* A plant that is watched: steps in which it may pass a balise are not for the stepper. */
typedef struct {
    int64_t slave;          /* its place in the plan, or -1 */
    int64_t first_output, output_count; /* columns */
    int64_t position, speed; /* columns */
    double position_scale, speed_scale; /* to [m] and [m/s] */
    double acceleration_limit;          /* [m/s2] */
    const double *places;               /* of the balises [m], increasing */
    int64_t place_count;
    int64_t cursor;                     /* places[cursor - 1] < position <= places[cursor], kept from step to step */
} Watch;

/* A telegram for a receiver with event mode (FMI 3). */
typedef struct {
    void *enter_event, *set_clock, *set_reals, *update, *enter_step; /* functions */
    const uint32_t *references;                                      /* of the payload */
    const double *payload;
    int64_t payload_count;
    int64_t clock;
    int64_t stage;                   /* the one that was not ordinary */
    int64_t flags[5];                /* what the update said */
    double next_event;
} Telegram;

/* Stages of telling: which calls have been made. */
enum {
    STAGE_SEND, STAGE_ARRIVE, STAGE_BEFORE, STAGE_ENTER, STAGE_CLOCK, STAGE_PAYLOAD, STAGE_UPDATE, STAGE_LEAVE, STAGE_AFTER,
    STAGE_GO_ON, STAGE_END, STAGE_DONE,
};

/* Why a stretch ended. */
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
};

typedef struct {
    double start, step;         /* t_k = start + k * step [s] */
    double *values;             /* of the plan */
    const double *before;       /* the same at the beginning of the step in which the stretch ended */
    int64_t value_count;
    Slave *slaves;
    int64_t slave_count;
    int64_t gathers_first;      /* Jacobi: all inputs are gathered before anything is stepped */
    Watch watch;
    double seconds_at_most;     /* a stretch is to last [s] */
    double seconds, sampled;    /* it lasted; steps of it whose doStep calls were timed */
    /* where and why it ended */
    int64_t stop, slave, port, status;
    int64_t event, terminate, early; /* results of doStep */
    double reached;
} Program;

#endif
