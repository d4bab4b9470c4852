//! Trees of shapes under a point.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/trees.rs"]
mod trees;

mod feel;
mod oracle;
mod states;
mod trees_of_shapes;
mod walks;
