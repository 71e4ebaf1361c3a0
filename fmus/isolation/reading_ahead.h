/* Reading ahead: what was read behind one step is read along with the next, and served where nothing else was called in between. Part of
   `proxy.c`.
 */
#include "requests.h"

static bool same_get(const Record *r, const Function *f, const uint64_t *a) {
    const size_t bytes = 4 * (size_t)a[2];
    const Passed *values = &r->arguments[3];
    return r->function == (uint32_t)(f - FUNCTIONS) && r->arguments[1].bytes == bytes && a[1] != 0 && a[3] != 0 &&
           (f->version != 3 || f->arguments[3].count != 4 || r->arguments[4].value == a[4]) &&
           values->bytes == counted(&f->arguments[3], a) * (size_t)f->arguments[3].size &&
           memcmp((const char *)r + r->arguments[1].value, (const void *)a[1], bytes) == 0;
}

static ReadAhead *known_get(Session *s, const Function *f, const uint64_t *a) {
    for (int k = 0; k < s->ahead_count; k++)
        if (same_get(s->ahead[k].record, f, a))
            return &s->ahead[k];
    return NULL;
}

/* Read this from now on behind each step, where there is room for it. */
static void read_ahead(Session *s, const Record *made) {
    const size_t bytes = made->arguments[3].bytes, replies = s->ahead_replies + aligned(sizeof(Reply)) + aligned(bytes);
    const size_t at = s->asking->ahead;
    if (s->ahead_count == READ_AHEAD || made->arguments[1].value == NONE || at + made->bytes > AHEAD_BYTES || replies > AHEAD_BYTES)
        return;
    Record *kept = request_at(s, at);
    memcpy(kept, made, made->bytes);
    kept->reply = (uint32_t)s->ahead_replies;
    kept->arguments[3].reply = (uint32_t)(s->ahead_replies + aligned(sizeof(Reply)));
    kept->kept = 1;
    memcpy(s->replies + kept->arguments[3].reply, s->replies + made->arguments[3].reply, bytes);
    s->ahead_replies = replies;
    s->ahead[s->ahead_count++] = (ReadAhead){kept, true, 0};
    s->asking->ahead = (uint32_t)(at + made->bytes);
}

/* Have those gets made behind the step that is sent next that were called behind the last one. */
static void want_reads_ahead(Session *s) {
    s->stepped = s->number + 1;
    for (int k = 0; k < s->ahead_count; k++) {
        ReadAhead *one = &s->ahead[k];
        if (one->record->wanted != one->called)
            one->record->wanted = one->called;
        if (one->called)
            one->number = s->stepped;
        s->asking->wanted |= one->called;
        one->called = false;
    }
}

/* Whether a get is answered by what was read ahead; then its status is in `said`. */
static bool was_read(Session *s, const Function *f, const uint64_t *a, int64_t *said) {
    ReadAhead *one = known_get(s, f, a);
    if (one == NULL)
        return false;
    one->called = true;
    const Reply reply = *(const Reply *)(s->replies + one->record->reply);
    if (one->number != s->stepped || reply.number != s->stepped)
        return false;
    memcpy((void *)a[3], s->replies + one->record->arguments[3].reply, one->record->arguments[3].bytes);
    const uint64_t end = s->answering->log_seen;
    tell_until(s, reply.log_end < end ? reply.log_end : end);
    *said = reply.value;
    return true;
}
