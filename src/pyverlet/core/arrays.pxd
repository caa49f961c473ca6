# Addresses of the data of contiguous NumPy arrays; an array of another type raises TypeError, a strided one ValueError.
# const_...: one that may be read-only. ..._in: arrays[key]. The caller keeps the array alive.
from libc.stdint cimport int32_t, int64_t, uint8_t, uint16_t, uint32_t, uint64_t
from lanes cimport real

# Code that writes two columns of numbers for so many particles, whose five columns it is given, and for a time.
ctypedef void (*column_function)(const double *given, double *values, Py_ssize_t count, double t) noexcept nogil

cdef extern from "arrays.h":
    real *reals(object array) except NULL
    real *reals_in(object arrays, object key) except NULL
    const real *const_reals(object array) except NULL
    const real *const_reals_in(object arrays, object key) except NULL
    float *singles(object array) except NULL
    const float *const_singles(object array) except NULL
    double *doubles(object array) except NULL
    double *doubles_in(object arrays, object key) except NULL
    const double *const_doubles(object array) except NULL
    int64_t *integers(object array) except NULL
    int64_t *integers_in(object arrays, object key) except NULL
    const int64_t *const_integers(object array) except NULL
    uint32_t *indices(object array) except NULL
    uint32_t *indices_in(object arrays, object key) except NULL
    const uint32_t *const_indices(object array) except NULL
    const uint32_t *const_indices_in(object arrays, object key) except NULL
    int32_t *small_integers(object array) except NULL
    int32_t *small_integers_in(object arrays, object key) except NULL
    const int32_t *const_small_integers(object array) except NULL
    uint64_t *words(object array) except NULL
    const uint64_t *const_words(object array) except NULL
    uint8_t *octets(object array) except NULL
    uint8_t *octets_in(object arrays, object key) except NULL
    const uint8_t *const_octets(object array) except NULL
    uint16_t *shorts(object array) except NULL
