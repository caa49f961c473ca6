/* Addresses of the data of NumPy arrays, by the buffer protocol. The caller keeps the array alive.
   name_in(arrays, key): of arrays[key], whatever that is a dict or a tuple of, in a fifth of the machine code. */
#pragma once
#include <Python.h>
#include "lanes.h"

#ifdef REAL64
#define REAL_NAME "float64"
#else
#define REAL_NAME "float32"
#endif

/* kinds: the format characters allowed, one of which the array must have, with items of `size` bytes. */
static void *array_data(PyObject *array, const char *kinds, Py_ssize_t size, int writable, const char *wanted) {
    Py_buffer view;
    int flags = PyBUF_FORMAT | PyBUF_C_CONTIGUOUS | (writable ? PyBUF_WRITABLE : 0);
    if (PyObject_GetBuffer(array, &view, flags))
        return NULL;
    void *data = view.buf;
    const char *format = view.format ? view.format : "B";
    if (*format == '@' || *format == '=' || *format == '<')
        format++;
    if (view.itemsize != size || format[1] || !strchr(kinds, format[0])) {
        PyErr_Format(PyExc_TypeError, "the array has items %s of %zd bytes; allowed is %s", format, view.itemsize, wanted);
        data = NULL;
    }
    PyBuffer_Release(&view);
    return data;
}
#define ARRAY_IN(name, type)                                                                                            \
    static __attribute__((noinline, unused)) type *name##_in(PyObject *arrays, PyObject *key) {                         \
        PyObject *array = PyObject_GetItem(arrays, key);                                                                \
        type *data = array ? name(array) : NULL;                                                                        \
        Py_XDECREF(array);                                                                                              \
        return data;                                                                                                    \
    }
#define ARRAY_DATA(name, type, kinds, wanted)                                                                           \
    static inline type *name(PyObject *array) { return (type *)array_data(array, kinds, sizeof(type), 1, wanted); }     \
    static inline const type *const_##name(PyObject *array) {                                                           \
        return (const type *)array_data(array, kinds, sizeof(type), 0, wanted);                                         \
    }                                                                                                                   \
    ARRAY_IN(name, type)                                                                                                \
    ARRAY_IN(const_##name, const type)
ARRAY_DATA(reals, real, "fd", REAL_NAME)
ARRAY_DATA(singles, float, "f", "float32")
ARRAY_DATA(doubles, double, "d", "float64")
ARRAY_DATA(integers, int64_t, "lq", "int64")
ARRAY_DATA(small_integers, int32_t, "il", "int32")
ARRAY_DATA(indices, uint32_t, "IL", "uint32")
ARRAY_DATA(words, uint64_t, "LQ", "uint64")
ARRAY_DATA(shorts, uint16_t, "H", "uint16")
ARRAY_DATA(octets, uint8_t, "B?", "uint8 or bool")
