# See processor.h.
cdef extern from "processor.h":
    bint has_x86_64_v3()
    const char *compiler_name()
