//! Fuzz targets: everything that reads foreign bytes, each as a function of bytes.
//!
//! Problem: a parser is attacked best by a fuzzer with coverage feedback, and what it once found has to be found again by
//! plain `cargo test`.
//! Model: a [`Target`] takes any bytes and must return. That it does so soon, without a panic and within the memory that
//! is allowed, is judged by who calls it: `tests/fuzz` runs each with libFuzzer, the test program `corpus` runs
//! the committed corpora, and bytes that once failed (`tests/fuzz/crashes`).
//! Invariant: a target depends on its bytes only; it reads no file that they name but such that cannot be there.

#![forbid(unsafe_code)]

#[cfg(feature = "application")]
mod application;
mod driver;
mod models;
mod scenes;

#[cfg(feature = "application")]
pub use application::{orders, replay_csv, replay_mcap, rig};
pub use driver::{config, hand_csv, reply, server};
pub use models::{ase, gltf, obj, patches, patches_obj, ply, png, stl, three_ds};
pub use scenes::{layout, scene, thesis};

/// A function of any bytes.
pub type Target = fn(&[u8]);

/// All of them by the name of their corpus.
pub const TARGETS: &[(&str, Target)] = &[
    ("ase", ase),
    ("config", config),
    ("gltf", gltf),
    ("hand_csv", hand_csv),
    ("layout", layout),
    ("obj", obj),
    ("patches", patches),
    ("patches_obj", patches_obj),
    ("ply", ply),
    ("png", png),
    ("reply", reply),
    ("scene", scene),
    ("server", server),
    ("stl", stl),
    ("thesis", thesis),
    ("three_ds", three_ds),
    #[cfg(feature = "application")]
    ("orders", orders),
    #[cfg(feature = "application")]
    ("replay_csv", replay_csv),
    #[cfg(feature = "application")]
    ("replay_mcap", replay_mcap),
    #[cfg(feature = "application")]
    ("rig", rig),
];

/// A refusal is short; that it acts on no terminal is the business of who prints it.
fn check_message(message: &str) {
    assert!(message.len() < LONGEST_MESSAGE, "a message of {} bytes: {message:.200}", message.len());
}

/// A list of all keys that may stand in a place is the longest of what we say.
const LONGEST_MESSAGE: usize = 4000;
