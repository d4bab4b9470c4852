/* The C side of tests/faults/c_program.rs.
 *
 *     operator SOCKET push N     answers every frame with N newtons along y until the driver is gone
 *     operator SOCKET attach N   tries to attach with a request of kind N
 *     operator SOCKET WHAT       asks for it: emergency-stop, clear-fault, zero, end-lease or stop
 */
#include "phantom3_client.h"

#include <stdlib.h>

static int push(const char *socket, double force_n) {
    PhantomAttachment driver;
    PhantomFrame frame;
    char error[PHANTOM_ERROR_BYTES];
    uint64_t seen = PHANTOM_NO_TICK;
    if (phantom_attach(socket, PHANTOM_REQUEST_KIND_COMMAND, "operator", &driver, error)) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    while (phantom_is_attached(&driver)) {
        phantom_sleep_for_frame(&driver, seen, 100 * 1000 * 1000);
        uint64_t tick = phantom_latest_tick(driver.segment);
        if (tick == seen || phantom_read_frame(driver.segment, tick, &frame) != PHANTOM_READ_OK) continue;
        seen = tick;
        PhantomCommand command = phantom_answer_to(&frame, driver.lease);
        command.devices[0].force_on_user_n[1] = force_n;
        phantom_publish(&driver, &command);
    }
    phantom_detach(&driver);
    return 0;
}

static int attach(const char *socket, uint64_t kind) {
    PhantomAttachment driver;
    char error[PHANTOM_ERROR_BYTES];
    if (!phantom_attach(socket, kind, "operator", &driver, error)) {
        phantom_detach(&driver);
        return 0;
    }
    fprintf(stderr, "%s\n", error);
    return 1;
}

static int ask(const char *socket, const char *what) {
    char error[PHANTOM_ERROR_BYTES] = "no such request";
    int failed = -1;
    if (!strcmp(what, "emergency-stop")) failed = phantom_emergency_stop(socket, "operator", error);
    if (!strcmp(what, "clear-fault")) failed = phantom_clear_fault(socket, "operator", error);
    if (!strcmp(what, "zero")) failed = phantom_zero(socket, "operator", 0, error);
    if (!strcmp(what, "end-lease")) failed = phantom_end_lease(socket, "operator", error);
    if (!strcmp(what, "stop")) failed = phantom_stop(socket, "operator", error);
    if (failed) fprintf(stderr, "%s\n", error);
    return failed ? 1 : 0;
}

int main(int argc, char **argv) {
    if (argc < 3) return 2;
    if (argc > 3 && !strcmp(argv[2], "push")) return push(argv[1], atof(argv[3]));
    if (argc > 3 && !strcmp(argv[2], "attach")) return attach(argv[1], strtoull(argv[3], NULL, 10));
    return ask(argv[1], argv[2]);
}
