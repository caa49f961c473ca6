# A team of threads that run through one function together: see team.h.
cdef extern from "team.h" nogil:
    ctypedef struct thread_team:
        int threads
        int parts
    ctypedef void (*team_function)(void *argument, int part, int parts) noexcept nogil
    thread_team *team_new(int threads)
    void team_run(thread_team *team, team_function function, void *argument, int parts)
    void team_barrier(thread_team *team)
    void team_free(thread_team *team)
