/* The C side of tests/c_client.rs.
 *
 *     c_client SOCKET command N   answers ticks 0 to N - 1, each after checking its frame word by word
 *     c_client SOCKET observe N   waits for frame N - 1 and checks it
 *     c_client SOCKET version     claims to be of ABI version 99.7
 *     c_client SOCKET attach N    attaches with a request of kind N
 *     c_client SOCKET ask WHAT    stop, emergency-stop, clear-fault, zero (devices 0 and 2) or end-lease
 *     c_client SOCKET send-stop   only by datagram; prints what came of it
 */
#include "phantom3_client.h"

#include <stdlib.h>

/* The same function as `word_of` in tests/common/mod.rs: every word tells its tick and its place. */
static uint64_t word_of(uint64_t tick, uint64_t place) { return (tick * (2 * place + 1)) ^ (place << 48); }

/* The driver of the test has two devices; what is behind them is zero. */
static int is_whole(const PhantomFrame *frame, uint64_t tick) {
    uint64_t words[PHANTOM_FRAME_WORDS];
    memcpy(words, frame, sizeof words);
    uint64_t existing = offsetof(PhantomFrame, devices[2]) / sizeof *words;
    for (uint64_t place = 0; place < PHANTOM_FRAME_WORDS; place++)
        if (words[place] != (place < existing ? word_of(tick, place) : 0)) return 0;
    return 1;
}

static void wait_for(const PhantomAttachment *driver, uint64_t tick) {
    for (;;) {
        uint64_t seen = phantom_latest_tick(driver->segment);
        if (seen != PHANTOM_NO_TICK && seen >= tick) return;
        if (!phantom_is_attached(driver)) {
            fprintf(stderr, "the driver is gone at tick %llu\n", (unsigned long long)tick);
            exit(1);
        }
        phantom_sleep_for_frame(driver, seen, 1000 * 1000 * 1000);
    }
}

static void read_whole(const PhantomAttachment *driver, uint64_t tick, PhantomFrame *frame) {
    wait_for(driver, tick);
    PhantomRead read = phantom_read_frame(driver->segment, tick, frame);
    if (read == PHANTOM_READ_OK && is_whole(frame, tick)) return;
    fprintf(stderr, "frame %llu: read %d, or not whole\n", (unsigned long long)tick, (int)read);
    exit(1);
}

static void answer(const PhantomAttachment *driver, const PhantomFrame *frame) {
    PhantomCommand command = phantom_answer_to(frame, driver->lease);
    command.device_count = 2;
    for (int device = 0; device < 2; device++)
        for (int axis = 0; axis < 3; axis++)
            command.devices[device].force_on_user_n[axis] = (double)frame->tick + 10.0 * device + axis;
    phantom_publish(driver, &command);
}

static int ask(const char *socket, const char *what) {
    char error[PHANTOM_ERROR_BYTES] = "no such request";
    int failed = -1;
    errno = ERANGE;
    if (!strcmp(what, "stop")) failed = phantom_stop(socket, "c_client", error);
    if (!strcmp(what, "emergency-stop")) failed = phantom_emergency_stop(socket, "c_client", error);
    if (!strcmp(what, "clear-fault")) failed = phantom_clear_fault(socket, "c_client", error);
    if (!strcmp(what, "zero")) failed = phantom_zero(socket, "c_client", 5, error);
    if (!strcmp(what, "end-lease")) failed = phantom_end_lease(socket, "c_client", error);
    if (errno != ERANGE) return 3;
    if (failed) fprintf(stderr, "%s\n", error);
    return failed ? 1 : 0;
}

static int send_stop(const char *socket) {
    errno = ERANGE;
    printf("%d\n", phantom_send_stop(socket));
    return errno == ERANGE ? 0 : 3;
}

/* What getenv gives of a variable that is not set, and an attachment that never was one. */
static int nothing(void) {
    PhantomAttachment driver;
    char error[PHANTOM_ERROR_BYTES];
    if (phantom_send_stop(NULL) != -1 || phantom_emergency_stop(NULL, NULL, error) != -1) return 3;
    if (phantom_attach(NULL, PHANTOM_REQUEST_KIND_OBSERVE, NULL, &driver, error) != -1) return 3;
    fprintf(stderr, "%s\n", error);
    if (phantom_is_attached(&driver)) return 4;
    memset(&driver, 0, sizeof driver);
    return phantom_is_attached(&driver) ? 4 : 0;
}

int main(int argc, char **argv) {
    if (argc == 2 && !strcmp(argv[1], "nothing")) return nothing();
    if (argc < 3) return 2;
    if (!strcmp(argv[2], "send-stop")) return send_stop(argv[1]);
    if (argc > 3 && !strcmp(argv[2], "ask")) return ask(argv[1], argv[3]);
    int commands = !strcmp(argv[2], "command");
    PhantomRequest request =
        phantom_request(commands ? PHANTOM_REQUEST_KIND_COMMAND : PHANTOM_REQUEST_KIND_OBSERVE, "c_client");
    if (argc > 3 && !strcmp(argv[2], "attach")) request.kind = strtoull(argv[3], NULL, 10);
    if (!strcmp(argv[2], "version")) request.abi_version = (UINT64_C(99) << 32) | 7;

    PhantomAttachment driver;
    char error[PHANTOM_ERROR_BYTES];
    if (phantom_attach_with(argv[1], &request, &driver, error)) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    uint64_t ticks = argc > 3 ? strtoull(argv[3], NULL, 10) : 1;
    /* What stood there before must not be seen. */
    PhantomFrame frame;
    memset(&frame, 0xff, sizeof frame);
    if (commands) {
        for (uint64_t tick = 0; tick < ticks; tick++) {
            read_whole(&driver, tick, &frame);
            answer(&driver, &frame);
        }
        if (ticks > PHANTOM_RING_FRAMES && phantom_read_frame(driver.segment, 0, &frame) != PHANTOM_READ_OVERWRITTEN)
            return 3;
        /* Still attached, so that the driver reads the last answer under our lease. */
        while (phantom_is_attached(&driver)) usleep(1000);
    } else {
        read_whole(&driver, ticks - 1, &frame);
        if (phantom_read_frame(driver.segment, ticks + PHANTOM_RING_FRAMES, &frame) != PHANTOM_READ_NOT_YET) return 3;
    }
    printf("%llu ticks whole\n", (unsigned long long)ticks);
    phantom_detach(&driver);
    return phantom_is_attached(&driver) ? 4 : 0;
}
