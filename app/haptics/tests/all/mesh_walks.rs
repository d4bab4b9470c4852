//! Random walks through meshes: never non-finite, never through the surface, never stuck on it.
//!
//! The long version, a million ticks per mesh, with a bumpy ball of a million triangles:
//! `cargo test --release -p haptics --test all mesh_walks:: -- --ignored`.
#![allow(non_snake_case)]

use crate::{common, mesh_oracle};

use common::meshes::*;
use common::*;
use haptics::mesh::{Mesh, Sides, make};
use haptics::{Contact, FingerOutput, Friction};
use mesh_oracle::{closest, corners};
use nalgebra::Vector3;
use std::sync::Arc;

/// A mesh, and which faces each of its vertices belongs to.
struct Ground {
    mesh: Arc<Mesh>,
    faces_of: Vec<Vec<u32>>,
}

impl Ground {
    fn new(mesh: Arc<Mesh>) -> Self {
        let mut faces_of = vec![Vec::new(); mesh.vertices().len()];
        for (face, of) in mesh.faces().iter().enumerate() {
            of.vertices.iter().for_each(|&vertex| faces_of[vertex as usize].push(face as u32));
        }
        Self { mesh, faces_of }
    }

    /// All faces that share a vertex with the one nearest to a point.
    fn around(&self, p: &Vector3<f64>) -> impl Iterator<Item = usize> {
        let face = self.mesh.nearest_unbounded(p).face as usize;
        self.mesh.faces()[face]
            .vertices
            .into_iter()
            .flat_map(|v| &self.faces_of[v as usize])
            .map(|&f| f as usize)
    }
}

/// What a walk has seen.
#[derive(Debug, Default)]
struct Seen {
    touching: usize,
    edges: usize,
    vertices: usize,
    long_walks: usize,
}

/// A tick's walk is bounded by 256 pieces, some 40 mm of triangles of half a millimetre. A god-object that comes out of
/// a dale opposite its HIP has half the way round a ball of 0.1 m before it, and the hills on that way.
const MOST_TICKS_OF_A_WALK: usize = 10;

fn walk(ground: &Ground, mut roaming: Roaming, ticks: usize) -> Seen {
    let mesh = &ground.mesh;
    let entity = touchable(mesh, Friction::None);
    let mut finger = point_finger();
    let mut seen = Seen::default();
    for tick in 0..ticks {
        let hip = roaming.next();
        let mut out = step(&mut finger, &entity, &hip);
        for _ in 0..MOST_TICKS_OF_A_WALK {
            if out.entity.is_none() || stuck(ground, &hip, &out).is_none() {
                break;
            }
            seen.long_walks += 1;
            let before = out;
            out = step(&mut finger, &entity, &hip);
            let spring_m = |out: &FingerOutput| (out.god_object_W - hip).norm();
            assert!(
                out.entity.is_none() || spring_m(&out) < spring_m(&before),
                "tick {tick}, HIP {hip:?}: goes nowhere, {before:?}, then {out:?}"
            );
        }
        let told = || format!("tick {tick}, HIP {hip:?}: {out:?}");
        assert!(
            out.force_on_user_W.iter().chain(out.god_object_W.iter()).all(|x| x.is_finite()),
            "{}",
            told()
        );
        if out.entity.is_none() {
            assert!(
                mesh.sides() == Sides::Sheet || !mesh.is_inside_unbounded(&hip) || is_on_it(mesh, &hip),
                "{}",
                told()
            );
            continue;
        }
        seen.touching += 1;
        seen.edges += usize::from(out.feature == haptics::Feature::Edge);
        seen.vertices += usize::from(out.feature == haptics::Feature::Vertex);
        assert_eq!(stuck(ground, &hip, &out), None, "{}", told());
        // The spring between the two, and nothing else: some roundings of 0.1 m, times 500 N/m.
        let spring = (out.god_object_W - hip) * K;
        assert!((out.force_on_user_W - spring).norm() < 1e-12, "{}", told());
    }
    seen
}

fn is_on_it(mesh: &Mesh, p: &Vector3<f64>) -> bool {
    mesh.nearest_unbounded(p).distance_m < 1e-13
}

/// Where, beside a god-object that ought to be at rest, the mesh is nearer to the HIP; or that it is not on the mesh.
fn stuck(ground: &Ground, hip: &Vector3<f64>, out: &FingerOutput) -> Option<String> {
    let at = &out.god_object_W;
    let mut is_on_it = false;
    for face in ground.around(at) {
        let face = corners(&ground.mesh, face);
        if (closest(&face, at) - at).norm() > 1e-12 {
            continue;
        }
        is_on_it = true;
        let gain_m = (at - hip).norm() - (closest(&face, hip) - hip).norm();
        // A way along a face that shortens the spring by more than roundings.
        if gain_m > 1e-12 {
            return Some(format!("{gain_m} m nearer on {face:?}"));
        }
    }
    (!is_on_it).then(|| "not on the mesh".into())
}

fn check(name: &str, mesh: Arc<Mesh>, half_width_m: f64, step_m: f64, ticks: usize) {
    let ground = Ground::new(mesh);
    let seen = walk(&ground, Roaming::new(9, half_width_m, step_m), ticks);
    println!("{name}: {seen:?}");
    assert!(seen.touching > ticks / 50, "{name}: {seen:?}");
    // Only round a ball, when the HIP passes near its middle: 0.17 % of the ticks on a million triangles.
    assert!(seen.long_walks <= seen.touching / 300, "{name}: {seen:?}");
}

fn check_all(ticks: usize, meridians: usize) {
    check("cube", cube(), 0.06, 5e-4, ticks);
    check("wedge", built(wedge(10.0)), 0.06, 2e-4, ticks);
    check("star", star(), 0.07, 5e-4, ticks);
    check("bumpy ball", bumpy_sphere(meridians), 0.09, 5e-4, ticks);
    check("Klein bottle", built(make::klein_bottle(64, 32, 0.1)), 0.1, 5e-4, ticks);
}

#[test]
fn a_klein_bottle_is_felt_from_wherever_one_comes_and_never_pressed_through() {
    let bottle = built(make::klein_bottle(128, 64, 0.1));
    let entity = touchable(&bottle, Friction::None);
    let mut noise = Noise(12);
    let mut felt = 0;
    for _ in 0..2000 {
        let face = (noise.uniform() * bottle.faces().len() as f64) as usize;
        let [a, b, c] = corners(&bottle, face);
        let middle = (a + b + c) / 3.0;
        // From either side: what is inside to one finger is outside to another.
        let side = if noise.uniform() < 0.5 { 1.0 } else { -1.0 };
        let normal = bottle.faces()[face].normal_B * side;
        let mut finger = point_finger();
        for i in -10..=20 {
            let depth = 1e-4 * f64::from(i);
            let was_touching = finger.contact(0).is_some();
            let out = step(&mut finger, &entity, &(middle - normal * depth));
            let contact = finger.contact(0);
            let begins_here = |contact: &Contact| (contact.god_object_W - middle).norm() < 1.1e-4;
            if !was_touching && contact.is_some_and(|contact| !begins_here(contact)) {
                // Held by another sheet: where the neck runs through the belly.
                break;
            }
            if i <= 0 {
                continue;
            }
            felt += 1;
            let contact = contact.unwrap_or_else(|| panic!("pressed through at {middle:?}, {depth}"));
            assert!(contact.normal_W.dot(&normal) > 0.9, "on the side it came from: {contact:?}");
            // Sheets bend: another place of the same side may be a little nearer.
            let force_n = out.force_on_user_W.norm();
            assert!(force_n <= K * depth * (1.0 + 1e-9) && force_n > 0.7 * K * depth, "{depth}: {force_n}");
        }
    }
    assert!(felt > 20_000, "{felt}");
}

#[test]
fn a_roaming_finger_is_never_stuck_and_never_inside_unnoticed() {
    check_all(50_000, 100);
}

#[test]
#[ignore = "the long version"]
fn a_roaming_finger_is_never_stuck_in_a_million_ticks() {
    check_all(1_000_000, 1000);
}
