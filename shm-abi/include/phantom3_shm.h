/* The shared-memory contract between the haptic driver and its applications, for C.
 *
 * Made from the Rust sources of the crate shm-abi: do not edit.
 * `PHANTOM3_BLESS=1 cargo test -p shm-abi --test c_header` makes it anew.
 *
 * Every word that is shared between processes is read and written atomically: use the __atomic builtins, as
 * phantom3_client.h does, never a plain access. Units are SI; positions and forces are in the device's base
 * frame D. Names in brackets are those of the Rust documentation; here they begin with Phantom or PHANTOM_.
 */

#ifndef PHANTOM3_SHM_H
#define PHANTOM3_SHM_H

#include <stddef.h>
#include <stdint.h>

/* The contract fixes the alignment of what lies in shared memory. */
#if defined(__GNUC__) || defined(__clang__)
#define PHANTOM_ALIGNED(n) __attribute__((aligned(n)))
#else
#error "this header needs __attribute__((aligned)) and the __atomic builtins of GCC or Clang"
#endif

// "PHANTOM3" read as a little-endian word: the first word of every segment and message.
#define PHANTOM_MAGIC 3696698092649793616

// Raised when an old reader would misread.
#define PHANTOM_ABI_MAJOR 1

// Raised when something is added that an old reader may ignore.
#define PHANTOM_ABI_MINOR 3

// Both, the major in the upper half.
#define PHANTOM_ABI_VERSION (((uint64_t)PHANTOM_ABI_MAJOR << 32) | (uint64_t)PHANTOM_ABI_MINOR)

// Devices in one frame.
#define PHANTOM_MAX_DEVICES 8

// Frames in the ring: four seconds at 1 kHz. A power of two.
#define PHANTOM_RING_FRAMES 4096

// Commands in the commander's ring: a writer that dies inside a write spoils one tick.
#define PHANTOM_RING_COMMANDS 4

// Words of a [`Frame`].
#define PHANTOM_FRAME_WORDS 335

// Words of a [`Command`].
#define PHANTOM_COMMAND_WORDS 36

// Buckets of a histogram: values below 32 ns exactly, then 32 buckets an octave; the last is open.
#define PHANTOM_HISTOGRAM_BUCKETS 1024

// Words of the epitaph.
#define PHANTOM_EPITAPH_WORDS 32

// Words of the set-up report.
#define PhantomREPORT_WORDS 512

// Bytes of a device's or client's name, padded with zeros.
#define PHANTOM_NAME_BYTES 64

// The same in words.
#define PHANTOM_NAME_WORDS 8

// [`DriverHeader::flags`]: forces and speeds are cut to those of commissioning.
#define PHANTOM_DRIVER_COMMISSIONING 1

// [`Bell::owner_sleeps`]: on the other segment's doorbell.
#define PHANTOM_SLEEPS_ON_OTHERS_BELL 1

// [`Bell::owner_sleeps`]: on the word of the own segment that the other side rings.
#define PHANTOM_SLEEPS_ON_OWN_WORD 2

// [`DeviceFrame::flags`]: the position is valid.
#define PHANTOM_DEVICE_POSITION_VALID 1

// [`DeviceFrame::flags`]: since 1.2. An instrumented gimbal measures the orientation.
#define PHANTOM_DEVICE_ORIENTATION_MEASURED 2

// [`DeviceFrame::flags`]: since 1.2. It does not know where it is until somebody asks to zero it
// ([`client::zero`](crate::client::zero)).
#define PHANTOM_DEVICE_NOT_ZEROED 4

// [`DeviceFrame::flags`]: since 1.2. Its `buttons` mean something.
#define PHANTOM_DEVICE_HAS_BUTTONS 8

// [`Frame::inputs`]: an emergency stop is pressed.
#define PHANTOM_INPUT_EMERGENCY_STOP 1

// [`Frame::inputs`]: there is a dead-man's switch.
#define PHANTOM_INPUT_DEAD_MAN_PRESENT 2

// [`Frame::inputs`]: and somebody holds it.
#define PHANTOM_INPUT_DEAD_MAN_HELD 4

// [`DeviceFrame::limits`]: the force was not finite or beyond the device's peak.
#define PHANTOM_LIMIT_PEAK 1

// [`DeviceFrame::limits`]: the tip was outside the workspace.
#define PHANTOM_LIMIT_WORKSPACE 2

// [`DeviceFrame::limits`]: the force grew faster than it may.
#define PHANTOM_LIMIT_SLEW 4

// [`DeviceFrame::limits`]: a motor was warm.
#define PHANTOM_LIMIT_HEAT 8

// [`DeviceFrame::limits`]: a motor was asked for more than its converter or amplifier gives.
#define PHANTOM_LIMIT_SATURATION 16

// The driver's state machine.
enum PhantomDriverState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Devices are being opened.
  PHANTOM_DRIVER_STATE_STARTING = 0,
  // Devices run but do not know where they are yet.
  PHANTOM_DRIVER_STATE_ZEROING = 1,
  // Positions are valid, motors are off.
  PHANTOM_DRIVER_STATE_IDLE = 2,
  // A lease gives fresh commands.
  PHANTOM_DRIVER_STATE_ACTIVE = 3,
  // Motors are off until somebody asks for them again; see [`FaultReason`].
  PHANTOM_DRIVER_STATE_FAULT = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomDriverState PhantomDriverState;
#else
typedef uint64_t PhantomDriverState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why the driver is in [`DriverState::Fault`]. Minor versions add reasons: a reader that meets a number which
// it does not know takes it for a fault all the same, and tells the number.
enum PhantomFaultReason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // It is not.
  PHANTOM_FAULT_REASON_NONE = 0,
  // A device could not be read.
  PHANTOM_FAULT_REASON_DEVICE_READ = 1,
  // A device could not be written.
  PHANTOM_FAULT_REASON_DEVICE_WRITE = 2,
  // A device reported a position that is not finite.
  PHANTOM_FAULT_REASON_POSITION_NOT_FINITE = 3,
  // A motor value came out not finite.
  PHANTOM_FAULT_REASON_MOTOR_NOT_FINITE = 4,
  // The loop panicked.
  PHANTOM_FAULT_REASON_PANIC = 5,
  // Since 1.1. A device moved faster than it may.
  PHANTOM_FAULT_REASON_OVERSPEED = 6,
  // Since 1.1. A position jumped farther in a tick than anything can move.
  PHANTOM_FAULT_REASON_POSITION_JUMP = 7,
  // Since 1.1. An emergency stop was pressed, or asked for over the socket.
  PHANTOM_FAULT_REASON_EMERGENCY_STOP = 8,
  // Since 1.1. An amplifier switched itself off: its watchdog was not served, or it refused a value.
  PHANTOM_FAULT_REASON_AMPLIFIER_TRIPPED = 9,
  // Since 1.1. More deadlines in a row were missed than the configuration allows.
  PHANTOM_FAULT_REASON_OVERRUN = 10,
  // Since 1.3. The driver's thread that hears requests stood still while a force might be let through.
  PHANTOM_FAULT_REASON_SERVICE_SILENT = 11,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomFaultReason PhantomFaultReason;
#else
typedef uint64_t PhantomFaultReason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What became of a tick's reply.
enum PhantomReplyKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Nobody holds the lease.
  PHANTOM_REPLY_KIND_NO_LEASE = 0,
  // A valid command arrived within the budget.
  PHANTOM_REPLY_KIND_FRESH = 1,
  // None arrived; an earlier one, still young enough, was used again.
  PHANTOM_REPLY_KIND_HELD = 2,
  // None arrived and the last one is too old: the force ramps to zero.
  PHANTOM_REPLY_KIND_EXPIRED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomReplyKind PhantomReplyKind;
#else
typedef uint64_t PhantomReplyKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What can be asked for.
enum PhantomRequestKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // To read the driver's segment.
  PHANTOM_REQUEST_KIND_OBSERVE = 1,
  // To read it and to command the devices.
  PHANTOM_REQUEST_KIND_COMMAND = 2,
  // That the driver stops.
  PHANTOM_REQUEST_KIND_STOP = 3,
  // That the driver leaves its fault state.
  PHANTOM_REQUEST_KIND_CLEAR_FAULT = 4,
  // Since 1.1. That all motors are switched off at once and stay so until the fault is cleared.
  PHANTOM_REQUEST_KIND_EMERGENCY_STOP = 5,
  // Since 1.2. That devices are taken to be in their home pose, in which they lie now; see
  // [`Request::devices`].
  PHANTOM_REQUEST_KIND_ZERO = 6,
  // Since 1.3. That the lease of whoever commands ends: its force ramps out, and somebody else may command.
  PHANTOM_REQUEST_KIND_END_LEASE = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomRequestKind PhantomRequestKind;
#else
typedef uint64_t PhantomRequestKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How the driver decided.
enum PhantomVerdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // As asked; descriptors follow where there are any.
  PHANTOM_VERDICT_GRANTED = 1,
  // This is not a request of this protocol.
  PHANTOM_VERDICT_WRONG_MAGIC = 2,
  // The two were built for different ABI versions.
  PHANTOM_VERDICT_WRONG_VERSION = 3,
  // Same version, different layout: one of them is a modified build.
  PHANTOM_VERDICT_WRONG_LAYOUT = 4,
  // Somebody commands already.
  PHANTOM_VERDICT_LEASE_HELD = 5,
  // The driver does not know this kind of request.
  PHANTOM_VERDICT_UNKNOWN_KIND = 6,
  // The driver has too many connections.
  PHANTOM_VERDICT_CROWDED = 7,
  // The driver could not make a segment.
  PHANTOM_VERDICT_NO_SEGMENT = 8,
  // Since 1.3. Whoever asks may not; [`Answer::allowed_group_plus_one`] says who may.
  PHANTOM_VERDICT_NOT_ALLOWED = 9,
  // Since 1.3. The driver's loop takes no requests at the moment.
  PHANTOM_VERDICT_BUSY = 10,
  // Since 1.3. It was asked before what it would undo, or too long ago.
  PHANTOM_VERDICT_OUTDATED = 11,
  // Since 1.3. An administrator has ended this user's lease, and others come first for some seconds.
  PHANTOM_VERDICT_LEASE_ENDED = 12,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomVerdict PhantomVerdict;
#else
typedef uint64_t PhantomVerdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Which clock moves the ticks.
enum PhantomClockMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // CLOCK_MONOTONIC, two processes.
  PHANTOM_CLOCK_MODE_REAL = 0,
  // Two processes; a tick ends when both have done their part.
  PHANTOM_CLOCK_MODE_LOCKSTEP = 1,
  // One process, as fast as the machine allows.
  PHANTOM_CLOCK_MODE_VIRTUAL = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomClockMode PhantomClockMode;
#else
typedef uint64_t PhantomClockMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How to wait for the other side.
enum PhantomWaitMode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Burn the CPU: shortest, and only right when both sides own a CPU each.
  PHANTOM_WAIT_MODE_SPIN = 0,
  // Sleep in the kernel: right when they share a CPU or run without real-time rights.
  PHANTOM_WAIT_MODE_FUTEX = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum PhantomWaitMode PhantomWaitMode;
#else
typedef uint64_t PhantomWaitMode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// The start of the driver's segment.
typedef struct PHANTOM_ALIGNED(64) PhantomDriverHeader {
  // [`MAGIC`].
  uint64_t magic;
  // [`ABI_VERSION`].
  uint64_t abi_version;
  // [`LAYOUT_HASH`].
  uint64_t layout_hash;
  // Bytes of the whole segment.
  uint64_t segment_bytes;
  // Process id of the driver.
  uint64_t driver_pid;
  // Length of a tick (ns).
  uint64_t period_ns;
  // How long the driver waits for a reply within a tick (ns); u64::MAX: for ever (lockstep).
  uint64_t reply_budget_ns;
  // How many ticks an old command may still drive the motors.
  uint64_t max_command_age_ticks;
  // How many ticks the force takes from full to zero once commands fail.
  uint64_t ramp_out_ticks;
  // How many ticks it takes from zero to full for a new lease.
  uint64_t ramp_in_ticks;
  // How many devices exist.
  uint64_t device_count;
  // A [`ClockMode`](crate::segment::ClockMode).
  uint64_t clock_mode;
  // A [`WaitMode`](crate::doorbell::WaitMode): how the driver waits for a reply.
  uint64_t wait_mode;
  // CPU of the driver's loop plus one; 0: any.
  uint64_t cpu_plus_one;
  // Since 1.1. Bit 0: commissioning, with little force; see [`DRIVER_COMMISSIONING`].
  uint64_t flags;
  // 1 once everything above stands; written last.
  uint64_t ready;
} PhantomDriverHeader;

// The number of the newest value, the word to sleep on, and whether its own side sleeps on the other's.
typedef struct PHANTOM_ALIGNED(64) PhantomBell {
  // Number of the newest complete value plus one; 0: none yet. Written after the value.
  uint64_t latest_plus_one;
  // The low half of `latest_plus_one`, written after it: the futex word.
  uint32_t doorbell;
  // Keeps the next word aligned.
  uint32_t padding;
  // [`SLEEPS_ON_OTHERS_BELL`] while the owner of *this* segment sleeps on the *other* segment's doorbell; since
  // 1.3 [`SLEEPS_ON_OWN_WORD`] while the commander sleeps on its own [`CommanderHeader::frame_doorbell`].
  uint64_t owner_sleeps;
  // Fills the cache line, so that ringing disturbs nothing else.
  uint64_t reserved[5];
} PhantomBell;

// Counts since the driver's start.
typedef struct PHANTOM_ALIGNED(64) PhantomCounters {
  // Ticks done.
  uint64_t ticks;
  // Deadlines skipped because the loop was still busy or asleep.
  uint64_t overruns;
  // Ticks under a lease.
  uint64_t ticks_commanded;
  // Of these, ticks whose reply arrived in time.
  uint64_t replies_fresh;
  // Of these, ticks without a reply in time.
  uint64_t replies_missed;
  // Commands that were torn.
  uint64_t commands_torn;
  // Commands that were whole but not believed.
  uint64_t commands_refused;
  // Forces cut to a device's peak.
  uint64_t forces_limited;
  // Leases granted.
  uint64_t leases_granted;
  // Would-be commanders refused because somebody held the lease.
  uint64_t leases_refused;
  // Faults entered.
  uint64_t faults;
  // Log records dropped.
  uint64_t log_dropped;
  // Since 1.1. Forces that grew slower than commanded.
  uint64_t forces_slewed;
  // Since 1.1. Forces cut because motors were warm.
  uint64_t forces_derated;
  // Since 1.1. Forces cut outside the workspace.
  uint64_t forces_faded;
  // Since 1.1. Ticks without force because the dead-man's switch was not held.
  uint64_t ticks_unattended;
} PhantomCounters;

// What a device is.
typedef struct PHANTOM_ALIGNED(64) PhantomDeviceDescription {
  // UTF-8, padded with zeros.
  uint64_t name[PHANTOM_NAME_WORDS];
  // UTF-8, padded with zeros: the kind, such as "premium" or "ideal".
  uint64_t kind[2];
  // Bits of an f64: the largest force (N); infinite where there is no limit.
  uint64_t peak_force_n;
  // Bits of an f64: the force it can hold for ever (N).
  uint64_t continuous_force_n;
  // Bits of f64s: the smallest corner of the workspace in D (m).
  uint64_t workspace_min_m[3];
  // Bits of f64s: its largest corner (m).
  uint64_t workspace_max_m[3];
  // Since 1.1. Bits of an f64: how fast a force may grow (N/s); infinite: no limit, 0: the driver is 1.0.
  uint64_t slew_n_per_s;
  // Since 1.1. Bits of an f64: the tip's speed that is a fault (m/s); infinite: none, 0: the driver is 1.0.
  uint64_t speed_limit_m_per_s;
  // Room for later minor versions; zero.
  uint64_t reserved[4];
} PhantomDeviceDescription;

// A histogram of nanoseconds with one writer.
typedef struct PHANTOM_ALIGNED(64) PhantomHistogramBlock {
  // Values recorded.
  uint64_t count;
  // The largest (ns).
  uint64_t max_ns;
  // Their sum (ns).
  uint64_t sum_ns;
  // Fills the cache line.
  uint64_t reserved[5];
  // How many fell into each bucket; see [`HISTOGRAM_BUCKETS`].
  uint64_t buckets[PHANTOM_HISTOGRAM_BUCKETS];
} PhantomHistogramBlock;

// One [`Frame`] under its sequence.
typedef struct PHANTOM_ALIGNED(64) PhantomFrameSlot {
  // `2k + 1` while frame `k` is written, `2k + 2` once it stands.
  uint64_t sequence;
  // The frame's words.
  uint64_t words[PHANTOM_FRAME_WORDS];
} PhantomFrameSlot;

// The driver's segment: written by the driver, read by everybody.
typedef struct PHANTOM_ALIGNED(64) PhantomDriverSegment {
  // Who made this and how it is laid out; constant once `ready` is set.
  struct PhantomDriverHeader header;
  // The latest tick and the word to wait on.
  struct PhantomBell bell;
  // What has happened so far.
  struct PhantomCounters counters;
  // The devices; constant once `header.ready` is set.
  struct PhantomDeviceDescription devices[PHANTOM_MAX_DEVICES];
  // How late the driver's loop woke, against the first deadline that it had not served: one value a wake.
  struct PhantomHistogramBlock wake_error_ns;
  // From wake-up to motors written, the wait for the reply not counted.
  struct PhantomHistogramBlock cycle_ns;
  // From a frame's doorbell to its accepted reply.
  struct PhantomHistogramBlock round_trip_ns;
  // The driver's last words.
  uint64_t epitaph[PHANTOM_EPITAPH_WORDS];
  // Which real-time guarantees the driver's loop obtained, a line each: UTF-8, padded with zeros;
  // constant once `header.ready` is set.
  uint64_t setup_report[PhantomREPORT_WORDS];
  // Frame `k` lies in slot `k % RING_FRAMES`.
  struct PhantomFrameSlot frames[PHANTOM_RING_FRAMES];
} PhantomDriverSegment;

// The start of the commander's segment.
typedef struct PHANTOM_ALIGNED(64) PhantomCommanderHeader {
  // [`MAGIC`].
  uint64_t magic;
  // [`ABI_VERSION`].
  uint64_t abi_version;
  // [`LAYOUT_HASH`].
  uint64_t layout_hash;
  // Bytes of the whole segment.
  uint64_t segment_bytes;
  // The lease.
  uint64_t lease;
  // Since 1.3. The futex word that the commander sleeps on, and nobody else can: changed and rung by the
  // driver while [`Bell::owner_sleeps`] is [`SLEEPS_ON_OWN_WORD`].
  uint32_t frame_doorbell;
  // Keeps the next word aligned.
  uint32_t padding;
  // Since 1.3. 1 once the commander has mapped the segment; written by it, so that the driver may forbid
  // everybody to map or to punch it again.
  uint64_t mapped;
  // Fills the cache line.
  uint64_t reserved;
} PhantomCommanderHeader;

// One [`Command`] under its sequence.
typedef struct PHANTOM_ALIGNED(64) PhantomCommandSlot {
  // `2k + 1` while the answer to tick `k` is written, `2k + 2` once it stands.
  uint64_t sequence;
  // The command's words.
  uint64_t words[PHANTOM_COMMAND_WORDS];
  // Fills the cache line.
  uint64_t padding[3];
} PhantomCommandSlot;

// The commander's segment: written by the holder of the lease, read by the driver.
typedef struct PHANTOM_ALIGNED(64) PhantomCommanderSegment {
  // Which lease this belongs to; written by the driver before it is handed over.
  struct PhantomCommanderHeader header;
  // The tick last answered (plus one) and the word the driver waits on.
  struct PhantomBell bell;
  // The answer to tick `k` lies in slot `k % RING_COMMANDS`.
  struct PhantomCommandSlot commands[PHANTOM_RING_COMMANDS];
} PhantomCommanderSegment;

// How the tick before this frame's ended.
typedef struct PhantomOutcome {
  // A [`ReplyKind`].
  uint64_t reply;
  // The tick whose command drove the motors; meaningless while `authority` is 0.
  uint64_t command_tick;
  // The share of the commanded force that was let through.
  double authority;
  // From the frame's doorbell to the accepted reply (ns); 0 where there was none.
  uint64_t round_trip_ns;
  // When the motors were written, CLOCK_MONOTONIC (ns).
  uint64_t written_ns;
} PhantomOutcome;

// One device in a [`Frame`].
typedef struct PhantomDeviceFrame {
  // Bits of `DEVICE_...`: bit 0, the position is valid; since 1.2 bit 1, the orientation is measured,
  // bit 2, it has to be zeroed, bit 3, it has buttons.
  uint64_t flags;
  // Bit `i`: button `i` is pressed.
  uint64_t buttons;
  // Encoder counts, extended beyond the counter's width: three joints, three gimbal axes.
  int64_t encoder_counts[6];
  // Joint angles (rad), in the same order.
  double joint_angle_rad[6];
  // The tip in the base frame D (m).
  double position_m_measured[3];
  // Orientation of the gimbal's last link in D, w x y z; identity where there is no instrumented gimbal.
  double orientation_wxyz_measured[4];
  // The force on the user asked for in the tick before, in D (N).
  double force_on_user_n_commanded[3];
  // The force on the user that the motors were made to render in the tick before, in D (N).
  double force_on_user_n_applied[3];
  // The motor values written in the tick before, as the hardware got them.
  int64_t motor_codes[3];
  // Since 1.1. How fast the tip moves, in D (m/s), estimated from the positions; since 1.2 from the counts.
  double velocity_m_per_s_estimated[3];
  // Since 1.1. Bits of `LIMIT_...`: what came between commanded and applied force in the tick before.
  uint64_t limits;
  // Since 1.1. Warmth of the warmest motor: 1 is what its continuous current would reach.
  double motor_heat;
  // Since 1.2. How fast each actuated joint turns (rad/s), estimated from its counts; m/s where the device has
  // metres for joint angles.
  double joint_velocity_rad_per_s_estimated[3];
  // Room for later minor versions; zero.
  uint64_t reserved[2];
} PhantomDeviceFrame;

// One tick of the driver, all devices.
typedef struct PhantomFrame {
  // Number of the tick, counted from the driver's start; skipped deadlines are counted too.
  uint64_t tick;
  // When the tick was due, CLOCK_MONOTONIC (ns).
  uint64_t deadline_ns;
  // When the driver had read the devices, CLOCK_MONOTONIC (ns).
  uint64_t read_ns;
  // A [`DriverState`].
  uint64_t state;
  // A [`FaultReason`].
  uint64_t fault;
  // Number of the lease that commands this tick; 0: nobody.
  uint64_t lease;
  // Share of the commanded force that reaches the motors if the reply is in time, 0 to 1.
  double authority;
  // Ticks since the lease first had full authority; negative before. The scripted hand's clock.
  int64_t run_tick;
  // How many of `devices` exist.
  uint64_t device_count;
  // What became of the tick before this one.
  struct PhantomOutcome previous;
  // Since 1.1. Bits of `INPUT_...`: what the switches say that guard the motors.
  uint64_t inputs;
  // The devices; those beyond `device_count` are zero.
  struct PhantomDeviceFrame devices[PHANTOM_MAX_DEVICES];
} PhantomFrame;

// What one device shall do.
typedef struct PhantomDeviceCommand {
  // The force on the user, in the device's base frame D (N).
  double force_on_user_n[3];
  // Room for later minor versions; zero.
  uint64_t reserved;
} PhantomDeviceCommand;

// The reply to one frame.
typedef struct PhantomCommand {
  // The tick of the frame that this answers.
  uint64_t tick;
  // The lease number that the commander was given.
  uint64_t lease;
  // How many of `devices` are meant.
  uint64_t device_count;
  // Room for later minor versions; zero.
  uint64_t reserved;
  // One per device, in the frame's order.
  struct PhantomDeviceCommand devices[PHANTOM_MAX_DEVICES];
} PhantomCommand;

// What the application wants.
typedef struct PhantomRequest {
  // [`MAGIC`].
  uint64_t magic;
  // The application's [`ABI_VERSION`].
  uint64_t abi_version;
  // The application's [`LAYOUT_HASH`].
  uint64_t layout_hash;
  // A [`RequestKind`].
  uint64_t kind;
  // Who asks: UTF-8, padded with zeros.
  uint8_t name[PHANTOM_NAME_BYTES];
  // Since 1.2. Bit `i`: device `i` is meant; 0: all are. Only [`RequestKind::Zero`] looks at it.
  uint64_t devices;
  // Since 1.3. When it was asked, by CLOCK_MONOTONIC (ns); 0: not told.
  uint64_t asked_ns;
  // Zero.
  uint64_t reserved[2];
} PhantomRequest;

// What the driver says to it.
typedef struct PhantomAnswer {
  // [`MAGIC`].
  uint64_t magic;
  // The driver's [`ABI_VERSION`].
  uint64_t abi_version;
  // The driver's [`LAYOUT_HASH`].
  uint64_t layout_hash;
  // Bytes of the driver's segment.
  uint64_t driver_segment_bytes;
  // Bytes of the commander's segment.
  uint64_t commander_segment_bytes;
  // A [`Verdict`].
  uint64_t verdict;
  // Number of the granted lease; 0: none.
  uint64_t lease;
  // Process id of the driver.
  uint64_t driver_pid;
  // Process id of whoever holds the lease; 0: nobody.
  uint64_t holder_pid;
  // Its name: UTF-8, padded with zeros.
  uint8_t holder_name[PHANTOM_NAME_BYTES];
  // Since 1.3. With [`Verdict::NotAllowed`]: the number of the group whose members may, plus one; 0: only root
  // and the user that the driver runs as.
  uint64_t allowed_group_plus_one;
  // Since 1.3. To an emergency stop: tick of the newest frame, plus one; 0: not told, or there is none.
  uint64_t latest_tick_plus_one;
  // Since 1.3. 1: that frame shows an emergency stop, and no force of any device.
  uint64_t latest_is_stopped;
  // Zero.
  uint64_t reserved[4];
} PhantomAnswer;

// Hash of every type, name, size and offset of the contract; both sides must agree on it.
#define PHANTOM_LAYOUT_HASH UINT64_C(0x85688db9fa628dbf)

#ifdef __cplusplus
#define PHANTOM_ASSERT(what) static_assert(what, #what)
#define PHANTOM_ALIGNOF(type) alignof(type)
#else
#define PHANTOM_ASSERT(what) _Static_assert(what, #what)
#define PHANTOM_ALIGNOF(type) _Alignof(type)
#endif

PHANTOM_ASSERT(sizeof(PhantomDriverSegment) == 11041024);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomDriverSegment) == 64);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, header) == 0);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, bell) == 128);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, counters) == 192);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, devices) == 320);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, wake_error_ns) == 1856);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, cycle_ns) == 10112);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, round_trip_ns) == 18368);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, epitaph) == 26624);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, setup_report) == 26880);
PHANTOM_ASSERT(offsetof(PhantomDriverSegment, frames) == 30976);

PHANTOM_ASSERT(sizeof(PhantomDriverHeader) == 128);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomDriverHeader) == 64);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, magic) == 0);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, abi_version) == 8);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, layout_hash) == 16);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, segment_bytes) == 24);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, driver_pid) == 32);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, period_ns) == 40);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, reply_budget_ns) == 48);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, max_command_age_ticks) == 56);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, ramp_out_ticks) == 64);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, ramp_in_ticks) == 72);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, device_count) == 80);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, clock_mode) == 88);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, wait_mode) == 96);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, cpu_plus_one) == 104);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, flags) == 112);
PHANTOM_ASSERT(offsetof(PhantomDriverHeader, ready) == 120);

PHANTOM_ASSERT(sizeof(PhantomBell) == 64);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomBell) == 64);
PHANTOM_ASSERT(offsetof(PhantomBell, latest_plus_one) == 0);
PHANTOM_ASSERT(offsetof(PhantomBell, doorbell) == 8);
PHANTOM_ASSERT(offsetof(PhantomBell, padding) == 12);
PHANTOM_ASSERT(offsetof(PhantomBell, owner_sleeps) == 16);
PHANTOM_ASSERT(offsetof(PhantomBell, reserved) == 24);

PHANTOM_ASSERT(sizeof(PhantomCounters) == 128);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomCounters) == 64);
PHANTOM_ASSERT(offsetof(PhantomCounters, ticks) == 0);
PHANTOM_ASSERT(offsetof(PhantomCounters, overruns) == 8);
PHANTOM_ASSERT(offsetof(PhantomCounters, ticks_commanded) == 16);
PHANTOM_ASSERT(offsetof(PhantomCounters, replies_fresh) == 24);
PHANTOM_ASSERT(offsetof(PhantomCounters, replies_missed) == 32);
PHANTOM_ASSERT(offsetof(PhantomCounters, commands_torn) == 40);
PHANTOM_ASSERT(offsetof(PhantomCounters, commands_refused) == 48);
PHANTOM_ASSERT(offsetof(PhantomCounters, forces_limited) == 56);
PHANTOM_ASSERT(offsetof(PhantomCounters, leases_granted) == 64);
PHANTOM_ASSERT(offsetof(PhantomCounters, leases_refused) == 72);
PHANTOM_ASSERT(offsetof(PhantomCounters, faults) == 80);
PHANTOM_ASSERT(offsetof(PhantomCounters, log_dropped) == 88);
PHANTOM_ASSERT(offsetof(PhantomCounters, forces_slewed) == 96);
PHANTOM_ASSERT(offsetof(PhantomCounters, forces_derated) == 104);
PHANTOM_ASSERT(offsetof(PhantomCounters, forces_faded) == 112);
PHANTOM_ASSERT(offsetof(PhantomCounters, ticks_unattended) == 120);

PHANTOM_ASSERT(sizeof(PhantomDeviceDescription) == 192);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomDeviceDescription) == 64);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, name) == 0);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, kind) == 64);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, peak_force_n) == 80);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, continuous_force_n) == 88);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, workspace_min_m) == 96);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, workspace_max_m) == 120);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, slew_n_per_s) == 144);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, speed_limit_m_per_s) == 152);
PHANTOM_ASSERT(offsetof(PhantomDeviceDescription, reserved) == 160);

PHANTOM_ASSERT(sizeof(PhantomHistogramBlock) == 8256);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomHistogramBlock) == 64);
PHANTOM_ASSERT(offsetof(PhantomHistogramBlock, count) == 0);
PHANTOM_ASSERT(offsetof(PhantomHistogramBlock, max_ns) == 8);
PHANTOM_ASSERT(offsetof(PhantomHistogramBlock, sum_ns) == 16);
PHANTOM_ASSERT(offsetof(PhantomHistogramBlock, reserved) == 24);
PHANTOM_ASSERT(offsetof(PhantomHistogramBlock, buckets) == 64);

PHANTOM_ASSERT(sizeof(PhantomFrameSlot) == 2688);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomFrameSlot) == 64);
PHANTOM_ASSERT(offsetof(PhantomFrameSlot, sequence) == 0);
PHANTOM_ASSERT(offsetof(PhantomFrameSlot, words) == 8);

PHANTOM_ASSERT(sizeof(PhantomCommanderSegment) == 1408);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomCommanderSegment) == 64);
PHANTOM_ASSERT(offsetof(PhantomCommanderSegment, header) == 0);
PHANTOM_ASSERT(offsetof(PhantomCommanderSegment, bell) == 64);
PHANTOM_ASSERT(offsetof(PhantomCommanderSegment, commands) == 128);

PHANTOM_ASSERT(sizeof(PhantomCommanderHeader) == 64);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomCommanderHeader) == 64);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, magic) == 0);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, abi_version) == 8);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, layout_hash) == 16);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, segment_bytes) == 24);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, lease) == 32);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, frame_doorbell) == 40);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, padding) == 44);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, mapped) == 48);
PHANTOM_ASSERT(offsetof(PhantomCommanderHeader, reserved) == 56);

PHANTOM_ASSERT(sizeof(PhantomCommandSlot) == 320);
PHANTOM_ASSERT(PHANTOM_ALIGNOF(PhantomCommandSlot) == 64);
PHANTOM_ASSERT(offsetof(PhantomCommandSlot, sequence) == 0);
PHANTOM_ASSERT(offsetof(PhantomCommandSlot, words) == 8);
PHANTOM_ASSERT(offsetof(PhantomCommandSlot, padding) == 296);

PHANTOM_ASSERT(sizeof(PhantomFrame) == 2680);
PHANTOM_ASSERT(offsetof(PhantomFrame, tick) == 0);
PHANTOM_ASSERT(offsetof(PhantomFrame, deadline_ns) == 8);
PHANTOM_ASSERT(offsetof(PhantomFrame, read_ns) == 16);
PHANTOM_ASSERT(offsetof(PhantomFrame, state) == 24);
PHANTOM_ASSERT(offsetof(PhantomFrame, fault) == 32);
PHANTOM_ASSERT(offsetof(PhantomFrame, lease) == 40);
PHANTOM_ASSERT(offsetof(PhantomFrame, authority) == 48);
PHANTOM_ASSERT(offsetof(PhantomFrame, run_tick) == 56);
PHANTOM_ASSERT(offsetof(PhantomFrame, device_count) == 64);
PHANTOM_ASSERT(offsetof(PhantomFrame, previous) == 72);
PHANTOM_ASSERT(offsetof(PhantomFrame, inputs) == 112);
PHANTOM_ASSERT(offsetof(PhantomFrame, devices) == 120);

PHANTOM_ASSERT(sizeof(PhantomOutcome) == 40);
PHANTOM_ASSERT(offsetof(PhantomOutcome, reply) == 0);
PHANTOM_ASSERT(offsetof(PhantomOutcome, command_tick) == 8);
PHANTOM_ASSERT(offsetof(PhantomOutcome, authority) == 16);
PHANTOM_ASSERT(offsetof(PhantomOutcome, round_trip_ns) == 24);
PHANTOM_ASSERT(offsetof(PhantomOutcome, written_ns) == 32);

PHANTOM_ASSERT(sizeof(PhantomDeviceFrame) == 320);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, flags) == 0);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, buttons) == 8);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, encoder_counts) == 16);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, joint_angle_rad) == 64);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, position_m_measured) == 112);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, orientation_wxyz_measured) == 136);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, force_on_user_n_commanded) == 168);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, force_on_user_n_applied) == 192);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, motor_codes) == 216);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, velocity_m_per_s_estimated) == 240);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, limits) == 264);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, motor_heat) == 272);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, joint_velocity_rad_per_s_estimated) == 280);
PHANTOM_ASSERT(offsetof(PhantomDeviceFrame, reserved) == 304);

PHANTOM_ASSERT(sizeof(PhantomCommand) == 288);
PHANTOM_ASSERT(offsetof(PhantomCommand, tick) == 0);
PHANTOM_ASSERT(offsetof(PhantomCommand, lease) == 8);
PHANTOM_ASSERT(offsetof(PhantomCommand, device_count) == 16);
PHANTOM_ASSERT(offsetof(PhantomCommand, reserved) == 24);
PHANTOM_ASSERT(offsetof(PhantomCommand, devices) == 32);

PHANTOM_ASSERT(sizeof(PhantomDeviceCommand) == 32);
PHANTOM_ASSERT(offsetof(PhantomDeviceCommand, force_on_user_n) == 0);
PHANTOM_ASSERT(offsetof(PhantomDeviceCommand, reserved) == 24);

PHANTOM_ASSERT(sizeof(PhantomRequest) == 128);
PHANTOM_ASSERT(offsetof(PhantomRequest, magic) == 0);
PHANTOM_ASSERT(offsetof(PhantomRequest, abi_version) == 8);
PHANTOM_ASSERT(offsetof(PhantomRequest, layout_hash) == 16);
PHANTOM_ASSERT(offsetof(PhantomRequest, kind) == 24);
PHANTOM_ASSERT(offsetof(PhantomRequest, name) == 32);
PHANTOM_ASSERT(offsetof(PhantomRequest, devices) == 96);
PHANTOM_ASSERT(offsetof(PhantomRequest, asked_ns) == 104);
PHANTOM_ASSERT(offsetof(PhantomRequest, reserved) == 112);

PHANTOM_ASSERT(sizeof(PhantomAnswer) == 192);
PHANTOM_ASSERT(offsetof(PhantomAnswer, magic) == 0);
PHANTOM_ASSERT(offsetof(PhantomAnswer, abi_version) == 8);
PHANTOM_ASSERT(offsetof(PhantomAnswer, layout_hash) == 16);
PHANTOM_ASSERT(offsetof(PhantomAnswer, driver_segment_bytes) == 24);
PHANTOM_ASSERT(offsetof(PhantomAnswer, commander_segment_bytes) == 32);
PHANTOM_ASSERT(offsetof(PhantomAnswer, verdict) == 40);
PHANTOM_ASSERT(offsetof(PhantomAnswer, lease) == 48);
PHANTOM_ASSERT(offsetof(PhantomAnswer, driver_pid) == 56);
PHANTOM_ASSERT(offsetof(PhantomAnswer, holder_pid) == 64);
PHANTOM_ASSERT(offsetof(PhantomAnswer, holder_name) == 72);
PHANTOM_ASSERT(offsetof(PhantomAnswer, allowed_group_plus_one) == 136);
PHANTOM_ASSERT(offsetof(PhantomAnswer, latest_tick_plus_one) == 144);
PHANTOM_ASSERT(offsetof(PhantomAnswer, latest_is_stopped) == 152);
PHANTOM_ASSERT(offsetof(PhantomAnswer, reserved) == 160);

#endif  /* PHANTOM3_SHM_H */
