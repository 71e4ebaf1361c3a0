/* The functions of FMI 1, 2 and 3 that cross from one process to the other: one line each with version, part, name, and what its arguments
   are. Knows nothing of memory or processes.

   c  the instance                        i b z d  by value: 32 bits, 8 bits, size_t, double
   s  a text                              h  a saved state; H  where one is returned
   <  an array that is read, > one that is filled: each with the size of an element (1 2 4 8 bytes, g for 16, w for 32) and the number of the
      argument that counts it, or . for one
   S  texts that are read, G texts that are returned, X and Y the same of byte strings whose lengths are the argument before
   e  the environment; k l u C L U  callbacks: the structure of FMI 1 and 2, logMessage, intermediateUpdate, clockUpdate, lock, unlock
 */

typedef enum {
    CALL, TEXT, SET, GET, STEP, STARTED, ENDED, INSTANTIATE, FREE,
} Part; /* STARTED: from here on sets may wait for the call behind them. ENDED: no longer */

#define GET12(version, name, size) F(version, GET, name, "c<42z>" size "2")
#define SET12(version, name, size) F(version, SET, name, "c<42z<" size "2")
#define BOTH3(name, size) \
    F(3, GET, fmi3Get##name, "c<42z>" size "4z") \
    F(3, SET, fmi3Set##name, "c<42z<" size "4z")

#define FMI1_FUNCTIONS \
    F(1, TEXT, fmiGetVersion, "") \
    F(1, TEXT, fmiGetTypesPlatform, "") \
    F(1, TEXT, fmiGetModelTypesPlatform, "") \
    F(1, FREE, fmiFreeSlaveInstance, "c") \
    F(1, FREE, fmiFreeModelInstance, "c") \
    F(1, CALL, fmiSetDebugLogging, "cb") \
    GET12(1, fmiGetReal, "8") \
    GET12(1, fmiGetInteger, "4") \
    GET12(1, fmiGetBoolean, "1") \
    SET12(1, fmiSetReal, "8") \
    SET12(1, fmiSetInteger, "4") \
    SET12(1, fmiSetBoolean, "1") \
    F(1, CALL, fmiGetString, "c<42zG2") \
    F(1, CALL, fmiSetString, "c<42zS2") \
    F(1, STARTED, fmiInitializeSlave, "cdbd") \
    F(1, ENDED, fmiTerminateSlave, "c") \
    F(1, ENDED, fmiResetSlave, "c") \
    F(1, CALL, fmiSetRealInputDerivatives, "c<42z<42<82") \
    F(1, CALL, fmiGetRealOutputDerivatives, "c<42z<42>82") \
    F(1, CALL, fmiCancelStep, "c") \
    F(1, STEP, fmiDoStep, "cddb") \
    F(1, CALL, fmiGetStatus, "ci>4.") \
    F(1, CALL, fmiGetRealStatus, "ci>8.") \
    F(1, CALL, fmiGetIntegerStatus, "ci>4.") \
    F(1, CALL, fmiGetBooleanStatus, "ci>1.") \
    F(1, CALL, fmiGetStringStatus, "ciG.") \
    F(1, SET, fmiSetTime, "cd") \
    F(1, SET, fmiSetContinuousStates, "c<82z") \
    F(1, CALL, fmiCompletedIntegratorStep, "c>1.") \
    F(1, STARTED, fmiInitialize, "cbd>g.") \
    F(1, CALL, fmiGetDerivatives, "c>82z") \
    F(1, CALL, fmiGetEventIndicators, "c>82z") \
    F(1, CALL, fmiEventUpdate, "cb>g.") \
    F(1, CALL, fmiGetContinuousStates, "c>82z") \
    F(1, CALL, fmiGetNominalContinuousStates, "c>82z") \
    F(1, CALL, fmiGetStateValueReferences, "c>42z") \
    F(1, ENDED, fmiTerminate, "c")

#define FMI2_FUNCTIONS \
    F(2, TEXT, fmi2GetVersion, "") \
    F(2, TEXT, fmi2GetTypesPlatform, "") \
    F(2, INSTANTIATE, fmi2Instantiate, "sisskii") \
    F(2, FREE, fmi2FreeInstance, "c") \
    F(2, CALL, fmi2SetDebugLogging, "cizS2") \
    F(2, CALL, fmi2SetupExperiment, "ciddid") \
    F(2, CALL, fmi2EnterInitializationMode, "c") \
    F(2, STARTED, fmi2ExitInitializationMode, "c") \
    F(2, ENDED, fmi2Terminate, "c") \
    F(2, ENDED, fmi2Reset, "c") \
    GET12(2, fmi2GetReal, "8") \
    GET12(2, fmi2GetInteger, "4") \
    GET12(2, fmi2GetBoolean, "4") \
    SET12(2, fmi2SetReal, "8") \
    SET12(2, fmi2SetInteger, "4") \
    SET12(2, fmi2SetBoolean, "4") \
    F(2, CALL, fmi2GetString, "c<42zG2") \
    F(2, CALL, fmi2SetString, "c<42zS2") \
    F(2, CALL, fmi2GetFMUstate, "cH") \
    F(2, CALL, fmi2SetFMUstate, "ch") \
    F(2, CALL, fmi2FreeFMUstate, "cH") \
    F(2, CALL, fmi2SerializedFMUstateSize, "ch>8.") \
    F(2, CALL, fmi2SerializeFMUstate, "ch>13z") \
    F(2, CALL, fmi2DeSerializeFMUstate, "c<12zH") \
    F(2, CALL, fmi2GetDirectionalDerivative, "c<42z<44z<84>82") \
    F(2, CALL, fmi2EnterEventMode, "c") \
    F(2, CALL, fmi2NewDiscreteStates, "c>w.") \
    F(2, CALL, fmi2EnterContinuousTimeMode, "c") \
    F(2, CALL, fmi2CompletedIntegratorStep, "ci>4.>4.") \
    F(2, SET, fmi2SetTime, "cd") \
    F(2, SET, fmi2SetContinuousStates, "c<82z") \
    F(2, CALL, fmi2GetDerivatives, "c>82z") \
    F(2, CALL, fmi2GetEventIndicators, "c>82z") \
    F(2, CALL, fmi2GetContinuousStates, "c>82z") \
    F(2, CALL, fmi2GetNominalsOfContinuousStates, "c>82z") \
    F(2, CALL, fmi2SetRealInputDerivatives, "c<42z<42<82") \
    F(2, CALL, fmi2GetRealOutputDerivatives, "c<42z<42>82") \
    F(2, STEP, fmi2DoStep, "cddi") \
    F(2, CALL, fmi2CancelStep, "c") \
    F(2, CALL, fmi2GetStatus, "ci>4.") \
    F(2, CALL, fmi2GetRealStatus, "ci>8.") \
    F(2, CALL, fmi2GetIntegerStatus, "ci>4.") \
    F(2, CALL, fmi2GetBooleanStatus, "ci>4.") \
    F(2, CALL, fmi2GetStringStatus, "ciG.")

#define FMI3_FUNCTIONS \
    F(3, TEXT, fmi3GetVersion, "") \
    F(3, INSTANTIATE, fmi3InstantiateModelExchange, "sssbbel") \
    F(3, INSTANTIATE, fmi3InstantiateCoSimulation, "sssbbbb<48zelu") \
    F(3, INSTANTIATE, fmi3InstantiateScheduledExecution, "sssbbelCLU") \
    F(3, FREE, fmi3FreeInstance, "c") \
    F(3, CALL, fmi3SetDebugLogging, "cbzS2") \
    F(3, CALL, fmi3EnterInitializationMode, "cbddbd") \
    F(3, STARTED, fmi3ExitInitializationMode, "c") \
    F(3, CALL, fmi3EnterEventMode, "c") \
    F(3, ENDED, fmi3Terminate, "c") \
    F(3, ENDED, fmi3Reset, "c") \
    BOTH3(Float32, "4") BOTH3(Float64, "8") \
    BOTH3(Int8, "1") BOTH3(UInt8, "1") BOTH3(Int16, "2") BOTH3(UInt16, "2") \
    BOTH3(Int32, "4") BOTH3(UInt32, "4") BOTH3(Int64, "8") BOTH3(UInt64, "8") \
    BOTH3(Boolean, "1") \
    F(3, CALL, fmi3GetString, "c<42zG4z") \
    F(3, CALL, fmi3SetString, "c<42zS4z") \
    F(3, CALL, fmi3GetBinary, "c<42z>85Y5z") \
    F(3, CALL, fmi3SetBinary, "c<42z<85X5z") \
    F(3, CALL, fmi3GetClock, "c<42z>12") \
    F(3, SET, fmi3SetClock, "c<42z<12") \
    F(3, CALL, fmi3GetNumberOfVariableDependencies, "ci>8.") \
    F(3, CALL, fmi3GetVariableDependencies, "ci>86>46>86>46z") \
    F(3, CALL, fmi3GetFMUState, "cH") \
    F(3, CALL, fmi3SetFMUState, "ch") \
    F(3, CALL, fmi3FreeFMUState, "cH") \
    F(3, CALL, fmi3SerializedFMUStateSize, "ch>8.") \
    F(3, CALL, fmi3SerializeFMUState, "ch>13z") \
    F(3, CALL, fmi3DeserializeFMUState, "c<12zH") \
    F(3, CALL, fmi3GetDirectionalDerivative, "c<42z<44z<86z>88z") \
    F(3, CALL, fmi3GetAdjointDerivative, "c<42z<44z<86z>88z") \
    F(3, ENDED, fmi3EnterConfigurationMode, "c") \
    F(3, CALL, fmi3ExitConfigurationMode, "c") \
    F(3, CALL, fmi3GetIntervalDecimal, "c<42z>82>42") \
    F(3, CALL, fmi3GetIntervalFraction, "c<42z>82>82>42") \
    F(3, CALL, fmi3GetShiftDecimal, "c<42z>82") \
    F(3, CALL, fmi3GetShiftFraction, "c<42z>82>82") \
    F(3, CALL, fmi3SetIntervalDecimal, "c<42z<82") \
    F(3, CALL, fmi3SetIntervalFraction, "c<42z<82<82") \
    F(3, CALL, fmi3SetShiftDecimal, "c<42z<82") \
    F(3, CALL, fmi3SetShiftFraction, "c<42z<82<82") \
    F(3, CALL, fmi3EvaluateDiscreteStates, "c") \
    F(3, CALL, fmi3UpdateDiscreteStates, "c>1.>1.>1.>1.>1.>8.") \
    F(3, CALL, fmi3EnterContinuousTimeMode, "c") \
    F(3, CALL, fmi3CompletedIntegratorStep, "cb>1.>1.") \
    F(3, SET, fmi3SetTime, "cd") \
    F(3, SET, fmi3SetContinuousStates, "c<82z") \
    F(3, CALL, fmi3GetContinuousStateDerivatives, "c>82z") \
    F(3, CALL, fmi3GetEventIndicators, "c>82z") \
    F(3, CALL, fmi3GetContinuousStates, "c>82z") \
    F(3, CALL, fmi3GetNominalsOfContinuousStates, "c>82z") \
    F(3, CALL, fmi3GetNumberOfEventIndicators, "c>8.") \
    F(3, CALL, fmi3GetNumberOfContinuousStates, "c>8.") \
    F(3, CALL, fmi3EnterStepMode, "c") \
    F(3, CALL, fmi3GetOutputDerivatives, "c<42z<42>85z") \
    F(3, STEP, fmi3DoStep, "cddb>1.>1.>1.>8.") \
    F(3, CALL, fmi3ActivateModelPartition, "cid")

/* FMI 1 hands a structure over by value when it instantiates: these two are written out. */
#define FMI1_INSTANTIATE \
    F(1, INSTANTIATE, fmiInstantiateSlave, "ssssdbbbk") \
    F(1, INSTANTIATE, fmiInstantiateModel, "ssbk")

#define UNIFORM_FUNCTIONS FMI1_FUNCTIONS FMI2_FUNCTIONS FMI3_FUNCTIONS
#define ALL_FUNCTIONS UNIFORM_FUNCTIONS FMI1_INSTANTIATE

enum {
#define F(version, part, name, arguments) N_##name,
    ALL_FUNCTIONS
#undef F
    FUNCTION_COUNT,
    N_STOP,   /* behind the last call of a request */
    N_RETURN, /* from a callback */
    N_END,    /* of the process */
};

#define ARGUMENTS_AT_MOST 13
#define DOUBLES_AT_MOST 4

typedef struct {
    char code, size; /* bytes of an element; 0 where there is none */
    int8_t count;    /* the word that counts it; -1 for one */
    uint8_t word;    /* its place among the integers and addresses, or among the doubles */
} Argument;

typedef struct {
    const char *name, *signature;
    int version, part, argument_count;
    Argument arguments[ARGUMENTS_AT_MOST];
} Function;

static Function FUNCTIONS[FUNCTION_COUNT] = {
#define F(version, part, name, arguments) [N_##name] = {#name, arguments, version, part, 0, {{0}}},
    ALL_FUNCTIONS
#undef F
};

static int element_size(char code) {
    return code == 'g' ? 16 : code == 'w' ? 32 : code - '0';
}

/* The number of the argument that counts another becomes the place of its word; doubles have no word. */
static void parse_signature(Function *f) {
    int words = 0, doubles = 0, word_of[ARGUMENTS_AT_MOST] = {0};
    for (const char *at = f->signature; *at != '\0'; at++) {
        Argument *made = &f->arguments[f->argument_count];
        made->code = *at;
        made->count = -1;
        made->word = (uint8_t)(*at == 'd' ? doubles++ : words++);
        word_of[f->argument_count++] = made->word;
        if (*at == 'H')
            made->size = 8;
        if (*at == '<' || *at == '>')
            made->size = (char)element_size(*++at);
        if (strchr("<>SGXY", made->code) != NULL && *++at != '.')
            made->count = (int8_t)(*at - '0');
    }
    for (int k = 0; k < f->argument_count; k++)
        if (f->arguments[k].count >= 0)
            f->arguments[k].count = (int8_t)word_of[(int)f->arguments[k].count];
}

static void parse_signatures(void) {
    for (int k = 0; k < FUNCTION_COUNT; k++)
        parse_signature(&FUNCTIONS[k]);
}
