# See processor.h.
cdef extern from "processor.h":
    int x86_64_level()
    const char *compiler_name()
