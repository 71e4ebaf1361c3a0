/* The words of FMI 3.0 where versions differ in nothing else: FMI is the prefix of the functions, REAL and INTEGER are both
   types of number and ONE(value) is how one value is handed over, STATE(before, after) names a function for a state,
   FMI_STATE(, ) the type of one and FMI_BYTE that of its bytes. */
#define FMI "fmi3"
#define REAL Float64
#define INTEGER Int32
#define ONE(value) value, 1
#define STATE(before, after) before##FMUState##after
#define FMI_STATE(before, after) fmi3##before##FMUState##after
#define DESERIALIZE DeserializeFMUState
#define FMI_BYTE fmi3Byte
