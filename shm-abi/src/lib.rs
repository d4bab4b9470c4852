//! The shared-memory contract between the haptic driver and its applications.
//!
//! Problem: two processes exchange one tick each millisecond and neither may ever wait for, crash with
//! or be lied to by the other.
//!
//! Model: two sealed memfds, created by the driver and handed out over a Unix socket. The **driver's**
//! segment ([`DriverSegment`]) holds the frames, one per tick, and is mapped read-only by everybody else.
//! The **commander's** segment ([`CommanderSegment`]) holds the replies; the one application that holds
//! the lease maps it writable, and every lease gets a fresh one. Payloads travel as atomic words under a
//! sequence ([`seqlock`]), so a reader sees a whole value or none, never a mixture and never undefined
//! behaviour. What the other side wrote is an allegation until [`validate`](Command::validate)d.
//!
//! Units and frames: SI; positions and forces are in the device's base frame D.
//!
//! # Versions
//!
//! A **minor** version adds what an old reader may ignore: it fills `reserved` words, which are zero before,
//! or adds a value to an enumeration, a flag, a kind of request. [`LAYOUT_HASH`] stays, and programs and
//! drivers of all minor versions of one major version work together: what the other side is too old to tell
//! reads as zero (see [`DriverView::abi_minor`]), and an enumeration's value that one side does not know is
//! `None` there ([`FaultReason::from_word`]). Everything else, such as a field that moves, grows, changes its
//! unit or its meaning, or a constant of another value, is a **major** version; the two sides refuse each other.
//!
//! To add a field:
//! 1. Was the version in force released? Then copy `include/*.h` to `tests/frozen/VERSION`, record their
//!    hashes in `tests/changelog.rs`, and raise [`ABI_MINOR`].
//! 2. Take it from the beginning of what is left of the type's reserved words, "Since 1.N." first in its docs, and
//!    zero must mean "not told"; write it behind the arrow in `assert_layout!` (`reserved: .. => { .. }`).
//! 3. Name it in CHANGELOG.md, in the row of its version.
//! 4. Give it a value in `tests/golden.rs` (and the version a line in `VERSIONS`), then
//!    `PHANTOM3_BLESS=1 cargo test -p shm-abi --test c_header --test golden`: look at the difference, which
//!    must be additions only.
//!
//! For an enumeration's value or a flag: steps 1, 3 and 4; a constant also has its C name in `cbindgen.toml`.
//!
//! Start with [`client::attach`] on the application's side and [`server::Server`] on the driver's.

#![deny(missing_docs)]
#![deny(unsafe_code)]

pub mod client;
pub mod command;
pub mod doorbell;
pub mod endpoint;
pub mod frame;
pub mod handshake;
pub mod layout;
#[allow(unsafe_code, reason = "socket options that no safe crate wraps")]
pub mod peer;
pub mod rights;
pub mod segment;
pub mod seqlock;
pub mod server;
pub mod socket_file;
pub mod stop_socket;
pub mod users;

mod enumeration;
mod far_address;
mod socket;

pub use command::{Command, CommandRefusal, DeviceCommand};
pub use frame::{DeviceFrame, DriverState, FaultReason, Frame, Outcome, ReplyKind};
pub use layout::{
    ABI_MAJOR, ABI_MINOR, ABI_VERSION, CommanderSegment, DriverSegment, LAYOUT_HASH, MAX_DEVICES, RING_FRAMES,
};
pub use segment::{CommanderMemory, CommanderView, DriverMemory, DriverView, FrameUnavailable};
