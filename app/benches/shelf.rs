//! What a tick costs with three fingers among ten thousand things that could move and rest (`shelf.toml`).
//!
//! Run `cargo bench -p phantom3 --bench shelf`. Almost all cubes are in the slow list and sleep; its turns are made between
//! ticks and not timed, for they have a thread of their own. The whole fast step (frame in, command out) is timed tick by
//! tick. `each` is what ticks in which cubes changed lists took more than the median of all, for each cube, the median
//! of these. `loading` is from the file's text to the first tick. First the cubes have to come to rest, which
//! takes some seconds.
#![allow(missing_docs, unused_crate_dependencies)]

use bytemuck::Zeroable;
use io_driver::config::period_of;
use phantom3::fast_step::FastStep;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use world::Scene;
use world::lists::SlowList;

const TICKS: u64 = 20_000;
const TURN: u64 = 10;
const MOST_SETTLING: u64 = 4000;

fn shelf() -> FastStep {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/benches/shelf.toml"));
    let scene = Scene::load(file).expect("the scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, period_of(1000.0)).expect("a rig");
    rig.fast_step().expect("rendering")
}

/// A run whose slow list is stepped here.
struct Run {
    step: FastStep,
    slow: SlowList,
    tick: u64,
    command: Command,
    row: Row,
}

impl Run {
    /// A tick with the fingers there; how long it took (ns).
    fn tick(&mut self, hips: [[f64; 3]; 3]) -> u64 {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count, frame.run_tick) = (self.tick + 1, 3, self.tick as i64);
        for (device, hip) in frame.devices.iter_mut().zip(hips) {
            (device.flags, device.position_m_measured) = (DEVICE_POSITION_VALID, hip);
        }
        let begin = Instant::now();
        self.step.step(black_box(&frame), &mut self.command, &mut self.row);
        black_box(&self.command);
        let took_ns = begin.elapsed().as_nanos() as u64;
        self.tick += 1;
        if self.tick.is_multiple_of(TURN) {
            self.slow.turn(TURN as u32, 1e-3);
        }
        took_ns
    }

    fn measure(&mut self, name: &str, hips: impl Fn(f64) -> [[f64; 3]; 3]) {
        let (mut times, mut changing) = (Vec::new(), Vec::new());
        let (mut awake, began) = (0, self.step.handed().expect("two lists").1);
        for tick in 0..TICKS {
            let before = self.step.handed().expect("two lists").1;
            let took_ns = self.tick(hips(tick as f64 * 1e-3));
            let after = self.step.handed().expect("two lists").1;
            let bodies = after.came + after.went - before.came - before.went;
            if bodies > 0 {
                changing.push((took_ns, bodies));
            }
            times.push(took_ns);
            awake += self.step.made().awake;
        }
        times.sort_unstable();
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize] as f64 / 1e3;
        let mut each: Vec<f64> =
            changing.iter().map(|&(ns, bodies)| (ns as f64 / 1e3 - at(0.5)) / bodies as f64).collect();
        each.sort_unstable_by(f64::total_cmp);
        let (here, handed) = self.step.handed().expect("two lists");
        println!(
            "{name:<26} {:>7.2} {:>7.2} {:>8.2}   {:>6.1} {here:>6} {:>9} {:>9.2}",
            at(0.5),
            at(0.999),
            at(1.0),
            awake as f64 / TICKS as f64,
            handed.came + handed.went - began.came - began.went,
            each.get(each.len() / 2).copied().unwrap_or_default(),
        );
    }
}

/// Above and before the shelf.
const AWAY: [[f64; 3]; 3] = [[0.0, 2.2, -0.5], [0.1, 2.2, -0.5], [0.2, 2.2, -0.5]];

/// To and fro along a row of cubes at this height and this far before them (m), 0.2 m/s.
fn along(t_s: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
    let x = 0.2 * (10.0 - (t_s % 20.0 - 10.0).abs());
    [[x, y, z], [x + 0.1, y + 0.1, z], [x + 0.2, y + 0.2, z]]
}

fn main() {
    if std::env::args().any(|argument| argument == "--test") {
        return;
    }
    let begin = Instant::now();
    let mut step = shelf();
    println!("loading: {:.2} s", begin.elapsed().as_secs_f64());
    let slow = step.take_slow().expect("too many for the fast list");
    let mut run = Run { step, slow, tick: 0, command: Command::zeroed(), row: Row::empty() };
    let begin = Instant::now();
    while !run.slow.manipulation().awake().is_empty() && run.tick < MOST_SETTLING {
        run.tick(AWAY);
    }
    println!(
        "at rest after {} ticks, {:.1} s; {} still awake, {} pairs left out",
        run.tick,
        begin.elapsed().as_secs_f64(),
        run.slow.manipulation().awake().len(),
        run.slow.manipulation().left_out()
    );
    println!(
        "{:<26} {:>7} {:>7} {:>8}   {:>6} {:>6} {:>9} {:>9}",
        "fast step (us)", "median", "p99.9", "most", "awake", "fast", "hand-overs", "each"
    );
    run.measure("fingers away", |_| AWAY);
    run.measure("before the shelf", |t_s| along(t_s, 0.52, -0.1));
    run.measure("along the cubes", |t_s| along(t_s, 0.52, -0.025));
    run.measure("on the cubes", |_| [[0.0, 0.538, 0.0], [0.1, 0.538, 0.0], [0.2, 0.538, 0.0]]);
}
