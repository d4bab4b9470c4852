//! What a scene or layout file can have wrong, and exactly what its author is told.

mod effects;
mod faces;
mod values;
mod words;

use std::path::Path;

use world::{Layout, Scene};

/// A scene that is in order, with a place to go wrong at the end of each part.
fn scene_with(top: &str, finger: &str, entity: &str) -> String {
    format!(
        "name = \"test\"\n{top}\n[[finger]]\n{finger}\n[[entity]]\nname = \"ball\"\n\
         shape = {{ kind = \"sphere\", radius_m = 0.05 }}\n{entity}\n"
    )
}

pub(crate) fn with_top(top: &str) -> String {
    scene_with(top, "", "")
}

pub(crate) fn with_finger(finger: &str) -> String {
    scene_with("", finger, "")
}

pub(crate) fn with_entity(entity: &str) -> String {
    scene_with("", "", entity)
}

pub(crate) fn with_shape(shape: &str) -> String {
    format!("[[finger]]\n[[entity]]\nname = \"thing\"\nshape = {shape}\n")
}

#[track_caller]
pub(crate) fn refused(text: &str, message: &str) {
    let error = Scene::parse(text, Path::new("s.toml")).expect_err("the scene is wrong");
    assert_eq!(error.to_string(), message);
}

#[track_caller]
pub(crate) fn layout_refused(text: &str, message: &str) {
    let error = Layout::parse(text, Path::new("l.toml")).expect_err("the layout is wrong");
    assert_eq!(error.to_string(), message);
}

#[test]
fn the_scene_that_the_others_are_spoilt_from_is_accepted() {
    Scene::parse(&with_entity(""), Path::new("s.toml")).expect("nothing is wrong");
}
