/* The C side of tests/minor_versions.rs. Compiled with the headers of one version, it prints every number that
 * these headers know, and answers each tick that it is told to.
 *
 *     c_reader SOCKET observe TICK           reads frame TICK
 *     c_reader SOCKET command TICK COUNT     and answers it and those after it: the force is the position
 *
 * The lists of fields are made by the test from the headers themselves.
 */
#include "phantom3_client.h"

#include <inttypes.h>
#include <stdlib.h>

static void print_uint64_t(const char *name, uint64_t value) { printf("%s = %" PRIu64 "\n", name, value); }
static void print_int64_t(const char *name, int64_t value) { printf("%s = %" PRId64 "\n", name, value); }
static void print_double(const char *name, double value) { printf("%s = %.17g\n", name, value); }
static void print_bits(const char *name, uint64_t bits) {
    double value;
    memcpy(&value, &bits, sizeof value);
    print_double(name, value);
}

static void print_frame(const PhantomFrame *here) {
#define FIELD(type, name, value) print_##type("PhantomFrame." name, here->value);
#include "PhantomFrame.inc"
#undef FIELD
}

static void print_header(const PhantomDriverHeader *here) {
#define FIELD(type, name, value) print_##type("PhantomDriverHeader." name, __atomic_load_n(&here->value, __ATOMIC_RELAXED));
#include "PhantomDriverHeader.inc"
#undef FIELD
}

static void print_description(const PhantomDeviceDescription *here) {
#define FIELD(type, name, value) print_##type("PhantomDeviceDescription." name, __atomic_load_n(&here->value, __ATOMIC_RELAXED));
#include "PhantomDeviceDescription.inc"
#undef FIELD
}

static void print_counters(const PhantomCounters *here) {
#define FIELD(type, name, value) print_##type("PhantomCounters." name, __atomic_load_n(&here->value, __ATOMIC_RELAXED));
#include "PhantomCounters.inc"
#undef FIELD
}

/* A number that these headers do not list is told as a number. */
static void print_fault(uint64_t fault) {
    switch (fault) {
    case PHANTOM_FAULT_REASON_NONE: printf("no fault\n"); break;
    case PHANTOM_FAULT_REASON_PANIC: printf("a fault that is known: the loop panicked\n"); break;
    default: printf("a fault of kind %" PRIu64 "\n", fault);
    }
}

static void read_frame(const PhantomAttachment *driver, uint64_t tick, PhantomFrame *frame) {
    while (phantom_is_attached(driver)) {
        uint64_t seen = phantom_latest_tick(driver->segment);
        if (seen != PHANTOM_NO_TICK && seen >= tick) break;
        phantom_sleep_for_frame(driver, seen, 1000 * 1000 * 1000);
    }
    if (phantom_read_frame(driver->segment, tick, frame) == PHANTOM_READ_OK) return;
    fprintf(stderr, "no frame %" PRIu64 "\n", tick);
    exit(1);
}

static void answer(const PhantomAttachment *driver, const PhantomFrame *frame) {
    PhantomCommand command = phantom_answer_to(frame, driver->lease);
    for (uint64_t device = 0; device < frame->device_count && device < PHANTOM_MAX_DEVICES; device++)
        memcpy(command.devices[device].force_on_user_n, frame->devices[device].position_m_measured,
               sizeof command.devices[device].force_on_user_n);
    phantom_publish(driver, &command);
}

int main(int argc, char **argv) {
    if (argc < 4) return 2;
    int commands = !strcmp(argv[2], "command");
    uint64_t kind = commands ? PHANTOM_REQUEST_KIND_COMMAND : PHANTOM_REQUEST_KIND_OBSERVE;
    uint64_t first = strtoull(argv[3], NULL, 10), count = argc > 4 ? strtoull(argv[4], NULL, 10) : 1;
    PhantomAttachment driver;
    PhantomFrame frame;
    char error[PHANTOM_ERROR_BYTES];
    if (phantom_attach(argv[1], kind, "c_reader", &driver, error)) {
        fprintf(stderr, "%s\n", error);
        return 1;
    }
    for (uint64_t tick = first; tick < first + count; tick++) {
        read_frame(&driver, tick, &frame);
        if (commands) answer(&driver, &frame);
    }
    printf("built for %u.%u\n", (unsigned)PHANTOM_ABI_MAJOR, (unsigned)PHANTOM_ABI_MINOR);
    print_frame(&frame);
    print_header(&driver.segment->header);
    print_description(&driver.segment->devices[0]);
    print_counters(&driver.segment->counters);
    print_fault(frame.fault);
    fflush(stdout);
    /* Still attached, so that the driver reads the last answer under our lease. */
    while (commands && phantom_is_attached(&driver)) usleep(1000);
    phantom_detach(&driver);
    return 0;
}
