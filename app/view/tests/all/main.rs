//! Tests of what is drawn, and of what mouse and keys mean.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../common/mod.rs"]
mod common;

mod camera_man;
mod doors;
mod eyes;
mod lamps;
mod mouse_hand;
mod overlay;
mod pictures;
mod shapes;
mod stages;
mod textures;
mod usual;
