/* A client of the haptic driver in C11 (GCC or Clang, Linux): attach, read frames, command.
 *
 * Everything is static inline; there is nothing to link. Include this before any system header, or define
 * _GNU_SOURCE yourself.
 *
 *     PhantomAttachment driver;
 *     char error[PHANTOM_ERROR_BYTES];
 *     if (phantom_attach("/run/phantom3/driver.sock", PHANTOM_REQUEST_KIND_COMMAND, "me", &driver, error)) {
 *         fprintf(stderr, "%s\n", error);
 *         return 1;
 *     }
 *     uint64_t seen = PHANTOM_NO_TICK;
 *     PhantomFrame frame;
 *     while (phantom_is_attached(&driver)) {
 *         phantom_sleep_for_frame(&driver, seen, 100 * 1000 * 1000);
 *         uint64_t tick = phantom_latest_tick(driver.segment);
 *         if (tick == seen || phantom_read_frame(driver.segment, tick, &frame) != PHANTOM_READ_OK) continue;
 *         seen = tick;
 *         PhantomCommand command = phantom_answer_to(&frame, driver.lease);
 *         command.devices[0].force_on_user_n[1] = ...;
 *         phantom_publish(&driver, &command);
 *     }
 *     phantom_detach(&driver);
 *
 * The same rules as in Rust: a value is whole or it is not returned; what the driver wrote is checked before
 * it is believed; the lease lasts as long as the connection is open, and one thread publishes.
 *
 * Signal handlers may call phantom_send_stop, which never waits, and phantom_emergency_stop, phantom_stop,
 * phantom_clear_fault, phantom_zero and phantom_end_lease, which wait for an answer for up to seven seconds. These call
 * nothing but what POSIX calls async-signal-safe: no allocation, no lock, no printf. They need 12 KiB of stack, and on an
 * alternate one no more than that and what the kernel takes of it (AT_MINSIGSTKSZ), and leave errno as it is. Of the
 * others phantom_latest_tick, phantom_read_frame and phantom_is_attached may be called there; phantom_attach,
 * phantom_detach, phantom_publish and phantom_sleep_for_frame may not.
 *
 * A path is neither NULL nor empty: every function that takes one fails then. A name that is NULL is an empty one.
 */
#ifndef PHANTOM3_CLIENT_H
#define PHANTOM3_CLIENT_H

#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif

#include "phantom3_shm.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/futex.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

/* Room for the longest message. */
#define PHANTOM_ERROR_BYTES 512
/* What phantom_latest_tick returns before the first frame; also "nothing seen yet". */
#define PHANTOM_NO_TICK UINT64_MAX
/* A driver that does not answer within this time is stopped or hung [s]. */
#define PHANTOM_ANSWER_TIMEOUT_S 2
/* How many symbolic links a path may lead through; the kernel's own bound. */
#define PHANTOM_MAX_LINKS 40
/* Room for a path and for what a symbolic link leads to. More than a socket's address has: the next link may lead to a short
 * name. */
#define PHANTOM_PATH_BYTES 1024

/* What an application holds of the driver. */
typedef struct PhantomAttachment {
    /* The driver's segment, mapped read-only. */
    const PhantomDriverSegment *segment;
    /* The commander's segment; NULL for an observer. */
    PhantomCommanderSegment *commander;
    /* The number to put into every command; 0 for an observer. */
    uint64_t lease;
    /* The connection, which is the lease. */
    int connection;
} PhantomAttachment;

/* How a read ended. */
typedef enum PhantomRead {
    PHANTOM_READ_OK,
    /* The tick has not come. */
    PHANTOM_READ_NOT_YET,
    /* The ring has gone round. */
    PHANTOM_READ_OVERWRITTEN,
    /* It was being written; try again, or take a newer one. */
    PHANTOM_READ_TORN,
} PhantomRead;

/* The sequence word of value k once it stands whole. */
static inline uint64_t phantom_stamp(uint64_t k) { return 2 * k + 2; }

/* The tick of the newest frame, or PHANTOM_NO_TICK. */
static inline uint64_t phantom_latest_tick(const PhantomDriverSegment *segment) {
    return __atomic_load_n(&segment->bell.latest_plus_one, __ATOMIC_ACQUIRE) - 1;
}

/* The words of a frame that mean something: the devices come last in it, and their number never changes. */
static inline size_t phantom_frame_words(const PhantomDriverSegment *segment) {
    uint64_t count = __atomic_load_n(&segment->header.device_count, __ATOMIC_RELAXED);
    if (count > PHANTOM_MAX_DEVICES) count = PHANTOM_MAX_DEVICES;
    return (offsetof(PhantomFrame, devices) + (size_t)count * sizeof(PhantomDeviceFrame)) / sizeof(uint64_t);
}

/* Reads frame `tick` whole, or says why it cannot be had; `frame` is unchanged then. Devices that the driver has
 * not are zero. */
static inline PhantomRead phantom_read_frame(const PhantomDriverSegment *segment, uint64_t tick,
                                             PhantomFrame *frame) {
    const PhantomFrameSlot *slot = &segment->frames[tick % PHANTOM_RING_FRAMES];
    const size_t used = phantom_frame_words(segment);
    uint64_t words[PHANTOM_FRAME_WORDS];
    if (tick >= UINT64_MAX / 2) return PHANTOM_READ_NOT_YET;
    uint64_t before = __atomic_load_n(&slot->sequence, __ATOMIC_ACQUIRE);
    if (before & 1) return PHANTOM_READ_TORN;
    for (size_t i = 0; i < used; i++) words[i] = __atomic_load_n(&slot->words[i], __ATOMIC_RELAXED);
    /* Whoever saw a word of a later write must also see that write's odd sequence. */
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&slot->sequence, __ATOMIC_RELAXED) != before) return PHANTOM_READ_TORN;
    if (before < phantom_stamp(tick)) return PHANTOM_READ_NOT_YET;
    if (before > phantom_stamp(tick)) return PHANTOM_READ_OVERWRITTEN;
    memcpy(frame, words, used * sizeof *words);
    memset((char *)frame + used * sizeof *words, 0, sizeof *frame - used * sizeof *words);
    return PHANTOM_READ_OK;
}

/* A command of zero force that answers `frame`. */
static inline PhantomCommand phantom_answer_to(const PhantomFrame *frame, uint64_t lease) {
    PhantomCommand command;
    memset(&command, 0, sizeof command);
    command.tick = frame->tick;
    command.lease = lease;
    command.device_count = frame->device_count;
    return command;
}

/* Answers a tick and wakes the driver if it sleeps. One thread only. */
static inline void phantom_publish(const PhantomAttachment *driver, const PhantomCommand *command) {
    PhantomCommandSlot *slot = &driver->commander->commands[command->tick % PHANTOM_RING_COMMANDS];
    PhantomBell *bell = &driver->commander->bell;
    uint64_t words[PHANTOM_COMMAND_WORDS];
    memcpy(words, command, sizeof words);
    __atomic_store_n(&slot->sequence, phantom_stamp(command->tick) - 1, __ATOMIC_RELAXED);
    /* No word of the value may become visible before the odd sequence. */
    __atomic_thread_fence(__ATOMIC_RELEASE);
    for (size_t i = 0; i < PHANTOM_COMMAND_WORDS; i++) __atomic_store_n(&slot->words[i], words[i], __ATOMIC_RELAXED);
    __atomic_store_n(&slot->sequence, phantom_stamp(command->tick), __ATOMIC_RELEASE);
    __atomic_store_n(&bell->latest_plus_one, command->tick + 1, __ATOMIC_RELEASE);
    __atomic_store_n(&bell->doorbell, (uint32_t)(command->tick + 1), __ATOMIC_RELEASE);
    /* Pairs with the fence of a sleeper: one of the two sees the other. */
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    if (__atomic_load_n(&driver->segment->bell.owner_sleeps, __ATOMIC_RELAXED))
        syscall(SYS_futex, &bell->doorbell, FUTEX_WAKE, INT_MAX, NULL, NULL, 0);
}

/* Sleeps until there is a frame other than `seen`, `timeout_ns` passes or a signal comes; look again in any
 * case. The driver wakes the commander only: an observer sleeps by the clock, a millisecond at a time. */
static inline void phantom_sleep_for_frame(const PhantomAttachment *driver, uint64_t seen, uint64_t timeout_ns) {
    const uint64_t second = 1000000000, millisecond = 1000000;
    if (driver->commander == NULL && timeout_ns > millisecond) timeout_ns = millisecond;
    struct timespec timeout = {(time_t)(timeout_ns / second), (long)(timeout_ns % second)};
    if (driver->commander == NULL) {
        if (phantom_latest_tick(driver->segment) == seen) nanosleep(&timeout, NULL);
        return;
    }
    PhantomCommanderSegment *own = driver->commander;
    /* A driver of before 1.3 rings its own doorbell only. */
    uint64_t version = __atomic_load_n(&driver->segment->header.abi_version, __ATOMIC_RELAXED);
    int is_old = (uint32_t)version < 3;
    const uint32_t *word = is_old ? &driver->segment->bell.doorbell : &own->header.frame_doorbell;
    uint32_t expected = __atomic_load_n(word, __ATOMIC_ACQUIRE);
    __atomic_store_n(&own->bell.owner_sleeps, is_old ? PHANTOM_SLEEPS_ON_OTHERS_BELL : PHANTOM_SLEEPS_ON_OWN_WORD,
                     __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    if (phantom_latest_tick(driver->segment) == seen) syscall(SYS_futex, word, FUTEX_WAIT, expected, &timeout, NULL, 0);
    __atomic_store_n(&own->bell.owner_sleeps, 0, __ATOMIC_RELAXED);
}

/* Whether it is attached and the driver still lives; never blocks. */
static inline int phantom_is_attached(const PhantomAttachment *driver) {
    struct pollfd fd = {driver->connection, POLLRDHUP, 0};
    return driver->segment && poll(&fd, 1, 0) <= 0;
}

/* Ends the lease and unmaps. */
static inline void phantom_detach(PhantomAttachment *driver) {
    if (driver->segment) munmap((void *)(uintptr_t)driver->segment, sizeof *driver->segment);
    if (driver->commander) munmap(driver->commander, sizeof *driver->commander);
    if (driver->connection >= 0) close(driver->connection);
    memset(driver, 0, sizeof *driver);
    driver->connection = -1;
}

/* A request of this header's version, asked now. */
static inline PhantomRequest phantom_request(uint64_t kind, const char *name) {
    PhantomRequest request;
    memset(&request, 0, sizeof request);
    request.magic = PHANTOM_MAGIC;
    request.abi_version = PHANTOM_ABI_VERSION;
    request.layout_hash = PHANTOM_LAYOUT_HASH;
    request.kind = kind;
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    request.asked_ns = (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
    size_t length = name ? strlen(name) : 0;
    if (length > 0) memcpy(request.name, name, length < PHANTOM_NAME_BYTES ? length : PHANTOM_NAME_BYTES);
    return request;
}

/* Receives the answer and at most two descriptors. Returns how many bytes of the answer came in time, however they drip. */
static inline size_t phantom_receive(int connection, PhantomAnswer *answer, int fds[2]) {
    size_t filled = 0;
    int count = 0;
    struct timespec begun, now;
    clock_gettime(CLOCK_MONOTONIC, &begun);
    while (filled < sizeof *answer) {
        clock_gettime(CLOCK_MONOTONIC, &now);
        if (now.tv_sec - begun.tv_sec > PHANTOM_ANSWER_TIMEOUT_S) break;
        union {
            char bytes[CMSG_SPACE(2 * sizeof(int))];
            struct cmsghdr align;
        } control;
        struct iovec into = {(char *)answer + filled, sizeof *answer - filled};
        struct msghdr message;
        memset(&message, 0, sizeof message);
        message.msg_iov = &into;
        message.msg_iovlen = 1;
        message.msg_control = control.bytes;
        message.msg_controllen = sizeof control.bytes;
        ssize_t received = recvmsg(connection, &message, MSG_CMSG_CLOEXEC);
        if (received < 0 && errno == EINTR) continue;
        if (received <= 0) break;
        filled += (size_t)received;
        for (struct cmsghdr *part = CMSG_FIRSTHDR(&message); part; part = CMSG_NXTHDR(&message, part)) {
            if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
            size_t arrived = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
            for (size_t i = 0; i < arrived; i++) {
                int fd;
                memcpy(&fd, CMSG_DATA(part) + i * sizeof fd, sizeof fd);
                if (count < 2) fds[count++] = fd;
                else close(fd);
            }
        }
    }
    return filled;
}

/* Maps a descriptor after checking that nobody can change its size under us. NULL: see `error`. */
static inline void *phantom_map(int fd, size_t bytes, int protection, char *error) {
    struct stat status;
    int seals = fcntl(fd, F_GET_SEALS);
    if (fd < 0 || seals < 0 || (seals & (F_SEAL_SHRINK | F_SEAL_GROW)) != (F_SEAL_SHRINK | F_SEAL_GROW)) {
        snprintf(error, PHANTOM_ERROR_BYTES, "the driver handed over no sealed segment; do not trust this driver");
        return NULL;
    }
    if (fstat(fd, &status) || (size_t)status.st_size != bytes) {
        snprintf(error, PHANTOM_ERROR_BYTES,
                 "the segment handed over does not have %zu bytes; rebuild both sides from one version", bytes);
        return NULL;
    }
    void *map = mmap(NULL, bytes, protection, MAP_SHARED | MAP_POPULATE, fd, 0);
    if (map != MAP_FAILED) return map;
    snprintf(error, PHANTOM_ERROR_BYTES, "cannot map the driver's segment: %s", strerror(errno));
    return NULL;
}

/* Appends a character, as long as there is room. */
static inline void phantom_put(char *text, size_t *used, char character) {
    if (*used + 1 < PHANTOM_ERROR_BYTES) text[(*used)++] = character;
}

/* Appends a number of at least so many digits. */
static inline void phantom_put_number(char *text, size_t *used, uint64_t number, unsigned base, unsigned least) {
    char digits[20];
    unsigned count = 0;
    do {
        digits[count++] = "0123456789abcdef"[number % base];
        number /= base;
    } while (number != 0 || count < least);
    while (count > 0) phantom_put(text, used, digits[--count]);
}

/* snprintf for signal handlers: PHANTOM_ERROR_BYTES at most, and of the conversions %s, %llu and %016llx only. */
__attribute__((format(printf, 2, 3)))
static inline void phantom_say(char *error, const char *format, ...) {
    size_t used = 0;
    va_list values;
    va_start(values, format);
    for (; *format; format++) {
        if (*format != '%') {
            phantom_put(error, &used, *format);
        } else if (*++format == 's') {
            for (const char *text = va_arg(values, const char *); *text; text++) phantom_put(error, &used, *text);
        } else {
            int is_hexadecimal = *format == '0';
            phantom_put_number(error, &used, va_arg(values, unsigned long long), is_hexadecimal ? 16 : 10,
                               is_hexadecimal ? 16 : 1);
            while (*format != 'u' && *format != 'x') format++;
        }
    }
    va_end(values);
    error[used] = 0;
}

/* The system's words for what keeps a program from a driver; NULL for what is not to be expected. strerror is not for
 * signal handlers. */
static inline const char *phantom_reason(int number) {
    switch (number) {
    case EACCES: return "Permission denied";
    case EAGAIN: return "Resource temporarily unavailable";
    case ECONNREFUSED: return "Connection refused";
    case EINTR: return "Interrupted system call";
    case ELOOP: return "Too many levels of symbolic links";
    case EMFILE: return "Too many open files";
    case ENAMETOOLONG: return "File name too long";
    case ENFILE: return "Too many open files in system";
    case ENOENT: return "No such file or directory";
    case ENOTDIR: return "Not a directory";
    case EPERM: return "Operation not permitted";
    case EPROTOTYPE: return "Protocol wrong type for socket";
    default: return NULL;
    }
}

/* Whether the answer grants what was asked for; else `error` says what was found and what to do. */
static inline int phantom_is_granted(const PhantomRequest *request, const PhantomAnswer *answer, char *error) {
    const unsigned long long found = answer->abi_version, own = request->abi_version, kind = request->kind;
    const unsigned long long minor = UINT64_C(0xffffffff), user = geteuid();
    if (answer->magic != PHANTOM_MAGIC) {
        phantom_say(error, "this is not a driver's socket: it answered with magic 0x%016llx",
                    (unsigned long long)answer->magic);
    } else if (found >> 32 != own >> 32) {
        phantom_say(error,
                    "the driver speaks ABI version %llu.%llu, this program %llu.%llu; install both from the same release",
                    found >> 32, found & minor, own >> 32, own & minor);
    } else if (answer->layout_hash != request->layout_hash) {
        phantom_say(error,
                    "the driver's memory layout is 0x%016llx, this program's 0x%016llx; rebuild both from the same source",
                    (unsigned long long)answer->layout_hash, (unsigned long long)request->layout_hash);
    } else if (answer->verdict == PHANTOM_VERDICT_LEASE_HELD) {
        char name[PHANTOM_NAME_BYTES + 1] = {0};
        memcpy(name, answer->holder_name, PHANTOM_NAME_BYTES);
        if (answer->holder_pid)
            phantom_say(error,
                        "the devices are commanded by process %llu (%s) already; end it first, or attach as an observer",
                        (unsigned long long)answer->holder_pid, name);
        else
            phantom_say(error,
                        "the devices are commanded by a process of another PID namespace (%s) already; end it first, or "
                        "attach as an observer",
                        name);
    } else if (answer->verdict == PHANTOM_VERDICT_NOT_ALLOWED && answer->allowed_group_plus_one) {
        phantom_say(error, "the driver does not let user %llu ask for this (kind %llu): members of group %llu may", user,
                    kind, (unsigned long long)(answer->allowed_group_plus_one - 1));
    } else if (answer->verdict == PHANTOM_VERDICT_NOT_ALLOWED) {
        phantom_say(error,
                    "the driver does not let user %llu ask for this (kind %llu): root and the user that it runs as may",
                    user, kind);
    } else if (answer->verdict == PHANTOM_VERDICT_OUTDATED) {
        phantom_say(error,
                    "the driver heard this too late: an emergency stop came after it was asked, or more than a second "
                    "went by; look how things stand, then ask again");
    } else if (answer->verdict == PHANTOM_VERDICT_LEASE_ENDED) {
        phantom_say(error,
                    "an administrator of the driver has ended the lease of user %llu; others come first for ten seconds",
                    user);
    } else if (answer->verdict == PHANTOM_VERDICT_UNKNOWN_KIND) {
        phantom_say(error,
                    "the driver speaks version %llu.%llu and does not know requests of kind %llu, this program speaks "
                    "%llu.%llu; start the driver that belongs to this program",
                    found >> 32, found & minor, kind, own >> 32, own & minor);
    } else if (answer->verdict != PHANTOM_VERDICT_GRANTED) {
        phantom_say(error, "the driver refused with verdict %llu (see PhantomVerdict)",
                    (unsigned long long)answer->verdict);
    } else {
        return 1;
    }
    return 0;
}

/* Address of a name with `suffix` behind it. Its length; 0: there is none, or it is empty or too long. An empty one would be the
 * abstract address of whoever has taken that. */
static inline socklen_t phantom_address(const char *path, const char *suffix, struct sockaddr_un *address) {
    size_t length = path ? strlen(path) : 0, more = strlen(suffix);
    memset(address, 0, sizeof *address);
    address->sun_family = AF_UNIX;
    if (length == 0 || length + more >= sizeof address->sun_path) return 0;
    memcpy(address->sun_path, path, length);
    memcpy(address->sun_path + length, suffix, more);
    return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length + more + 1);
}

/* Connects to a driver's socket. -1: see `error`. */
static inline int phantom_connect(const char *path, char *error) {
    struct sockaddr_un address;
    struct timeval timeout = {PHANTOM_ANSWER_TIMEOUT_S, 0};
    socklen_t length = phantom_address(path, "", &address);
    if (length == 0) {
        if (!path || *path == 0) phantom_say(error, "the path of the driver's socket is empty; name the socket");
        else
            phantom_say(error, "the socket's name is longer than %llu bytes; choose a shorter one",
                        (unsigned long long)(sizeof address.sun_path - 1));
        return -1;
    }
    int connection = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (connection >= 0) {
        setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
        if (!connect(connection, (const struct sockaddr *)&address, length)) return connection;
    }
    int number = errno;
    const char *reason = phantom_reason(number);
    if (reason) phantom_say(error, "cannot reach a driver at %s: %s; is one running?", path, reason);
    else
        phantom_say(error, "cannot reach a driver at %s: error %llu of the system; is one running?", path,
                    (unsigned long long)number);
    if (connection >= 0) close(connection);
    return -1;
}

/* Closes what descriptors there are. */
static inline void phantom_close(int fds[2]) {
    for (int i = 0; i < 2; i++)
        if (fds[i] >= 0) close(fds[i]);
}

/* A driver in a container tells numbers of processes that mean others here, or nobody; the kernel knows its own here. */
static inline void phantom_number_as_here(int connection, PhantomAnswer *answer) {
    struct ucred listener;
    socklen_t length = sizeof listener;
    if (getsockopt(connection, SOL_SOCKET, SO_PEERCRED, &listener, &length)) return;
    if ((uint64_t)listener.pid == answer->driver_pid) return;
    answer->driver_pid = (uint64_t)listener.pid;
    answer->holder_pid = 0;
}

/* Sends a request and receives the answer, which must grant it. Returns the connection and fills in the descriptors
 * that came, which are the caller's then; -1: see `error`. */
static inline int phantom_exchange(const char *path, const PhantomRequest *request, PhantomAnswer *answer, int fds[2],
                                   char *error) {
    fds[0] = fds[1] = -1;
    int connection = phantom_connect(path, error);
    if (connection < 0) return -1;
    /* A driver without room for us answers unasked and hangs up, so that a failed send is no reason to stop. */
    (void)!send(connection, request, sizeof *request, MSG_NOSIGNAL);
    if (phantom_receive(connection, answer, fds) < sizeof *answer) {
        phantom_say(error, "the driver at %s gives no answer; it may be stopped, or no driver", path);
    } else {
        phantom_number_as_here(connection, answer);
        if (phantom_is_granted(request, answer, error)) return connection;
    }
    phantom_close(fds);
    close(connection);
    return -1;
}

/* What a word of a segment may be. */
typedef struct PhantomBound {
    const char *what;
    const uint64_t *word;
    uint64_t least, most;
} PhantomBound;

#define PHANTOM_LEAST_VERSION ((uint64_t)PHANTOM_ABI_MAJOR << 32)
#define PHANTOM_MOST_VERSION (PHANTOM_LEAST_VERSION | UINT64_C(0xffffffff))

/* Whether all words are what they may be; else `error` says what was found. */
static inline int phantom_are_within(const PhantomBound *bounds, size_t count, char *error) {
    for (size_t i = 0; i < count; i++) {
        uint64_t found = __atomic_load_n(bounds[i].word, __ATOMIC_ACQUIRE);
        if (bounds[i].least <= found && found <= bounds[i].most) continue;
        snprintf(error, PHANTOM_ERROR_BYTES,
                 "the driver says of itself: %s: %llu, expected %llu to %llu; do not trust this driver, start the one "
                 "that belongs to this program",
                 bounds[i].what, (unsigned long long)found, (unsigned long long)bounds[i].least,
                 (unsigned long long)bounds[i].most);
        return 0;
    }
    return 1;
}

/* Whether the driver says of itself what can be; else `error` says what was found. */
static inline int phantom_is_possible(const PhantomDriverSegment *segment, char *error) {
    const PhantomDriverHeader *header = &segment->header;
    const uint64_t most_ticks = UINT64_C(1) << 32;
    const PhantomBound bounds[] = {
        {"first word", &header->magic, PHANTOM_MAGIC, PHANTOM_MAGIC},
        {"ABI version", &header->abi_version, PHANTOM_LEAST_VERSION, PHANTOM_MOST_VERSION},
        {"layout hash", &header->layout_hash, PHANTOM_LAYOUT_HASH, PHANTOM_LAYOUT_HASH},
        {"ready word", &header->ready, 1, 1},
        {"segment of so many bytes", &header->segment_bytes, sizeof *segment, sizeof *segment},
        {"period in nanoseconds", &header->period_ns, 50000, UINT64_C(10000000000)},
        {"reply budget in nanoseconds", &header->reply_budget_ns, 1, UINT64_MAX},
        {"age of a command in ticks", &header->max_command_age_ticks, 0, most_ticks},
        {"ramp out in ticks", &header->ramp_out_ticks, 1, most_ticks},
        {"ramp in in ticks", &header->ramp_in_ticks, 1, most_ticks},
        {"number of devices", &header->device_count, 0, PHANTOM_MAX_DEVICES},
    };
    return phantom_are_within(bounds, sizeof bounds / sizeof *bounds, error);
}

/* The same for the commander's segment. */
static inline int phantom_is_for_commands(const PhantomCommanderSegment *segment, char *error) {
    const PhantomCommanderHeader *header = &segment->header;
    const PhantomBound bounds[] = {
        {"commander's first word", &header->magic, PHANTOM_MAGIC, PHANTOM_MAGIC},
        {"commander's ABI version", &header->abi_version, PHANTOM_LEAST_VERSION, PHANTOM_MOST_VERSION},
        {"commander's layout hash", &header->layout_hash, PHANTOM_LAYOUT_HASH, PHANTOM_LAYOUT_HASH},
    };
    return phantom_are_within(bounds, sizeof bounds / sizeof *bounds, error);
}

/* Attaches with a request of any content, of the two kinds that hand over memory; no other is sent. 0: done; -1: see
 * `error`, which has PHANTOM_ERROR_BYTES. */
static inline int phantom_attach_with(const char *path, const PhantomRequest *request, PhantomAttachment *driver,
                                      char *error) {
    PhantomAnswer answer;
    int fds[2];
    int commands = request->kind == PHANTOM_REQUEST_KIND_COMMAND;
    memset(driver, 0, sizeof *driver);
    driver->connection = -1;
    if (!commands && request->kind != PHANTOM_REQUEST_KIND_OBSERVE) {
        snprintf(error, PHANTOM_ERROR_BYTES,
                 "a request of kind %llu hands over nothing to attach to, and was not sent; use phantom_stop, "
                 "phantom_emergency_stop, phantom_clear_fault, phantom_zero or phantom_end_lease",
                 (unsigned long long)request->kind);
        return -1;
    }
    driver->connection = phantom_exchange(path, request, &answer, fds, error);
    if (driver->connection < 0) return -1;
    driver->segment = (const PhantomDriverSegment *)phantom_map(fds[0], sizeof *driver->segment, PROT_READ, error);
    int is_usable = driver->segment && phantom_is_possible(driver->segment, error);
    if (is_usable && commands) {
        driver->commander = (PhantomCommanderSegment *)phantom_map(fds[1], sizeof *driver->commander,
                                                                   PROT_READ | PROT_WRITE, error);
        driver->lease = answer.lease;
        is_usable = driver->commander && phantom_is_for_commands(driver->commander, error);
        /* From here on the driver may forbid further mappings. */
        if (is_usable) __atomic_store_n(&driver->commander->header.mapped, 1, __ATOMIC_RELEASE);
    }
    phantom_close(fds);
    if (is_usable) return 0;
    phantom_detach(driver);
    return -1;
}

/* Attaches as PHANTOM_REQUEST_KIND_OBSERVE or PHANTOM_REQUEST_KIND_COMMAND. 0: done; -1: see `error`, which
 * has PHANTOM_ERROR_BYTES. */
static inline int phantom_attach(const char *path, uint64_t kind, const char *name, PhantomAttachment *driver,
                                 char *error) {
    PhantomRequest request = phantom_request(kind, name);
    return phantom_attach_with(path, &request, driver, error);
}

/* Asks for what hands over nothing. 0: the driver has heard it; whether it is done, a frame tells. -1: see `error`. */
static inline int phantom_ask(const char *path, const PhantomRequest *request, char *error) {
    PhantomAnswer answer;
    int fds[2];
    const int errno_before = errno;
    int connection = phantom_exchange(path, request, &answer, fds, error);
    if (connection >= 0) {
        phantom_close(fds);
        close(connection);
    }
    errno = errno_before;
    return connection < 0 ? -1 : 0;
}

/* Asks the driver to end: it writes zero to the motors and leaves. As phantom_ask. */
static inline int phantom_stop(const char *path, const char *name, char *error) {
    PhantomRequest request = phantom_request(PHANTOM_REQUEST_KIND_STOP, name);
    return phantom_ask(path, &request, error);
}

/* Asks the driver to leave its fault state. As phantom_ask. */
static inline int phantom_clear_fault(const char *path, const char *name, char *error) {
    PhantomRequest request = phantom_request(PHANTOM_REQUEST_KIND_CLEAR_FAULT, name);
    return phantom_ask(path, &request, error);
}

/* Tells the driver that devices lie in their home pose now: bit i of `devices` means device i, 0 all. As phantom_ask. */
static inline int phantom_zero(const char *path, const char *name, uint64_t devices, char *error) {
    PhantomRequest request = phantom_request(PHANTOM_REQUEST_KIND_ZERO, name);
    request.devices = devices;
    return phantom_ask(path, &request, error);
}

/* Asks that the lease of whoever commands ends. As phantom_ask. */
static inline int phantom_end_lease(const char *path, const char *name, char *error) {
    PhantomRequest request = phantom_request(PHANTOM_REQUEST_KIND_END_LEASE, name);
    return phantom_ask(path, &request, error);
}

/* Sends a datagram to an address. 0: it is on its way; 1: the queue is full; -1: nobody is there. */
static inline int phantom_send_stop_to(const struct sockaddr_un *address, socklen_t length) {
    int sender = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (sender < 0) return -1;
    ssize_t sent = sendto(sender, "stop", 4, MSG_DONTWAIT | MSG_NOSIGNAL, (const struct sockaddr *)address, length);
    int is_full = sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
    close(sender);
    return sent >= 0 ? 0 : is_full ? 1 : -1;
}

/* Where the last component of a path begins. */
static inline size_t phantom_directory_bytes(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

/* Sends a datagram to the stop socket beside a path that no address has room for, by way of its directory. As
 * phantom_send_stop_to. */
static inline int phantom_send_stop_beside_far(const char *path) {
    struct sockaddr_un address;
    char place[sizeof address.sun_path] = "/proc/self/fd/", above[PHANTOM_PATH_BYTES] = "";
    size_t used = strlen(place), bytes = phantom_directory_bytes(path), length = strlen(path + bytes);
    if (bytes == 0 || bytes >= sizeof above) return -1;
    memcpy(above, path, bytes);
    int directory = open(above, O_PATH | O_DIRECTORY | O_CLOEXEC);
    if (directory < 0) return -1;
    phantom_put_number(place, &used, (uint64_t)directory, 10, 1);
    place[used++] = '/';
    int sent = -1;
    if (used + length < sizeof place) {
        memcpy(place + used, path + bytes, length + 1);
        socklen_t address_length = phantom_address(place, ".stop", &address);
        if (address_length > 0) sent = phantom_send_stop_to(&address, address_length);
    }
    close(directory);
    return sent;
}

/* Sends a datagram to the stop socket beside a path. As phantom_send_stop_to. */
static inline int phantom_send_stop_beside(const char *path) {
    struct sockaddr_un address;
    socklen_t length = phantom_address(path, ".stop", &address);
    return length > 0 ? phantom_send_stop_to(&address, length) : phantom_send_stop_beside_far(path);
}

/* Replaces a path by what the symbolic link of that name leads to. 1: done; 0: it is none; -1: it leads to more than there
 * is room for. Links of directories may stay: what lies beside a socket is found through them. */
static inline int phantom_follow(char path[PHANTOM_PATH_BYTES]) {
    char target[PHANTOM_PATH_BYTES];
    ssize_t length = readlink(path, target, sizeof target);
    if (length <= 0) return 0;
    size_t kept = target[0] == '/' ? 0 : phantom_directory_bytes(path);
    if (kept + (size_t)length >= PHANTOM_PATH_BYTES) return -1;
    memcpy(path + kept, target, (size_t)length);
    path[kept + (size_t)length] = 0;
    return 1;
}

/* Sends a datagram to the stop socket beside a path and, where that is a symbolic link, beside what it leads to, which
 * alone counts then. As phantom_send_stop_to; -1 also where a link cannot be followed to its end. */
static inline int phantom_send_stop_through(const char *link) {
    char path[PHANTOM_PATH_BYTES];
    int sent = phantom_send_stop_beside(link), links = 0, more = 1;
    if (strlen(link) >= sizeof path) return -1;
    memcpy(path, link, strlen(link) + 1);
    while (links <= PHANTOM_MAX_LINKS && (more = phantom_follow(path)) > 0) links++;
    if (more != 0) return -1;
    return links > 0 ? phantom_send_stop_beside(path) : sent;
}

/* Sends a datagram to the driver's stop socket, which lies beside its own: whatever comes there stops the motors, and
 * no connection is needed for it. Where `path` is a link, then also to what lies beside its target, which alone counts:
 * beside the link may be a stranger. Never waits; for signal handlers, too. 0: it is on its way; 1: the queue is full of
 * stops, perhaps of others only; -1: nobody is there, there is no path, it cannot be followed, or it or what it leads to is
 * too long: 1024 bytes and more, or 103 and more of which the last name has more than 80. */
static inline int phantom_send_stop(const char *path) {
    const int errno_before = errno;
    int sent = path && *path ? phantom_send_stop_through(path) : -1;
    errno = errno_before;
    return sent;
}

/* Asks the driver to switch all motors off at once; they stay off until phantom_clear_fault. By datagram, which a driver
 * hears whose service is stuck and which is sent before anything waits, and over a connection, by which the driver knows
 * whose stop it is. For signal handlers, too. 0: the driver has heard it, or the datagram is on its way to whoever listens
 * beside its socket, who may be about to end and do nothing about it; a frame of state PHANTOM_DRIVER_STATE_FAULT tells
 * that it is done. -1: see `error`. */
static inline int phantom_emergency_stop(const char *path, const char *name, char *error) {
    int sent = phantom_send_stop(path);
    PhantomRequest request = phantom_request(PHANTOM_REQUEST_KIND_EMERGENCY_STOP, name);
    int asked = phantom_ask(path, &request, error);
    return sent == 0 ? 0 : asked;
}

#endif /* PHANTOM3_CLIENT_H */
