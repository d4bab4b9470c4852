//! A step never allocates: counted over ticks that touch, slide and leave.
#![allow(non_snake_case)]

mod common;
#[path = "common/solids.rs"]
mod solids;

use common::*;
use haptics::mesh::{Mesh, make};
use haptics::{Finger, Friction, Nurbs, nurbs};
use nalgebra::Vector3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting the calls of each thread.
struct Counting;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is handed on unchanged to `System`, which keeps the contract; counting
// touches a thread-local without destructor and without allocation.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: the caller keeps `alloc`'s contract for this very layout.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        CALLS.set(CALLS.get() + 1);
        // SAFETY: `block` came from `System.alloc` with this layout, through `alloc` above.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_step_on_a_mesh_never_allocates() {
    let bumpy = std::sync::Arc::new(Mesh::build(make::bumpy_sphere(100, 51, 0.02)).unwrap().0);
    let knot = std::sync::Arc::new(Mesh::build(make::klein_bottle(40, 20, 0.04)).unwrap().0);
    let entities = [entity(bumpy, stiction()), entity(knot, Friction::coulomb(0.3).unwrap())];
    let mut finger = Finger::new(0.0, entities.len()).unwrap();
    let mut noise = Noise(10);
    let (mut free, mut stuck, mut slid) = (0, 0, 0);
    let before = CALLS.get();
    for i in 0..100_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.025 * (2.0 * t).sin(), 0.025 * (3.0 * t).cos(), 0.01 * t.sin())
            + noise.vector(1e-5);
        match finger.step(&entities, &hip, DT).friction {
            haptics::ContactState::Free => free += 1,
            haptics::ContactState::Stick => stuck += 1,
            haptics::ContactState::Slip => slid += 1,
        }
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(free > 1000 && stuck > 1000 && slid > 1000, "{free} {stuck} {slid}");
}

#[test]
fn a_step_on_rational_patches_never_allocates() {
    let solid = std::sync::Arc::new(Nurbs::build(&nurbs::make::vase(0.05)).unwrap().0);
    let sheet = std::sync::Arc::new(Nurbs::build(&nurbs::make::sheet(6, 0.05, 0.002)).unwrap().0);
    for radius in [0.0, 0.002] {
        let entities =
            [entity(solid.clone(), stiction()), entity(sheet.clone(), Friction::coulomb(0.3).unwrap())];
        let mut finger = Finger::new(radius, entities.len()).unwrap();
        let mut noise = Noise(10);
        let mut touched = 0;
        let before = CALLS.get();
        for i in 0..20_000u32 {
            if i.is_multiple_of(500) {
                finger.forget(0);
            }
            let t = f64::from(i) * DT;
            let hip = Vector3::new(0.02 * (2.0 * t).sin(), 0.03 * (3.0 * t).cos(), 0.01 * t.sin())
                + noise.vector(1e-5);
            touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
        }
        assert_eq!(CALLS.get() - before, 0);
        assert!(touched > 1000, "{touched}");
    }
}

#[test]
fn no_shape_makes_a_step_allocate() {
    for solid in solids::all() {
        let entities = [entity(solid.form, stiction())];
        let mut finger = point_finger();
        let mut noise = Noise(8);
        let (mut hip, mut touched) = (Vector3::y(), 0);
        let before = CALLS.get();
        for i in 0..20_000u32 {
            // Also begins inside now and then, where the nearest point is searched for.
            if i.is_multiple_of(100) {
                finger.forget(0);
            }
            hip = hip * 0.99 + noise.vector(0.1 * solid.size_m);
            touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
        }
        assert_eq!(CALLS.get() - before, 0, "{}", solid.name);
        assert!(touched > 500, "{}: {touched}", solid.name);
    }
}

#[test]
fn no_friction_model_ever_allocates() {
    for (name, friction) in laws::drift_free().into_iter().chain(laws::drifting()) {
        let entities = [table(friction.clone()), ball(0.02, friction)];
        let mut finger = point_finger();
        let mut noise = Noise(10);
        let before = CALLS.get();
        for i in 0..5000 {
            let t = f64::from(i) * DT;
            let hip = Vector3::new(0.03 * (2.0 * t).sin(), 0.02 * (3.0 * t).cos(), 0.0) + noise.vector(1e-4);
            finger.step(&entities, &hip, DT);
        }
        assert_eq!(CALLS.get() - before, 0, "{name}");
    }
}

#[test]
fn a_step_never_allocates() {
    let entities = [table(stiction()), ball(0.02, Friction::coulomb_viscous(0.3, 1.0).unwrap())];
    let mut finger = Finger::new(0.001, entities.len()).unwrap();
    let mut noise = Noise(9);
    let (mut free, mut stuck, mut slid, mut both) = (0, 0, 0, 0);
    let before = CALLS.get();
    for i in 0..100_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.03 * (2.0 * t).sin(), 0.02 * (3.0 * t).cos(), 0.0) + noise.vector(1e-4);
        let out = finger.step(&entities, &hip, DT);
        match out.friction {
            haptics::ContactState::Free => free += 1,
            haptics::ContactState::Stick => stuck += 1,
            haptics::ContactState::Slip => slid += 1,
        }
        both += u32::from(finger.contacts().count() == 2);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(free > 1000 && stuck > 100 && slid > 1000 && both > 1000, "{free} {stuck} {slid} {both}");
    drop(vec![0u8; 16]);
    assert!(CALLS.get() > before, "the counter counts");
}

#[test]
fn queries_of_a_mesh_never_allocate() {
    let mesh = Mesh::build(make::bumpy_sphere(100, 50, 0.1)).unwrap().0;
    let mut noise = Noise(10);
    let (mut hits, mut inside) = (0, 0);
    let before = CALLS.get();
    for _ in 0..10_000 {
        let (p, q) = (noise.vector(0.06), noise.vector(0.06));
        hits += u32::from(mesh.first_hit(&p, &q).is_some());
        inside += u32::from(mesh.is_inside(&p));
        assert!(mesh.clearance(&p, 1.0) <= mesh.nearest(&p).distance_m);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(hits > 1000 && inside > 1000, "{hits} {inside}");
}
