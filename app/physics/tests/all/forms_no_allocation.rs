//! Contact points of closed forms never allocate, whatever they do to each other.
#![allow(non_snake_case)]

use crate::{counting, solids};

use counting::CALLS;
use haptics::{Form, Plane, Shape};
use nalgebra::Vector3;
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points};
use solids::*;

#[test]
fn contact_points_never_allocate() {
    let plane: Form = Plane::new(Vector3::y(), 0.0).unwrap().into();
    let shapes: Vec<Shape> =
        all().into_iter().chain(scaled()).chain([("plane", plane)]).map(|(_, form)| form.into()).collect();
    let (mut noise, mut touched, mut calls) = (Noise(1), 0, 0);
    for a in &shapes {
        for b in &shapes {
            let mut memory = PairMemory::default();
            for _ in 0..300 {
                let X_WA = pose(noise.turn(), noise.direction() * 0.03);
                let X_WB = pose(noise.turn(), Vector3::zeros());
                let mut found = ContactPoints::default();
                let (a, b) = (Solid { shape: a, X_W: &X_WA }, Solid { shape: b, X_W: &X_WB });
                let before = CALLS.get();
                contact_points(a, b, 1e-3, &mut memory, &mut found);
                calls += CALLS.get() - before;
                touched += found.as_slice().len();
            }
        }
    }
    assert_eq!(calls, 0);
    assert!(touched > 30_000, "{touched}");
}
