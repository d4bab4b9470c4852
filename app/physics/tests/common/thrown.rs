//! Random bodies of all shapes above, in and on random planes and each other.
#![allow(dead_code, non_snake_case, unreachable_pub)]

use haptics::{
    Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Entity, Form, Friction, Plane, Shape, Sphere, Torus,
};
use nalgebra::{Isometry3, Vector3};
use physics::{Body, Response, Settings};

use crate::common::{World, body, object};
use crate::meshes;
use crate::noise::Noise;

/// What may be thrown into a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Kind {
    Sphere,
    Box,
    Capsule,
    Cylinder,
    Cone,
    CutCone,
    Torus,
    Ellipsoid,
    /// A mesh, convex.
    Block,
    /// A mesh, not convex.
    Angle,
}

pub const KINDS: [Kind; 10] = [
    Kind::Sphere,
    Kind::Box,
    Kind::Capsule,
    Kind::Cylinder,
    Kind::Cone,
    Kind::CutCone,
    Kind::Torus,
    Kind::Ellipsoid,
    Kind::Block,
    Kind::Angle,
];

/// The first so many entities; all others are bodies.
pub const PLANES: usize = 2;

/// What a scene is made of.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// Of what moves.
    pub kinds: &'static [Kind],
    /// At most so many bodies.
    pub bodies: usize,
    /// Half of the scenes begin with all of them within the floor, the wall and each other.
    pub is_deep: bool,
    pub response: Response,
    /// Torsional and rolling friction of all (m).
    pub turning_m: f64,
}

/// Some centimetres large.
pub fn shape(kind: Kind, noise: &mut Noise) -> Shape {
    let form: Form = match kind {
        Kind::Sphere => Sphere::new(noise.within(0.005, 0.04)).unwrap().into(),
        Kind::Box => Cuboid::new([0; 3].map(|_| noise.within(0.01, 0.08))).unwrap().into(),
        Kind::Capsule => Capsule::new(noise.within(0.005, 0.02), noise.within(0.01, 0.08)).unwrap().into(),
        Kind::Cylinder => Cylinder::new(noise.within(0.005, 0.04), noise.within(0.01, 0.08)).unwrap().into(),
        Kind::Cone => Cone::new(noise.within(0.01, 0.04), 0.0, noise.within(0.02, 0.08)).unwrap().into(),
        Kind::CutCone => {
            let (bottom, top) = (noise.within(0.01, 0.04), noise.within(0.005, 0.02));
            Cone::new(bottom, top, noise.within(0.01, 0.06)).unwrap().into()
        }
        Kind::Torus => {
            let tube = noise.within(0.004, 0.012);
            Torus::new(tube + noise.within(0.006, 0.03), tube).unwrap().into()
        }
        Kind::Ellipsoid => Ellipsoid::new([0; 3].map(|_| noise.within(0.01, 0.04))).unwrap().into(),
        Kind::Block => {
            let size = noise.within(0.02, 0.06);
            return meshes::build(meshes::block(2, size, size, |_, _| 0.0)).into();
        }
        Kind::Angle => return meshes::build(meshes::angle()).into(),
    };
    form.into()
}

/// Planes with things above or in them: 1 g to 10 kg, 10 to 5000 N/m, with and without damping and friction.
pub fn scene(seed: u64, recipe: &Recipe) -> World {
    let noise = &mut Noise::new(seed);
    let mu = |noise: &mut Noise| if noise.chance(0.25) { 0.0 } else { noise.within(0.0, 1.5) };
    let plane = |noise: &mut Noise, normal: Vector3<f64>| {
        let plane = Plane::new(normal, 0.0).unwrap();
        let entity = Entity::new(plane, Isometry3::identity(), noise.log_within(100.0, 5000.0)).unwrap();
        let entity = entity.with_turning_friction(recipe.turning_m, recipe.turning_m).unwrap();
        entity.with_friction(Friction::coulomb(mu(noise)).unwrap()).unwrap()
    };
    // A floor that may lean, and a wall across it.
    let lean = noise.vector(0.3);
    let wall = Vector3::x() + Vector3::y() * noise.within(0.0, 0.5);
    let mut entities = vec![plane(noise, Vector3::y() + lean), plane(noise, wall)];
    let mut bodies = Vec::new();
    let is_deep = recipe.is_deep && noise.chance(0.5);
    for place in 0..1 + noise.below(recipe.bodies) {
        let shape = shape(recipe.kinds[noise.below(recipe.kinds.len())], noise);
        let at = if is_deep {
            Vector3::new(noise.within(0.0, 0.1), noise.within(0.0, 0.1), noise.within(-0.05, 0.05))
        } else {
            Vector3::new(0.15 + 0.1 * place as f64, noise.within(0.25, 0.4), noise.within(-0.1, 0.1))
        };
        let X_WB = Isometry3::from_parts(at.into(), noise.turn());
        let entity = object(shape, X_WB, noise.log_within(10.0, 5000.0), mu(noise));
        let damping = if noise.chance(0.5) { 0.0 } else { noise.within(0.0, 2.0) };
        let entity = entity.with_damping(damping).unwrap();
        let entity = entity.with_turning_friction(recipe.turning_m, recipe.turning_m).unwrap();
        bodies.push((entities.len(), thrown(&entity, noise)));
        entities.push(entity);
    }
    let settings = Settings { response: recipe.response, ..Settings::default() };
    World::new(entities, &bodies, settings, 0)
}

fn thrown(entity: &Entity, noise: &mut Noise) -> Body {
    let at_rest = body(entity, noise.log_within(1e-3, 10.0));
    at_rest.moving(noise.vector(1.0), noise.vector(30.0))
}
