/* Every type there is: outputs are their inputs with a twist, so that a wrong order, a lost bit or a swapped element shows.
 *
 * Integers: last bit flipped. Floating: plus one. Boolean: not. String: an exclamation mark added. Binary: bytes reversed.
 * Enumeration: the next of three. Arrays of two: elements swapped. vector[n], matrix[2, n]: element (i, j) plus 10 i + j, from 1;
 * n is a structural parameter up to LONGEST. FMI 1 and 2: the types they have, scalars only; reference 30 is `w_only`.
 */
#include "test_fmus.h"

#define LONGEST 8
#define ROWS 2

/* One set of values; inputs and outputs have one each. */
typedef struct {
    double f64;
    float f32;
    int8_t i8;
    uint8_t u8;
    int16_t i16;
    uint16_t u16;
    int32_t i32;
    uint32_t u32;
    int64_t i64;
    uint64_t u64;
    bool flag;
    Text text;
    Blob blob;
    int64_t choice;
    int32_t choice32; /* FMI 1 and 2 */
    double vector[LONGEST], matrix[ROWS * LONGEST];
    int64_t pair_i64[2];
    uint64_t pair_u64[2];
    bool pair_bool[2];
    Text pair_text[2];
    Blob pair_blob[2];
    float pair_f32[2];
} Set;

typedef struct {
    double time, only;
    uint64_t n;
    Set u, y;
} Model;

#include "plain.h"

#define HAS_STRUCTURE 1
enum { TIME = 0, LENGTH = 1, FIRST_U = 2, ONLY = 30, FIRST_Y = 32 };
enum { S_F64, S_F32, S_I8, S_U8, S_I16, S_U16, S_I32, S_U32, S_I64, S_U64, S_BOOL, S_TEXT, S_BLOB, S_CHOICE, S_VECTOR, S_MATRIX,
       S_PAIR_I64, S_PAIR_U64, S_PAIR_BOOL, S_PAIR_TEXT, S_PAIR_BLOB, S_PAIR_F32 };

static void model_start(Model *m) {
    m->n = 3;
    m->u.choice = m->u.choice32 = 1;
}

static void model_begin(Model *m, double t0) { m->time = t0; }

static bool model_resize(Model *m) {
    memset(m->u.vector, 0, sizeof m->u.vector);
    memset(m->u.matrix, 0, sizeof m->u.matrix);
    return m->n >= 1 && m->n <= LONGEST;
}

static Slot in_set(Set *s, unsigned which, Role role, size_t n) {
#define SLOT(KIND, FIELD, SIZE) (Slot){.kind = KIND, .role = role, .at = FIELD, .size = SIZE}
    switch (which) {
    case S_F64: return SLOT(F64, &s->f64, 1);
    case S_F32: return SLOT(F32, &s->f32, 1);
    case S_I8: return SLOT(I8, &s->i8, 1);
    case S_U8: return SLOT(U8, &s->u8, 1);
    case S_I16: return SLOT(I16, &s->i16, 1);
    case S_U16: return SLOT(U16, &s->u16, 1);
    case S_I32: return SLOT(I32, &s->i32, 1);
    case S_U32: return SLOT(U32, &s->u32, 1);
    case S_I64: return SLOT(I64, &s->i64, 1);
    case S_U64: return SLOT(U64, &s->u64, 1);
    case S_BOOL: return SLOT(BOOL, &s->flag, 1);
    case S_TEXT: return SLOT(TEXT, &s->text, 1);
    case S_BLOB: return SLOT(BLOB, &s->blob, 1);
#if FMI_VERSION == 3
    case S_CHOICE: return SLOT(I64, &s->choice, 1);
#else
    case S_CHOICE: return SLOT(I32, &s->choice32, 1);
#endif
    case S_VECTOR: return SLOT(F64, s->vector, n);
    case S_MATRIX: return SLOT(F64, s->matrix, ROWS * n);
    case S_PAIR_I64: return SLOT(I64, s->pair_i64, 2);
    case S_PAIR_U64: return SLOT(U64, s->pair_u64, 2);
    case S_PAIR_BOOL: return SLOT(BOOL, s->pair_bool, 2);
    case S_PAIR_TEXT: return SLOT(TEXT, s->pair_text, 2);
    case S_PAIR_BLOB: return SLOT(BLOB, s->pair_blob, 2);
    case S_PAIR_F32: return SLOT(F32, s->pair_f32, 2);
    default: return (Slot){0};
    }
}

static Slot model_slot(Model *m, unsigned reference) {
    if (reference == TIME)
        return (Slot){.kind = F64, .role = OUTPUT, .at = &m->time, .size = 1};
    if (reference == LENGTH)
        return (Slot){.kind = U64, .role = STRUCTURAL, .at = &m->n, .size = 1};
    if (reference == ONLY)
        return (Slot){.kind = F64, .role = INPUT, .at = &m->only, .size = 1};
    if (reference >= FIRST_Y)
        return in_set(&m->y, reference - FIRST_Y, OUTPUT, m->n);
    return in_set(&m->u, reference - FIRST_U, INPUT, m->n);
}

static void twist_text(const Text *from, Text *to) { snprintf(to->text, sizeof to->text, "%.254s!", from->text); }

static void twist_blob(const Blob *from, Blob *to) {
    to->size = from->size;
    for (size_t i = 0; i < from->size; i++)
        to->bytes[i] = from->bytes[from->size - 1 - i];
}

static void twist_scalars(const Set *u, Set *y) {
    y->f64 = u->f64 + 1.0;
    y->f32 = u->f32 + 1.0f;
    y->i8 = (int8_t)(u->i8 ^ 1);
    y->u8 = (uint8_t)(u->u8 ^ 1);
    y->i16 = (int16_t)(u->i16 ^ 1);
    y->u16 = (uint16_t)(u->u16 ^ 1);
    y->i32 = u->i32 ^ 1;
    y->u32 = u->u32 ^ 1;
    y->i64 = u->i64 ^ 1;
    y->u64 = u->u64 ^ 1;
    y->flag = !u->flag;
    y->choice = u->choice % 3 + 1;
    y->choice32 = u->choice32 % 3 + 1;
    twist_text(&u->text, &y->text);
    twist_blob(&u->blob, &y->blob);
}

static void model_refresh(Model *m) {
    const Set *u = &m->u;
    Set *y = &m->y;
    twist_scalars(u, y);
    for (size_t j = 0; j < m->n; j++)
        y->vector[j] = u->vector[j] + (double)(j + 1);
    for (size_t i = 0; i < ROWS; i++)
        for (size_t j = 0; j < m->n; j++)
            y->matrix[i * m->n + j] = u->matrix[i * m->n + j] + 10.0 * (double)(i + 1) + (double)(j + 1);
    for (int i = 0; i < 2; i++) {
        y->pair_i64[i] = u->pair_i64[1 - i];
        y->pair_u64[i] = u->pair_u64[1 - i];
        y->pair_bool[i] = u->pair_bool[1 - i];
        y->pair_text[i] = u->pair_text[1 - i];
        y->pair_blob[i] = u->pair_blob[1 - i];
        y->pair_f32[i] = u->pair_f32[1 - i];
    }
}

static Outcome model_step(Model *m, Host *host, double t, double until) {
    (void)host, (void)t;
    m->time = until;
    return arrived(until);
}

static Update model_update(Model *m, const Host *host, double t) {
    (void)m, (void)host, (void)t;
    return (Update){0};
}

#include "face.h"
