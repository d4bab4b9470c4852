//! What a tick costs with three fingers among ten thousand things that could move and rest (`shelf.toml`).
//!
//! Run `cargo bench -p phantom3 --bench shelf`. Almost all cubes are in the slow list and sleep; its turns are made between
//! ticks and not timed, for they have a thread of their own. The whole fast step (frame in, command out) is timed tick by
//! tick. Ticks in which the thread was preempted are left out and counted (`out`); `faults` are pages that were not there.
//! Below each row stands what the ticks did that took longest, one in a thousand, and what such ticks mostly take: one that
//! follows a turn of the slow list finds the caches full of that. `each` is what ticks in which cubes changed lists took more
//! than the median of all, for each cube, the median of these. `loading` is from the file's text to the first tick. First the
//! cubes have to come to rest, which takes some seconds.
#![allow(missing_docs, unused_crate_dependencies)]

use bytemuck::Zeroable;
use io_driver::config::period_of;
use phantom3::fast_step::FastStep;
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use rt_core::usage::ResourceUsage;
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
/// Of each row, before it is measured.
const SETTLING: u64 = 1000;

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

    /// A tick in which nobody knows where the fingers are.
    fn lose(&mut self) {
        let mut frame = Frame::zeroed();
        (frame.tick, frame.device_count, frame.run_tick) = (self.tick + 1, 3, self.tick as i64);
        self.step.step(&frame, &mut self.command, &mut self.row);
        self.tick += 1;
    }

    fn measure(&mut self, name: &str, hips: impl Fn(f64) -> [[f64; 3]; 3]) {
        // There at once, not on the way from where they were.
        self.lose();
        for _ in 0..SETTLING {
            self.tick(hips(0.0));
        }
        let mut ticks = vec![Timed { took_us: 1.0, ..Timed::default() }; TICKS as usize];
        let began = self.step.handed().expect("two lists").1;
        let (mut awake, mut out, mut faults) = (0, 0, 0);
        ticks.clear();
        for tick in 0..TICKS {
            let before = self.step.handed().expect("two lists").1;
            let (usage, after_a_turn) = (ResourceUsage::of_thread(), self.tick.is_multiple_of(TURN));
            let took_us = self.tick(hips(tick as f64 * 1e-3)) as f64 / 1e3;
            let usage = ResourceUsage::of_thread().delta(&usage);
            let after = self.step.handed().expect("two lists").1;
            awake += self.step.made().awake;
            faults += usage.minor_faults;
            if usage.involuntary_switches > 0 {
                out += 1;
                continue;
            }
            ticks.push(Timed {
                took_us,
                bodies: after.came + after.went - before.came - before.went,
                did: [
                    after.parcels[0] > before.parcels[0],
                    after.parcels[1] > before.parcels[1],
                    self.step.made().rows > 0,
                    after_a_turn,
                ],
            });
        }
        ticks.sort_unstable_by(|one, other| one.took_us.total_cmp(&other.took_us));
        let at = |share: f64| ticks[((ticks.len() - 1) as f64 * share) as usize].took_us;
        let changing = ticks.iter().filter(|tick| tick.bodies > 0);
        let each: Vec<f64> = changing.map(|tick| (tick.took_us - at(0.5)) / tick.bodies as f64).collect();
        let (here, handed) = self.step.handed().expect("two lists");
        println!(
            "{name:<26} {:>7.2} {:>7.2} {:>8.2}   {:>6.1} {here:>6} {:>9} {:>9.2} {out:>6} {faults:>6}",
            at(0.5),
            at(0.999),
            at(1.0),
            awake as f64 / TICKS as f64,
            handed.came + handed.went - began.came - began.went,
            median(each),
        );
        tell_slowest(&ticks);
    }
}

/// A tick and what was done in it, one after another of [`WHAT`].
#[derive(Debug, Clone, Copy, Default)]
struct Timed {
    took_us: f64,
    /// So many changed lists.
    bodies: u64,
    did: [bool; WHAT.len()],
}

const WHAT: [&str; 4] = ["cubes came", "cubes went", "contacts solved", "after a turn of the slow list"];

/// What the slowest of a thousand did, and what such ticks mostly take.
fn tell_slowest(ticks: &[Timed]) {
    let slowest = &ticks[ticks.len() - ticks.len() / 1000..];
    let mut kinds: Vec<[bool; WHAT.len()]> = slowest.iter().map(|tick| tick.did).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let of_kind = |ticks: &[Timed]| ticks.iter().filter(|tick| tick.did == kind).count();
        let all = ticks.iter().filter(|tick| tick.did == kind).map(|tick| tick.took_us).collect();
        let words: Vec<_> =
            WHAT.into_iter().zip(kind).filter(|(_, did)| *did).map(|(word, _)| word).collect();
        println!(
            "    {:>4} of the slowest {}: {} ({} ticks, median {:.2})",
            of_kind(slowest),
            slowest.len(),
            if words.is_empty() { "nothing of note".into() } else { words.join(", ") },
            of_kind(ticks),
            median(all),
        );
    }
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_unstable_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or_default()
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
        "{:<26} {:>7} {:>7} {:>8}   {:>6} {:>6} {:>9} {:>9} {:>6} {:>6}",
        "fast step (us)", "median", "p99.9", "most", "awake", "fast", "hand-overs", "each", "out", "faults"
    );
    run.measure("fingers away", |_| AWAY);
    run.measure("before the shelf", |t_s| along(t_s, 0.52, -0.1));
    run.measure("along the cubes", |t_s| along(t_s, 0.52, -0.025));
    run.measure("one on a cube, two along", |t_s| {
        let [_, second, third] = along(t_s, 0.52, -0.025);
        [[4.0, 0.538, 0.0], second, third]
    });
    run.measure("on the cubes", |_| [[0.0, 0.538, 0.0], [0.1, 0.538, 0.0], [0.2, 0.538, 0.0]]);
}
