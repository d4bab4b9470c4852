//! How long a scene of ten thousand entities takes from its text to the first tick.
//!
//! Run `cargo bench -p phantom3 --bench load_scene`. Medians of five, in milliseconds: reading the text, models and
//! pictures, everything that a run needs; and the process's memory afterwards. Three fingers; `moving` entities have a mass.
#![allow(missing_docs, unused_crate_dependencies)]

use io_driver::config::period_of;
use phantom3::rig::{HandMode, Rig};
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};
use world::Scene;

const RUNS: usize = 5;
const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/scenes/shelf.toml");
const FINGERS: &str = "[[finger]]\n[[finger]]\n[[finger]]\n";
const SHELF: &str = "[[entity]]\nname = \"item\"\ntemplate = \"thing\"\nposition_m = [0.2, 0.2, 0.2]\n\
                     grid = { count = [10, 100, 10], spacing_m = [0.1, 0.1, 0.1] }\n";

fn shelf(thing: &str) -> String {
    format!("{FINGERS}[[template]]\nname = \"thing\"\n{thing}\n{SHELF}")
}

fn main() {
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let cube = "shape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] }";
    let csg = "shape = { kind = \"csg\", op = \"difference\", children = [{ shape = { kind = \"box\", size_m = [0.04, 0.04, 0.04] } }, \
               { shape = { kind = \"cylinder\", radius_m = 0.01, length_m = 0.1 } }] }";
    let mesh = "shape = { kind = \"mesh\", file = \"../meshes/bumpy-100k.stl\", scale = 0.1 }";
    let written_out: String = (0..10_000)
        .map(|i| format!("[[entity]]\nname = \"item-{i}\"\nposition_m = [{}.0, 0.0, 0.0]\n{cube}\n", i + 1))
        .collect();
    let moving_boxes = format!("{cube}\nmass_kg = 0.1");
    let cases = [
        ("boxes, a grid", shelf(cube)),
        ("boxes, each written out", format!("{FINGERS}{written_out}")),
        ("boxes, moving", shelf(&moving_boxes)),
        ("a mesh of 100k", shelf(mesh)),
        ("a csg of two", shelf(csg)),
    ];
    println!(
        "{:<26} {:>9} {:>9} {:>9}   {:>9}",
        "10,000 entities", "read ms", "rig ms", "total ms", "memory MB"
    );
    for (name, text) in cases {
        let mut times: Vec<[Duration; 2]> = (0..RUNS).map(|_| load(&text)).collect();
        times.sort_by_key(|[read, rig]| *read + *rig);
        let [read, rig] = times[RUNS / 2].map(|time| time.as_secs_f64() * 1e3);
        println!("{name:<26} {read:>9.1} {rig:>9.1} {:>9.1}   {:>9}", read + rig, resident_mb());
    }
}

/// Reading; and the rig with its fast step, which is made twice: once to check it, once for the run.
fn load(text: &str) -> [Duration; 2] {
    let file = Path::new(FILE);
    let begin = Instant::now();
    let scene = Scene::parse(text, file).unwrap_or_else(|error| panic!("{error}"));
    let read = begin.elapsed();
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, period_of(1000.0));
    let rig = rig.unwrap_or_else(|error| panic!("{error}"));
    black_box(rig.fast_step().unwrap_or_else(|error| panic!("{error}")));
    [read, begin.elapsed() - read]
}

fn resident_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) >> 10
}
