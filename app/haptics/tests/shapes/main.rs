//! The closed forms.
#![allow(non_snake_case)]

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/solids.rs"]
mod solids;

mod edges;
mod oracle;
mod starts;
mod walks;
