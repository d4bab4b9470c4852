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
pub mod segment;
pub mod seqlock;
pub mod server;

mod enumeration;
mod socket;

pub use command::{Command, CommandRefusal, DeviceCommand};
pub use frame::{DeviceFrame, DriverState, FaultReason, Frame, Outcome, ReplyKind};
pub use layout::{
    ABI_MAJOR, ABI_MINOR, ABI_VERSION, CommanderSegment, DriverSegment, LAYOUT_HASH, MAX_DEVICES, RING_FRAMES,
};
pub use segment::{CommanderMemory, CommanderView, DriverMemory, DriverView, FrameUnavailable};
