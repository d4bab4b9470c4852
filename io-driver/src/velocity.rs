//! How fast joints turn, from counters that only know whole counts.
//!
//! Problem: a count of a Premium is 0.03 mm at the tip, so that differences of successive readings at 1 kHz come in
//! steps of 30 mm/s, and of 240 mm/s at 8 kHz: a damper of 5 N s/m makes a rattle of 0.15 N of them. A long window
//! is smooth but late, and damping that is late feeds an oscillation instead of taking from it.
//!
//! Model: the longest window in which the movement is a parabola, found anew in every tick by trying longer and
//! longer ones. Within `n` readings the velocity now is the slope at the newest end of the parabola that fits them
//! best; with readings that are right to within one count it is right to within
//! `count * sqrt(row . row)`, `row` being what the fit weighs the readings with. The window grows while the
//! intervals of all windows so far have a velocity in common; the estimate is the slope of the last, as far as all
//! the others allow it. This is first-order adaptive windowing (FOAW; Janabi-Sharifi, Hayward, Chen, Discrete-time adaptive
//! windowing for velocity estimation, IEEE Trans. Control Systems Technology 8(6), 2000) with two changes:
//! - A parabola for a straight line. A line through an accelerated movement is late by half its window, 7 ms in a
//!   hand's stroke; the slope at the end of a parabola is late by a tenth of a millisecond.
//! - Intersected intervals (Goldenshluger, Nemirovski, 1997) for the largest deviation from the line. FOAW asks every
//!   reading to lie within a count of the line through the newest one, so that a newest reading that is off by two
//!   counts leaves it a window of one tick, and a peak of 60 mm/s: slow movements with noise are its known weakness.
//!   A short window's interval is wide and forgives that.
//!
//! Readings within half a millisecond are averaged first: more of them in less time say more about the
//! velocity only if they differ, and the cost stays what it is at 2 kHz. A lease begins with a block of its own: what its
//! commander is told does not show how long the driver was there before, but for the first window.
//! Units: `places` in counts and velocities in counts per second, or both in metres.
//! Invariants: with a tolerance of zero it is the plain difference `(place - last place) / (ticks * period)`, bit for
//! bit: exact places are functions of the tick. Counts are taken at the time that the clock tells, so that deadlines
//! that were skipped, made up for or moved do not make a movement look fast or slow.
//! Cost: bounded by 61 blocks of readings and 13 fits: for three joints about 0.25 us at 1 kHz and
//! 0.5 us from 2 kHz on; no allocation.
//!
//! What it is worth against others, by the truth of known movements (error rms in mm/s at the tip of a Premium at
//! 1 kHz, lag in ms in brackets; all of it: `cargo bench -p io-driver --bench velocity`):
//!
//! | movement | difference | mean of 4 ms | FOAW | Kalman | this |
//! |---|---|---|---|---|---|
//! | rest, noisy counts (at 8 kHz) | 27 (217) | 6.8 (6.7) | 5.8 (43) | 4.1 (2.6) | 2.4 (0.7) |
//! | 5 mm/s | 14 | 5.5 | 0.6 | 3.0 | 0.9 |
//! | strokes of a hand, 0.2 m/s | 19 | 4.9 (1.9) | 4.5 (6.9) | 3.0 (0.1) | 1.2 (0.1) |
//! | the same, 1 m/s | 19 (0.5) | 30 (1.9) | 29 (1.9) | 10 (0.1) | 17 (0.3) |
//! | tremor, 10 Hz, 0.1 mm | 13 | 4.9 (2.0) | 2.3 (8.0) | 3.5 | 1.8 (2.4) |
//! | ring-down of a contact, 50 Hz, 0.2 mm | 14 | 9.3 (2.0) | 11 (2.3) | 17 (3.4) | 12 (2.2) |
//!
//! Its limit: what swings by a few counts at 100 Hz and more is over before a window can tell it from noise.

use crate::device::TickTime;

/// How far a reading may be off (counts). Rounding makes half a count of it, the edges of a real encoder, which are
/// not quite where they belong, the rest.
const TOLERANCE_COUNTS: f64 = 1.0;
/// Longest window (ns). A third longer would make the noise of rest a third less and tremor 5 ms late.
const WINDOW_NS: u64 = 30_000_000;
/// Readings of less than this (ns) are averaged.
const BLOCK_NS: u64 = 500_000;
/// Places for blocks.
const PLACES: usize = (WINDOW_NS / BLOCK_NS) as usize + 1;
/// Numbers of blocks with which a window is tried: two for a difference, and steps of about a quarter for parabolas.
/// Three and four blocks would hardly be better than a difference.
const RUNGS: [usize; 13] = [2, 5, 7, 9, 12, 16, 20, 25, 30, 37, 45, 53, PLACES];

/// The velocities of three joints, or of a point's three coordinates.
#[derive(Debug, Clone)]
pub struct VelocityEstimator {
    /// How far a place may be off; 0: it is exact.
    tolerance: f64,
    /// Tick and places of the last reading.
    last: Option<(u64, [f64; 3])>,
    /// Full blocks, the newest at `newest`.
    blocks: [Block; PLACES],
    newest: usize,
    filled: usize,
    /// The block that the newest reading belongs to.
    open: Block,
}

/// The mean of the readings of some ticks.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    first_ns: u64,
    count: f64,
    /// Mean of the times after the first (periods).
    mean_time: f64,
    mean_places: [f64; 3],
}

impl VelocityEstimator {
    /// For places that are counts of encoders.
    pub fn of_counts() -> Self {
        Self::new(TOLERANCE_COUNTS)
    }

    /// For places that are exact: the plain difference.
    pub fn of_exact_places() -> Self {
        Self::new(0.0)
    }

    fn new(tolerance: f64) -> Self {
        Self {
            tolerance,
            last: None,
            blocks: [Block::default(); PLACES],
            newest: 0,
            filled: 0,
            open: Block::default(),
        }
    }

    /// Forgets what was observed: the next place is compared with nothing, and has no velocity.
    pub fn forget(&mut self) {
        self.last = None;
        self.filled = 0;
        self.open = Block::default();
    }

    /// Takes the places of a tick; returns the velocities in it.
    pub fn observe(&mut self, time: TickTime, places: [f64; 3]) -> [f64; 3] {
        let TickTime { tick, period_ns, .. } = time;
        if !places.iter().all(|place| place.is_finite()) {
            self.forget();
            return [0.0; 3];
        }
        // A tick that is not after the last one begins a history of its own: nothing moves in no time.
        if self.last.is_some_and(|(last_tick, _)| tick <= last_tick) {
            self.forget();
        }
        let Some((last_tick, last)) = self.last.replace((tick, places)) else {
            self.open.add(time, places);
            return [0.0; 3];
        };
        if self.tolerance > 0.0 {
            self.keep(time, places);
            let period_s = period_ns as f64 / 1e9;
            return self.per_period(time, places).map(|velocity| velocity / period_s);
        }
        // As whoever reads the frames computes it, to the last bit.
        let elapsed_s = (tick - last_tick) as f64 * (period_ns as f64 / 1e9);
        std::array::from_fn(|j| (places[j] - last[j]) / elapsed_s)
    }

    /// Puts a reading where it belongs.
    fn keep(&mut self, time: TickTime, places: [f64; 3]) {
        let block_ticks = (BLOCK_NS / time.period_ns.max(1)).max(1);
        let is_full = time.time_ns.saturating_sub(self.open.first_ns) >= block_ticks * time.period_ns;
        if is_full || time.begins_lease {
            self.newest = (self.newest + 1) % PLACES;
            self.blocks[self.newest] = self.open;
            self.filled = (self.filled + 1).min(PLACES);
            self.open = Block::default();
        }
        self.open.add(time, places);
    }

    /// What all windows agree about, from the shortest to the longest that agrees with those before.
    fn per_period(&self, time: TickTime, places: [f64; 3]) -> [f64; 3] {
        let mut sums = Sums::default();
        sums.add(&self.open, time, places);
        let mut common = [Interval::EVERYTHING; 3];
        let mut rungs = RUNGS.iter();
        let mut rung = rungs.next();
        let (newer, older) = self.blocks.split_at(self.newest + 1);
        let newest_first = newer.iter().rev().chain(older.iter().rev());
        for (back, block) in newest_first.take(self.filled).enumerate() {
            // The last one is taken however long ago it was: ticks were skipped then, and there is no other.
            if back > 0 && time.time_ns.saturating_sub(block.first_ns) > WINDOW_NS {
                break;
            }
            sums.add(block, time, places);
            if rung.is_some_and(|blocks| back + 2 == *blocks) {
                rung = rungs.next();
                if !sums.narrow(&mut common, self.tolerance) {
                    break;
                }
            }
        }
        common.map(|interval| interval.velocity())
    }
}

impl Block {
    fn add(&mut self, time: TickTime, places: [f64; 3]) {
        if self.count == 0.0 {
            self.first_ns = time.time_ns;
        }
        self.count += 1.0;
        let share = 1.0 / self.count;
        self.mean_time += (self.periods_until(time) - self.mean_time) * share;
        for (mean, place) in self.mean_places.iter_mut().zip(places) {
            *mean += (place - *mean) * share;
        }
    }

    /// From its first reading to this time.
    fn periods_until(&self, time: TickTime) -> f64 {
        time.time_ns.saturating_sub(self.first_ns) as f64 / time.period_ns as f64
    }
}

/// Velocities that a window allows, per period.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Interval {
    low: f64,
    high: f64,
    /// What the longest window so far says by itself.
    slope: f64,
    is_final: bool,
}

impl Interval {
    const EVERYTHING: Self =
        Self { low: f64::NEG_INFINITY, high: f64::INFINITY, slope: 0.0, is_final: false };

    /// Keeps what the window allows, too; if that is nothing, everything stays as it was for good.
    fn narrow(&mut self, velocity: f64, half_width: f64) {
        let (low, high) = (self.low.max(velocity - half_width), self.high.min(velocity + half_width));
        self.is_final |= low > high;
        if !self.is_final {
            (self.low, self.high, self.slope) = (low, high, velocity);
        }
    }

    /// Not `clamp`: it panics where there is nothing between the ends.
    fn velocity(&self) -> f64 {
        self.slope.max(self.low).min(self.high)
    }
}

/// Moments of the blocks of a window: time `x` in periods from now, place `y` from the newest one.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    x: [f64; 5],
    y: [f64; 3],
    xy: [f64; 3],
    xxy: [f64; 3],
}

impl Sums {
    fn add(&mut self, block: &Block, time: TickTime, places: [f64; 3]) {
        let x = block.mean_time - block.periods_until(time);
        let xx = x * x;
        for (sum, power) in self.x.iter_mut().zip([1.0, x, xx, x * xx, xx * xx]) {
            *sum += power;
        }
        for (j, place) in places.iter().enumerate() {
            let y = block.mean_places[j] - place;
            self.y[j] += y;
            self.xy[j] += x * y;
            self.xxy[j] += xx * y;
        }
    }

    /// Narrows what the windows have in common; whether any joint may try a longer one.
    fn narrow(&self, common: &mut [Interval; 3], tolerance: f64) -> bool {
        let [a, b, c] = self.row();
        // The length of the row is the root of the middle of the inverse: (X'X)^-1 X'X (X'X)^-1 = (X'X)^-1.
        let half_width = tolerance * b.sqrt();
        for (j, interval) in common.iter_mut().enumerate() {
            interval.narrow(a * self.y[j] + b * self.xy[j] + c * self.xxy[j], half_width);
        }
        common.iter().any(|interval| !interval.is_final)
    }

    /// The middle row of the inverse of the normal equations' matrix: what the slope at `x = 0` is made of.
    fn row(&self) -> [f64; 3] {
        let [n, x, xx, xxx, xxxx] = self.x;
        if n == 2.0 {
            // Two blocks have no parabola, only a line.
            let determinant = n * xx - x * x;
            return [-x / determinant, n / determinant, 0.0];
        }
        let minors = [x * xxxx - xx * xxx, n * xxxx - xx * xx, n * xxx - x * xx];
        let determinant = n * (xx * xxxx - xxx * xxx) - x * minors[0] + xx * (x * xxx - xx * xx);
        [-minors[0] / determinant, minors[1] / determinant, -minors[2] / determinant]
    }
}
