/* The whole FMU as one translation unit, and the only file to compile. Only the functions of FMI are visible outside; define
   FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX to link several FMUs into one program. */
#include "model.c"

#include "noise.c"
#include "runtime.c"
#include "events.c"
#include "instance.c"

#if FMI_VERSION == 2
#include "fmi2.c"
#else
#include "fmi3.c"
#endif
