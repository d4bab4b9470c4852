//! Meshes under a point: how they are built, asked and walked over.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../mesh_oracle/mod.rs"]
mod mesh_oracle;

mod accuracy;
mod build;
mod convexity;
mod cracks;
mod crossing;
mod crossing_sheets;
mod energy;
mod folds;
mod friction;
mod grooves;
mod inside;
mod joints;
mod ledges;
mod materials;
mod moving;
mod nesting;
mod outlying;
mod overlaps;
mod parts;
mod pins;
mod plates;
mod pockets;
mod queries;
mod sealed_rims;
mod unfolded;
mod walk;
mod wedges;
