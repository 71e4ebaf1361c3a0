/* FMU states: saved, restored, as bytes. */
#include "front.h"

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
    return status == fmi2OK ? reported(front) : fmi2Error;
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
    return reported(front);
}
