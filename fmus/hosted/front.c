/* The front of a Python-hosted FMU: the FMI 2.0 functions, handed on to the library of pythonfmu in resources/.

   pythonfmu can only be loaded into a process that has Python already, answers every failure with fmi2Fatal, checks neither GUID nor
   type, leaves broken references behind when Python raises, and destroys its own state twice at the end of the process. So this file
   brings Python in where it is missing and ends that state in time, and the Python side (slave.py) never raises: it reports a failure
   as a log message with status fmi2Error, and the call that caused it returns fmi2Error. */
#include "fmi2Functions.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

#include "hosted_model.h"

#define TEXT_SIZE 4096

typedef struct {
    fmi2InstantiateTYPE *Instantiate;
    fmi2FreeInstanceTYPE *FreeInstance;
    fmi2SetupExperimentTYPE *SetupExperiment;
    fmi2EnterInitializationModeTYPE *EnterInitializationMode;
    fmi2ExitInitializationModeTYPE *ExitInitializationMode;
    fmi2TerminateTYPE *Terminate;
    fmi2ResetTYPE *Reset;
    fmi2GetRealTYPE *GetReal;
    fmi2GetIntegerTYPE *GetInteger;
    fmi2GetBooleanTYPE *GetBoolean;
    fmi2GetStringTYPE *GetString;
    fmi2SetRealTYPE *SetReal;
    fmi2SetIntegerTYPE *SetInteger;
    fmi2SetBooleanTYPE *SetBoolean;
    fmi2SetStringTYPE *SetString;
    fmi2GetFMUstateTYPE *GetFMUstate;
    fmi2SetFMUstateTYPE *SetFMUstate;
    fmi2FreeFMUstateTYPE *FreeFMUstate;
    fmi2SerializedFMUstateSizeTYPE *SerializedFMUstateSize;
    fmi2SerializeFMUstateTYPE *SerializeFMUstate;
    fmi2DeSerializeFMUstateTYPE *DeSerializeFMUstate;
    fmi2DoStepTYPE *DoStep;
    fmi2GetRealStatusTYPE *GetRealStatus;
} Library;

typedef struct {
    Library library;
    void *handle;
    void *python;
    fmi2Component component;
    fmi2CallbackFunctions callbacks; /* what pythonfmu gets: its messages come back to `hear` */
    const fmi2CallbackFunctions *importer;
    fmi2ComponentEnvironment environment;
    char *name;
    bool failed;    /* the running call reported an error */
    bool discarded; /* the last step was */
    bool on;        /* debug logging */
} Front;

/* -- messages ---------------------------------------------------------------------------------------------------- */

static void tell(const Front *front, fmi2Status status, const char *category, const char *text) {
    if (front->importer == NULL || front->importer->logger == NULL)
        return;
    /* Many importers show the format as it is and never look at the arguments after it. */
    if (strchr(text, '%') == NULL)
        front->importer->logger(front->environment, front->name, status, category, text);
    else
        front->importer->logger(front->environment, front->name, status, category, "%s", text);
}

static fmi2Status fail(Front *front, const char *format, ...) {
    char text[TEXT_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    front->failed = true;
    tell(front, fmi2Error, "logStatusError", text);
    return fmi2Error;
}

static void hear(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...) {
    (void)name, (void)category;
    Front *front = environment;
    if (status >= fmi2Error)
        fail(front, "%s", message); /* pythonfmu hands over finished text, without arguments */
    else if (status != fmi2OK)
        tell(front, status, status == fmi2Discard ? "logStatusDiscard" : "logStatusWarning", message);
    else if (front->on)
        tell(front, status, "logEvents", message);
}

/* -- Python and pythonfmu ---------------------------------------------------------------------------------------- */

typedef void (*Function)(void);
typedef int PyIsInitialized(void);
typedef void PyInitializeEx(int signals);
typedef void *PySaveThread(void);
typedef int PyGILStateEnsure(void);
typedef void PyGILStateRelease(int held);

static Function symbol(void *handle, const char *name) {
#ifdef _WIN32
    return (Function)(void *)GetProcAddress(handle, name);
#else
    Function function = NULL;
    void *found = dlsym(handle, name);
    memcpy(&function, &found, sizeof function); /* C knows no cast from an object to a function */
    return function;
#endif
}

static void *open_library(const char *path, bool for_all) {
#ifdef _WIN32
    (void)for_all;
    return LoadLibraryExA(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
#else
    return dlopen(path, RTLD_NOW | (for_all ? RTLD_GLOBAL : RTLD_LOCAL));
#endif
}

static void close_library(void *handle) {
    if (handle == NULL)
        return;
#ifdef _WIN32
    FreeLibrary(handle);
#else
    dlclose(handle);
#endif
}

static void *find_loaded_python(void) {
#ifdef _WIN32
    return GetModuleHandleA("python3.dll");
#else
    void *process = dlopen(NULL, RTLD_NOW);
    return process != NULL && dlsym(process, "Py_IsInitialized") != NULL ? process : NULL;
#endif
}

/* A library that the user names, else the version this FMU was built with, else another one. */
static void *load_python(void) {
    const char *wanted = getenv("FMU_OBSERVER_LIBPYTHON");
    if (wanted != NULL && *wanted != '\0')
        return open_library(wanted, true);
#ifdef _WIN32
    return open_library("python3.dll", true);
#else
    for (int turn = HOSTED_OLDEST_MINOR - 1; turn <= HOSTED_OLDEST_MINOR + 9; turn++) {
        char name[64];
        snprintf(name, sizeof name, "libpython3.%d.so.1.0", turn < HOSTED_OLDEST_MINOR ? HOSTED_BUILT_MINOR : turn);
        void *python = open_library(name, true);
        if (python != NULL)
            return python;
    }
    return NULL;
#endif
}

static fmi2Status start_python(Front *front) {
    void *python = find_loaded_python();
    if (python == NULL)
        python = load_python();
    front->python = python;
    if (python == NULL)
        return fail(front,
                    "fmi2Instantiate: this FMU runs Python code, and there is no Python in this process and no library of Python 3.%d was found. "
                    "Set the environment variable FMU_OBSERVER_LIBPYTHON to the path of one (libpython3.*.so.1.0, python3.dll), and PYTHONPATH to "
                    "the folder in which the package fmu-observer is installed.",
                    HOSTED_BUILT_MINOR);
    PyIsInitialized *is_initialized = (PyIsInitialized *)symbol(python, "Py_IsInitialized");
    PyInitializeEx *initialize = (PyInitializeEx *)symbol(python, "Py_InitializeEx");
    PySaveThread *save_thread = (PySaveThread *)symbol(python, "PyEval_SaveThread");
    if (is_initialized == NULL || initialize == NULL || save_thread == NULL)
        return fail(front, "fmi2Instantiate: FMU_OBSERVER_LIBPYTHON names a library that is not Python's.");
    if (!is_initialized()) {
        initialize(0); /* here and not in pythonfmu, which would end Python with its library; NumPy cannot be started twice */
        save_thread();
    }
    return fmi2OK;
}

/* pythonfmu keeps a state for ending Python, and destroys it twice when the library goes. There is nothing to end here: Python was
   running before. So the state is given up at once. Python's lock keeps other threads from the state meanwhile. */
static void make_component(Front *front, const char *resources, fmi2Boolean visible) {
    PyGILStateEnsure *ensure = (PyGILStateEnsure *)symbol(front->python, "PyGILState_Ensure");
    PyGILStateRelease *release = (PyGILStateRelease *)symbol(front->python, "PyGILState_Release");
    Function give_up = symbol(front->handle, "finalizePythonInterpreter");
    int held = ensure();
    front->component =
        front->library.Instantiate(front->name, fmi2CoSimulation, HOSTED_GUID, resources, &front->callbacks, visible, fmi2True);
    if (give_up != NULL)
        give_up();
    release(held);
}

#define LOOK_UP(function) \
    complete = (front->library.function = (fmi2##function##TYPE *)symbol(front->handle, "fmi2" #function)) != NULL && complete

static fmi2Status load_pythonfmu(Front *front, const char *resources) {
    char path[TEXT_SIZE];
    snprintf(path, sizeof path, "%s/" HOSTED_LIBRARY, resources);
    front->handle = open_library(path, false);
    if (front->handle == NULL)
        return fail(front, "fmi2Instantiate: the library %s cannot be loaded; is fmuResourceLocation the folder of this FMU?", path);
    bool complete = true;
    LOOK_UP(Instantiate);
    LOOK_UP(FreeInstance);
    LOOK_UP(SetupExperiment);
    LOOK_UP(EnterInitializationMode);
    LOOK_UP(ExitInitializationMode);
    LOOK_UP(Terminate);
    LOOK_UP(Reset);
    LOOK_UP(GetReal);
    LOOK_UP(GetInteger);
    LOOK_UP(GetBoolean);
    LOOK_UP(GetString);
    LOOK_UP(SetReal);
    LOOK_UP(SetInteger);
    LOOK_UP(SetBoolean);
    LOOK_UP(SetString);
    LOOK_UP(GetFMUstate);
    LOOK_UP(SetFMUstate);
    LOOK_UP(FreeFMUstate);
    LOOK_UP(SerializedFMUstateSize);
    LOOK_UP(SerializeFMUstate);
    LOOK_UP(DeSerializeFMUstate);
    LOOK_UP(DoStep);
    LOOK_UP(GetRealStatus);
    return complete ? fmi2OK : fail(front, "fmi2Instantiate: the library %s is not the one of pythonfmu.", path);
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9')
        return c - '0';
    c |= 32;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The path in a file URI: without scheme and host, %20 and the like decoded. */
static void path_of(const char *uri, char *path, size_t size) {
    if (strncmp(uri, "file:", 5) == 0) {
        uri += 5;
        if (strncmp(uri, "//", 2) == 0) {
            const char *root = strchr(uri + 2, '/');
            uri = root != NULL ? root : uri + 2;
        }
#ifdef _WIN32
        uri += *uri == '/'; /* file:///C:/folder */
#endif
    }
    size_t used = 0;
    for (; *uri != '\0' && used + 1 < size; uri++) {
        if (uri[0] == '%' && hex_digit(uri[1]) >= 0 && hex_digit(uri[2]) >= 0) {
            path[used++] = (char)(16 * hex_digit(uri[1]) + hex_digit(uri[2]));
            uri += 2;
        } else {
            path[used++] = *uri;
        }
    }
    path[used] = '\0';
}

/* -- life -------------------------------------------------------------------------------------------------------- */

static void front_free(Front *front) {
    if (front->component != NULL)
        front->library.FreeInstance(front->component);
    close_library(front->handle);
    free(front->name);
    free(front);
}

static Front *front_create(fmi2String name, const fmi2CallbackFunctions *functions, fmi2Boolean logging) {
    Front *front = calloc(1, sizeof *front);
    if (front == NULL)
        return NULL;
    const char *shown = name != NULL && *name != '\0' ? name : HOSTED_NAME;
    front->name = malloc(strlen(shown) + 1);
    if (front->name == NULL) {
        free(front);
        return NULL;
    }
    strcpy(front->name, shown);
    front->importer = functions;
    front->environment = functions != NULL ? functions->componentEnvironment : NULL;
    front->callbacks.logger = hear;
    front->callbacks.allocateMemory = calloc;
    front->callbacks.freeMemory = free;
    front->callbacks.componentEnvironment = front;
    front->on = logging;
    return front;
}

/* What Python reported by now: pythonfmu hands messages on at the end of most calls, but not at instantiation and reset. */
static fmi2Status heard(Front *front) {
    front->library.GetInteger(front->component, NULL, 0, NULL);
    return front->failed ? fmi2Error : fmi2OK;
}

static fmi2Status instantiate(Front *front, fmi2Type type, fmi2String guid, fmi2String location, fmi2Boolean visible) {
    if (type != fmi2CoSimulation)
        return fail(front, "fmi2Instantiate: this FMU is for co-simulation only.");
    if (guid == NULL || strcmp(guid, HOSTED_GUID) != 0)
        return fail(front, "fmi2Instantiate: GUID " HOSTED_GUID " was expected, %s was given; library and modelDescription.xml do not belong together.",
                    guid != NULL ? guid : "none");
    if (location == NULL)
        return fail(front, "fmi2Instantiate: fmuResourceLocation is missing; the Python code lies there.");
    char resources[TEXT_SIZE / 2];
    path_of(location, resources, sizeof resources);
    if (start_python(front) != fmi2OK || load_pythonfmu(front, resources) != fmi2OK)
        return fmi2Error;
    make_component(front, resources, visible);
    return front->component != NULL ? heard(front) : fmi2Error;
}

const char *fmi2GetTypesPlatform(void) {
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void) {
    return fmi2Version;
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID, fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean loggingOn) {
    Front *front = front_create(instanceName, functions, loggingOn);
    if (front == NULL || instantiate(front, fmuType, fmuGUID, fmuResourceLocation, visible) == fmi2OK)
        return front;
    front_free(front);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c != NULL)
        front_free(c);
}

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories, const fmi2String categories[]) {
    (void)nCategories, (void)categories;
    if (c == NULL)
        return fmi2Error;
    ((Front *)c)->on = loggingOn;
    return fmi2OK;
}

/* -- calls handed on --------------------------------------------------------------------------------------------- */

static fmi2Status status_of(const Front *front, fmi2Status status) {
    return front->failed || status > fmi2Error ? fmi2Error : status;
}

#define HAND_ON(c, call)                          \
    do {                                          \
        Front *front = (c);                       \
        if (front == NULL)                        \
            return fmi2Error;                     \
        front->failed = false;                    \
        fmi2Status status = front->library.call;  \
        return status_of(front, status);          \
    } while (0)

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    HAND_ON(c, SetupExperiment(front->component, toleranceDefined, tolerance, startTime, stopTimeDefined, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    HAND_ON(c, EnterInitializationMode(front->component));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    HAND_ON(c, ExitInitializationMode(front->component));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    HAND_ON(c, Terminate(front->component));
}

fmi2Status fmi2Reset(fmi2Component c) {
    Front *front = c;
    if (front == NULL)
        return fmi2Error;
    front->failed = front->discarded = false;
    fmi2Status status = front->library.Reset(front->component);
    return status == fmi2OK ? heard(front) : fmi2Error;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    HAND_ON(c, GetReal(front->component, vr, nvr, value));
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    HAND_ON(c, GetInteger(front->component, vr, nvr, value));
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    HAND_ON(c, GetBoolean(front->component, vr, nvr, value));
}

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2String value[]) {
    HAND_ON(c, GetString(front->component, vr, nvr, value));
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    HAND_ON(c, SetReal(front->component, vr, nvr, value));
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer value[]) {
    HAND_ON(c, SetInteger(front->component, vr, nvr, value));
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    HAND_ON(c, SetBoolean(front->component, vr, nvr, value));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2String value[]) {
    HAND_ON(c, SetString(front->component, vr, nvr, value));
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint, fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    Front *front = c;
    if (front == NULL)
        return fmi2Error;
    front->failed = false;
    fmi2Status status = status_of(front, front->library.DoStep(front->component, currentCommunicationPoint, communicationStepSize,
                                                               noSetFMUStatePriorToCurrentPoint));
    front->discarded = status == fmi2Discard;
    return status;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    HAND_ON(c, GetRealStatus(front->component, s, value));
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (c == NULL || value == NULL || s != fmi2Terminated)
        return fmi2Error;
    *value = ((Front *)c)->discarded;
    return fmi2OK;
}

/* -- state ------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Front *front = c;
    if (front == NULL)
        return fmi2Error;
    if (FMUstate == NULL || *FMUstate == NULL)
        return fmi2OK;
    fmi2Status status = front->library.FreeFMUstate(front->component, FMUstate);
    *FMUstate = NULL;
    return status;
}

/* FMI 2.0 reuses a state that is handed in; here it is exchanged for a new one. */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    Front *front = c;
    if (front == NULL || FMUstate == NULL)
        return fmi2Error;
    front->failed = false;
    fmi2FMUstate saved = NULL;
    fmi2Status status = status_of(front, front->library.GetFMUstate(front->component, &saved));
    if (status == fmi2OK) {
        fmi2FreeFMUstate(c, FMUstate);
        *FMUstate = saved;
    }
    return status;
}

static fmi2Status need_state(Front *front, const void *state, const char *function) {
    return state != NULL ? fmi2OK : fail(front, "%s: there is no FMU state.", function);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    if (c == NULL || need_state(c, FMUstate, __func__) != fmi2OK)
        return fmi2Error;
    ((Front *)c)->discarded = false;
    HAND_ON(c, SetFMUstate(front->component, FMUstate));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    if (c == NULL || size == NULL || need_state(c, FMUstate, __func__) != fmi2OK)
        return fmi2Error;
    Front *front = c;
    front->failed = false;
    fmi2Status status = front->library.SerializedFMUstateSize(front->component, FMUstate, size);
    return status == fmi2OK ? heard(front) : fmi2Error;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate, fmi2Byte serializedState[], size_t size) {
    size_t needed = 0;
    if (fmi2SerializedFMUstateSize(c, FMUstate, &needed) != fmi2OK)
        return fmi2Error;
    if (serializedState == NULL || size < needed) /* pythonfmu would read beyond the end */
        return fail(c, "%s: the state needs %zu bytes, there is room for %zu.", __func__, needed, size);
    HAND_ON(c, SerializeFMUstate(front->component, FMUstate, serializedState, needed));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size, fmi2FMUstate *FMUstate) {
    Front *front = c;
    if (front == NULL || serializedState == NULL || FMUstate == NULL)
        return fmi2Error;
    front->failed = false;
    fmi2FMUstate made = NULL;
    fmi2Status status = front->library.DeSerializeFMUstate(front->component, serializedState, size, &made);
    if (status != fmi2OK)
        return fmi2Error;
    *FMUstate = made;
    return heard(front);
}

/* -- not supported ----------------------------------------------------------------------------------------------- */

#define REFUSE(c) return (c) == NULL ? fmi2Error : fail((c), "%s: not supported by a Python-hosted FMU.", __func__)

fmi2Status fmi2CancelStep(fmi2Component c) {
    REFUSE(c);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    (void)s, (void)value;
    REFUSE(c);
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s, (void)value;
    REFUSE(c);
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    (void)s, (void)value;
    REFUSE(c);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                       const fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    REFUSE(c);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Integer order[],
                                        fmi2Real value[]) {
    (void)vr, (void)nvr, (void)order, (void)value;
    REFUSE(c);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[], size_t nUnknown,
                                        const fmi2ValueReference vKnown_ref[], size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    (void)vUnknown_ref, (void)nUnknown, (void)vKnown_ref, (void)nKnown, (void)dvKnown, (void)dvUnknown;
    REFUSE(c);
}
