//! What a picture costs: of the default scene, and of a shelf with ten thousand cubes.
//!
//! Run `cargo bench -p view --bench picture`. Pictures are of 1280x720 places, drawn without a display and read back. `still`:
//! nothing moves from one to the next; `moving`: everything does, so shadows are made anew and all places are sent again. The
//! sixtieth part of a second is 16.7 ms. Where there are no graphics it says so.
#![allow(missing_docs, unused_crate_dependencies)]

use haptics::{Cuboid, Entity};
use nalgebra::{Isometry3, Point3, Vector3};
use std::path::Path;
use std::time::Instant;
use view::{Eyes, Moment, Stage, Studio};
use world::{Scene, SceneCamera};

const SIZE: [u32; 2] = [1280, 720];
const PICTURES: usize = 60;

fn main() {
    for (name, file, camera) in [
        ("default scene", "../../config/scenes/default.toml", None),
        ("shelf of 10,000", "../benches/shelf.toml", Some(before_the_shelf())),
    ] {
        let scene = Scene::load(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("the scene");
        measure(name, &scene, camera);
    }
}

fn measure(name: &str, scene: &Scene, camera: Option<SceneCamera>) {
    // Only where they are matters: what is drawn is of known form.
    let shape = || Cuboid::new([0.01; 3]).expect("a box");
    let entity = |pose| Entity::new(shape(), pose, 1000.0).expect("an entity");
    let entities: Vec<Entity> = scene.entities.iter().map(|spec| entity(spec.pose)).collect();
    let stage = Stage::new(scene, &entities);
    let begun = Instant::now();
    let mut studio = match Studio::new(&stage, SIZE) {
        Ok(studio) => studio,
        Err(missing) => return println!("{name}: skipped: {missing}"),
    };
    let camera = camera.unwrap_or_else(|| stage.cameras[0].clone());
    let mut moment =
        Moment { poses: entities.iter().map(|entity| entity.X_WB).collect(), ..Moment::default() };
    studio.take(&moment, &camera, &Eyes::default());
    let (things, first_ms) = (stage.things.len(), 1e3 * begun.elapsed().as_secs_f64());
    println!(
        "{name}: {things} things, drawn by {}; the first picture after {first_ms:.0} ms",
        studio.renderer()
    );
    for (with_shadows, moves) in [(true, false), (true, true), (false, true)] {
        studio.painter().with_shadows = with_shadows;
        let mut took_ms: Vec<f64> = (0..PICTURES)
            .map(|_| {
                if moves {
                    let up = Isometry3::translation(0.0, 1e-5, 0.0);
                    moment.poses.iter_mut().for_each(|pose| *pose = up * *pose);
                }
                let begun = Instant::now();
                studio.take(&moment, &camera, &Eyes::default());
                1e3 * begun.elapsed().as_secs_f64()
            })
            .collect();
        took_ms.sort_by(f64::total_cmp);
        let (median, worst) = (took_ms[PICTURES / 2], took_ms[PICTURES - 1]);
        let how = if moves { "moving" } else { "still" };
        let shadows = if with_shadows { "with shadows" } else { "without shadows" };
        println!("    {how}, {shadows}: median {median:.1} ms, worst {worst:.1} ms");
    }
}

/// Sees it whole.
fn before_the_shelf() -> SceneCamera {
    let (eye, at) = (Point3::new(2.45, 1.4, 5.0), Vector3::new(2.45, 0.95, 0.45));
    let pose = Isometry3::face_towards(&eye, &(eye + (eye.coords - at)), &Vector3::y());
    SceneCamera { name: "front".into(), pose, field_of_view_deg: 40.0, near_m: 0.1, far_m: 50.0 }
}
