/* The table by which generated code describes one model to the runtime. No code; no state.

   `model.c` is generated: straight-line functions of the equations and one constant `Model`. Everything else in this
   folder is the same for all models. */
#ifndef MODEL_H
#define MODEL_H

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
} TriggeredEvent;

/* What a variable is, which decides where its value lies and when it may be set. */
typedef enum {
    ROLE_TIME,
    ROLE_INPUT,
    ROLE_PAYLOAD, /* input that belongs to a triggered event */
    ROLE_OUTPUT,
    ROLE_STATE,
    ROLE_FIXED,   /* parameter, fixed after initialisation */
    ROLE_TUNABLE, /* parameter, may change between steps */
    ROLE_COUNT,   /* FMI 2: integer that announces an event when it is raised */
    ROLE_CLOCK,   /* FMI 3: triggered input clock */
    ROLE_STAMP    /* instant of an event */
} Role;

typedef struct {
    const char *name;
    Role role;
    int index; /* position in u, y, x or p, or number of the triggered event */
} Variable;

typedef struct {
    const char *name;
    const char *token; /* GUID (FMI 2) or instantiation token (FMI 3) */
    int states;        /* length of x */
    int inputs;        /* length of u: inputs, payloads, noises */
    int noise_offset;  /* position of the first noise in u */
    int outputs;       /* length of y */
    int parameters;    /* length of p */
    int internal_step; /* position in p */
    int seed;          /* position in p, or -1 where there is no noise */
    int integer_work;  /* length of iw */
    int real_work;     /* length of w */
    const double *start_x;
    const double *start_u;
    const double *start_p;
    ModelFunction step;   /* (t, h, x, u, p) -> x, or NULL where nothing flows */
    ModelFunction output; /* (t, x, u, p) -> y, or NULL without outputs */
    int periodic_count;
    const PeriodicEvent *periodic;
    int triggered_count;
    const TriggeredEvent *triggered;
    unsigned variable_count;
    const Variable *variables; /* by value reference */
} Model;

PRIVATE const Model model; /* defined in model.c */

#endif
