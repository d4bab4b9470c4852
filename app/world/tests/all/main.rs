//! Tests of what scenes, layouts, models and settings are read as.
//!
//! One program: each costs the time to link it, and tests of one program share the cores.

#[path = "../../examples/make_picture/drawn.rs"]
#[allow(dead_code, reason = "the example uses all of it")]
mod drawn;
#[path = "../../examples/default_hand/script.rs"]
mod script;
#[path = "../../examples/make_mesh/written.rs"]
mod written;

mod any_model;
mod any_text;
mod appearance;
mod default_hand;
mod effects;
mod events;
mod face_names;
mod formats;
mod height_maps;
mod kinds;
mod layouts;
mod lists;
mod loading;
mod made;
mod models;
mod nurbs_files;
mod pictures;
mod scenes;
mod seen;
mod settings;
mod shading;
mod templates;
mod thesis;
mod written_models;
