//! Stages: everything that a scene says is drawn, whatever it is felt as.

use haptics::{Entity, Shape, Sphere};
use nalgebra::Vector3;
use std::path::Path;
use std::sync::Arc;
use view::Stage;
use world::{Scene, ShapeSpec};

const BORED: &str = "{ kind = \"csg\", op = \"difference\", children = [{ shape = { kind = \"box\", size_m = [0.1, 0.06, 0.08] } }, \
                     { shape = { kind = \"cylinder\", radius_m = 0.02, length_m = 0.2 } }] }";

/// A ball that is drawn as a solid with a bore, and one that is felt as that, too.
fn things() -> [String; 2] {
    [
        format!(
            "[[entity]]\nname = \"seen\"\nshape = {{ kind = \"sphere\", radius_m = 0.02 }}\nvisual = {{ shape = {BORED} }}\n"
        ),
        format!("[[entity]]\nname = \"felt\"\nshape = {BORED}\n"),
    ]
}

fn stage(text: &str) -> (Scene, Stage) {
    let scene = Scene::parse(&format!("[[finger]]\n{text}"), Path::new("scene.toml")).unwrap();
    let entities: Vec<Entity> = scene
        .entities
        .iter()
        .map(|spec| {
            let shape = match &spec.shape {
                ShapeSpec::Csg(_) => Shape::from(Arc::new(spec.shape.csg().unwrap())),
                _ => Shape::Form(Sphere::new(0.02).unwrap().into()),
            };
            Entity::new(shape, spec.pose, 1000.0).unwrap()
        })
        .collect();
    let stage = Stage::new(&scene, &entities);
    (scene, stage)
}

#[test]
fn a_solid_that_is_only_seen_is_drawn_whatever_comes_first() {
    let [seen, felt] = things();
    for text in [seen.clone(), format!("{seen}{felt}"), format!("{felt}{seen}")] {
        let (scene, stage) = stage(&text);
        assert!(stage.not_drawn.is_empty(), "{:?}", stage.not_drawn);
        assert_eq!(stage.things.len(), scene.entities.len());
        for thing in &stage.things {
            let most =
                thing.triangles.places.iter().fold(Vector3::zeros(), |most, place| place.coords.sup(&most));
            assert!((most - Vector3::new(0.05, 0.03, 0.04)).amax() < 1e-12, "{most}");
        }
        // What looks alike is one.
        assert!(stage.things.iter().all(|thing| Arc::ptr_eq(&thing.triangles, &stage.things[0].triangles)));
    }
}
