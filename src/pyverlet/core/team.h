/* A team of threads that run through one function together, each with its number, and wait for each other at barriers.

   Made once; between two runs its threads sleep. A process that was forked has none of them: there a run has one part. */
#pragma once
#include <stdatomic.h>
#include <stdint.h>
#include <stdlib.h>
#ifdef _WIN32
#include <process.h>
#include <windows.h>
typedef SRWLOCK team_lock;
typedef CONDITION_VARIABLE team_signal;
typedef HANDLE team_thread;
#define TEAM_ENTRY unsigned __stdcall
static inline void team_lock_init(team_lock *l) { InitializeSRWLock(l); }
static inline void team_signal_init(team_signal *s) { InitializeConditionVariable(s); }
static inline void team_acquire(team_lock *l) { AcquireSRWLockExclusive(l); }
static inline void team_release(team_lock *l) { ReleaseSRWLockExclusive(l); }
static inline void team_wait(team_signal *s, team_lock *l) { SleepConditionVariableSRW(s, l, INFINITE, 0); }
static inline void team_wake_all(team_signal *s) { WakeAllConditionVariable(s); }
static inline void team_yield(void) { SwitchToThread(); }
static inline int64_t team_process(void) { return 0; } /* Windows does not fork */
static inline int team_start(team_thread *t, unsigned(__stdcall *entry)(void *), void *argument) {
    *t = (HANDLE)_beginthreadex(0, 0, entry, argument, 0, 0);
    return *t != 0;
}
static inline void team_join(team_thread t) {
    WaitForSingleObject(t, INFINITE);
    CloseHandle(t);
}
#else
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>
typedef pthread_mutex_t team_lock;
typedef pthread_cond_t team_signal;
typedef pthread_t team_thread;
#define TEAM_ENTRY void *
static inline void team_lock_init(team_lock *l) { pthread_mutex_init(l, 0); }
static inline void team_signal_init(team_signal *s) { pthread_cond_init(s, 0); }
static inline void team_acquire(team_lock *l) { pthread_mutex_lock(l); }
static inline void team_release(team_lock *l) { pthread_mutex_unlock(l); }
static inline void team_wait(team_signal *s, team_lock *l) { pthread_cond_wait(s, l); }
static inline void team_wake_all(team_signal *s) { pthread_cond_broadcast(s); }
static inline void team_yield(void) { sched_yield(); }
static inline int64_t team_process(void) { return getpid(); }
static inline int team_start(team_thread *t, void *(*entry)(void *), void *argument) {
    sigset_t all, before; /* signals are for Python's own threads */
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    int failed = pthread_create(t, 0, entry, argument);
    pthread_sigmask(SIG_SETMASK, &before, 0);
    return !failed;
}
static inline void team_join(team_thread t) { pthread_join(t, 0); }
#endif

enum {
    TEAM_POLLS = 4000,       /* looks at a barrier before a thread yields its processor */
    TEAM_SLEEP_POLLS = 20000 /* looks for the next run before a thread sleeps */
};
typedef void (*team_function)(void *argument, int part, int parts);
typedef struct {
    int threads; /* that there are, with the caller's */
    int parts;   /* that the present run has, at most so many */
    int quit;
    int64_t process;
    team_function function;
    void *argument;
    atomic_int arrived, phase, working;
    atomic_llong run; /* its number << 16 | its parts, in one so that a thread that wakes late reads both of one run */
    team_lock lock;
    team_signal signal;
    team_thread *ids;
} thread_team;
typedef struct {
    thread_team *team;
    int part;
} team_member;

static inline void team_pause(void) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    __asm__ volatile("yield");
#endif
}
static inline void team_poll(int k) {
    if (k < TEAM_POLLS)
        team_pause();
    else
        team_yield();
}

/* Wait until all parts of this run are here. What they wrote before is seen by all after it. */
static inline void team_barrier(thread_team *t) {
    if (t->parts == 1)
        return;
    int phase = atomic_load_explicit(&t->phase, memory_order_relaxed);
    if (atomic_fetch_add_explicit(&t->arrived, 1, memory_order_acq_rel) == t->parts - 1) {
        atomic_store_explicit(&t->arrived, 0, memory_order_relaxed);
        atomic_store_explicit(&t->phase, phase + 1, memory_order_release);
        return;
    }
    for (int k = 0; atomic_load_explicit(&t->phase, memory_order_acquire) == phase; k++)
        team_poll(k);
}

static TEAM_ENTRY team_member_main(void *argument) {
    team_member me = *(team_member *)argument;
    free(argument);
    thread_team *t = me.team;
    long long seen = 0;
    for (;;) {
        for (int k = 0; atomic_load_explicit(&t->run, memory_order_acquire) == seen && k < TEAM_SLEEP_POLLS; k++)
            team_pause();
        if (atomic_load(&t->run) == seen) {
            team_acquire(&t->lock);
            while (atomic_load(&t->run) == seen)
                team_wait(&t->signal, &t->lock);
            team_release(&t->lock);
        }
        seen = atomic_load(&t->run);
        if (t->quit)
            return 0;
        int parts = seen & 0xffff;
        if (me.part < parts) {
            t->function(t->argument, me.part, parts);
            atomic_fetch_sub_explicit(&t->working, 1, memory_order_release);
        }
    }
}

/* A team of at most this many threads, the caller's among them; fewer if the system gives no more. NULL without memory. */
static thread_team *team_new(int threads) {
    thread_team *t = (thread_team *)calloc(1, sizeof *t);
    if (!t || !(t->ids = (team_thread *)calloc(threads, sizeof *t->ids))) {
        free(t);
        return 0;
    }
    t->threads = 1;
    t->process = team_process();
    team_lock_init(&t->lock);
    team_signal_init(&t->signal);
    for (int part = 1; part < threads; part++) {
        team_member *m = (team_member *)malloc(sizeof *m);
        if (!m)
            break;
        *m = (team_member){t, part};
        if (!team_start(&t->ids[part], team_member_main, m)) {
            free(m);
            break;
        }
        t->threads++;
    }
    return t;
}

static inline void team_begin(thread_team *t, int parts) {
    team_acquire(&t->lock);
    long long number = atomic_load(&t->run) >> 16;
    atomic_store_explicit(&t->run, (number + 1) << 16 | parts, memory_order_release);
    team_wake_all(&t->signal);
    team_release(&t->lock);
}

/* Run the function on `parts` threads (at most all), the caller's being part 0; returns when all are through. */
static void team_run(thread_team *t, team_function function, void *argument, int parts) {
    if (parts > t->threads)
        parts = t->threads;
    if (parts < 2 || t->process != team_process()) {
        t->parts = 1;
        function(argument, 0, 1);
        return;
    }
    t->parts = parts;
    t->function = function;
    t->argument = argument;
    atomic_store(&t->working, parts - 1);
    team_begin(t, parts);
    function(argument, 0, parts);
    for (int k = 0; atomic_load_explicit(&t->working, memory_order_acquire); k++)
        team_poll(k);
}

/* End the threads of this process and free the team. */
static void team_free(thread_team *t) {
    if (!t)
        return;
    if (t->process == team_process()) {
        t->quit = 1;
        team_begin(t, 0);
        for (int part = 1; part < t->threads; part++)
            team_join(t->ids[part]);
    }
    free(t->ids);
    free(t);
}
