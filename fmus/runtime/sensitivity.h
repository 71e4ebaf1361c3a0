/* Directional derivatives: how outputs and derivatives change with time, inputs, states and parameters, exactly. */
#ifndef SENSITIVITY_H
#define SENSITIVITY_H

#include "instance.h"

/* For every unknown the sum of its partial derivatives by the knowns, each times its seed. Dry friction is held as it is. Refused
   by name: an unknown that is no real output or derivative; a known that is not time, a real input, state or parameter. */
PRIVATE Status sensitivity_directional(Instance *instance, const char *function, const unsigned *unknowns, size_t unknown_count,
                                       const unsigned *knowns, size_t known_count, const double *seed, double *sensitivity);

#endif
