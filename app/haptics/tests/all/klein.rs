//! The other impossible object of Melder 8.3.3: a surface with one side. It passes through itself, and a finger on it passes
//! along: only the sheet that it is on is there.
#![allow(non_snake_case)]

use crate::common;

use common::meshes::{built, step, touchable};
use common::*;
use haptics::Friction;
use haptics::mesh::make;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

const SIZE: f64 = 0.1;
/// Below the surface, and per tick along it (m).
const PRESSED: f64 = 2e-4;
const WAY: f64 = 1e-4;

/// The same figure eight on its half turn as [`make::klein_bottle`] has; goes on beyond u = 2 pi, where v has become -v.
fn surface(u: f64, v: f64) -> Vector3<f64> {
    let (sin, cos) = (0.5 * u).sin_cos();
    let out = 3.0 + cos * v.sin() - sin * (2.0 * v).sin();
    let scale = 0.5 * SIZE / 4.0;
    Vector3::new(out * u.cos(), sin * v.sin() + cos * (2.0 * v).sin(), -out * u.sin()) * scale
}

/// Of the two the one that goes on smoothly with u and v.
fn normal(u: f64, v: f64) -> Vector3<f64> {
    let h = 1e-6;
    let along_u = surface(u + h, v) - surface(u - h, v);
    let along_v = surface(u, v + h) - surface(u, v - h);
    along_u.cross(&along_v).normalize()
}

/// From `[u, v]` to `[u, v]` in steps of [`WAY`] or less.
fn path(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    let steps = 6000;
    (0..=steps).map(move |step| {
        let share = f64::from(step) / f64::from(steps);
        [0, 1].map(|at| from[at] + (to[at] - from[at]) * share)
    })
}

#[test]
fn a_finger_that_goes_around_a_klein_bottle_comes_back_on_its_other_side() {
    // The generator turns the other way around y if its first point beside u = 0 says so.
    let soup = make::klein_bottle(256, 128, SIZE);
    let nearest =
        |p: Vector3<f64>| soup.vertices.iter().map(|q| (q - p).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest(surface(1.0, 0.7)) < 1e-3, "the same bottle: {}", nearest(surface(1.0, 0.7)));
    let bottle = touchable(&built(soup), Friction::None);
    for side in [1.0, -1.0] {
        let begin = [0.3, 0.5 * PI];
        let mut finger = point_finger();
        let first = surface(begin[0], begin[1]) + normal(begin[0], begin[1]) * (side * PRESSED);
        step(&mut finger, &bottle, &first);
        // Once around, and through the place where the eight crosses itself to where it began.
        let around = path(begin, [begin[0] + TAU, 0.5 * PI]);
        let across = path([begin[0] + TAU, 0.5 * PI], [begin[0] + TAU, -0.5 * PI]);
        let (mut last, mut moved) = (first, 0.0f64);
        for [u, v] in around.chain(across) {
            let (p, n) = (surface(u, v), normal(u, v) * side);
            let hip = p - n * PRESSED;
            // The first step is the way in.
            moved = if last == first { 0.0 } else { moved.max((hip - last).norm()) };
            last = hip;
            let out = step(&mut finger, &bottle, &hip);
            let contact = finger.contact(0).unwrap_or_else(|| panic!("lost at {u} {v}, side {side}"));
            // Facets of 1 mm on bends of 5 mm, and the sheet that crosses is not there.
            assert!(contact.normal_W.dot(&n) > 0.9, "{u} {v}: {:?} is not {n:?}", contact.normal_W);
            assert!(
                (contact.god_object_W - p).norm() < PRESSED,
                "{u} {v}: {:?} is not {p:?}",
                contact.god_object_W
            );
            let force_n = out.force_on_user_W.norm();
            assert!((force_n / (K * PRESSED) - 1.0).abs() < 0.5, "{u} {v}: {force_n}");
        }
        assert!(moved < 3.0 * WAY, "{moved}");
        // At the same place, pressed from the other side.
        let there = surface(begin[0], begin[1]) - last;
        let began = normal(begin[0], begin[1]) * side;
        assert!(there.norm() < 1.01 * PRESSED && there.dot(&began) < -0.99 * PRESSED, "{there:?} {began:?}");
        let contact = finger.contact(0).expect("a contact");
        assert!(contact.normal_W.dot(&began) < -0.9, "{contact:?}");
    }
}
