//! A card with counters, converters and amplifiers that is no hardware: a process of its own.
//!
//! Problem: whether a driver's death ends in zero force can only be seen from outside the driver, and whether
//! it ever writes a value beyond its limits only by whoever gets every value.
//! Model: [`card`] is the registers, a file that both processes map; [`amplifier`] is what a good amplifier
//! does with what it gets: it checks every value, minds its watchdog and switches itself off; [`motion`] is
//! what moves the counters, [`held_arm`] of it the arm that is simulated whole; [`process`] is the program that plays all of it.
//! Invariants: every value that a driver writes is numbered and queued, so that none is missed or replaced
//! before it was checked; what overruns the queue is counted as lost.

pub mod amplifier;
#[allow(unsafe_code, reason = "registers mapped from a file")]
pub mod card;
pub mod held_arm;
pub mod motion;
pub mod process;
