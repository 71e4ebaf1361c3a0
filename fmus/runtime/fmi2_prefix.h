/* The header of FMI 2.0, with its macro for the names of functions as the standard has it: some editions of the header leave out
   FMI2_FUNCTION_PREFIX, by which several FMUs are linked into one program. No code. */
#ifndef FMI2_PREFIX_H
#define FMI2_PREFIX_H

#include "fmi2Functions.h"

#if defined(FMI2_FUNCTION_PREFIX)
#undef fmi2Paste
#undef fmi2PasteB
#undef fmi2FullName
#define fmi2Paste(a, b) a##b
#define fmi2PasteB(a, b) fmi2Paste(a, b)
#define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)
#endif

#endif
