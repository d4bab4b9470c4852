//! Movements of a tip whose place and velocity are known exactly, and what the counters of an arm make of them.
//!
//! Model: along a line through the workspace, `p(t) = start + direction s(t)`, with `s` and its derivative in
//! closed form; the joints by the inverse kinematics, their velocities by solving `J q' = p'`; the counters by
//! rounding to the nearest count, with Gaussian noise before the rounding where it is asked for.

use io_driver::device_file::{ArmFile, DeviceFile, builtin};
use io_driver::encoders::JointMap;
use io_driver::kinematics::Mechanism;
use io_driver::sim::split_mix::SplitMix64;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::path::Path;

/// How far along the line (m) and how fast (m/s), by time (s).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    /// For people.
    pub(crate) name: &'static str,
    /// Whether the velocity never changes.
    pub(crate) is_steady: bool,
    /// Standard deviation of a counter's reading before rounding (counts).
    pub(crate) noise_counts: f64,
    /// Place and velocity.
    pub(crate) at: fn(f64) -> (f64, f64),
}

/// Those of the table.
pub(crate) const MOTIONS: [Motion; 9] = [
    Motion { name: "rest, noisy counts", is_steady: true, noise_counts: 0.3, at: |_| (0.0, 0.0) },
    Motion { name: "slow, 5 mm/s", is_steady: true, noise_counts: 0.0, at: |t| (5e-3 * t, 5e-3) },
    Motion { name: "slow, noisy counts", is_steady: true, noise_counts: 0.3, at: |t| (5e-3 * t, 5e-3) },
    Motion { name: "strokes, 0.2 m/s", is_steady: false, noise_counts: 0.0, at: |t| strokes(t, 0.2) },
    Motion { name: "strokes, 1 m/s", is_steady: false, noise_counts: 0.0, at: |t| strokes(t, 1.0) },
    Motion { name: "reversal, 10 m/s^2", is_steady: false, noise_counts: 0.0, at: reversal },
    Motion {
        name: "tremor, 10 Hz 0.1 mm",
        is_steady: false,
        noise_counts: 0.0,
        at: |t| swing(t, 10.0, 1e-4),
    },
    Motion { name: "ring-down, 50 Hz 0.2 mm", is_steady: false, noise_counts: 0.0, at: ring_down },
    Motion {
        name: "ring, 100 Hz 0.1 mm",
        is_steady: false,
        noise_counts: 0.0,
        at: |t| swing(t, 100.0, 1e-4),
    },
];

/// There and back with least jerk; the peak speed is `15/8` of the length over the time.
fn strokes(t: f64, peak_m_per_s: f64) -> (f64, f64) {
    const LENGTH_M: f64 = 0.08;
    let stroke_s = 1.875 * LENGTH_M / peak_m_per_s;
    let number = (t / stroke_s).floor();
    let x = t / stroke_s - number;
    let way = x.powi(3) * (10.0 - 15.0 * x + 6.0 * x * x);
    let rate = 30.0 * (x * (1.0 - x)).powi(2) / stroke_s;
    if number % 2.0 == 0.0 {
        (LENGTH_M * way, LENGTH_M * rate)
    } else {
        (LENGTH_M * (1.0 - way), -LENGTH_M * rate)
    }
}

/// Back and forth under 10 m/s^2 that changes its sign every 40 ms: 0.2 m/s, turning round sharply.
fn reversal(t: f64) -> (f64, f64) {
    const ACCELERATION: f64 = 10.0;
    const HALF_S: f64 = 0.02;
    let phase = t / HALF_S;
    let (quarter, part) = (phase.floor() as i64 % 4, (phase - phase.floor()) * HALF_S);
    let top = 0.5 * ACCELERATION * HALF_S * HALF_S;
    let peak = ACCELERATION * HALF_S;
    let rising = 0.5 * ACCELERATION * part * part;
    match quarter {
        0 => (rising, ACCELERATION * part),
        1 => (top + peak * part - rising, peak - ACCELERATION * part),
        2 => (2.0 * top - rising, -ACCELERATION * part),
        _ => (top - peak * part + rising, -peak + ACCELERATION * part),
    }
}

fn swing(t: f64, hz: f64, amplitude_m: f64) -> (f64, f64) {
    let (sin, cos) = (TAU * hz * t).sin_cos();
    (amplitude_m * sin, amplitude_m * TAU * hz * cos)
}

/// Every 0.2 s anew, dying away in 40 ms.
fn ring_down(t: f64) -> (f64, f64) {
    const DECAY_S: f64 = 0.04;
    const RISE_S: f64 = 2e-3;
    let since = t % 0.2;
    let (place, velocity) = swing(since, 50.0, 2e-4);
    let gone = (-since / RISE_S).exp();
    let share = (-since / DECAY_S).exp() * (1.0 - gone).powi(2);
    let rate = share * (2.0 * gone / (RISE_S * (1.0 - gone).max(1e-9)) - 1.0 / DECAY_S);
    (share * place, share * velocity + rate * place)
}

/// One tick of a movement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) tick: u64,
    pub(crate) time_s: f64,
    pub(crate) counts: [i64; 3],
    pub(crate) joints_rad: [f64; 3],
}

/// An arm that is led along a line.
#[derive(Debug, Clone)]
pub(crate) struct Course {
    pub(crate) arm: ArmFile,
    pub(crate) map: JointMap,
    start: Vector3<f64>,
    direction: Vector3<f64>,
}

impl Course {
    /// The Premium, obliquely through its workspace, so that all three joints turn.
    pub(crate) fn premium() -> Self {
        let text = builtin("premium-1.5").expect("it comes with the program");
        let file = DeviceFile::parse(text, Path::new("premium-1.5.toml")).expect("it is valid");
        let DeviceFile::Arm(arm) = file else { panic!("the Premium is an arm") };
        let map = JointMap::new(&arm.encoders);
        let (start, direction) = (Vector3::new(-0.02, 0.03, -0.01), Vector3::new(0.6, 0.64, 0.48));
        Self { arm: *arm, map, start, direction }
    }

    /// Velocity of the joints (rad/s) and of the tip (m/s) at a time.
    pub(crate) fn truth(&self, motion: &Motion, time_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (place, speed) = (motion.at)(time_s.max(0.0));
        let joints = self.arm.mechanism.inverse(self.start + self.direction * place).expect("within reach");
        let tip = self.direction * speed;
        let turn = self.arm.mechanism.jacobian(joints).lu().solve(&tip).expect("no singularity");
        (turn, tip)
    }

    /// What the counters say, tick by tick.
    pub(crate) fn samples(&self, motion: &Motion, rate_hz: f64, seconds: f64) -> Vec<Sample> {
        let mut noise = Noise::new(0x5EED);
        let rad_per_count = self.map.rad_per_count();
        (0..(seconds * rate_hz) as u64)
            .map(|tick| {
                let time_s = tick as f64 / rate_hz;
                let (place, _) = (motion.at)(time_s);
                let true_joints =
                    self.arm.mechanism.inverse(self.start + self.direction * place).expect("within reach");
                let read = std::array::from_fn(|j| {
                    true_joints[j] + motion.noise_counts * noise.gaussian() * rad_per_count[j]
                });
                let counts = self.map.angles_to_counts(read);
                Sample { tick, time_s, counts, joints_rad: self.map.counts_to_angles(counts) }
            })
            .collect()
    }
}

/// Normal numbers by Box and Muller's transform.
pub(crate) struct Noise(SplitMix64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub(crate) fn uniform(&mut self) -> f64 {
        self.0.unit()
    }

    pub(crate) fn gaussian(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}
