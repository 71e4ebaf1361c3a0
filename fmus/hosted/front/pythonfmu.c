/* pythonfmu: its library in resources/, and the component it makes. */
#include "front.h"

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
