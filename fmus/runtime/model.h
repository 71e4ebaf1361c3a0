/* The table by which generated code describes one model to the runtime. No code; no state.

   `model.c` is generated: straight-line functions of the equations and one constant `Model`. Everything else in this
   folder is the same for all models. */
#ifndef MODEL_H
#define MODEL_H

#include <stdbool.h>
#include <stdint.h>

#include "private.h"

/* A generated function: pointers to its arguments and results, work vectors, and a memory index that is always 0. */
typedef int (*ModelFunction)(const double **arg, double **res, int *iw, double *w, int mem);

/* An event at the instants start + offset + k * period. */
typedef struct {
    const char *name;
    ModelFunction jump; /* (t, x, u, p) -> x */
    int period;         /* position in p */
    int offset;         /* position in p, or -1 for zero */
    int noises;         /* standard normal numbers drawn at every instant */
} PeriodicEvent;

/* An event that arrives from outside; its payload stands in u. */
typedef struct {
    const char *name;
    ModelFunction jump; /* (t, x, u, p) -> x */
    int payload;        /* position of its payload in u */
    int payload_count;
    int verdict;        /* position in x of what the model made of it, see `Verdict`; -1 where it uses every one */
} TriggeredEvent;

/* What parameters and start values must fulfil. */
#define MOST_NAMED 4
typedef struct {
    const char *text; /* what is said where they do not */
    int named_count;
    int named[MOST_NAMED]; /* positions in p, then x, of the parameters and states that it names */
} Requirement;

/* A vector parameter that is read from a column of a CSV file among the FMU's resources. */
typedef struct {
    const char *file;
    const char *column;
    int parameter; /* position of its first entry in p */
    int count;     /* entries */
} Resource;

/* What a variable is, which decides where its value lies and when it may be set. */
typedef enum {
    ROLE_TIME,
    ROLE_INPUT,
    ROLE_PAYLOAD, /* input that belongs to a triggered event */
    ROLE_OUTPUT,
    ROLE_INTEGER_OUTPUT, /* kept as a double, a whole number to the outside */
    ROLE_STATE,
    ROLE_FIXED,   /* parameter, fixed after initialisation */
    ROLE_TUNABLE, /* parameter, may change between steps */
    ROLE_COUNT,      /* integer that announces an event when it is raised */
    ROLE_CLOCK,      /* FMI 3: triggered input clock */
    ROLE_STAMP,      /* instant of an event */
    ROLE_POLICY,     /* enumeration: what to do with late events */
    ROLE_HORIZON,    /* how far back late events can be replayed [s] */
    ROLE_OUTCOME,    /* integer: how many events have come to an `Outcome` so far */
    ROLE_DERIVATIVE, /* of a continuous state */
    ROLE_INDICATOR   /* event indicator of a state with dry friction, or switching function */
} Role;

typedef struct {
    const char *name;
    Role role;
    int index; /* position in u, y, x, p, derivatives, indicators or outcomes, or number of the triggered event */
} Variable;

/* What to do with an event stamped before the current time; the numbers of the enumeration in the model description. */
typedef enum { LATE_REPLAY = 1, LATE_REJECT = 2, LATE_LATE = 3 } LatePolicy;

/* What became of an event, in the order of the variables that count them: it took effect; of these, late at its stamp, and late
   when it was announced; it was too late; it was announced and never seen; of the first, doubted by the model; doubted and kept out. */
typedef enum { OUTCOME_ACCEPTED, OUTCOME_REPLAYED, OUTCOME_LATE, OUTCOME_REJECTED, OUTCOME_LOST, OUTCOME_DOUBTED, OUTCOME_IGNORED, OUTCOMES } Outcome;

/* What the model made of an event; the numbers of its memory. */
typedef enum { VERDICT_USED, VERDICT_DOUBTED, VERDICT_IGNORED } Verdict;

typedef struct {
    const char *name;
    const char *token; /* GUID (FMI 2) or instantiation token (FMI 3) */
    int states;        /* length of x: continuous states, then memory */
    int continuous;    /* of these, the continuous ones */
    int inputs;        /* length of u: inputs, payloads, noises */
    int own_inputs;    /* of these, the inputs proper, which come first */
    int noise_offset;  /* position of the first noise in u */
    int outputs;       /* length of y */
    int parameters;    /* length of p */
    int internal_step; /* position in p */
    int seed;          /* position in p, or -1 where there is no noise */
    uint32_t purpose;  /* of what is drawn, see `Purpose` in `noise.py` */
    int integer_work;  /* length of iw */
    int real_work;     /* length of w */
    const double *start_x;
    const double *start_u;
    const double *start_p;
    ModelFunction step;   /* (t, h, x, u, p) -> continuous states, and how many switches change on the way; or NULL where nothing
                             flows */
    ModelFunction output; /* (t, x, u, p) -> y, or NULL without outputs */
    int periodic_count;
    const PeriodicEvent *periodic;
    int triggered_count;
    const TriggeredEvent *triggered;
    bool counts_events;    /* events are announced by counts, not by clocks */
    LatePolicy late_policy; /* start values of the parameters of the same name */
    double replay_horizon;
    int communication_count;
    const ModelFunction *communications; /* jumps at the end of every communication step: (t, x, u, p) -> x */
    int resource_count;
    const Resource *resources;
    int friction_count;
    const int *frictions;           /* positions in x of the states with dry friction */
    int switching_count;    /* switching functions: the switch of one is 1 where it is not negative, else 0 */
    ModelFunction balance;  /* (t, x, u, p, s) -> what drives the states with dry friction, what holds them, then the switching
                               functions; s the signs of these states, then the switches; or NULL where there are none */
    ModelFunction derivative; /* (t, x, u, p, s) -> derivatives of the continuous states; or NULL where nothing flows */
    ModelFunction tangent;    /* (t, x, u, p, s, dt, dx, du, dp) -> dy, then d derivative; or NULL where both are empty */
    unsigned first_reference; /* value reference of the first variable; the others count up from there */
    int requirement_count;
    int lasting_count; /* how many of them, the first, are not about start values alone */
    const Requirement *requirements;
    ModelFunction fulfilled; /* (x, p) -> 1 for each requirement that is fulfilled; or NULL without any */
    unsigned variable_count;
    const Variable *variables;
} Model;

PRIVATE const Model model; /* defined in model.c */

#endif
