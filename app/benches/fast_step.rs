//! What a tick of rendering costs, by what the fingers do.
//!
//! Run `cargo bench -p phantom3`. `fast step` is the pure step of two fingers in the default scene (a ball
//! and a table, both with stiction): both free, both holding, both sliding. `one finger on the ball` leaves
//! the second one in the air. `events` is what telling what happened in a tick takes, beside its step. Each checks that its fingers do what its name says.

use bytemuck::Zeroable;
use criterion::{Criterion, criterion_group, criterion_main};
use haptics::ContactState;
use io_driver::config::period_of;
use nalgebra::{Rotation3, Vector3};
use phantom3::fast_step::{EventTeller, FastStep};
use phantom3::rig::{HandMode, Rig};
use phantom3::row::Row;
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::path::Path;
use world::Scene;
use world::events::event_queue;

/// Ticks of one round of a movement, which then repeats.
const ROUND: usize = 256;
const IN_THE_AIR: Vector3<f64> = Vector3::new(0.1, 0.3, 0.0);
const BALL: Vector3<f64> = Vector3::new(-0.08, 0.06, 0.0);
const BALL_RADIUS_M: f64 = 0.04;

fn default_scene() -> FastStep {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/scenes/default.toml"));
    let scene = Scene::load(file).expect("the default scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, period_of(1000.0)).expect("a rig");
    rig.fast_step().expect("rendering")
}

/// Circles 4 mm below the table, 0.5 mm a tick: it slides, since sticking ends at 0.5 x 4 = 2 mm.
fn over_the_table(part: f64) -> Vector3<f64> {
    Rotation3::from_axis_angle(&Vector3::y_axis(), TAU * part) * Vector3::new(0.02, 0.0, 0.0)
        + Vector3::new(0.1, -0.004, 0.0)
}

/// Circles 5 mm below the ball's surface, halfway up: 0.6 mm a tick, while sticking ends at 3.5 mm.
fn over_the_ball(part: f64) -> Vector3<f64> {
    let up = Vector3::new(1.0, 1.0, 0.0).normalize() * (BALL_RADIUS_M - 0.005);
    BALL + Rotation3::from_axis_angle(&Vector3::y_axis(), TAU * part) * up
}

/// A round of frames in which finger i is at `hips[i]` of the part of the round that is over.
fn frames(hips: [fn(f64) -> Vector3<f64>; 2]) -> Vec<Frame> {
    let frame = |index: usize| {
        let mut frame = Frame::zeroed();
        frame.device_count = 2;
        for (device, hip) in frame.devices.iter_mut().zip(hips) {
            device.flags = DEVICE_POSITION_VALID;
            device.position_m_measured = hip(index as f64 / ROUND as f64).into();
        }
        frame
    };
    (0..ROUND).map(frame).collect()
}

fn bench(
    criterion: &mut Criterion,
    name: &str,
    hips: [fn(f64) -> Vector3<f64>; 2],
    expected: [ContactState; 2],
) {
    let mut step = default_scene();
    let mut frames = frames(hips);
    let (mut tick, mut command, mut row) = (0, Command::zeroed(), Row::empty());
    let mut next = |row: &mut Row| {
        let frame = &mut frames[tick as usize % ROUND];
        tick += 1;
        frame.tick = tick;
        step.step(black_box(frame), &mut command, row);
        black_box(&command);
    };
    // From the air into the material, so that a contact begins where a finger would begin it; the first
    // round may still hold.
    (0..2 * ROUND).for_each(|_| next(&mut row));
    for _ in 0..ROUND {
        next(&mut row);
        assert_eq!([row.fingers[0].friction, row.fingers[1].friction], expected, "{name}");
    }
    criterion.bench_function(name, |bencher| bencher.iter(|| next(&mut row)));
}

fn steps(criterion: &mut Criterion) {
    use ContactState::{Free, Slip, Stick};
    let free: fn(f64) -> Vector3<f64> = |_| IN_THE_AIR;
    let held_ball: fn(f64) -> Vector3<f64> = |_| over_the_ball(0.0);
    let held_table: fn(f64) -> Vector3<f64> = |_| over_the_table(0.0);
    bench(criterion, "fast step, 2 fingers free", [free, free], [Free, Free]);
    bench(criterion, "fast step, 2 fingers holding", [held_ball, held_table], [Stick, Stick]);
    bench(criterion, "fast step, 2 fingers sliding", [over_the_ball, over_the_table], [Slip, Slip]);
    bench(criterion, "one finger on the ball, sliding", [over_the_ball, free], [Slip, Free]);
}

/// Nothing is new: two fingers in the air, or two that hold.
fn telling(criterion: &mut Criterion, name: &str, hips: [fn(f64) -> Vector3<f64>; 2]) {
    let (mut step, mut frames) = (default_scene(), frames(hips));
    let (mut command, mut row) = (Command::zeroed(), Row::empty());
    for frame in &mut frames {
        frame.tick = row.run_tick + 1;
        frame.run_tick = row.run_tick as i64 + 1;
        step.step(frame, &mut command, &mut row);
    }
    let (mut out, mut events) = event_queue(64);
    let mut teller = EventTeller::new(&mut step);
    teller.tell(&step, &row, &mut out);
    while events.receive(u64::MAX).is_some() {}
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| {
            row.run_tick += 1;
            teller.tell(black_box(&step), black_box(&row), &mut out);
        });
    });
    assert_eq!(events.receive(u64::MAX), None, "{name}: something was new");
}

fn events(criterion: &mut Criterion) {
    telling(criterion, "events, 2 fingers free", [|_| IN_THE_AIR, |_| IN_THE_AIR]);
    telling(criterion, "events, 2 fingers holding", [|_| over_the_ball(0.0), |_| over_the_table(0.0)]);
}

criterion_group!(benches, steps, events);
criterion_main!(benches);
