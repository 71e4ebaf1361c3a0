/* Life: an instance is made, set to log or not, and freed. */
#include "front.h"

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
static fmi2Status reported(Front *front) {
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
    return front->component != NULL ? reported(front) : fmi2Error;
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
