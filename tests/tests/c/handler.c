/* The C side of tests/faults/c_program.rs: stops in a signal handler that comes into the midst of allocations.
 *
 *     handler SOCKET WHAT N     N times: send-stop or emergency-stop, each half a millisecond after the one before
 */
#include "phantom3_client.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

static const char *path;
static int is_by_datagram_only;
static volatile sig_atomic_t ended, refused;

static void stop(int signal_number) {
    char error[PHANTOM_ERROR_BYTES];
    (void)signal_number;
    int failed = is_by_datagram_only ? phantom_send_stop(path) < 0 : phantom_emergency_stop(path, "handler", error);
    refused = refused + (failed ? 1 : 0);
    ended = ended + 1;
    /* Only then the next one: a slow machine must not be in here for ever. */
    struct itimerval soon = {{0, 0}, {0, 500}};
    setitimer(ITIMER_REAL, &soon, NULL);
}

/* Nearly always within an allocation, whose lock is held then. */
static void allocate(unsigned *seed) {
    void *blocks[1000];
    for (int i = 0; i < 1000; i++) blocks[i] = malloc(16 + (size_t)(rand_r(seed) % 2000));
    for (int i = 0; i < 1000; i++) free(blocks[i]);
}

static void *allocate_for_ever(void *nothing) {
    unsigned seed = 1;
    for (;;) allocate(&seed);
    return nothing;
}

int main(int argc, char **argv) {
    if (argc < 4) return 2;
    path = argv[1];
    is_by_datagram_only = !strcmp(argv[2], "send-stop");
    int times = atoi(argv[3]);
    unsigned seed = 2;
    pthread_t other;
    struct sigaction on_alarm;
    memset(&on_alarm, 0, sizeof on_alarm);
    on_alarm.sa_handler = stop;
    sigset_t alarms;
    sigemptyset(&alarms);
    sigaddset(&alarms, SIGALRM);
    /* The thread that is made allocates only, this one is interrupted, too. */
    pthread_sigmask(SIG_BLOCK, &alarms, NULL);
    if (pthread_create(&other, NULL, allocate_for_ever, NULL)) return 2;
    pthread_sigmask(SIG_UNBLOCK, &alarms, NULL);
    sigaction(SIGALRM, &on_alarm, NULL);
    raise(SIGALRM);
    while (ended < times) allocate(&seed);
    printf("%d stops, %d refused\n", times, (int)refused);
    return 0;
}
