//! The program as scripts drive it: what a run prints, writes, refuses and feels like, scene by scene.

mod abandoned;
mod bad_input;
mod ball;
mod contact_scenes;
mod crowd;
mod csg;
mod cut;
mod doctor;
mod driver_cli;
mod driver_output;
mod effects;
mod emulate;
mod ended;
mod events;
mod faces;
mod first_run;
mod frictions;
mod gallery;
mod grasp;
mod height_map;
mod impedance;
mod kept;
mod lists;
mod materials;
mod mesh;
mod model_of_many_files;
mod noise;
mod nurbs;
mod objects;
mod old_client;
mod orders;
mod output;
mod passive;
mod pictures;
mod plane;
mod play;
mod plot;
mod record;
mod repeatable;
mod scarce;
mod scenes;
mod shading;
mod shapes;
mod sphere;
mod study;
mod tardis;
mod time;
mod together;
mod viscous;
mod window;

/// What the example `make_mesh` writes.
#[allow(dead_code, reason = "its kinds are the program's")]
#[path = "../../../app/world/examples/make_mesh/written.rs"]
mod written;
