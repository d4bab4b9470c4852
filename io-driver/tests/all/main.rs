//! Tests of the driver's library that need no process of their own.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../common/mod.rs"]
mod common;
#[path = "../../../rt-core/tests/machines/mod.rs"]
mod machines;
#[path = "../../benches/velocity/motion.rs"]
mod motion;
#[path = "../rigid_bodies/mod.rs"]
mod rigid_bodies;
#[path = "../../benches/velocity/rivals.rs"]
mod rivals;
#[path = "../../benches/velocity/score.rs"]
mod score;

mod cycle;
mod doctor;
mod every_arm;
mod heavy_arm;
mod kinematics_forces;
mod kinematics_premium;
mod kinematics_wooden_haptics;
mod protection;
mod replay;
mod sim_dynamics;
mod velocity;
mod velocity_limits;
mod warm_motors;
mod zeroing;
