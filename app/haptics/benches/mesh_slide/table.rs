//! Single ticks, timed one by one.

use std::hint::black_box;
use std::time::Instant;

use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Algorithm, Entity, Finger, Friction};
use nalgebra::Vector3;

use crate::path::{self, PHASES, Phase, R, RadiusAt, TICK_S};
use crate::{SIZES, entity, frictions, phases_of, shape_of};

/// Runs of which the best counts.
const RUNS: usize = 7;
/// Streamed through between ticks for cold caches: more than any level but a server's last one.
const EVICTED_BYTES: usize = 256 << 20;
/// Of the slide's ticks, every so many-th is timed cold.
const COLD_EVERY: usize = 100;

pub(crate) fn print() {
    let clock_ns = clock_ns();
    println!(
        "one tick of one finger in ns; the clock's {clock_ns} ns are taken off; best of {RUNS} runs per tick,"
    );
    println!("then the first run as it was\n");
    build_times();
    header();
    for meridians in SIZES {
        let ball = make::uv_sphere(meridians, path::rings(meridians), R);
        rows(&format!("ball {}", triangles(&ball)), &ball, path::smooth, clock_ns);
    }
    let million = make::uv_sphere(1000, 501, R);
    rows("shuffled 1M", &make::shuffled(&million, 7), path::smooth, clock_ns);
    let bumpy = make::bumpy_sphere(1000, 501, R);
    rows("bumpy 1M", &bumpy, path::bumpy, clock_ns);
    for (name, algorithm) in
        [("god-object 1M", Algorithm::ClassicGodObject), ("vector field 1M", Algorithm::VectorField)]
    {
        let entity = entity(&shape_of(million.clone()), Friction::None, algorithm);
        row(name, "no friction", &entity, path::smooth, clock_ns);
    }
    cold(&[SIZES[0], SIZES[3]], clock_ns);
    cracks(clock_ns);
}

/// Strokes over a floor of tiles, with hairline cracks between them and without.
fn cracks(clock_ns: u64) {
    const TILES: i32 = 30;
    const SIZE_M: f64 = 0.01;
    println!("\nstroke over {TILES} x {TILES} tiles of {} mm", SIZE_M * 1e3);
    for (name, gap_m) in [("apart", 1e-3), ("cracks of 5 um", 5e-6), ("touching", 0.0)] {
        let tile = make::cuboid([SIZE_M - gap_m, SIZE_M, SIZE_M - gap_m]);
        let mut floor = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
        for place in 0..TILES * TILES {
            let [x, z] = [place % TILES, place / TILES].map(|i| SIZE_M * f64::from(i - TILES / 2));
            let first = floor.vertices.len() as u32;
            floor.vertices.extend(tile.vertices.iter().map(|vertex| vertex + Vector3::new(x, 0.0, z)));
            floor.faces.extend(tile.faces.iter().map(|face| face.map(|corner| corner + first)));
        }
        // A ring around the middle, half a millimetre deep.
        let around = |tick: usize| {
            let turn = tick as f64 * 2e-3;
            let down_m = (5e-3 - 1e-5 * tick as f64).max(-5e-4);
            let reach_m = 0.1 + 0.01 * (0.37 * turn).sin();
            (Phase::Slide, Vector3::new(reach_m * turn.cos(), 0.5 * SIZE_M + down_m, reach_m * turn.sin()))
        };
        let path: Vec<_> = (0..20_000).map(around).collect();
        for (friction_name, friction) in frictions() {
            let entity = entity(&shape_of(floor.clone()), friction, Algorithm::FrictionCone);
            let runs: Vec<_> = (0..RUNS).map(|_| tick_times(&entity, &path, clock_ns)).collect();
            let best = |tick: usize| runs.iter().map(|run| run[tick]).min().unwrap_or(0);
            let times = sorted((0..path.len()).map(best));
            let [median, p99, most] = [0.5, 0.99, 1.0].map(|q| quantile(&times, q));
            println!("{name:<16} {friction_name:<12} median {median}, p99 {p99}, max {most}");
        }
    }
}

fn triangles(soup: &TriangleSoup) -> String {
    match soup.faces.len() {
        n if n > 500_000 => "1M".into(),
        n if n > 50_000 => "100k".into(),
        n if n > 5000 => "10k".into(),
        _ => "1k".into(),
    }
}

fn build_times() {
    for (name, shuffle) in [("as generated", false), ("shuffled", true)] {
        let mut soup = make::uv_sphere(1000, 501, R);
        if shuffle {
            soup = make::shuffled(&soup, 7);
        }
        let best_s = (0..3).map(|_| {
            let soup = soup.clone();
            let start = Instant::now();
            black_box(Mesh::build(soup).expect("a mesh"));
            start.elapsed().as_secs_f64()
        });
        println!("build of 1M triangles, {name}: {:.2} s", best_s.fold(f64::INFINITY, f64::min));
    }
    println!();
}

fn header() {
    println!(
        "{:<16} {:<12} {:<9} {:>7} {:>7} {:>7} {:>8} {:>9} {:>9}",
        "mesh", "friction", "phase", "median", "p99", "p99.9", "max", "raw p99.9", "raw max"
    );
}

fn rows(name: &str, soup: &TriangleSoup, radius_at: RadiusAt, clock_ns: u64) {
    let shape = shape_of(soup.clone());
    for (friction_name, friction) in frictions() {
        row(name, friction_name, &entity(&shape, friction, Algorithm::FrictionCone), radius_at, clock_ns);
    }
}

fn row(name: &str, friction: &str, entity: &Entity, radius_at: RadiusAt, clock_ns: u64) {
    let path = path::standard_path(radius_at);
    let runs: Vec<_> = (0..RUNS).map(|_| tick_times(entity, &path, clock_ns)).collect();
    let best = |tick: usize| runs.iter().map(|run| run[tick]).min().unwrap_or(0);
    let phases = phases_of(&path);
    for (phase, _) in PHASES {
        let ticks = || (0..path.len()).filter(|&tick| phases[tick] == phase);
        let (times, raw) = (sorted(ticks().map(best)), sorted(ticks().map(|tick| runs[0][tick])));
        println!(
            "{name:<16} {friction:<12} {:<9} {:>7} {:>7} {:>7} {:>8} {:>9} {:>9}",
            format!("{phase:?}"),
            quantile(&times, 0.5),
            quantile(&times, 0.99),
            quantile(&times, 0.999),
            quantile(&times, 1.0),
            quantile(&raw, 0.999),
            quantile(&raw, 1.0),
        );
    }
}

fn tick_times(entity: &Entity, path: &[(Phase, Vector3<f64>)], clock_ns: u64) -> Vec<u64> {
    let mut finger = Finger::new(0.0, 1).expect("a finger");
    let time = |(_, hip): &(Phase, Vector3<f64>)| timed(&mut finger, entity, hip, clock_ns);
    path.iter().map(time).collect()
}

fn timed(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>, clock_ns: u64) -> u64 {
    let start = Instant::now();
    black_box(finger.step(std::slice::from_ref(entity), black_box(hip), TICK_S));
    (start.elapsed().as_nanos() as u64).saturating_sub(clock_ns)
}

/// Slides of which every so many-th tick finds everything evicted: the mesh, the finger, the code.
fn cold(sizes: &[usize], clock_ns: u64) {
    println!("\nslide with cold caches ({} MiB streamed through before the tick)", EVICTED_BYTES >> 20);
    let mut stream = vec![1_u64; EVICTED_BYTES / 8];
    for &meridians in sizes {
        let soup = make::uv_sphere(meridians, path::rings(meridians), R);
        let name = format!("ball {}", triangles(&soup));
        let shape = shape_of(soup);
        for (friction_name, friction) in frictions() {
            let entity = entity(&shape, friction, Algorithm::FrictionCone);
            let mut finger = Finger::new(0.0, 1).expect("a finger");
            let path = path::standard_path(path::smooth);
            let mut times = Vec::new();
            for (tick, (phase, hip)) in path.iter().enumerate() {
                let is_cold = *phase == Phase::Slide && tick % COLD_EVERY == 0;
                if is_cold {
                    stream.iter_mut().for_each(|word| *word = word.wrapping_mul(3));
                    black_box(&mut stream);
                }
                let time = timed(&mut finger, &entity, hip, clock_ns);
                times.extend(is_cold.then_some(time));
            }
            let times = sorted(times.into_iter());
            let [median, p90, max] = [0.5, 0.9, 1.0].map(|q| quantile(&times, q));
            println!("{name:<16} {friction_name:<12} median {median}, p90 {p90}, max {max}");
        }
    }
}

/// Median of what two readings of the clock measure when nothing is between them.
fn clock_ns() -> u64 {
    let empty = (0..100_000).map(|_| Instant::now().elapsed().as_nanos() as u64);
    quantile(&sorted(empty), 0.5)
}

fn sorted(times: impl Iterator<Item = u64>) -> Vec<u64> {
    let mut times: Vec<_> = times.collect();
    times.sort_unstable();
    times
}

fn quantile(sorted: &[u64], q: f64) -> u64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((q * last as f64).round() as usize).copied().unwrap_or(0)
}
