cdef extern from "processor.h":
    bint has_x86_64_v3()
