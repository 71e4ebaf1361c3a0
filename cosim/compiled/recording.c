/* A recording as a slave of FMI 3: rows of columns over time. The rules of `Recording.at` and `RecordingSlave`. Part of `stepper.c`.

   What it says depends on the time alone, so Python may step it again at any time. Its time events are not for the stepper: a chunk ends
   before the step in which one lies. */
#include "stepper.h"

/* The row at or before `t`, the last one of several; -1 where there is none. The search goes on from where it ended last. */
static int64_t row_at(Recording *recording, double t) {
    const double *time = recording->time;
    int64_t row = recording->row;
    while (row >= 0 && time[row] > t)
        row--;
    while (row + 1 < recording->row_count && time[row + 1] <= t)
        row++;
    recording->row = row < 0 ? 0 : row;
    return row;
}

/* The columns at `t` [s], into `values`; of several rows of this time those of the first one where it is to be `before` them. False
   outside of the recording. */
static bool recorded_at(Recording *recording, double t, bool before, double *values) {
    const double *time = recording->time;
    const int64_t width = recording->column_count;
    int64_t row = row_at(recording, t + TIME_TOLERANCE);
    if (row < 0 || (row == recording->row_count - 1 && t > time[row] + TIME_TOLERANCE))
        return false;
    const bool on_row = time[row] >= t - TIME_TOLERANCE;
    while (on_row && before && row > 0 && time[row - 1] >= t - TIME_TOLERANCE)
        row--;
    const double *here = recording->rows + row * width;
    memcpy(values, here, (size_t)width * sizeof(double));
    if (on_row)
        return true;
    const double *following = here + width, share = (t - time[row]) / (time[row + 1] - time[row]);
    for (int64_t i = 0; i < width; i++)
        if (!recording->held[i])
            values[i] = here[i] + share * (following[i] - here[i]);
    return true;
}

/* One column, wherever a component stands; it ends with the last row. As `ColumnCourse`. */
static double column_at(Recording *recording, int64_t column, double t, bool before) {
    const double *time = recording->time, end = time[recording->row_count - 1];
    const double *values = recording->rows + column;
    const int64_t width = recording->column_count;
    t = end < t ? end : t;
    int64_t row = row_at(recording, t + TIME_TOLERANCE);
    row = row < 0 ? 0 : row;
    if (time[row] >= t - TIME_TOLERANCE) {
        while (before && row > 0 && time[row - 1] >= t - TIME_TOLERANCE)
            row--;
        return values[row * width];
    }
    double here = values[row * width], share = (t - time[row]) / (time[row + 1] - time[row]);
    return recording->held[column] ? here : here + share * (values[(row + 1) * width] - here);
}

/* Its mean from `t` to `until` [s]: exact for lines, whatever rows lie between. */
static double column_mean(Recording *recording, int64_t column, double t, double until) {
    const double *time = recording->time;
    double since = t, value = column_at(recording, column, t, false), last = column_at(recording, column, until, true);
    if (until > time[recording->row_count - 1] || until - t <= 2.0 * TIME_TOLERANCE)
        return 0.5 * (value + last);
    int64_t row = row_at(recording, t + TIME_TOLERANCE);
    while (row >= 0 && time[row] >= t + TIME_TOLERANCE)
        row--;
    double total = -0.0; /* which is nothing added to any number */
    for (row++; row < recording->row_count && time[row] < until - TIME_TOLERANCE; row++) {
        double following = recording->rows[row * recording->column_count + column];
        total += (time[row] - since) * (0.5 * (following + value));
        since = time[row];
        value = following;
    }
    return (total + (until - since) * (0.5 * (last + value))) / (until - t);
}

static int go_to(Recording *recording, double t, bool before) {
    if (!recorded_at(recording, t, before, recording->values))
        return STATUS_ERROR;
    recording->stands[0] = t;
    recording->stands[1] = before;
    return 0;
}

EXPORTED int recording_step(void *instance, double t, double h, bool no_set_state, bool *event, bool *terminate, bool *early, double *reached) {
    (void)no_set_state;
    *event = *terminate = *early = false;
    *reached = t + h;
    return go_to(instance, t + h, true);
}

EXPORTED int recording_get_reals(void *instance, const uint32_t *references, size_t count, double *values, size_t value_count) {
    const Recording *recording = instance;
    (void)value_count;
    for (size_t i = 0; i < count; i++)
        values[i] = recording->values[references[i] - 1];
    return 0;
}

EXPORTED int recording_get_integers(void *instance, const uint32_t *references, size_t count, int32_t *values, size_t value_count) {
    const Recording *recording = instance;
    (void)value_count;
    for (size_t i = 0; i < count; i++)
        values[i] = (int32_t)recording->values[references[i] - 1];
    return 0;
}

/* One state at a time: the stepper saves it where a step over a balise begins. */
EXPORTED int recording_save(void *instance, void **state) {
    Recording *recording = instance;
    memcpy(recording->saved, recording->stands, sizeof(recording->saved));
    *state = recording->saved;
    return 0;
}

EXPORTED int recording_restore(void *instance, void *state) {
    const double *saved = state;
    return go_to(instance, saved[0], saved[1] != 0.0);
}

EXPORTED int recording_release(void *instance, void **state) {
    (void)instance;
    *state = NULL;
    return 0;
}
