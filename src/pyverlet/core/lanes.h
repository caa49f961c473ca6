/* Eight lanes: eight numbers that are computed at once, by the vector types of GCC and Clang.

   Each lane is rounded by itself and nothing is contracted, so the bits are the same on every processor. Compiled with
   -DREAL64 a number is a double, otherwise a float. Arrays of points are interleaved: x and y of particle i at 2 i. */
#pragma once
#include <math.h>
#include <stdint.h>
#include <string.h>
#ifdef REAL64
typedef double real;
typedef int64_t lane_int;
#else
typedef float real;
typedef int32_t lane_int;
#endif
enum { LANES = 8 };
typedef real lanes __attribute__((vector_size(LANES * sizeof(real)), aligned(sizeof(real))));
typedef lane_int mask __attribute__((vector_size(LANES * sizeof(real)), aligned(sizeof(real))));
typedef lanes lanes_in_memory __attribute__((may_alias)); /* of an array whose items are also read one by one */
typedef struct {
    lanes x, y;
} lanes2;
typedef struct {
    lanes x, y, z, w;
} lanes4;
#define LANES_INLINE static inline __attribute__((always_inline))

LANES_INLINE lanes spread(real a) { return (lanes){a, a, a, a, a, a, a, a}; }
LANES_INLINE lanes load(const real *array, int64_t k) { return *(const lanes_in_memory *)(array + k); }
LANES_INLINE void store(real *array, int64_t k, lanes a) { *(lanes_in_memory *)(array + k) = a; }

/* A mask has all bits of a lane set where a comparison holds. */
LANES_INLINE mask above(lanes a, lanes b) { return a > b; }
LANES_INLINE mask equal(lanes a, lanes b) { return a == b; }
LANES_INLINE mask both(mask a, mask b) { return a & b; }
LANES_INLINE mask either(mask a, mask b) { return a | b; }
LANES_INLINE mask outside(mask a) { return ~a; }
LANES_INLINE lanes choose(mask m, lanes a, lanes b) { return (lanes)(((mask)a & m) | ((mask)b & ~m)); }
/* Bit l is set where the mask is in lane l. */
LANES_INLINE int bits_of(mask m) {
    int bits = 0;
#if defined(__AVX__) && !defined(REAL64)
    bits = __builtin_ia32_movmskps256((__attribute__((vector_size(32))) float)m);
#elif defined(__AVX__)
    typedef double four __attribute__((vector_size(32)));
    union {
        mask all;
        four half[2];
    } u = {m};
    bits = __builtin_ia32_movmskpd256(u.half[0]) | __builtin_ia32_movmskpd256(u.half[1]) << 4;
#elif defined(__SSE2__) && !defined(REAL64)
    typedef float four __attribute__((vector_size(16)));
    union {
        mask all;
        four half[2];
    } u = {m};
    bits = __builtin_ia32_movmskps(u.half[0]) | __builtin_ia32_movmskps(u.half[1]) << 4;
#else
    for (int l = 0; l < LANES; l++)
        bits |= (m[l] & 1) << l;
#endif
    return bits;
}
LANES_INLINE int any_lane(mask m) {
#ifdef __AVX__
    return bits_of(m) != 0;
#else
    int64_t words[sizeof(mask) / 8], any = 0;
    memcpy(words, &m, sizeof m);
    for (unsigned k = 0; k < sizeof(mask) / 8; k++)
        any |= words[k];
    return any != 0;
#endif
}
/* The number of the lowest bit that is set, of a number that is not 0. */
LANES_INLINE int lowest_bit(uint32_t bits) { return __builtin_ctz(bits); }
LANES_INLINE int any_above(lanes a, lanes b) { return any_lane(a > b); }
/* Of equal numbers, and where one is not a number, the second: (a > b ? a : b) and (a < b ? a : b), as C and SSE have it. */
LANES_INLINE lanes larger(lanes a, lanes b) { return choose(a > b, a, b); }
LANES_INLINE lanes smaller(lanes a, lanes b) { return choose(a < b, a, b); }
LANES_INLINE real largest_lane(lanes a) {
    real most = a[0];
    for (int l = 1; l < LANES; l++)
        most = a[l] > most ? a[l] : most;
    return most;
}
LANES_INLINE lanes where_zero(lanes test, lanes a, lanes b) { return choose(test == spread(0), a, b); }
LANES_INLINE lanes magnitude(lanes a) { return choose(a < spread(0), -a, a); }
LANES_INLINE lanes square_root(lanes a) {
    lanes r;
    for (int l = 0; l < LANES; l++)
        r[l] = sizeof(real) == 4 ? sqrtf(a[l]) : sqrt(a[l]);
    return r;
}

/* Of points, x and y one after the other: x + y in both places. */
LANES_INLINE lanes sum_of_pairs(lanes a) { return a + __builtin_shufflevector(a, a, 1, 0, 3, 2, 5, 4, 7, 6); }

/* Numbers of the particles index[k] to index[k + 7]: one each (gather, scatter), two (take, put) or four (take4, put4). */
LANES_INLINE lanes gather(const real *array, const uint32_t *index, int64_t k) {
    lanes r;
    for (int l = 0; l < LANES; l++)
        r[l] = array[index[k + l]];
    return r;
}
LANES_INLINE void scatter(real *array, const uint32_t *index, int64_t k, lanes a) {
    for (int l = 0; l < LANES; l++)
        array[index[k + l]] = a[l];
}
/* Four numbers of a particle are one load; eight of those become four lanes by two rounds of shuffles. */
typedef real four_reals __attribute__((vector_size(4 * sizeof(real)), aligned(sizeof(real))));
#define LANES_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#define LANES_LOW(a, b) LANES_SHUFFLE(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define LANES_HIGH(a, b) LANES_SHUFFLE(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define LANES_EVEN(a, b) LANES_SHUFFLE(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define LANES_ODD(a, b) LANES_SHUFFLE(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
LANES_INLINE lanes4 take4(const real *array, const uint32_t *index, int64_t k) {
    const uint32_t *i = index + k;
#define FOUR(l) (*(const four_reals *)(array + 4 * (size_t)i[l]))
#define EIGHT(l) LANES_SHUFFLE(FOUR(l), FOUR(l + 4), 0, 1, 2, 3, 4, 5, 6, 7)
    lanes p = EIGHT(0), q = EIGHT(1), r = EIGHT(2), s = EIGHT(3);
#undef EIGHT
#undef FOUR
    lanes a = LANES_LOW(p, q), b = LANES_HIGH(p, q), c = LANES_LOW(r, s), d = LANES_HIGH(r, s);
    return (lanes4){LANES_EVEN(a, c), LANES_ODD(a, c), LANES_EVEN(b, d), LANES_ODD(b, d)};
}
LANES_INLINE void put4(real *array, const uint32_t *index, int64_t k, lanes x, lanes y, lanes z, lanes w) {
    const uint32_t *i = index + k;
    lanes a = LANES_LOW(x, y), b = LANES_HIGH(x, y), c = LANES_LOW(z, w), d = LANES_HIGH(z, w);
    lanes p = LANES_EVEN(a, c), q = LANES_ODD(a, c), r = LANES_EVEN(b, d), s = LANES_ODD(b, d);
#define FOUR(l) (*(four_reals *)(array + 4 * (size_t)i[l]))
    FOUR(0) = LANES_SHUFFLE(p, p, 0, 1, 2, 3);
    FOUR(1) = LANES_SHUFFLE(q, q, 0, 1, 2, 3);
    FOUR(2) = LANES_SHUFFLE(r, r, 0, 1, 2, 3);
    FOUR(3) = LANES_SHUFFLE(s, s, 0, 1, 2, 3);
    FOUR(4) = LANES_SHUFFLE(p, p, 4, 5, 6, 7);
    FOUR(5) = LANES_SHUFFLE(q, q, 4, 5, 6, 7);
    FOUR(6) = LANES_SHUFFLE(r, r, 4, 5, 6, 7);
    FOUR(7) = LANES_SHUFFLE(s, s, 4, 5, 6, 7);
#undef FOUR
}
#ifdef REAL64
LANES_INLINE lanes2 take(const real *array, const uint32_t *index, int64_t k) {
    lanes2 r;
    for (int l = 0; l < LANES; l++) {
        r.x[l] = array[2 * (size_t)index[k + l]];
        r.y[l] = array[2 * (size_t)index[k + l] + 1];
    }
    return r;
}
LANES_INLINE void put(real *array, const uint32_t *index, int64_t k, lanes x, lanes y) {
    for (int l = 0; l < LANES; l++) {
        array[2 * (size_t)index[k + l]] = x[l];
        array[2 * (size_t)index[k + l] + 1] = y[l];
    }
}
#else
/* Two floats at once, as one double that is only copied. */
typedef double two_floats __attribute__((aligned(4), may_alias));
#if defined(__AVX2__) || defined(__clang__)
typedef double four_doubles __attribute__((vector_size(32)));
LANES_INLINE lanes2 take(const real *array, const uint32_t *index, int64_t k) {
    const two_floats *a = (const two_floats *)array;
    const uint32_t *i = index + k;
    lanes p = (lanes)(four_doubles){a[i[0]], a[i[1]], a[i[2]], a[i[3]]},
          q = (lanes)(four_doubles){a[i[4]], a[i[5]], a[i[6]], a[i[7]]};
    return (lanes2){__builtin_shufflevector(p, q, 0, 2, 4, 6, 8, 10, 12, 14),
                    __builtin_shufflevector(p, q, 1, 3, 5, 7, 9, 11, 13, 15)};
}
LANES_INLINE void put(real *array, const uint32_t *index, int64_t k, lanes x, lanes y) {
    two_floats *a = (two_floats *)array;
    const uint32_t *i = index + k;
    four_doubles p = (four_doubles)__builtin_shufflevector(x, y, 0, 8, 1, 9, 2, 10, 3, 11),
                 q = (four_doubles)__builtin_shufflevector(x, y, 4, 12, 5, 13, 6, 14, 7, 15);
    a[i[0]] = p[0];
    a[i[1]] = p[1];
    a[i[2]] = p[2];
    a[i[3]] = p[3];
    a[i[4]] = q[0];
    a[i[5]] = q[1];
    a[i[6]] = q[2];
    a[i[7]] = q[3];
}
#else
/* By halves of four lanes: gcc splits wider shuffles into single floats where registers have 16 bytes, 3 times as slow. */
typedef double two_doubles __attribute__((vector_size(16)));
typedef float half_lanes __attribute__((vector_size(16)));
typedef union {
    lanes all;
    half_lanes half[2];
} lane_halves;
LANES_INLINE lanes2 take(const real *array, const uint32_t *index, int64_t k) {
    const two_floats *a = (const two_floats *)array;
    lane_halves x, y;
    for (int h = 0; h < 2; h++) {
        const uint32_t *i = index + k + 4 * h;
        half_lanes p = (half_lanes)(two_doubles){a[i[0]], a[i[1]]}, q = (half_lanes)(two_doubles){a[i[2]], a[i[3]]};
        x.half[h] = __builtin_shufflevector(p, q, 0, 2, 4, 6);
        y.half[h] = __builtin_shufflevector(p, q, 1, 3, 5, 7);
    }
    return (lanes2){x.all, y.all};
}
LANES_INLINE void put(real *array, const uint32_t *index, int64_t k, lanes x, lanes y) {
    two_floats *a = (two_floats *)array;
    lane_halves u = {x}, v = {y};
    for (int h = 0; h < 2; h++) {
        const uint32_t *i = index + k + 4 * h;
        two_doubles p = (two_doubles)__builtin_shufflevector(u.half[h], v.half[h], 0, 4, 1, 5),
                    q = (two_doubles)__builtin_shufflevector(u.half[h], v.half[h], 2, 6, 3, 7);
        a[i[0]] = p[0];
        a[i[1]] = p[1];
        a[i[2]] = q[0];
        a[i[3]] = q[1];
    }
}
#endif
#endif
