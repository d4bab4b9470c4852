//! Capacities of a scene on this machine: pairs, things that may be awake, ticks, and bytes of recordings.
//!
//! Model: the scene's own world is stepped for a few hundred ticks, with fingers that rest where they begin; the slow list by
//! itself, a tick at a time, with all awake. Counts are exact; times are medians of what was measured, without real-time rights,
//! and what follows from them is an estimate. Bytes of recordings are the most: of rows in which everything moves.
//! Cost: a third of a second, and three ticks of the slow list where these take longer.

#![allow(non_snake_case)] // Frames are capital letters.

mod recorded;

use crate::fast_step::FastStep;
use crate::pace::Pace;
use crate::rig::Rig;
use crate::row::Row;
use bytemuck::Zeroable;
use physics::MOST_PAIRS;
use recorded::most_bytes_a_row;
use serde_json::{Value, json};
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::{Command, Frame};
use std::time::{Duration, Instant};
use world::lists::SlowList;

/// Needs of a scene, and the room and time that this machine has.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Capacities {
    period_ns: u64,
    /// Things that move.
    moving: usize,
    /// Pairs of things near each other as the scene begins.
    pairs: usize,
    /// Pairs that have room in the fast list before more is made.
    pair_room: usize,
    /// Fast tick with as few awake as there were (ns), and how many.
    at_rest: (f64, usize),
    /// Fast tick with as many awake as there were, or as many as the fast list keeps (ns), and how many.
    awake: (f64, usize),
    /// Time of a tick for each thing that is awake (ns); `None`: nothing moves.
    each_ns: Option<f64>,
    /// Tick of the slow list with all awake (ns), and how many; `None`: there is no slow list.
    slow: Option<(f64, usize)>,
    /// The most bytes of a second of recording: a table, and an MCAP.
    csv_bytes_s: f64,
    mcap_bytes_s: Option<f64>,
}

/// Time and number of what was awake, of each tick.
type Ticks = Vec<(f64, usize)>;

impl Capacities {
    /// Of a scene that is ready to run; it has run for some ticks afterwards. `None`: nothing could be measured.
    pub(super) fn measure(rig: &Rig, step: &mut FastStep) -> Option<Self> {
        let mut slow = step.take_slow();
        let [of_fast, pair_room] = step.pairs();
        let pairs = of_fast + slow.as_ref().map_or(0, |slow| slow.manipulation().pair_count());
        let moving = step.bodies().len();
        let slow_ticks = slow.as_mut().map(|slow| slow_ticks(slow, rig.period_ns));
        let ticks = fast_ticks(rig, step, slow.as_mut());
        let (least, most) = (ticks.iter().map(|tick| tick.1).min()?, ticks.iter().map(|tick| tick.1).max()?);
        let at_rest = (median(&ticks, least)?, least);
        let fast = (median(&ticks, most)?, most);
        let of_slow = slow_ticks.as_ref().and_then(|ticks| {
            let most = ticks.iter().map(|tick| tick.1).max().filter(|most| *most > 0)?;
            Some((median(ticks, most)?, most))
        });
        let each_ns = match of_slow {
            Some((tick_ns, awake)) => Some(tick_ns / awake as f64),
            None if most > least => Some((fast.0 - at_rest.0).max(0.0) / (most - least) as f64),
            None => (most > 0).then(|| fast.0 / most as f64),
        };
        let kept = rig.scene.dynamics.lists.fast_bodies.min(moving);
        let awake = match (of_slow, each_ns) {
            (Some(_), Some(each_ns)) => (at_rest.0 + each_ns * (kept - least.min(kept)) as f64, kept),
            _ => fast,
        };
        let rate_hz = 1e9 / rig.period_ns as f64;
        let bytes = most_bytes_a_row(rig, step.entities(), step.bodies().to_vec());
        let [csv_bytes_s, mcap_bytes_s] = bytes.map(|bytes| bytes.map(|bytes| bytes * rate_hz));
        let csv_bytes_s = csv_bytes_s?;
        let slow = of_slow;
        Some(Self {
            period_ns: rig.period_ns,
            moving,
            pairs,
            pair_room,
            at_rest,
            awake,
            each_ns,
            slow,
            csv_bytes_s,
            mcap_bytes_s,
        })
    }

    /// Things that may be awake in the fast list while a tick keeps to its share of the time.
    fn fitting(&self) -> Option<usize> {
        let each_ns = self.each_ns.filter(|each_ns| *each_ns > 0.0)?;
        let (rest_ns, at_rest) = self.at_rest;
        let left_ns = Pace::most_ns(self.period_ns) as f64 - rest_ns;
        Some(at_rest + (left_ns.max(0.0) / each_ns) as usize)
    }

    /// For people.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let period_us = in_us(self.period_ns as f64);
        if self.moving > 0 {
            // Of many things at one place there are half the square.
            let others = if self.pairs >= MOST_PAIRS {
                ", the most that there can be: others are LEFT OUT"
            } else {
                ""
            };
            lines.push(format!(
                "pairs near each other: {} at the start{others}; room for {} in the fast list, until more is made",
                self.pairs, self.pair_room
            ));
        }
        let (rest_ns, at_rest) = self.at_rest;
        let mut tick = format!("fast tick: {} us of {period_us}", in_us(rest_ns));
        if self.moving > 0 {
            tick.push_str(&format!(" with {at_rest} things awake"));
        }
        let (awake_ns, awake) = self.awake;
        if awake > at_rest {
            tick.push_str(&format!(", {} us with {awake}", in_us(awake_ns)));
        }
        lines.push(format!("{tick} (estimated)"));
        if let Some((each_ns, fitting)) = self.each_ns.zip(self.fitting()) {
            lines.push(format!(
                "things awake: {fitting} in a third of a tick, of {} us each (estimated)",
                in_us(each_ns)
            ));
        }
        if let Some((tick_ns, awake)) = self.slow {
            let times = tick_ns / self.period_ns as f64;
            let pace = if times > 1.0 {
                format!(
                    "{} times as long as it has",
                    if times < 10.0 { format!("{times:.1}") } else { format!("{times:.0}") }
                )
            } else {
                "less than it has".to_owned()
            };
            lines.push(format!(
                "slow list: a tick takes {:.1} ms with all {awake} awake, {pace} (estimated)",
                tick_ns / 1e6
            ));
        }
        let mcap = self.mcap_bytes_s.map_or(String::new(), |bytes| format!(", {} as MCAP", in_bytes(bytes)));
        let most = format!("recording: at most {} a second as CSV{mcap}", in_bytes(self.csv_bytes_s));
        lines.push(format!("{most}, while everything moves (estimated)"));
        lines
    }

    pub(super) fn to_json(&self) -> Value {
        json!({
            "pairs": self.pairs,
            "pair_room": self.pair_room,
            "fast_tick_at_rest_ns": self.at_rest.0,
            "awake_at_rest": self.at_rest.1,
            "fast_tick_awake_ns": self.awake.0,
            "awake": self.awake.1,
            "awake_body_ns": self.each_ns,
            "awake_bodies_in_a_tick": self.fitting(),
            "slow_tick_ns": self.slow.map(|slow| slow.0),
            "slow_awake": self.slow.map(|slow| slow.1),
            "csv_bytes_per_s": self.csv_bytes_s,
            "mcap_bytes_per_s": self.mcap_bytes_s,
        })
    }
}

/// Ticks of the slow list with all that is awake there.
fn slow_ticks(slow: &mut SlowList, period_ns: u64) -> Ticks {
    let (begin, mut ticks) = (Instant::now(), Ticks::new());
    while ticks.len() < LEAST_TICKS || (ticks.len() < MOST_TICKS && begin.elapsed() < SLOW_BUDGET) {
        let awake = slow.manipulation().awake().len();
        let started = Instant::now();
        slow.turn(1, period_ns as f64 / 1e9);
        ticks.push((started.elapsed().as_nanos() as f64, awake));
    }
    // In the first one contacts are searched that the others only follow.
    ticks.split_off(1)
}

/// Ticks of the fast list, with fingers where they begin.
fn fast_ticks(rig: &Rig, step: &mut FastStep, mut slow: Option<&mut SlowList>) -> Ticks {
    let (mut frame, mut command, mut row) = (frame(rig), Command::zeroed(), Row::empty());
    let (mut left, mut ticks) = (FAST_BUDGET, Ticks::new());
    for tick in 1..=MOST_TICKS {
        (frame.tick, frame.run_tick) = (tick as u64, tick as i64 - 1);
        let started = Instant::now();
        step.step(&frame, &mut command, &mut row);
        ticks.push((started.elapsed().as_nanos() as f64, step.made().awake));
        step.make_room();
        if let Some(slow) = &mut slow {
            slow.turn(0, rig.period_ns as f64 / 1e9);
        }
        left = left.saturating_sub(started.elapsed());
        if left.is_zero() && ticks.len() >= LEAST_TICKS {
            break;
        }
    }
    ticks
}

/// All devices where their fingers begin.
fn frame(rig: &Rig) -> Frame {
    let mut frame = Frame::zeroed();
    frame.device_count = rig.device_count() as u64;
    for finger in &rig.scene.fingers {
        if let Some(device) = frame.devices.get_mut(finger.device) {
            let start_D = rig.base_in_world(finger.device).inverse_transform_point(&finger.start_m);
            device.flags = DEVICE_POSITION_VALID;
            device.position_m_measured = start_D.coords.into();
        }
    }
    frame
}

/// Median time of the ticks with so many awake.
fn median(ticks: &Ticks, awake: usize) -> Option<f64> {
    let mut times: Vec<f64> = ticks.iter().filter(|tick| tick.1 == awake).map(|tick| tick.0).collect();
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied()
}

fn in_us(time_ns: f64) -> String {
    let us = time_ns / 1e3;
    if us < 10.0 { format!("{us:.1}") } else { format!("{us:.0}") }
}

fn in_bytes(bytes: f64) -> String {
    if bytes < 1e6 { format!("{:.0} kB", bytes / 1e3) } else { format!("{:.1} MB", bytes / 1e6) }
}

/// Time for either list.
const FAST_BUDGET: Duration = Duration::from_millis(150);
const SLOW_BUDGET: Duration = Duration::from_millis(100);
/// So many are measured in any case.
const LEAST_TICKS: usize = 3;
/// Things that rest sleep after 500.
const MOST_TICKS: usize = 700;
