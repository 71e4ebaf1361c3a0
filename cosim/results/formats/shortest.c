/* Rows of numbers as text: the shortest decimals that read back as the same double, written as Python's repr does.
 *
 * The digits are found by R. Giulietti, "The Schubfach way to render doubles" (2020), with the notation of that paper:
 * the double is c * 2^q, the decimals next to it are multiples of 10^k, and `powers` holds the upper 128 bits of 10^-k,
 * rounded up, for k from -324 to 292 (see csv_numbers.py). Nothing here depends on the locale. */

#include <stdint.h>
#include <string.h>

#define LEAST_POWER (-292)
#define SIGNIFICAND ((UINT64_C(1) << 52) - 1)

__extension__ typedef unsigned __int128 uint128;

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

typedef struct {
    uint64_t digits;
    int exponent;
} Decimal;

/* The upper bits of a product with 10^-k; the last bit says whether anything was lost. */
static uint64_t rounded_to_odd(const uint64_t *power, uint64_t factor)
{
    uint128 low = (uint128)power[1] * factor;
    uint128 high = (uint128)power[0] * factor + (uint64_t)(low >> 64);
    return (uint64_t)(high >> 64) | ((uint64_t)high > 1);
}

static Decimal shortest(uint64_t fraction, int biased, const uint64_t *powers)
{
    uint64_t c = biased ? fraction | (SIGNIFICAND + 1) : fraction;
    int q = (biased ? biased : 1) - 1075;
    if (q <= 0 && q > -53 && (c & ((UINT64_C(1) << -q) - 1)) == 0)
        return (Decimal){c >> -q, 0}; /* a whole number */
    int closer = fraction == 0 && biased > 1; /* the double below is nearer than the one above */
    uint64_t open = c & 1;                    /* whether the ends of the interval round to other doubles */
    int k = (q * 1262611 - (closer ? 524031 : 0)) >> 22;
    int h = q + ((-k * 1741647) >> 19) + 1;
    const uint64_t *power = powers + 2 * (-k - LEAST_POWER);
    uint64_t lower = rounded_to_odd(power, (4 * c - 2 + (uint64_t)closer) << h) + open;
    uint64_t middle = rounded_to_odd(power, (4 * c) << h);
    uint64_t upper = rounded_to_odd(power, (4 * c + 2) << h) - open;
    uint64_t s = middle / 4;
    if (s >= 10) { /* a decimal with a digit less */
        uint64_t shorter = s / 10;
        int below = lower <= 40 * shorter, above = 40 * shorter + 40 <= upper;
        if (below != above)
            return (Decimal){shorter + (uint64_t)above, k + 1};
    }
    int below = lower <= 4 * s, above = 4 * s + 4 <= upper;
    if (below != above)
        return (Decimal){s + (uint64_t)above, k};
    uint64_t half = 4 * s + 2;
    return (Decimal){s + (middle > half || (middle == half && (s & 1))), k};
}

/* Digits of a positive whole number without the zeros at its end; their count. What was cut off goes to the exponent. */
static int write_digits(Decimal *decimal, char *to)
{
    char reversed[24];
    int count = 0, start = 0;
    for (uint64_t rest = decimal->digits; rest; rest /= 10)
        reversed[count++] = (char)('0' + rest % 10);
    while (reversed[start] == '0')
        start++;
    decimal->exponent += start;
    for (int i = count - 1; i >= start; i--)
        *to++ = reversed[i];
    return count - start;
}

static char *copied(char *to, const char *text, int length)
{
    memcpy(to, text, (size_t)length);
    return to + length;
}

static char *zeros(char *to, int count)
{
    memset(to, '0', (size_t)count);
    return to + count;
}

/* As Python lays them out: with an exponent below 1e-4 and from 1e16 on. */
static char *laid_out(char *to, const char *digits, int count, int point)
{
    if (point > 16 || point <= -4) {
        int power = point - 1;
        *to++ = digits[0];
        if (count > 1) {
            *to++ = '.';
            to = copied(to, digits + 1, count - 1);
        }
        *to++ = 'e';
        *to++ = power < 0 ? '-' : '+';
        power = power < 0 ? -power : power;
        if (power >= 100)
            *to++ = (char)('0' + power / 100);
        *to++ = (char)('0' + power / 10 % 10);
        *to++ = (char)('0' + power % 10);
        return to;
    }
    if (point <= 0)
        return copied(zeros(copied(to, "0.", 2), -point), digits, count);
    if (count <= point)
        return copied(zeros(copied(to, digits, count), point - count), ".0", 2);
    to = copied(to, digits, point);
    *to++ = '.';
    return copied(to, digits + point, count - point);
}

static char *write_number(char *to, double value, const uint64_t *powers)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint64_t fraction = bits & SIGNIFICAND;
    int biased = (int)(bits >> 52 & 0x7ff);
    if (biased == 0x7ff && fraction)
        return copied(to, "nan", 3);
    if (bits >> 63)
        *to++ = '-';
    if (biased == 0x7ff)
        return copied(to, "inf", 3);
    if (biased == 0 && fraction == 0)
        return copied(to, "0.0", 3);
    char digits[24];
    Decimal decimal = shortest(fraction, biased, powers);
    int count = write_digits(&decimal, digits);
    return laid_out(to, digits, count, count + decimal.exponent);
}

/* Write rows of numbers with commas between them and a line feed behind each; the count of bytes. `text` has room for
 * 25 bytes a number. */
EXPORTED int64_t shortest_rows(const double *values, int64_t rows, int64_t columns, const uint64_t *powers, char *text)
{
    char *to = text;
    for (int64_t row = 0; row < rows; row++)
        for (int64_t column = 0; column < columns; column++) {
            to = write_number(to, *values++, powers);
            *to++ = column + 1 < columns ? ',' : '\n';
        }
    return to - text;
}
