//! What may reach the motors, and how much of it.
//!
//! | guard | file | acts by |
//! |---|---|---|
//! | who commands, how fresh, ramps, faults, dead-man | [`authority`] | the share that is let through |
//! | peak force, not a number | [`peak`] | cutting the length of the force |
//! | workspace edge | [`workspace`] | fading the force out beyond it |
//! | slew rate | [`slew`] | letting a force grow, turn and reverse only so fast; it may vanish at once |
//! | device speed, position jumps | [`speed`] | a fault |
//! | rest, before a pose is taken for the zeroing pose | [`stillness`] | refusing a zero |
//! | switches: emergency stop, dead-man | [`switches`] | a fault; the share |
//! | warmth of the motors | [`crate::heat`], in the device | cutting the force, and the current |
//!
//! Whatever here means time goes by the time of [`elapsed`], not by ticks. [`guard`] is one device's chain of these.
//! `SAFETY.md` tells which hazard each is for and what tests it.

pub mod authority;
pub mod elapsed;
pub mod guard;
pub mod peak;
pub mod slew;
pub mod speed;
pub mod stillness;
pub mod switches;
pub mod workspace;

pub use authority::{CommandAge, Ramps, Safety};
pub use elapsed::{Elapsed, TickClock};
pub use guard::{Guard, Limits, Restrained};
pub use peak::limit_force;
