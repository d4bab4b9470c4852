//! Height maps.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/solids.rs"]
mod solids;

mod beside_meshes;
mod charts;
mod cliffs;
mod feel;
mod smooth;
mod survey;
