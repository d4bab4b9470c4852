//! What it costs to ask a mesh of a million triangles, by where the finger is and how wide the tree's nodes are.
//!
//! Run `cargo bench -p haptics --bench mesh_queries`; `-- 'width 4'` is what meshes use. A tree of width 2 is what
//! there would be without vector instructions: its boxes fill half a register. `on a path` moves as a finger does,
//! 0.2 mm a tick, so that the caches know the place; `anywhere` jumps, so that they do not.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use haptics::mesh::{Bvh, Mesh, Sides, Triangles, make};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

const STEP_M: f64 = 2e-4;
const QUERIES: usize = 4096;
/// Distances from the surface \[m\].
const HEIGHTS: [(&str, f64); 2] = [("20 mm off", 0.02), ("1 mm off", 1e-3)];

/// A point and its normal, or two ends.
type Pair = (Vector3<f64>, Vector3<f64>);
type Query<'a> = &'a dyn Fn(&Vector3<f64>, &Vector3<f64>);

fn bumpy_sphere() -> Mesh {
    Mesh::build(make::bumpy_sphere(1000, 500, 0.1)).expect("a mesh").0
}

/// Points of the surface, each with its outward direction: a great circle in steps of a tick, or all over.
fn places(mesh: &Mesh, is_path: bool) -> Vec<Pair> {
    let tilted = Rotation3::from_euler_angles(0.7, 0.3, 0.5);
    let direction = |i: usize| {
        let i = i as f64;
        let (angle, y) = if is_path {
            (i * STEP_M / 0.1, 0.0)
        } else {
            (TAU * (i * 0.618_033_988_749_895).fract(), 2.0 * (i * 0.754_877_666_246_693).fract() - 1.0)
        };
        let across = f64::sqrt(1.0 - y * y);
        tilted * Vector3::new(across * angle.cos(), y, across * angle.sin())
    };
    let place = |i| {
        let direction = direction(i);
        let hit = mesh.first_hit(&(direction * 0.2), &Vector3::zeros()).expect("a star around its middle");
        (hit.point_B, mesh.faces()[hit.face as usize].normal_B)
    };
    (0..QUERIES).map(place).collect()
}

/// 0.2 mm along the surface, about as often to as fro.
fn sideways(i: usize, normal: &Vector3<f64>) -> Vector3<f64> {
    let angle = i as f64;
    let any = Vector3::new(angle.cos(), angle.sin(), (0.7 * angle).cos());
    (any - normal * any.dot(normal)).normalize() * STEP_M
}

fn queries<const WIDTH: usize>(criterion: &mut Criterion, mesh: &Mesh) {
    let tree = Bvh::<WIDTH>::build(mesh.faces(), mesh.vertices());
    println!("width {WIDTH}: {:.1} bytes per triangle", tree.size_bytes() as f64 / mesh.faces().len() as f64);
    let triangles = Triangles { faces: mesh.faces(), vertices: mesh.vertices() };
    let width = format!("width {WIDTH}");
    let mut run = |name: String, points: &[Pair], query: Query<'_>| {
        let mut i = 0;
        criterion.bench_function(&format!("{name}, {width}"), |bencher| {
            bencher.iter(|| {
                i = (i + 1) % QUERIES;
                let (first, second) = &points[i];
                query(first, second);
            });
        });
    };
    for (manner, is_path) in [("on a path", true), ("anywhere", false)] {
        let places = places(mesh, is_path);
        for (where_to, height) in HEIGHTS {
            let above: Vec<_> =
                places.iter().map(|(point, normal)| (point + normal * height, *normal)).collect();
            let steps: Vec<_> = above
                .iter()
                .enumerate()
                .map(|(i, (point, normal))| (*point, point + sideways(i, normal)))
                .collect();
            run(format!("step {where_to}, {manner}"), &steps, &|from, to| {
                black_box(tree.first_hit(triangles, Sides::Solid, from, to));
            });
            run(format!("nearest {where_to}, {manner}"), &above, &|point, _| {
                black_box(tree.nearest_unbounded(triangles, point));
            });
            run(format!("clearance {where_to}, {manner}"), &above, &|point, _| {
                black_box(tree.clearance(point, 0.05));
            });
        }
        let entering: Vec<_> = places
            .iter()
            .map(|(point, normal)| (point + normal * (0.5 * STEP_M), point - normal * (0.5 * STEP_M)))
            .collect();
        run(format!("step entering, {manner}"), &entering, &|from, to| {
            black_box(tree.first_hit(triangles, Sides::Solid, from, to).expect("an entry"));
        });
        let long: Vec<_> =
            places.iter().map(|(point, normal)| (point + normal * 0.02, point - normal * 0.02)).collect();
        run(format!("4 cm entering, {manner}"), &long, &|from, to| {
            black_box(tree.first_hit(triangles, Sides::Solid, from, to).expect("an entry"));
        });
    }
    criterion.bench_function(&format!("build, {width}"), |bencher| {
        bencher.iter_batched(
            || (),
            |()| Bvh::<WIDTH>::build(mesh.faces(), mesh.vertices()),
            BatchSize::PerIteration,
        );
    });
}

fn widths(criterion: &mut Criterion) {
    let mesh = bumpy_sphere();
    queries::<2>(criterion, &mesh);
    queries::<4>(criterion, &mesh);
    queries::<8>(criterion, &mesh);
}

fn brief() -> Criterion {
    Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(700))
}

criterion_group! { name = benches; config = brief(); targets = widths }
criterion_main!(benches);
