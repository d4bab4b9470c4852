//! The laws of friction, and the shapes on which they are closed forms.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/solids.rs"]
mod solids;

mod curves;
mod damping;
mod differential;
mod edges;
mod energy;
mod none;
mod others;
mod plane;
mod properties;
mod roots;
mod sphere;
mod strain;
mod viscous;
