/* A model exchange instance behind a table of functions, so that a host program uses FMI 2 and FMI 3 alike. All calls return a
   status, except save. */
#ifndef EXCHANGE_H
#define EXCHANGE_H

#include <stddef.h>

typedef struct Model Model;

struct Model {
    int (*enter_initialization)(Model *model);
    int (*exit_initialization)(Model *model);
    int (*set_reals)(Model *model, const unsigned *references, size_t count, const double *values);
    int (*announce)(Model *model, unsigned reference, int count); /* by clock or by count, as the FMU has it */
    int (*update)(Model *model, double *next_time);
    int (*enter_event_mode)(Model *model);
    int (*enter_continuous_time_mode)(Model *model);
    int (*set_time)(Model *model, double t);
    int (*set_states)(Model *model, const double *x, size_t count);
    int (*get_states)(Model *model, double *x, size_t count);
    int (*get_derivatives)(Model *model, double *dx, size_t count);
    int (*get_indicators)(Model *model, double *z, size_t count);
    int (*directional)(Model *model, unsigned unknown, unsigned known, double seed, double *sensitivity);
    int (*do_step)(Model *model, double t, double h);
    size_t (*save)(Model *model, char **bytes); /* bytes: to be freed */
    int (*try_restore)(Model *model, const char *bytes, size_t size);
    void (*close)(Model *model);
};

Model *open_model2(const char *name, const char *library, const char *token, const char *resources);
Model *open_model3(const char *name, const char *library, const char *token, const char *resources);

#endif
