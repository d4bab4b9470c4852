//! Scenes, layouts and the thesis' own files.

use crate::check_message;
use std::path::Path;
use world::thesis::{Conversion, ObjectKind, read_list, read_object};
use world::{Layout, Scene};

/// Nothing lies beside it.
const NOWHERE: &str = "/nowhere/at/all/scene.toml";

/// A scene.
pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(errors) = Scene::examine(text, Path::new(NOWHERE)) {
        errors.iter().for_each(|error| check_message(&error.to_string()));
    }
}

/// A layout.
pub fn layout(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = Layout::parse(text, Path::new(NOWHERE)) {
        check_message(&error.to_string());
    }
}

/// A scene list, an object file, or what follows of an object file: a scene that is valid TOML.
pub fn thesis(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let file = Path::new("objects.ini");
    if let Err(error) = read_list(&text, file) {
        check_message(&error.to_string());
    }
    let object = match read_object(&text, file) {
        Ok(object) => object,
        Err(error) => return check_message(&error.to_string()),
    };
    for kind in KINDS {
        let mut conversion = Conversion::new("fuzz", "meshes/");
        let part = std::slice::from_ref(&object);
        if let Err(error) = conversion.add(kind, &object, part) {
            check_message(&error.to_string());
            continue;
        }
        let toml = conversion.finish(true).toml;
        assert!(toml.parse::<toml::Table>().is_ok(), "no TOML comes of {kind:?}:\n{toml}");
    }
}

const KINDS: [ObjectKind; 6] = [
    ObjectKind::GameObject,
    ObjectKind::Environment,
    ObjectKind::EnvironmentMixed,
    ObjectKind::Light,
    ObjectKind::Camera,
    ObjectKind::Phantom,
];
