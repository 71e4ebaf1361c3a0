/* The whole FMU as one translation unit, and the only file to compile. Only the functions of FMI are visible outside; define
   FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX to link several FMUs into one program. */
#include "model.c"

#include "noise.c"
#include "switching.c"
#include "runtime.c"
#include "log.c"
#include "journal.c"
#include "replay.c"
#include "instance.c"
#include "variables.c"
#include "events.c"
#include "step.c"
#include "snapshot.c"
#include "resource.c"
#include "exchange.c"
#include "sensitivity.c"

#if FMI_VERSION == 2
#include "fmi2_prefix.h"
#include "fmi2.c"
#else
#include "fmi3.c"
#endif
