//! Trees of shapes under a point.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/trees.rs"]
mod trees;
#[path = "../common/joints.rs"]
mod joints;

mod feel;
mod joined;
mod oracle;
mod seams;
mod states;
mod trees_of_shapes;
mod walks;
