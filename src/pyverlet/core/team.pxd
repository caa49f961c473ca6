# A team of threads that share out the items of a stage: see team.h.
cdef extern from "team.h" nogil:
    ctypedef struct thread_team:
        int threads
        int parts
        int timed
        int span
        double since
    ctypedef void (*team_function)(void *argument, int item) noexcept nogil
    thread_team *team_new(int threads)
    void team_run(thread_team *team, team_function function, void *argument, int parts)
    void team_stage(thread_team *team, team_function function, void *argument, int items)
    int team_take_number(thread_team *team)
    void team_give_number(thread_team *team, int number)
    long long team_reserve(thread_team *team, long long places)
    long long team_reserved(thread_team *team)
    void team_reserve_from(thread_team *team, long long place)
    void team_enter(thread_team *team, int span)
    int team_spent(thread_team *team, int span, double *spent)
    double team_clock()
    void team_free(thread_team *team)
