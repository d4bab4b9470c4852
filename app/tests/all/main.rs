//! Tests of the application in one process.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../../haptics/tests/common/counting.rs"]
mod counting;

mod doors;
mod faded_forces;
mod mouse_hand;
mod on_request;
mod orders;
mod reply_modes;
mod study_stiffness;
mod two_lists;
mod virtual_run;
