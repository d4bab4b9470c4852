//! Trees of shapes under a point.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/joints.rs"]
mod joints;
#[path = "../common/trees.rs"]
mod trees;

mod facets;
mod feel;
mod joined;
mod oracle;
mod seams;
mod states;
mod trees_of_shapes;
mod walks;
