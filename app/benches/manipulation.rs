//! What a tick costs while three fingers hold one of ten objects, and the others stand on a table.
//!
//! Run `cargo bench -p phantom3 --bench manipulation`. The scene is `config/scenes/ten.toml`: two boxes and a mesh of
//! 100,000 triangles among what stands on the table. The fingers close on the cube, then hold it, swaying by a centimetre
//! in a second; after a second, 20,000 ticks of the whole fast step (frame in, command out) are timed one by one, several
//! runs of the same ticks, of which each tick's best counts: what others on the machine take is not its cost.
//! Also per contact point: the cost of the objects' part, divided by the contact points of all ten.
#![allow(missing_docs, unused_crate_dependencies)]

use bytemuck::Zeroable;
use haptics::ContactState;
use io_driver::config::period_of;
use phantom3::fast_step::FastStep;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use world::Scene;

const SETTLES: usize = 1000;
const TICKS: usize = 20_000;
const RUNS: usize = 5;

fn ten() -> FastStep {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/scenes/ten.toml"));
    let scene = Scene::load(file).expect("the scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, period_of(1000.0)).expect("a rig");
    rig.fast_step().expect("rendering")
}

/// Where the fingers are in a tick.
fn frame(tick: usize) -> Frame {
    let mut frame = Frame::zeroed();
    // Nothing falls until the fingers have closed on it.
    (frame.tick, frame.device_count, frame.run_tick) = (tick as u64 + 1, 3, tick as i64 - 250);
    let closed = (tick as f64 / 200.0).min(1.0);
    let x = 0.035 - 0.014 * closed;
    let sway = 0.01 * (TAU * (tick as f64 - 250.0).max(0.0) / 1000.0).sin();
    for (device, at) in frame.devices.iter_mut().zip([[-x, 0.0], [x, 0.01], [x, -0.01]]) {
        device.flags = DEVICE_POSITION_VALID;
        device.position_m_measured = [at[0] + sway, 0.125, at[1] + 0.5 * sway];
    }
    frame
}

fn main() {
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let frames: Vec<Frame> = (0..SETTLES + TICKS).map(frame).collect();
    let mut best = vec![u64::MAX; TICKS];
    let (mut rows, mut sweeps) = (0, 0);
    for _ in 0..RUNS {
        let mut step = ten();
        let (mut command, mut row) = (Command::zeroed(), Row::empty());
        for (tick, frame) in frames.iter().enumerate() {
            let before = Instant::now();
            step.step(black_box(frame), &mut command, &mut row);
            let took = before.elapsed().as_nanos() as u64;
            black_box(&command);
            if let Some(best) = tick.checked_sub(SETTLES).map(|tick| &mut best[tick]) {
                *best = took.min(*best);
                let made = step.made();
                (rows, sweeps) = (rows + made.rows, sweeps + made.sweeps);
            }
        }
        let held = row.fingers[..3].iter().all(|finger| finger.friction == ContactState::Stick);
        assert!(held, "the fingers hold it: {:?}", &row.fingers[..3]);
    }
    best.sort_unstable();
    let at = |share: f64| best[((TICKS - 1) as f64 * share) as usize] as f64 / 1e3;
    let (rows, sweeps) = (rows as f64 / (RUNS * TICKS) as f64, sweeps as f64 / (RUNS * TICKS) as f64);
    println!("three fingers hold one of ten objects, the whole fast step, us:");
    println!("  median {:.2}   p99 {:.2}   p99.9 {:.2}   max {:.2}", at(0.5), at(0.99), at(0.999), at(1.0));
    println!(
        "  contact points {rows:.1}, turns of the solver {sweeps:.1}, {:.0} ns a contact point",
        at(0.5) * 1e3 / rows
    );
}
