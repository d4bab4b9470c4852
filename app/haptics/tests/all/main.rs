//! Tests of god-objects, friction and effects that need no program of their own.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/counting.rs"]
mod counting;
#[path = "../common/effects.rs"]
mod effects;
#[path = "../../examples/own_parts.rs"]
mod example;
#[path = "../mesh_oracle/mod.rs"]
mod mesh_oracle;
#[path = "../common/solids.rs"]
mod solids;
#[path = "../common/sources.rs"]
mod sources;
#[path = "../common/tardis.rs"]
mod tardis;
#[path = "../common/trees.rs"]
mod trees;

use common::Noise;

mod baselines;
mod beginning_inside;
mod chapter_8_1;
mod classic_god_object;
mod doors;
mod effects_robustness;
mod friction_drift;
mod klein;
mod leaps;
mod materials;
mod mesh_descent;
mod mesh_leaks;
mod mesh_rest;
mod mesh_walks;
mod moving_entities;
mod no_allocation;
mod own_parts;
mod passivity;
mod passivity_fidelity;
mod relative_motion;
mod rises;
mod robustness;
mod shading;
mod shading_energy;
mod shading_force;
mod symmetries;
mod together;
