//! Other ways to estimate a velocity from counts, to compare with; none of them is in the driver.

use io_driver::device::TickTime;
use io_driver::velocity::VelocityEstimator;
use nalgebra::{Matrix3, Vector3};

/// Three joints, in counts; returns counts per second.
pub(crate) trait Estimator {
    fn observe(&mut self, time: TickTime, counts: [f64; 3]) -> [f64; 3];
}

/// What makes a fresh one.
pub(crate) type Maker = fn() -> Box<dyn Estimator>;

/// All of them by name, the driver's own last.
pub(crate) const RIVALS: [(&str, Maker); 7] = [
    ("difference", || Box::new(Window::new(0.0))),
    ("4 ms mean", || Box::new(Window::new(4e-3))),
    ("16 ms mean", || Box::new(Window::new(16e-3))),
    ("FOAW", || Box::new(Foaw::new())),
    // Spectral densities at which the noise of rest is about that of the driver's own.
    ("alpha-beta", || Box::new(Kalman::new([0.0, 3e6]))),
    ("Kalman", || Box::new(Kalman::new([1e11, 0.0]))),
    ("driver", || Box::new(VelocityEstimator::of_counts())),
];

impl Estimator for VelocityEstimator {
    fn observe(&mut self, time: TickTime, counts: [f64; 3]) -> [f64; 3] {
        self.observe(time, counts)
    }
}

/// What was read, the newest first: time (s) and counts.
#[derive(Clone, Default)]
struct History(Vec<(f64, [f64; 3])>);

/// Enough for 16 ms at 8 kHz.
const PLACES: usize = 130;

impl History {
    fn push(&mut self, time: TickTime, counts: [f64; 3]) {
        self.0.truncate(PLACES);
        self.0.insert(0, ((time.tick * time.period_ns) as f64 / 1e9, counts));
    }

    /// Mean velocity since the reading so many places back.
    fn mean(&self, back: usize, joint: usize) -> f64 {
        let ((now, newest), (then, oldest)) = (&self.0[0], &self.0[back]);
        if back == 0 { 0.0 } else { (newest[joint] - oldest[joint]) / (now - then) }
    }

    /// Slope of the line that fits the newest readings best, that one the last.
    fn slope(&self, back: usize, joint: usize) -> f64 {
        let (mut x, mut xx, mut y, mut xy) = (0.0, 0.0, 0.0, 0.0);
        let n = back as f64 + 1.0;
        for (time, counts) in &self.0[..=back] {
            let (dx, dy) = (time - self.0[0].0, counts[joint] - self.0[0].1[joint]);
            (x, xx, y, xy) = (x + dx, xx + dx * dx, y + dy, xy + dx * dy);
        }
        (n * xy - x * y) / (n * xx - x * x)
    }
}

/// Mean velocity over a window of this length; at least one tick.
struct Window {
    seconds: f64,
    history: History,
}

impl Window {
    fn new(seconds: f64) -> Self {
        Self { seconds, history: History::default() }
    }
}

impl Estimator for Window {
    fn observe(&mut self, time: TickTime, counts: [f64; 3]) -> [f64; 3] {
        self.history.push(time, counts);
        let readings = &self.history.0;
        // Times are multiples of the period, which their rounding must not lengthen a window by.
        let reaches = |(then, _): &(f64, _)| readings[0].0 - then >= self.seconds - 1e-9;
        let back = readings[1..].iter().position(reaches).map_or(readings.len() - 1, |place| place + 1);
        std::array::from_fn(|joint| self.history.mean(back, joint))
    }
}

/// Janabi-Sharifi, Hayward and Chen's, best-fit: the longest window whose readings all lie within a count of the line
/// through the newest and the oldest one, at most 16 ms.
struct Foaw {
    history: History,
}

impl Foaw {
    const LONGEST_S: f64 = 16e-3;

    fn new() -> Self {
        Self { history: History::default() }
    }

    fn back(&self, joint: usize) -> usize {
        let readings = &self.history.0;
        let (now, newest) = &readings[0];
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut longest = 0;
        for (back, (then, counts)) in readings.iter().enumerate().skip(1) {
            let elapsed = now - then;
            let mean = (newest[joint] - counts[joint]) / elapsed;
            if back > 1 && (elapsed > Self::LONGEST_S + 1e-9 || mean < low || mean > high) {
                break;
            }
            (low, high) = (low.max(mean - 1.0 / elapsed), high.min(mean + 1.0 / elapsed));
            longest = back;
        }
        longest
    }
}

impl Estimator for Foaw {
    fn observe(&mut self, time: TickTime, counts: [f64; 3]) -> [f64; 3] {
        self.history.push(time, counts);
        std::array::from_fn(|joint| match self.back(joint) {
            0 => 0.0,
            back => self.history.slope(back, joint),
        })
    }
}

/// A Kalman filter with place, velocity and acceleration. Without noise of the jerk the acceleration stays zero: the
/// alpha-beta filter.
struct Kalman {
    /// Spectral densities of jerk and of acceleration (counts^2/s^5, counts^2/s^3).
    noise: [f64; 2],
    joints: [(Vector3<f64>, Matrix3<f64>); 3],
    last_tick: Option<u64>,
}

impl Kalman {
    /// Of a reading that is rounded to the nearest count (counts^2).
    const READING: f64 = 1.0 / 12.0;

    fn new(noise: [f64; 2]) -> Self {
        Self { noise, joints: [(Vector3::zeros(), Matrix3::zeros()); 3], last_tick: None }
    }

    fn begin(&mut self, counts: [f64; 3]) -> [f64; 3] {
        let acceleration = if self.noise[0] > 0.0 { 1e8 } else { 0.0 };
        for ((state, spread), count) in self.joints.iter_mut().zip(counts) {
            *state = Vector3::new(count, 0.0, 0.0);
            *spread = Matrix3::from_diagonal(&Vector3::new(Self::READING, 1e4, acceleration));
        }
        [0.0; 3]
    }

    fn process(&self, dt: f64) -> Matrix3<f64> {
        let [jerk, acceleration] = self.noise;
        let powers: [f64; 6] = std::array::from_fn(|n| dt.powi(n as i32));
        let [_, d1, d2, d3, d4, d5] = powers;
        let of_jerk =
            Matrix3::new(d5 / 20.0, d4 / 8.0, d3 / 6.0, d4 / 8.0, d3 / 3.0, d2 / 2.0, d3 / 6.0, d2 / 2.0, d1);
        let of_acceleration = Matrix3::new(d3 / 3.0, d2 / 2.0, 0.0, d2 / 2.0, d1, 0.0, 0.0, 0.0, 0.0);
        of_jerk * jerk + of_acceleration * acceleration
    }
}

impl Estimator for Kalman {
    fn observe(&mut self, time: TickTime, counts: [f64; 3]) -> [f64; 3] {
        let Some(last) = self.last_tick.replace(time.tick) else { return self.begin(counts) };
        let dt = ((time.tick - last) * time.period_ns) as f64 / 1e9;
        let step = Matrix3::new(1.0, dt, dt * dt / 2.0, 0.0, 1.0, dt, 0.0, 0.0, 1.0);
        let process = self.process(dt);
        std::array::from_fn(|joint| {
            let (state, spread) = &mut self.joints[joint];
            *state = step * *state;
            *spread = step * *spread * step.transpose() + process;
            let gain = spread.column(0) / (spread[(0, 0)] + Self::READING);
            *state += gain * (counts[joint] - state[0]);
            *spread -= gain * spread.row(0).clone_owned();
            state[1]
        })
    }
}
