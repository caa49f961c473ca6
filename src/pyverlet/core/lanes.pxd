# Eight lanes, for Cython: it sees a lane vector as one number and leaves the arithmetic to C.
# With REAL64, C has doubles where it has floats.
from libc.stdint cimport int64_t, uint32_t

cdef extern from "lanes.h" nogil:
    ctypedef float real
    ctypedef float lanes
    ctypedef int mask
    ctypedef struct lanes2:
        lanes x
        lanes y
    ctypedef struct lanes4:
        lanes x
        lanes y
        lanes z
        lanes w
    int LANES
    lanes spread(real a)
    lanes load(const real *array, int64_t k)
    void store(real *array, int64_t k, lanes a)
    mask above(lanes a, lanes b)
    mask equal(lanes a, lanes b)
    mask both(mask a, mask b)
    mask either(mask a, mask b)
    mask outside(mask a)
    lanes choose(mask m, lanes a, lanes b)
    bint any_lane(mask m)
    int bits_of(mask m)
    int lowest_bit(uint32_t bits)
    bint any_above(lanes a, lanes b)
    lanes larger(lanes a, lanes b)
    lanes smaller(lanes a, lanes b)
    real largest_lane(lanes a)
    lanes where_zero(lanes test, lanes a, lanes b)
    lanes magnitude(lanes a)
    lanes square_root(lanes a)
    lanes sum_of_pairs(lanes a)
    lanes gather(const real *array, const uint32_t *index, int64_t k)
    void scatter(real *array, const uint32_t *index, int64_t k, lanes a)
    lanes2 take(const real *array, const uint32_t *index, int64_t k)
    void put(real *array, const uint32_t *index, int64_t k, lanes x, lanes y)
    lanes4 take4(const real *array, const uint32_t *index, int64_t k)
    void put4(real *array, const uint32_t *index, int64_t k, lanes x, lanes y, lanes z, lanes w)
    lanes2 load2(const real *array, int64_t k)
    void store2(real *array, int64_t k, lanes x, lanes y)
    lanes4 load4(const real *array, int64_t k)
    void store4(real *array, int64_t k, lanes x, lanes y, lanes z, lanes w)
