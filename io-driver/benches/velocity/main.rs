//! Estimates of velocity from encoder counts, against the truth and against each other.
//!
//! Run `cargo bench -p io-driver --bench velocity`. Most movements lead the tip of a Premium 1.5 along a line; its
//! inverse kinematics and counters make counts of it. The last ones are those of a simulated arm in a simulated hand. The first table is of the tip (mm/s), the second of the three
//! joints together (mrad/s); each cell tells root mean square error, largest error and lag (ms). Then the time of a
//! call for three joints, where a movement is rest and where it is a stroke.

mod motion;
mod rivals;
mod score;
mod simulated;

use io_driver::device::TickTime;
use motion::{Course, MOTIONS};
use rivals::RIVALS;
use score::{Score, estimate, scores};
use simulated::{Ride, TASKS};
use std::hint::black_box;
use std::time::Instant;

const RATES_HZ: [u32; 4] = [1000, 2000, 4000, 8000];
const SECONDS: f64 = 1.0;

fn main() {
    let course = Course::premium();
    let results: Vec<Vec<Vec<[Score; 2]>>> = RATES_HZ.iter().map(|rate| at_rate(&course, *rate)).collect();
    for (which, unit) in [(1, "the tip (mm/s)"), (0, "the joints (mrad/s)")] {
        println!("\nVelocity of {unit}: error rms, largest, lag in ms");
        for (rate, movements) in RATES_HZ.iter().zip(&results) {
            print!("{:<25}", format!("{} kHz", rate / 1000));
            RIVALS.iter().for_each(|(name, _)| print!("{name:>18}"));
            println!();
            let names = MOTIONS.iter().map(|motion| motion.name).chain(TASKS.iter().map(|task| task.name));
            for (name, row) in names.zip(movements) {
                print!("{name:<25}");
                row.iter().for_each(|score| print!("{:>18}", cell(&score[which])));
                println!();
            }
        }
    }
    println!("\nTime of a call for three joints (ns): rest, stroke");
    for rate in RATES_HZ {
        print!("{:<25}", format!("{} kHz", rate / 1000));
        RIVALS.iter().for_each(|(_, make)| {
            let [rest, stroke] = [0, 3].map(|motion| call_ns(&course, motion, rate, make().as_mut()));
            print!("{:>18}", format!("{rest:.0} {stroke:.0}"));
        });
        println!();
    }
}

/// A row of scores for each movement.
fn at_rate(course: &Course, rate_hz: u32) -> Vec<Vec<[Score; 2]>> {
    let period_ns = u64::from(1_000_000_000 / rate_hz);
    let row = |motion| {
        let samples = course.samples(motion, f64::from(rate_hz), SECONDS);
        let score = |make: &rivals::Maker| {
            let found = estimate(make().as_mut(), course, &samples, period_ns);
            scores(|time_s| course.truth(motion, time_s), motion.is_steady, &samples, &found)
        };
        RIVALS.iter().map(|(_, make)| score(make)).collect()
    };
    let simulated_row = |task| {
        let ride = Ride::new(&course.arm, task, f64::from(rate_hz), SECONDS);
        let score = |make: &rivals::Maker| {
            let found = estimate(make().as_mut(), course, &ride.samples, period_ns);
            scores(|time_s| ride.truth(time_s), false, &ride.samples, &found)
        };
        RIVALS.iter().map(|(_, make)| score(make)).collect()
    };
    MOTIONS.iter().map(row).chain(TASKS.iter().map(simulated_row)).collect()
}

fn cell(score: &Score) -> String {
    let lag = score.lag_s.map_or("-".into(), |lag| format!("{:.1}", lag * 1e3));
    format!("{:.1} {:.0} {lag}", score.rms * 1e3, score.max * 1e3)
}

/// Mean over a movement, which is run through several times: that of the fastest run, since nothing makes a program
/// faster than it is, and others on the machine make it slower.
fn call_ns(course: &Course, motion: usize, rate_hz: u32, estimator: &mut dyn rivals::Estimator) -> f64 {
    const ROUNDS: u64 = 20;
    let samples = course.samples(&MOTIONS[motion], f64::from(rate_hz), SECONDS);
    let period_ns = u64::from(1_000_000_000 / rate_hz);
    let round_ns = |round: u64| {
        let begun = Instant::now();
        for sample in &samples {
            let tick = round * samples.len() as u64 + sample.tick;
            let time = TickTime::counted(tick, period_ns, 0);
            black_box(estimator.observe(time, sample.counts.map(|count| count as f64)));
        }
        begun.elapsed().as_nanos() as f64 / samples.len() as f64
    };
    (0..ROUNDS).map(round_ns).fold(f64::INFINITY, f64::min)
}
