//! The hard real-time driver: device I/O, kinematics, safety, and the frames that everybody reads.
//!
//! Problem: a haptic device has to be read and written every millisecond whatever the application does, and
//! whatever it does must not hurt anybody.
//!
//! One tick is [`cycle::Cycle`]: read all devices, publish the frame, take the reply, limit, write. Who
//! moves the clock is somebody else's: [`real_loop`] in the driver's own process, or an application that
//! runs the driver on a virtual clock. Devices lie behind [`device::Device`], mechanisms behind
//! [`kinematics::Mechanism`], the decision how much force is let through in [`safety`]. [`emulator`] is a
//! program of its own: hardware for those who have none.

#![deny(unsafe_code)]
#![deny(missing_docs)]

pub mod arguments;
pub mod bell_thread;
pub mod cli;
pub mod commission;
pub mod config;
pub mod cycle;
pub mod device;
pub mod device_file;
pub mod doctor;
pub mod drive;
pub mod driver;
pub mod emulator;
pub mod encoders;
pub mod heartbeat;
pub mod heat;
pub mod kinematics;
#[allow(unsafe_code, reason = "wishes mapped from a file")]
pub mod live_hand;
pub mod log_thread;
mod loop_thread;
pub mod mail;
pub mod meter;
pub mod monitor;
pub mod motors;
pub mod open;
pub mod print;
pub mod real_loop;
mod reply;
pub mod safety;
pub mod sandbox;
pub mod say;
mod service;
pub mod sim;
mod state_log;
pub mod status;

mod stop_thread;
pub mod supervisor;
pub mod table;
pub mod toml_report;
pub mod urgent;
pub mod velocity;
pub mod zeroing;
