/* Resources: vector parameters that are read from CSV files in the FMU's folder of resources, at instantiation.

   A file has a header line; the numbers of the column that belongs to the parameter increase from row to row. Where a file is
   missing the start values stand; where one is wrong, instantiation fails with a message that names file and line. */
#ifndef RESOURCE_H
#define RESOURCE_H

#include "instance.h"

/* Number of doubles that an instance keeps, so that a reset finds the files' values again. */
PRIVATE size_t resource_length(void);

/* Read all files into `instance->resource_values` and apply them. `location` is the URI of the folder of resources (FMI 2) or
   its path (FMI 3), or NULL where the importer gives none. */
PRIVATE Status resource_load(Instance *instance, const char *location);

/* The values read become start values of the parameters. */
PRIVATE void resource_apply(Instance *instance);

#endif
