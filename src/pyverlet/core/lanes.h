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

/* A mask has all bits of a lane set where a comparison holds. Register by register: gcc compares wider vectors number by number. */
#if defined(__AVX512F__)
enum { REGISTER = 64 };
#elif defined(__AVX__)
enum { REGISTER = 32 };
#else
enum { REGISTER = 16 };
#endif
enum { PART = sizeof(lanes) < REGISTER ? sizeof(lanes) : REGISTER, PARTS = sizeof(lanes) / PART };
typedef real lanes_part __attribute__((vector_size(PART), may_alias));
typedef lane_int mask_part __attribute__((vector_size(PART), may_alias));
#define BY_PARTS(a, operator, b)                                                                                          \
    mask m;                                                                                                               \
    for (int k = 0; k < PARTS; k++)                                                                                       \
        ((mask_part *)&m)[k] = (mask_part)(((lanes_part *)&a)[k] operator((lanes_part *)&b)[k]);                          \
    return m;
LANES_INLINE mask above(lanes a, lanes b) { BY_PARTS(a, >, b) }
LANES_INLINE mask equal(lanes a, lanes b) { BY_PARTS(a, ==, b) }
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
LANES_INLINE int any_above(lanes a, lanes b) { return any_lane(above(a, b)); }
/* Of equal numbers, and where one is not a number, the second: (a > b ? a : b) and (a < b ? a : b), as C and SSE have it. */
#if defined(__AVX__) && !defined(REAL64)
typedef float eight_reals __attribute__((vector_size(32)));
LANES_INLINE lanes larger(lanes a, lanes b) { return (lanes)__builtin_ia32_maxps256((eight_reals)a, (eight_reals)b); }
LANES_INLINE lanes smaller(lanes a, lanes b) { return (lanes)__builtin_ia32_minps256((eight_reals)a, (eight_reals)b); }
#else
LANES_INLINE lanes larger(lanes a, lanes b) { return choose(above(a, b), a, b); }
LANES_INLINE lanes smaller(lanes a, lanes b) { return choose(above(b, a), a, b); }
#endif
LANES_INLINE real largest_lane(lanes a) {
    real most = a[0];
    for (int l = 1; l < LANES; l++)
        most = a[l] > most ? a[l] : most;
    return most;
}
LANES_INLINE lanes where_zero(lanes test, lanes a, lanes b) { return choose(equal(test, spread(0)), a, b); }
LANES_INLINE lanes magnitude(lanes a) { return choose(above(spread(0), a), -a, a); }
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
/* Points are moved four at a time: gcc splits shuffles of more than a register into single numbers. */
typedef real four_reals __attribute__((vector_size(4 * sizeof(real)), aligned(sizeof(real)), may_alias));
#define MIX(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
LANES_INLINE four_reals half_of(lanes a, int h) {
    if (PARTS == 1)
        return h ? MIX(a, a, 4, 5, 6, 7) : MIX(a, a, 0, 1, 2, 3);
    return ((four_reals *)&a)[h];
}
LANES_INLINE lanes joined(four_reals a, four_reals b) {
    if (PARTS == 1)
        return MIX(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
    lanes r;
    ((four_reals *)&r)[0] = a;
    ((four_reals *)&r)[1] = b;
    return r;
}
#if defined(__AVX__) && !defined(REAL64)
/* Four numbers of a particle are one load; eight of those become four lanes by two rounds of shuffles. */
#define LOW(a, b) MIX(a, b, 0, 8, 1, 9, 4, 12, 5, 13)
#define HIGH(a, b) MIX(a, b, 2, 10, 3, 11, 6, 14, 7, 15)
#define EVEN(a, b) MIX(a, b, 0, 1, 8, 9, 4, 5, 12, 13)
#define ODD(a, b) MIX(a, b, 2, 3, 10, 11, 6, 7, 14, 15)
LANES_INLINE lanes4 take4(const real *array, const uint32_t *index, int64_t k) {
    const uint32_t *i = index + k;
#define FOUR(l) (*(const four_reals *)(array + 4 * (size_t)i[l]))
#define EIGHT(l) MIX(FOUR(l), FOUR(l + 4), 0, 1, 2, 3, 4, 5, 6, 7)
    lanes p = EIGHT(0), q = EIGHT(1), r = EIGHT(2), s = EIGHT(3);
#undef EIGHT
#undef FOUR
    lanes a = LOW(p, q), b = HIGH(p, q), c = LOW(r, s), d = HIGH(r, s);
    return (lanes4){EVEN(a, c), ODD(a, c), EVEN(b, d), ODD(b, d)};
}
LANES_INLINE void put4(real *array, const uint32_t *index, int64_t k, lanes x, lanes y, lanes z, lanes w) {
    const uint32_t *i = index + k;
    lanes a = LOW(x, y), b = HIGH(x, y), c = LOW(z, w), d = HIGH(z, w);
    lanes p = EVEN(a, c), q = ODD(a, c), r = EVEN(b, d), s = ODD(b, d);
#define FOUR(l) (*(four_reals *)(array + 4 * (size_t)i[l]))
    FOUR(0) = MIX(p, p, 0, 1, 2, 3);
    FOUR(1) = MIX(q, q, 0, 1, 2, 3);
    FOUR(2) = MIX(r, r, 0, 1, 2, 3);
    FOUR(3) = MIX(s, s, 0, 1, 2, 3);
    FOUR(4) = MIX(p, p, 4, 5, 6, 7);
    FOUR(5) = MIX(q, q, 4, 5, 6, 7);
    FOUR(6) = MIX(r, r, 4, 5, 6, 7);
    FOUR(7) = MIX(s, s, 4, 5, 6, 7);
#undef FOUR
}
#else
/* Four rows of four numbers become columns, by what a processor mixes in one step: two rounds. */
#ifdef REAL64
#define EVEN(a, b) MIX(a, b, 0, 4, 2, 6)
#define ODD(a, b) MIX(a, b, 1, 5, 3, 7)
#else
#define EVEN(a, b) MIX(a, b, 0, 4, 1, 5)
#define ODD(a, b) MIX(a, b, 2, 6, 3, 7)
#endif
LANES_INLINE void transpose(four_reals *r) {
    four_reals a = EVEN(r[0], r[1]), b = ODD(r[0], r[1]), c = EVEN(r[2], r[3]), d = ODD(r[2], r[3]);
    r[0] = MIX(a, c, 0, 1, 4, 5);
    r[sizeof(real) == 8 ? 2 : 1] = MIX(a, c, 2, 3, 6, 7);
    r[sizeof(real) == 8 ? 1 : 2] = MIX(b, d, 0, 1, 4, 5);
    r[3] = MIX(b, d, 2, 3, 6, 7);
}
LANES_INLINE lanes4 take4(const real *array, const uint32_t *index, int64_t k) {
    four_reals half[2][4];
    for (int h = 0; h < 2; h++) {
        for (int l = 0; l < 4; l++)
            half[h][l] = *(const four_reals *)(array + 4 * (size_t)index[k + 4 * h + l]);
        transpose(half[h]);
    }
    return (lanes4){joined(half[0][0], half[1][0]), joined(half[0][1], half[1][1]), joined(half[0][2], half[1][2]),
                    joined(half[0][3], half[1][3])};
}
LANES_INLINE void put4(real *array, const uint32_t *index, int64_t k, lanes x, lanes y, lanes z, lanes w) {
    for (int h = 0; h < 2; h++) {
        four_reals half[4] = {half_of(x, h), half_of(y, h), half_of(z, h), half_of(w, h)};
        transpose(half);
        for (int l = 0; l < 4; l++)
            *(four_reals *)(array + 4 * (size_t)index[k + 4 * h + l]) = half[l];
    }
}
#endif
/* Two numbers of a particle are one load, too: of a vector, or of a double that is only copied. */
#ifdef REAL64
typedef double point __attribute__((vector_size(16), aligned(8), may_alias));
#define TWO(a, b) MIX(a, b, 0, 1, 2, 3)
#else
typedef double point __attribute__((aligned(4), may_alias));
typedef double two_points __attribute__((vector_size(16)));
#define TWO(a, b) (four_reals)(two_points){a, b}
#endif
LANES_INLINE lanes2 take(const real *array, const uint32_t *index, int64_t k) {
    const point *at = (const point *)array;
    four_reals x[2], y[2];
    for (int h = 0; h < 2; h++) {
        const uint32_t *i = index + k + 4 * h;
        four_reals a = TWO(at[i[0]], at[i[1]]), b = TWO(at[i[2]], at[i[3]]);
        x[h] = MIX(a, b, 0, 2, 4, 6);
        y[h] = MIX(a, b, 1, 3, 5, 7);
    }
    return (lanes2){joined(x[0], x[1]), joined(y[0], y[1])};
}
LANES_INLINE void put(real *array, const uint32_t *index, int64_t k, lanes x, lanes y) {
    point *at = (point *)array;
    for (int h = 0; h < 2; h++) {
        const uint32_t *i = index + k + 4 * h;
        four_reals a = half_of(x, h), b = half_of(y, h);
        four_reals c = MIX(a, b, 0, 4, 1, 5), d = MIX(a, b, 2, 6, 3, 7);
#ifdef REAL64
        at[i[0]] = MIX(c, c, 0, 1), at[i[1]] = MIX(c, c, 2, 3), at[i[2]] = MIX(d, d, 0, 1), at[i[3]] = MIX(d, d, 2, 3);
#else
        two_points p = (two_points)c, q = (two_points)d;
        at[i[0]] = p[0], at[i[1]] = p[1], at[i[2]] = q[0], at[i[3]] = q[1];
#endif
    }
}

/* Two or four numbers each of the particles k to k + 7. */
static const uint32_t consecutive[LANES] = {0, 1, 2, 3, 4, 5, 6, 7};
LANES_INLINE lanes2 load2(const real *array, int64_t k) { return take(array + 2 * k, consecutive, 0); }
LANES_INLINE void store2(real *array, int64_t k, lanes x, lanes y) { put(array + 2 * k, consecutive, 0, x, y); }
LANES_INLINE lanes4 load4(const real *array, int64_t k) { return take4(array + 4 * k, consecutive, 0); }
LANES_INLINE void store4(real *array, int64_t k, lanes x, lanes y, lanes z, lanes w) {
    put4(array + 4 * k, consecutive, 0, x, y, z, w);
}
