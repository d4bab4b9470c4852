//! What the whole-system tests share: the programs under test as child processes.
//!
//! The tests pass without a device, root, a display or real-time rights. None asserts on wall-clock time
//! except with a wide margin that is explained where it stands.

#![forbid(unsafe_code)]

pub mod bare_loop;
pub mod c_program;
pub mod driver;
pub mod everything;
pub mod faults;
pub mod intruder;
pub mod jitter;
pub mod lab;
pub mod programs;
pub mod recording;
pub mod screen;
pub mod slices;
pub mod strangers;
pub mod threads;
pub mod workplace;
