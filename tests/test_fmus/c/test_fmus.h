/* What every test FMU consists of, whatever its FMI version. Knows no FMI function.
 *
 * A model is one C file. It defines `Model` (everything a saved state holds), `Scratch` (what is remembered for speed only), and
 * the functions below; then it includes `face.h`, which puts the functions of one FMI version around it. `config.h` is generated:
 * FMI_VERSION, MODEL_IDENTIFIER, TOKEN, the capabilities, and the numbers of the model.
 *
 *   void model_start(Model *)                            the declared start values
 *   void model_begin(Model *, double t0)                 initialisation ends at t0
 *   Slot model_slot(Model *, unsigned reference)         where a variable lies; `at` is NULL where there is none
 *   void model_refresh(Model *)                          outputs follow inputs and states, before they are read
 *   Outcome model_step(Model *, Host *, double t, double until)
 *   Update model_update(Model *, const Host *, double t) one super-dense instant of an event
 *
 * Optional, announced by HAS_...: model_slope (INPUT_DERIVATIVES), model_rate (OUTPUT_DERIVATIVES), model_sensitivity
 * (DIRECTIONAL), model_interval (INTERVALS), model_resize (STRUCTURE). With TAKES_TOLERANCE:
 *
 *   bool model_tolerance(Model *, double tolerance)      told at set-up, 0 where none is; false refuses it
 */
#ifndef ZOO_H
#define ZOO_H

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config.h"

typedef enum { F64, F32, I8, U8, I16, U16, I32, U32, I64, U64, BOOL, TEXT, BLOB, CLOCK } Kind;
typedef enum { PARAMETER, STRUCTURAL, INPUT, CLOCKED_INPUT, INPUT_CLOCK, OUTPUT, OUTPUT_CLOCK } Role;

typedef struct {
    char text[256];
} Text; /* the value of a String */

typedef struct {
    size_t size;
    unsigned char bytes[248];
} Blob; /* the value of a Binary */

typedef struct {
    Kind kind;
    Role role;
    void *at;    /* first of the values; bool for BOOL and CLOCK */
    size_t size; /* number of values */
    const bool *clock; /* CLOCKED_INPUT: the clock that must be active; NULL: any time */
} Slot;

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status; /* the numbers of FMI 1, 2 and 3 */

typedef struct {
    Status status;
    double reached;  /* `until`, unless the model stops on the way */
    bool event;      /* event mode is needed at `reached` */
    bool terminate;
    bool early;      /* what the model says; the faces pass it on */
    double lag;      /* FMI 3: by how much lastSuccessfulTime, without an early return, lies before `reached` */
} Outcome;

typedef struct {
    bool again; /* discreteStatesNeedUpdate */
    bool terminate;
    bool has_next;
    double next; /* nextEventTime */
} Update;

typedef enum { NOT_YET_KNOWN, UNCHANGED, CHANGED } Qualifier; /* fmi3IntervalQualifier */

#endif
