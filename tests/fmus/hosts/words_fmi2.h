/* The words of FMI 2.0 where versions differ in nothing else: FMI is the prefix of the functions, REAL and INTEGER are both
   types of number and ONE(value) is how one value is handed over, STATE(before, after) names a function for a state,
   FMI_STATE(, ) the type of one and FMI_BYTE that of its bytes. */
#define FMI "fmi2"
#define REAL Real
#define INTEGER Integer
#define ONE(value) value
#define STATE(before, after) before##FMUstate##after
#define FMI_STATE(before, after) fmi2##before##FMUstate##after
#define DESERIALIZE DeSerializeFMUstate
#define FMI_BYTE char
