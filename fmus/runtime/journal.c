/* The journal: see journal.h. Nothing is allocated; nothing here evaluates the model. */
#include "journal.h"

#include <math.h>
#include <string.h>

#define RING_BLOCKS (JOURNAL_CAPACITY / JOURNAL_SPACING + 8) /* room for what one step adds, so that it can be undone */
#define ROUNDING_ULPS 4.0 /* an importer's k*H and the sum t + H at which a step ended differ by so many units in the last place */

/* -- places ------------------------------------------------------------------------------------------------------ */

static bool is_tunable(unsigned i) {
    return model.variables[i].role == ROLE_TUNABLE;
}

static size_t tunable_count(void) {
    size_t count = 0;
    for (unsigned i = 0; i < model.variable_count; i++)
        count += is_tunable(i);
    return count;
}

static size_t stated_length(void) {
    return (size_t)model.own_inputs + tunable_count();
}

static size_t payload_length(void) {
    return runtime_queue_stride() - 2;
}

static size_t record_length(const Journal *journal) {
    return 3 + (size_t)model.own_inputs + (size_t)journal->tunable_count + payload_length();
}

static size_t noise_count(void) {
    return (size_t)(model.inputs - model.noise_offset);
}

static size_t snapshot_length(void) {
    return (size_t)model.states + noise_count() + (size_t)model.periodic_count;
}

static size_t block_length(size_t record) {
    return snapshot_length() + JOURNAL_SPACING * record;
}

PRIVATE size_t journal_length(void) {
    if (model.triggered_count == 0)
        return 0;
    return 2 * RING_BLOCKS * block_length(3 + stated_length() + payload_length()) + stated_length() + tunable_count();
}

PRIVATE void journal_place(Journal *journal, double *numbers) {
    memset(journal, 0, sizeof *journal);
    if (numbers == NULL)
        return;
    journal->tunable_count = (int)tunable_count();
    size_t ring = RING_BLOCKS * block_length(record_length(journal));
    journal->blocks = numbers;
    journal->backup = numbers + ring;
    journal->present = journal->backup + ring;
    journal->tunables = journal->present + stated_length();
    for (unsigned i = 0, n = 0; i < model.variable_count; i++)
        if (is_tunable(i))
            journal->tunables[n++] = model.variables[i].index;
}

PRIVATE void journal_clear(Journal *journal) {
    journal->range = (JournalMark){0, 0};
    journal->guarded = journal->saved = false;
}

static size_t block_place(const Journal *journal, int64_t block) {
    return (size_t)(block % RING_BLOCKS) * block_length(record_length(journal));
}

static double *snapshot_of(const Journal *journal, int64_t number) {
    return journal->blocks + block_place(journal, number / JOURNAL_SPACING);
}

static double *slot(const Journal *journal, int64_t number) {
    size_t within = (size_t)(number % JOURNAL_SPACING) * record_length(journal);
    return snapshot_of(journal, number) + snapshot_length() + within;
}

static Record record_at(double *place, const Journal *journal) {
    double *stated = place + 3;
    return (Record){place, place + 1, place + 2, stated, stated + model.own_inputs + journal->tunable_count};
}

PRIVATE Record journal_record(const Journal *journal, int64_t number) {
    return record_at(slot(journal, number), journal);
}

/* -- remembering ------------------------------------------------------------------------------------------------- */

static void copy_numbers(double *target, const double *source, size_t count) {
    if (count > 0 && target != source)
        memmove(target, source, count * sizeof(double));
}

PRIVATE void journal_read_stated(const Journal *journal, const Runtime *runtime, double *stated) {
    copy_numbers(stated, runtime->u, (size_t)model.own_inputs);
    for (int i = 0; i < journal->tunable_count; i++)
        stated[model.own_inputs + i] = runtime->p[(size_t)journal->tunables[i]];
}

PRIVATE void journal_give(const Journal *journal, Runtime *runtime, const double *stated) {
    copy_numbers(runtime->u, stated, (size_t)model.own_inputs);
    for (int i = 0; i < journal->tunable_count; i++)
        runtime->p[(size_t)journal->tunables[i]] = stated[model.own_inputs + i];
}

static void take_snapshot(const Runtime *runtime, double *place) {
    copy_numbers(place, runtime->x, (size_t)model.states);
    copy_numbers(place + model.states, runtime->u + model.noise_offset, noise_count());
    copy_numbers(place + (size_t)model.states + noise_count(), runtime->ticks, (size_t)model.periodic_count);
}

PRIVATE void journal_append(Journal *journal, const Runtime *runtime, double until, int kind, const double *payload) {
    int64_t number = journal->range.end++;
    Record record = journal_record(journal, number);
    if (number % JOURNAL_SPACING == 0)
        take_snapshot(runtime, snapshot_of(journal, number));
    if (kind >= 0)
        copy_numbers(record.payload, payload, (size_t)model.triggered[kind].payload_count);
    *record.t = runtime->clock.t;
    *record.until = until;
    *record.kind = kind;
    journal_read_stated(journal, runtime, record.stated);
    if (journal->range.end - journal->range.first > JOURNAL_CAPACITY)
        journal->range.first = journal->range.end - JOURNAL_CAPACITY;
}

/* -- finding ----------------------------------------------------------------------------------------------------- */

/* Number of the first record, from `first` on, that begins after t. */
static int64_t first_after(const Journal *journal, double t) {
    int64_t low = journal->range.first, high = journal->range.end;
    while (low < high) {
        int64_t middle = low + (high - low) / 2;
        if (*journal_record(journal, middle).t > t)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

PRIVATE int64_t journal_find(const Journal *journal, const Runtime *runtime, double stamp) {
    JournalMark range = journal->range;
    if (stamp < runtime->clock.t - *runtime->horizon - TIME_TOLERANCE)
        return BEYOND_HORIZON;
    if (range.first == range.end || stamp < *journal_record(journal, range.first).t - TIME_TOLERANCE)
        return BEYOND_RECORDS;
    double ulp = runtime_resolution(stamp);
    int64_t found = first_after(journal, stamp + ROUNDING_ULPS * ulp) - 1;
    return found > range.first ? found : range.first;
}

PRIVATE int64_t journal_rewind(const Journal *journal, Runtime *runtime, int64_t number) {
    int64_t start = number - number % JOURNAL_SPACING;
    const double *place = snapshot_of(journal, start);
    copy_numbers(runtime->x, place, (size_t)model.states);
    copy_numbers(runtime->u + model.noise_offset, place + model.states, noise_count());
    copy_numbers(runtime->ticks, place + (size_t)model.states + noise_count(), (size_t)model.periodic_count);
    runtime->clock.t = *journal_record(journal, start).t;
    return start;
}

/* -- changing the past ------------------------------------------------------------------------------------------- */

static void copy_blocks(const Journal *journal, double *target, const double *source, JournalMark range) {
    size_t length = block_length(record_length(journal));
    for (int64_t block = range.first / JOURNAL_SPACING; block <= (range.end - 1) / JOURNAL_SPACING && range.end > 0; block++)
        copy_numbers(target + block_place(journal, block), source + block_place(journal, block), length);
}

PRIVATE void journal_make_room(Journal *journal, int64_t number, int count) {
    if (journal->guarded && !journal->saved) {
        copy_blocks(journal, journal->backup, journal->blocks, journal->guard);
        journal->saved = true;
    }
    for (int64_t i = journal->range.end - 1; i >= number; i--)
        copy_numbers(slot(journal, i + count), slot(journal, i), record_length(journal));
    journal->range.end = number;
}

PRIVATE void journal_guard(Journal *journal) {
    journal->guard = journal->range;
    journal->guarded = true;
    journal->saved = false;
}

PRIVATE void journal_release(Journal *journal) {
    journal->guarded = false;
}

PRIVATE void journal_undo(Journal *journal) {
    if (journal->saved)
        copy_blocks(journal, journal->blocks, journal->backup, journal->guard);
    journal->range = journal->guard;
    journal->guarded = false;
}

/* -- saving ------------------------------------------------------------------------------------------------------ */

PRIVATE JournalMark journal_saved_range(const Journal *journal, const Runtime *runtime) {
    JournalMark range = journal->range;
    double oldest = runtime->clock.t - *runtime->horizon - 2.0 * TIME_TOLERANCE;
    while (range.first < range.end && *journal_record(journal, range.first).until < oldest)
        range.first++;
    if (range.first == range.end)
        return (JournalMark){0, 0};
    int64_t start = range.first - range.first % JOURNAL_SPACING;
    return (JournalMark){range.first - start, range.end - start};
}

static size_t saved_record_length(void) {
    return 3 + stated_length() + payload_length();
}

PRIVATE size_t journal_saved_length(JournalMark range) {
    size_t records = (size_t)range.end, blocks = (records + JOURNAL_SPACING - 1) / JOURNAL_SPACING;
    return blocks * snapshot_length() + records * saved_record_length();
}

PRIVATE void journal_save(const Journal *journal, JournalMark range, double *numbers) {
    size_t record = record_length(journal);
    int64_t start = journal->range.end - range.end;
    for (int64_t i = 0; i < range.end; i += JOURNAL_SPACING) {
        int64_t rest = range.end - i, count = rest < JOURNAL_SPACING ? rest : JOURNAL_SPACING;
        size_t length = snapshot_length() + (size_t)count * record;
        copy_numbers(numbers, snapshot_of(journal, start + i), length);
        numbers += length;
    }
}

PRIVATE void journal_load(Journal *journal, JournalMark range, const double *numbers) {
    journal_clear(journal);
    if (journal->blocks == NULL)
        return;
    size_t record = record_length(journal);
    for (int64_t i = 0; i < range.end; i += JOURNAL_SPACING) {
        int64_t rest = range.end - i, count = rest < JOURNAL_SPACING ? rest : JOURNAL_SPACING;
        size_t length = snapshot_length() + (size_t)count * record;
        copy_numbers(snapshot_of(journal, i), numbers, length);
        numbers += length;
    }
    journal->range = range;
}

static bool is_sane_record(const double *place, double earliest, double h) {
    double t = place[0], until = place[1], kind = place[2];
    bool known = kind >= RECORD_COMMUNICATION && kind < model.triggered_count && kind == floor(kind);
    bool ordered = isfinite(t) && isfinite(until) && t >= earliest && until >= t;
    return known && ordered && (until - t) / h <= MOST_INTERNAL_STEPS;
}

static bool is_sane_snapshot(const double *place) {
    const double *ticks = place + (size_t)model.states + noise_count();
    for (int i = 0; i < model.periodic_count; i++)
        if (!(ticks[i] >= 0.0 && ticks[i] < LARGEST_WHOLE && ticks[i] == floor(ticks[i])))
            return false;
    return true;
}

PRIVATE bool journal_is_sane(JournalMark range, const double *numbers, const Clock *clock) {
    size_t place = 0, record = saved_record_length();
    double earliest = -INFINITY;
    for (int64_t i = 0; i < range.end; i++, place += record) {
        if (i % JOURNAL_SPACING == 0) {
            if (!is_sane_snapshot(numbers + place))
                return false;
            place += snapshot_length();
        }
        if (!is_sane_record(numbers + place, earliest, clock->h))
            return false;
        earliest = numbers[place + 1];
    }
    return earliest <= clock->t;
}
