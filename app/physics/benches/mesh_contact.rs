//! What it costs to find where meshes touch: `cargo bench -p physics --bench mesh_contact`.
#![allow(non_snake_case)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use haptics::mesh::make;
use haptics::{Cuboid, Cylinder, Plane, Shape, Sphere, Torus};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoints, PairMemory, Solid, contact_points};

#[path = "../tests/common/meshes.rs"]
mod meshes;

use meshes::{build, cut_in_four, terrain};

/// Of a pair that rests: its memory is that of many ticks, its pose trembles by a nanometre.
fn rest(c: &mut Criterion, name: &str, (a, X_WA): (&Shape, Isometry3<f64>), b: &Shape) {
    let mut memory = PairMemory::default();
    let mut tick = 0_u32;
    let X_WB = Isometry3::identity();
    let mut step = || {
        tick = tick.wrapping_add(1);
        let shake = 1e-9 * f64::from(tick % 7);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(shake, 0.3 * shake, -shake));
        let X_WA = Isometry3::from_parts(X_WA.translation, turn * X_WA.rotation);
        let mut found = ContactPoints::default();
        let (a, b) = (Solid { shape: a, X_W: &X_WA }, Solid { shape: b, X_W: &X_WB });
        contact_points(a, b, 1e-3, &mut memory, &mut found);
        found
    };
    for _ in 0..100 {
        step();
    }
    println!("{name}: {} points", step().as_slice().len());
    c.bench_function(name, |bench| bench.iter(|| black_box(step())));
}

fn cuboid(times: usize, turn: UnitQuaternion<f64>) -> Shape {
    let mut soup = make::cuboid([0.1; 3]);
    (0..times).for_each(|_| soup = cut_in_four(&soup));
    soup.vertices.iter_mut().for_each(|v| *v = turn * *v);
    build(soup).into()
}

fn benches(c: &mut Criterion) {
    let floor: Shape = Plane::new(Vector3::y(), 0.0).unwrap().into();
    let at = |x: f64, y: f64, turn| Isometry3::from_parts(Vector3::new(x, y, 0.0077).into(), turn);
    let straight = UnitQuaternion::identity();
    let lying = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 0.7, -0.4));
    let low = 0.05 - 1e-4;
    rest(c, "mesh on plane/cube of 12", (&cuboid(0, straight), at(0.0, low, straight)), &floor);
    rest(c, "mesh on plane/cube of 49k", (&cuboid(6, straight), at(0.0, low, straight)), &floor);
    // No box of its hierarchy is parallel to the floor.
    rest(
        c,
        "mesh on plane/cube of 49k, oblique in its frame",
        (&cuboid(6, lying), at(0.0, low, lying.inverse())),
        &floor,
    );
    let ball = |nu: usize, nv: usize| -> Shape { build(make::uv_sphere(nu, nv, 0.05)).into() };
    let balls = [ball(316, 159), ball(1000, 501)];
    rest(c, "mesh on plane/ball of 100k", (&balls[0], at(0.0, low, straight)), &floor);
    rest(c, "mesh on plane/ball of 100k, turned", (&balls[0], at(0.0, low, lying)), &floor);
    rest(c, "mesh on plane/ball of 100k, 1 mm deep", (&balls[0], at(0.0, 0.049, lying)), &floor);
    rest(c, "mesh on plane/ball of 1M", (&balls[1], at(0.0, low, lying)), &floor);

    let sphere: Shape = Sphere::new(0.02).unwrap().into();
    let flat: Shape = build(terrain(200, 0.3, |_, _| 0.0)).into();
    let wavy = |x: f64, z: f64| 0.004 * (60.0 * x).sin() * (50.0 * z).cos();
    let bumpy: Shape = build(terrain(200, 0.3, wavy)).into();
    rest(c, "ball on mesh/flat of 80k", (&sphere, at(0.0123, 0.0199, straight)), &flat);
    let ground = wavy(0.0123, 0.0077);
    rest(c, "ball on mesh/wavy of 80k", (&sphere, at(0.0123, ground + 0.0199, straight)), &bumpy);

    let table: Shape = Cuboid::new([0.4, 0.2, 0.4]).unwrap().into();
    let on_table = at(0.0, 0.1 + low, straight);
    rest(c, "mesh on box/cube of 12", (&cuboid(0, straight), on_table), &table);
    rest(c, "mesh on box/cube of 49k", (&cuboid(6, straight), on_table), &table);
    rest(c, "mesh on box/ball of 100k", (&balls[0], on_table), &table);
    let cube: Shape = Cuboid::new([0.05; 3]).unwrap().into();
    rest(c, "box on mesh/flat of 80k", (&cube, at(0.0123, 0.0249, straight)), &flat);
    rest(c, "box on mesh/wavy of 80k", (&cube, at(0.0123, ground + 0.0249, straight)), &bumpy);
    let cylinder: Shape = Cylinder::new(0.02, 0.05).unwrap().into();
    rest(c, "cylinder on mesh/flat of 80k", (&cylinder, at(0.0123, 0.0249, straight)), &flat);
    rest(c, "mesh on mesh/cube of 49k on flat of 80k", (&cuboid(6, straight), at(0.0, low, straight)), &flat);

    let ring: Shape = Torus::new(0.025, 0.01).unwrap().into();
    let upright = UnitQuaternion::from_scaled_axis(Vector3::new(1.5, 0.2, 0.1));
    let block: Shape = Cuboid::new([0.1; 3]).unwrap().into();
    for (name, cube) in
        [("box", block), ("cube of 12", cuboid(0, straight)), ("cube of 49k", cuboid(6, straight))]
    {
        let (lies, deep) = (at(0.0123, 0.06 - 1e-4, straight), at(0.045, 0.055, upright));
        rest(c, &format!("ring/on {name}"), (&ring, lies), &cube);
        rest(c, &format!("ring/30 mm deep in {name}"), (&ring, deep), &cube);
    }

    moving(c, "moving/cube of 49k on plane", (&cuboid(6, straight), at(0.0, low, straight)), &floor);
    moving(c, "moving/ball of 100k on plane", (&balls[0], at(0.0, low, lying)), &floor);
    moving(c, "moving/ball of 100k on box", (&balls[0], on_table), &table);
    moving(c, "moving/box on flat of 80k", (&cube, at(0.0123, 0.0249, straight)), &flat);
}

/// Of a pair that moves: nothing is as it was a tick ago.
fn moving(c: &mut Criterion, name: &str, (a, X_WA): (&Shape, Isometry3<f64>), b: &Shape) {
    let mut memory = PairMemory::default();
    let mut tick = 0_u32;
    let X_WB = Isometry3::identity();
    c.bench_function(name, |bench| {
        bench.iter(|| {
            tick = tick.wrapping_add(1);
            let phase = f64::from(tick) * 0.01;
            let rolls =
                Vector3::new(0.02 * phase.sin(), 0.01 * (0.7 * phase).cos(), 0.02 * (1.3 * phase).sin());
            let mut pose = X_WA;
            pose.rotation = UnitQuaternion::from_scaled_axis(rolls) * pose.rotation;
            pose.translation.vector.y += 1e-4 * (3.0 * phase).sin();
            let mut found = ContactPoints::default();
            let (a, b) = (Solid { shape: a, X_W: &pose }, Solid { shape: b, X_W: &X_WB });
            contact_points(a, b, 1e-3, &mut memory, &mut found);
            black_box(found)
        });
    });
}

criterion_group!(mesh_contact, benches);
criterion_main!(mesh_contact);
