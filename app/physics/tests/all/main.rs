//! Tests of rigid bodies, contacts and grasps.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../common/mod.rs"]
mod common;
#[path = "../../../haptics/tests/common/counting.rs"]
mod counting;
#[path = "../common/held.rs"]
mod held;
#[path = "../common/meshes.rs"]
mod meshes;
#[path = "../common/noise.rs"]
mod noise;
#[path = "../common/solids.rs"]
mod solids;
#[path = "../common/thrown.rs"]
mod thrown;

mod attach;
mod ball_grasp;
mod broad_phase;
mod contact_stiffness;
mod cradle;
mod dense;
mod driven;
mod energy;
mod energy_impulse;
mod explodes;
mod forms_distance;
mod forms_mass;
mod forms_moving;
mod forms_no_allocation;
mod forms_points;
mod forms_rest;
mod forms_slopes;
mod gimbal;
mod grasp;
mod grasp_quality;
mod hand_over;
mod heavy_top;
mod held_objects;
mod impulse;
mod islands;
mod ledger;
mod let_out;
mod limit_surface;
mod meshes_bars;
mod meshes_bumps;

mod meshes_floor;
mod meshes_mass;
mod meshes_oracle;
mod meshes_places;
mod meshes_plane;
mod meshes_sharp;
mod meshes_sheets;
mod meshes_stacks;
mod no_allocation;
mod pulls;
mod put;
mod ramp;
mod restitution;
mod rings_through;
mod rotate_down_up;
mod sleep;
mod soft_drop;
mod soft_robustness;
mod solver;
mod spaces;
mod stability;
mod stack;
mod struck;
mod torque_free;
mod turning_friction;
mod turns;
