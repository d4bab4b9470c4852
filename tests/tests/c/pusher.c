/* The C side of tests/contract/old_client.rs: answers every frame with 3 N along y until the driver is gone. */
#include "phantom3_client.h"

int main(int argc, char **argv) {
    PhantomAttachment driver;
    PhantomFrame frame;
    char error[PHANTOM_ERROR_BYTES];
    uint64_t seen = PHANTOM_NO_TICK;
    if (argc < 2) return 2;
    if (phantom_attach(argv[1], PHANTOM_REQUEST_KIND_COMMAND, "pusher", &driver, error)) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    while (phantom_is_attached(&driver)) {
        phantom_sleep_for_frame(&driver, seen, 100 * 1000 * 1000);
        uint64_t tick = phantom_latest_tick(driver.segment);
        if (tick == seen || phantom_read_frame(driver.segment, tick, &frame) != PHANTOM_READ_OK) continue;
        seen = tick;
        PhantomCommand command = phantom_answer_to(&frame, driver.lease);
        command.devices[0].force_on_user_n[1] = 3.0;
        phantom_publish(&driver, &command);
    }
    phantom_detach(&driver);
    return 0;
}
