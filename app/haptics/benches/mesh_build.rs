//! What it costs to build a mesh, by its size and the order of the input.
//!
//! Run `cargo bench -p haptics --bench mesh_build`. `generated` comes in rows, `shuffled` has its faces and vertices in
//! random order, `own corners` has three vertices of its own for each face, as STL has. All give the same mesh, with its
//! hierarchy of boxes.

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use haptics::mesh::{Mesh, TriangleSoup, make};
use std::time::Duration;

/// Meridians of a sphere of about nu^2 triangles.
const MERIDIANS: [(&str, usize); 4] = [("1k", 32), ("10k", 100), ("100k", 316), ("1M", 1000)];

fn with_own_corners(soup: &TriangleSoup) -> TriangleSoup {
    let corner = |&index: &u32| soup.vertices[index as usize];
    TriangleSoup {
        vertices: soup.faces.iter().flatten().map(corner).collect(),
        faces: (0..soup.faces.len() as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect(),
    }
}

fn build(c: &mut Criterion) {
    for (size, nu) in MERIDIANS {
        let generated = make::bumpy_sphere(nu, nu / 2, 0.1);
        let shuffled = make::shuffled(&generated, 1);
        let own_corners = with_own_corners(&generated);
        let mut group = c.benchmark_group("mesh build");
        group.throughput(Throughput::Elements(generated.faces.len() as u64));
        group.sample_size(10).measurement_time(Duration::from_secs(5));
        for (input, soup) in [("generated", generated), ("shuffled", shuffled), ("own corners", own_corners)]
        {
            group.bench_with_input(BenchmarkId::new(input, size), &soup, |b, soup| {
                let build = |soup| Mesh::build(soup).expect("a sphere");
                b.iter_batched(|| soup.clone(), build, BatchSize::LargeInput);
            });
        }
        group.finish();
    }
}

criterion_group!(benches, build);
criterion_main!(benches);
