/* A team of threads: one runs a frame and opens its stages, the items of which all of them share out among themselves.

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
static inline double team_clock(void) {
    LARGE_INTEGER ticks, each;
    QueryPerformanceCounter(&ticks);
    QueryPerformanceFrequency(&each);
    return (double)ticks.QuadPart / each.QuadPart;
}
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
#include <time.h>
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
static inline double team_clock(void) { /* s */
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}
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
    TEAM_POLLS = 4000,        /* looks for the end of a stage before a thread yields its processor */
    TEAM_SLEEP_POLLS = 20000, /* looks for the next run before a thread sleeps */
    TEAM_MOST = 256,          /* threads */
    TEAM_SPANS = 16,          /* parts of a frame that times are taken of */
    TEAM_BITS = 22,           /* of the number of an item */
    TEAM_ITEMS = (1 << TEAM_BITS) - 1,
    TEAM_NEXT = 1 << TEAM_BITS
};
typedef void (*team_function)(void *argument, int item);
/* Items of a stage that one thread claims first: the number of the stage (20 bits), the next item and the end (22), in one word, so that a
   claim succeeds only while the stage is open. On a cache line of its own. */
typedef struct {
    atomic_ullong claims;
    unsigned worked; /* spans in which the thread that this share is of did something, a bit for each; written by it alone */
    char apart[52];
    atomic_int taken; /* whether the number of this share is in use: see team_take_number */
    char from[60];
} team_share;
typedef struct {
    int threads; /* that there are, with the caller's */
    int parts;   /* that the present run has, at most so many */
    int quit;
    long long runs;
    int64_t process;
    team_function function;
    void *argument;
    int timed; /* whether times are taken */
    int span;  /* what the frame is at, and since when; what spans have taken, s */
    double since, spent[TEAM_SPANS];
    char apart[128];
    atomic_uint stage; /* number of the stage that is open, or was last */
    atomic_llong run;  /* its number << 16 | its parts while it lasts, else 0: in one so that a thread that wakes late reads both
                          of one run */
    char from[128];
    atomic_int left; /* items of the stage that are not done */
    char others[128];
    atomic_llong reserved; /* places of an array that are given away: see team_reserve */
    team_lock lock;
    team_signal signal;
    team_thread *ids;
    team_share share[]; /* one for each thread: a world of few particles has one, and there may be ten thousand such worlds */
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

/* Do items of the open stage, those of one's own share first, then what others have not begun. */
static inline void team_work(thread_team *t, int part, int parts) {
    int done = 0;
    for (int k = 0; k < parts; k++) {
        team_share *s = &t->share[part + k < parts ? part + k : part + k - parts];
        unsigned long long c = atomic_load_explicit(&s->claims, memory_order_acquire);
        while ((c >> TEAM_BITS & TEAM_ITEMS) < (c & TEAM_ITEMS)) {
            if (atomic_compare_exchange_weak_explicit(&s->claims, &c, c + TEAM_NEXT, memory_order_acq_rel, memory_order_acquire)) {
                t->function(t->argument, c >> TEAM_BITS & TEAM_ITEMS);
                done++;
                c += TEAM_NEXT;
            }
        }
    }
    if (done) {
        t->share[part].worked |= 1u << t->span;
        atomic_fetch_sub_explicit(&t->left, done, memory_order_release);
    }
}

/* A number below that of the threads which no other thread has until it is given back: of scratch memory. */
static inline int team_take_number(thread_team *t) {
    int number = 0;
    while (atomic_exchange_explicit(&t->share[number].taken, 1, memory_order_acquire))
        number = number + 1 < t->threads ? number + 1 : 0;
    return number;
}
static inline void team_give_number(thread_team *t, int number) {
    atomic_store_explicit(&t->share[number].taken, 0, memory_order_release);
}

/* The first of so many places that no other thread gets; team_reserved: how many have been given away, from which on it goes on. */
static inline long long team_reserve(thread_team *t, long long places) { return atomic_fetch_add(&t->reserved, places); }
static inline long long team_reserved(thread_team *t) { return atomic_load(&t->reserved); }
static inline void team_reserve_from(thread_team *t, long long place) { atomic_store(&t->reserved, place); }

/* The frame comes to what is charged to another span. */
static inline void team_enter(thread_team *t, int span) {
    if (t->timed) {
        double now = team_clock();
        t->spent[t->span] += now - t->since;
        t->since = now;
    }
    t->span = span;
}

/* Threads that have worked in a span since the last call, and its time, s. */
static inline int team_spent(thread_team *t, int span, double *spent) {
    int threads = 0;
    for (int part = 0; part < t->threads; part++) {
        threads += t->share[part].worked >> span & 1;
        t->share[part].worked &= ~(1u << span);
    }
    *spent = t->spent[span];
    t->spent[span] = 0;
    return threads > 0 ? threads : *spent > 0; /* what is no stage is done by the caller */
}

/* Called by the thread that runs the frame: have function(argument, item) called for each item up to `items`, at most TEAM_ITEMS, by
   the threads of the team that are free, or by this thread if there is no team. Returns when all are done, even if a thread is late: the others
   take its items. */
static inline void team_stage(thread_team *t, team_function function, void *argument, int items) {
    int parts = !t || items < t->parts ? items : t->parts;
    if (!t || parts < 2) {
        if (t)
            t->share[0].worked |= items > 0 ? 1u << t->span : 0;
        for (int item = 0; item < items; item++)
            function(argument, item);
        return;
    }
    unsigned stage = atomic_load_explicit(&t->stage, memory_order_relaxed) + 1;
    t->function = function; /* all shares of the last stage are claimed: these are not read now */
    t->argument = argument;
    atomic_store_explicit(&t->left, items, memory_order_relaxed);
    for (int part = 0; part < t->parts; part++) {
        unsigned long long first = (long long)items * part / t->parts, end = (long long)items * (part + 1) / t->parts;
        atomic_store_explicit(&t->share[part].claims, (unsigned long long)stage << 2 * TEAM_BITS | first << TEAM_BITS | end, memory_order_release);
    }
    atomic_store_explicit(&t->stage, stage, memory_order_release);
    team_work(t, 0, t->parts);
    for (int k = 0; atomic_load_explicit(&t->left, memory_order_acquire) > 0; k++)
        team_poll(k);
}

static TEAM_ENTRY team_member_main(void *argument) {
    team_member me = *(team_member *)argument;
    free(argument);
    thread_team *t = me.team;
    long long run = 0;
    for (;;) {
        for (int k = 0; (run = atomic_load_explicit(&t->run, memory_order_acquire)) == 0 && k < TEAM_SLEEP_POLLS; k++)
            team_pause();
        if (run == 0) {
            team_acquire(&t->lock);
            while ((run = atomic_load(&t->run)) == 0)
                team_wait(&t->signal, &t->lock);
            team_release(&t->lock);
        }
        if (t->quit)
            return 0;
        int parts = run & 0xffff;
        unsigned stage = 0;
        for (int k = 0; atomic_load_explicit(&t->run, memory_order_acquire) == run; k++) {
            unsigned now = atomic_load_explicit(&t->stage, memory_order_acquire);
            if (me.part < parts && now != stage) {
                stage = now;
                team_work(t, me.part, parts);
                k = 0;
            } else
                team_poll(k);
        }
    }
}

/* A team of at most this many threads, the caller's among them; fewer if the system gives no more. NULL without memory. */
static thread_team *team_new(int threads) {
    if (threads > TEAM_MOST)
        threads = TEAM_MOST;
    thread_team *t = (thread_team *)calloc(1, sizeof *t + threads * sizeof *t->share);
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

static inline void team_begin(thread_team *t, long long run) {
    team_acquire(&t->lock);
    atomic_store_explicit(&t->run, run, memory_order_release);
    team_wake_all(&t->signal);
    team_release(&t->lock);
}

/* Call function(argument, 0) while `parts` threads (at most all; none without a team) wait for the stages that it opens. */
static void team_run(thread_team *t, team_function function, void *argument, int parts) {
    if (t && parts > t->threads)
        parts = t->threads;
    if (!t || parts < 2 || t->process != team_process()) {
        if (t)
            t->parts = 1;
        function(argument, 0);
        return;
    }
    t->parts = parts;
    t->runs++;
    team_begin(t, t->runs << 16 | parts);
    function(argument, 0);
    atomic_store_explicit(&t->run, 0, memory_order_release);
}

/* End the threads of this process and free the team. */
static void team_free(thread_team *t) {
    if (!t)
        return;
    if (t->process == team_process()) {
        t->quit = 1;
        team_begin(t, -1);
        for (int part = 1; part < t->threads; part++)
            team_join(t->ids[part]);
    }
    free(t->ids);
    free(t);
}
