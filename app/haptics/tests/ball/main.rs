//! Balls that touch, slide and roll: a finger with a radius on every kind of surface.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/cones.rs"]
mod cones;
#[path = "../mesh_oracle/mod.rs"]
mod mesh_oracle;
#[path = "../common/trees.rs"]
mod trees;

mod contacts;
mod csg;
mod csg_feel;
mod csg_oracle;
mod csg_starts;
mod deep;
mod feet;
mod fine;
mod forms;
mod mesh;
mod quality;
mod rises;
mod several_cones;
mod shading;
mod starts;
mod walks;
