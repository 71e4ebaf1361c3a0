/* The functions of FMI 2.0 that the hosts call; included with FUNCTION(name) defined. */
FUNCTION(Instantiate)
FUNCTION(FreeInstance)
FUNCTION(SetupExperiment)
FUNCTION(EnterInitializationMode)
FUNCTION(ExitInitializationMode)
FUNCTION(GetReal)
FUNCTION(SetReal)
FUNCTION(GetInteger)
FUNCTION(SetInteger)
FUNCTION(DoStep)
#include "state_functions_fmi2.h"
FUNCTION(Reset)
FUNCTION(Terminate)
