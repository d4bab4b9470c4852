//! What heights add to a tick of contact.
//!
//! Run `cargo bench -p haptics --bench height_map`. One point finger 2 mm below the surface slides over it by 0.2 mm a tick,
//! with stiction: without a picture, with one along the force, with one that raises the surface; of 64 and of 4096 texels
//! along a side (64 MB: every tick meets texels that no cache has). What counts are differences within one run.
#![allow(non_snake_case, unused_crate_dependencies, missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{DT, ball, entity, point_finger, stiction, table};
use criterion::{Criterion, criterion_group, criterion_main};
use haptics::mesh::{Mesh, make};
use haptics::{Entity, HeightForm, HeightGrid, HeightMap, PictureScale, Shape};
use nalgebra::Vector3;
use std::hint::black_box;
use std::sync::Arc;

/// Ticks of one round of the walk, which then repeats.
const ROUND: usize = 4096;
const RADIUS_M: f64 = 0.05;

/// A mesh's triangles, each with a place of the picture of its own.
fn globe() -> Entity {
    let soup = make::uv_sphere(316, 159, RADIUS_M);
    let place =
        |v: &Vector3<f64>| [v.x.atan2(v.z) / std::f64::consts::TAU + 0.5, 0.5 + v.y / (2.0 * RADIUS_M)];
    let uv: Vec<_> = soup.faces.iter().map(|face| face.map(|v| place(&soup.vertices[v as usize]))).collect();
    entity(Shape::from(Arc::new(Mesh::build_with_uv(soup, &uv).unwrap().0)), stiction())
}

fn walk(is_flat: bool) -> Vec<Vector3<f64>> {
    (0..ROUND)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / ROUND as f64;
            let (x, z) = ((3.0 * angle).sin(), (4.0 * angle).cos());
            if is_flat {
                return Vector3::new(0.04 * x, -2e-3, 0.04 * z);
            }
            Vector3::new(x, 0.5 * z, 1.0).normalize() * (RADIUS_M - 2e-3)
        })
        .collect()
}

/// One picture over all of it, or 0.1 m of a plane.
fn relief(side: usize, form: HeightForm, is_flat: bool) -> Arc<HeightMap> {
    let texel = |i: usize| (i.wrapping_mul(0x9E37_79B9) >> 7 & 0xFF) as f32 / 255.0;
    let grid = Arc::new(HeightGrid::new(side, side, (0..side * side).map(texel).collect()).unwrap());
    let scale = if is_flat { PictureScale::Size([0.1; 2]) } else { PictureScale::Repeat([1.0; 2]) };
    Arc::new(HeightMap::new(grid, 5e-5, scale).unwrap().with_form(form))
}

fn contact_update(criterion: &mut Criterion) {
    let shapes =
        [("plane", table(stiction())), ("ball", ball(RADIUS_M, stiction())), ("mesh of 100k", globe())];
    for (name, plain) in shapes {
        let is_flat = name == "plane";
        let path = walk(is_flat);
        let mut group = criterion.benchmark_group(name);
        for (work, side, form) in [
            ("plain", 1, None),
            ("along-force", 64, Some(HeightForm::AlongForce)),
            ("gradient", 64, Some(HeightForm::Gradient)),
            ("gradient of 16 M texels", 4096, Some(HeightForm::Gradient)),
        ] {
            let entities = [match form {
                Some(form) => plain.clone().with_height_map(relief(side, form, is_flat)),
                None => plain.clone(),
            }];
            let mut finger = point_finger();
            let above = path[0] + if is_flat { Vector3::y() * 0.01 } else { path[0].normalize() * 0.01 };
            finger.step(&entities, &above, DT);
            let touched = path.iter().filter(|hip| finger.step(&entities, *hip, DT).entity.is_some()).count();
            assert!(touched > ROUND * 9 / 10, "{name} {work}: {touched} of {ROUND}");
            let mut tick = 0;
            group.bench_function(work, |bencher| {
                bencher.iter(|| {
                    tick = (tick + 1) % ROUND;
                    finger.step(black_box(&entities), black_box(&path[tick]), DT)
                });
            });
        }
    }
}

criterion_group!(benches, contact_update);
criterion_main!(benches);
