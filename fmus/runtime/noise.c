/* Counter-based noise: Philox 4x32-10 (Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3, SC'11)
   and Box-Muller. The same operations in the same order as `noise.py`, so that the numbers are the same bit for bit. */
#include "noise.h"

#include <math.h>

#define PI 3.141592653589793

PRIVATE void noise_philox4x32(uint32_t counter[4], uint32_t k0, uint32_t k1) {
    for (int round = 0; round < 10; round++) {
        uint64_t product_0 = UINT64_C(0xD2511F53) * counter[0];
        uint64_t product_1 = UINT64_C(0xCD9E8D57) * counter[2];
        uint32_t c1 = counter[1], c3 = counter[3];
        counter[0] = (uint32_t)(product_1 >> 32) ^ c1 ^ k0;
        counter[1] = (uint32_t)product_1;
        counter[2] = (uint32_t)(product_0 >> 32) ^ c3 ^ k1;
        counter[3] = (uint32_t)product_0;
        k0 += UINT32_C(0x9E3779B9);
        k1 += UINT32_C(0xBB67AE85);
    }
}

/* Uniform on the open interval (0, 1) from the upper 27 and 26 bits of two words. */
static double uniform(uint32_t high, uint32_t low) {
    return ((high >> 5) * 67108864.0 + (low >> 6) + 0.5) * 0x1p-53;
}

PRIVATE double noise_standard_normal(uint64_t seed, uint64_t signal, uint64_t index, uint32_t purpose) {
    uint32_t word[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)signal, purpose};
    noise_philox4x32(word, (uint32_t)seed, (uint32_t)(seed >> 32));
    double first = uniform(word[0], word[1]);
    double second = uniform(word[2], word[3]);
    return sqrt(-2.0 * log(first)) * cos(2.0 * PI * second);
}

PRIVATE double noise_seed_of(uint64_t run_seed, const char *name) {
    uint64_t hashed = UINT64_C(0xCBF29CE484222325); /* FNV-1a (Fowler, Noll, Vo) */
    for (const char *byte = name; *byte != '\0'; byte++)
        hashed = (hashed ^ (unsigned char)*byte) * UINT64_C(0x100000001B3);
    uint32_t word[4] = {(uint32_t)hashed, (uint32_t)(hashed >> 32), (uint32_t)run_seed, (uint32_t)(run_seed >> 32)};
    noise_philox4x32(word, UINT32_C(0x73656564), 0);
    return (double)((uint64_t)(word[0] >> 5) << 26 | word[1] >> 6);
}
