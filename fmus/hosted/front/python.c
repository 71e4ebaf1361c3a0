/* Python: found in this process, or brought into it. */
#include "front.h"

typedef int PyIsInitialized(void);
typedef void PyInitializeEx(int signals);
typedef void *PySaveThread(void);
typedef int PyGILStateEnsure(void);
typedef void PyGILStateRelease(int held);

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
