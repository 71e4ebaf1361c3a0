/* The journal: the recent past of a runtime, so that it can be lived again with one more event in it.

   A bounded ring in memory that was set aside at instantiation. A record says what the runtime did and what it was given; every
   32 records stands a snapshot of its state, from which the state before any record is found again. Mirrors `journal.py`: the
   same records, the same reach. */
#ifndef JOURNAL_H
#define JOURNAL_H

#include <stdint.h>

#include "runtime.h"

#define JOURNAL_CAPACITY 4096 /* records remembered at most, as in the Python block */
#define JOURNAL_SPACING 32    /* records to a snapshot */

#define TIME_TOLERANCE 1e-9 /* [s] closer than this is the same instant, as in the Python block */

/* What a record says, where it is not a jump: the number of the event else. */
#define RECORD_ADVANCE (-1)
#define RECORD_COMMUNICATION (-2)

/* Why a stamp is out of reach. */
#define BEYOND_HORIZON (-1)
#define BEYOND_RECORDS (-2)

/* Records have consecutive numbers. */
typedef struct {
    int64_t first; /* the oldest one that counts */
    int64_t end;   /* the next one to come */
} JournalMark;

typedef struct {
    JournalMark range;
    double *blocks;      /* ring of blocks: a snapshot, then JOURNAL_SPACING records; NULL: nothing is remembered */
    double *backup;      /* of the ring, from the beginning of the present step */
    double *present;     /* what was given last, while the past is lived again */
    double *tunables;    /* positions in p */
    int tunable_count;
    JournalMark guard;   /* the range before the present step */
    bool guarded, saved; /* within a step that may be undone; and the backup holds what was before it */
} Journal;

typedef struct {
    double *t, *until, *kind, *stated, *payload;
} Record;

/* Doubles that a journal needs; none for a model without triggered events. */
PRIVATE size_t journal_length(void);

/* Lay the journal into `numbers`, or let it remember nothing (NULL). */
PRIVATE void journal_place(Journal *journal, double *numbers);
PRIVATE void journal_clear(Journal *journal);

PRIVATE Record journal_record(const Journal *journal, int64_t number);

/* Remember where the runtime stands before it advances to `until`, communicates, or jumps at an event with its payload. */
PRIVATE void journal_append(Journal *journal, const Runtime *runtime, double until, int kind, const double *payload);

/* Number of the record in which a stamp lies (at the border of two, to rounding, the later), or BEYOND_... */
PRIVATE int64_t journal_find(const Journal *journal, const Runtime *runtime, double stamp);

/* What is given from outside: inputs proper, and tunable parameters. */
PRIVATE void journal_give(const Journal *journal, Runtime *runtime, const double *stated);
PRIVATE void journal_read_stated(const Journal *journal, const Runtime *runtime, double *stated);

/* Put the runtime at the snapshot before record `number`, and return the record that follows the snapshot. */
PRIVATE int64_t journal_rewind(const Journal *journal, Runtime *runtime, int64_t number);

/* Move the records from `number` on up by `count`, and end the journal before them. */
PRIVATE void journal_make_room(Journal *journal, int64_t number, int count);

/* A step that may be undone begins; has ended; is undone. */
PRIVATE void journal_guard(Journal *journal);
PRIVATE void journal_release(Journal *journal);
PRIVATE void journal_undo(Journal *journal);

/* The part within reach, to be saved: records from a snapshot on, of which the first ones may not count (`range` in the copy);
   its length in doubles; whether content from outside is sound. */
PRIVATE JournalMark journal_saved_range(const Journal *journal, const Runtime *runtime);
PRIVATE size_t journal_saved_length(JournalMark range);
PRIVATE void journal_save(const Journal *journal, JournalMark range, double *numbers);
PRIVATE void journal_load(Journal *journal, JournalMark range, const double *numbers);
PRIVATE bool journal_is_sane(JournalMark range, const double *numbers, const Clock *clock);

#endif
