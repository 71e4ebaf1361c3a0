/* Shared libraries: opened, searched and closed on Windows and elsewhere. */
#include "front.h"

typedef void (*Function)(void);

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
