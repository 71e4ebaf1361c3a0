/* Bytes of a serialised state, damaged in one word of eight bytes after the other, in several ways each. */
#ifndef DAMAGE_H
#define DAMAGE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define DAMAGE_KINDS 9
#define DAMAGE_WORDS 500 /* of a longer state the first ones, and as many of the others, evenly spread */

typedef struct {
    char *bytes;
    size_t words, word;
    int kind;
    char held[8]; /* what belongs there */
    bool harmed;
} Damage;

static Damage damage_first(char *bytes, size_t size) {
    return (Damage){.bytes = bytes, .words = size / 8};
}

static void damage_put(char *place, int kind) {
    const double numbers[] = {NAN, INFINITY, -1.0, 0.5, 1e300, -1e300};
    uint64_t bits;
    memcpy(&bits, place, 8);
    bits ^= UINT64_C(1) << (kind == 6 ? 62 : kind == 7 ? 54 : 3);
    if (kind < 6)
        memcpy(place, &numbers[kind], 8);
    else
        memcpy(place, &bits, 8);
}

/* Undo the last damage and do the next; false, with the bytes whole again, when there is none left. */
static bool damage_next(Damage *d) {
    if (d->harmed) {
        memcpy(d->bytes + 8 * d->word, d->held, 8);
        if (++d->kind == DAMAGE_KINDS) {
            size_t stride = d->words / DAMAGE_WORDS;
            d->kind = 0;
            d->word += d->word < DAMAGE_WORDS || stride < 2 ? 1 : stride;
        }
    }
    d->harmed = d->word < d->words;
    if (!d->harmed)
        return false;
    memcpy(d->held, d->bytes + 8 * d->word, 8);
    damage_put(d->bytes + 8 * d->word, d->kind);
    return true;
}

#endif
