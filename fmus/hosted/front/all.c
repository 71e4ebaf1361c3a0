/* The front of a Python-hosted FMU: the FMI 2.0 functions, handed on to the library of pythonfmu in resources/.

   pythonfmu can only be loaded into a process that has Python already, answers every failure with fmi2Fatal, checks neither GUID nor
   type, leaves broken references behind when Python raises, and destroys its own state twice at the end of the process. So this library
   brings Python in where it is missing and ends that state in time, and the Python side (slave.py) never raises: it reports a failure
   as a log message with status fmi2Error, and the call that caused it returns fmi2Error.

   This is the only file to compile; it includes the others, each of which has one idea. */

#include "messages.c"
#include "libraries.c"
#include "python.c"
#include "pythonfmu.c"
#include "location.c"
#include "life.c"
#include "calls.c"
#include "state.c"
#include "unsupported.c"
