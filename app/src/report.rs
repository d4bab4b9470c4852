//! What a run tells at its end, a line each; the README explains the lines.

use crate::attachment_totals::Timing;
use crate::control::OrderTally;
use crate::fast_loop::Tally;
use crate::lists_end::ListsEnd;
use crate::record::Recorded;
use crate::record::destination::{is_standard_output, shown};
use crate::snapshots::Drawn;
use io_driver::status::{CounterStatus, Percentiles};
use rt_core::plain_text::Plain;
use rt_core::setup::SetupReport;
use rustix::fs::{FileType, fstat};
use std::fmt;
use std::io;
use std::path::Path;

/// The end of a run in figures.
pub struct Report {
    /// Which clock moved the ticks.
    pub clock: &'static str,
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// Who drove the devices, one after the other; what follows is of all of them together.
    pub drivers: Vec<String>,
    /// The fast thread's counts.
    pub tally: Tally,
    /// The drivers'.
    pub counters: CounterStatus,
    /// The driver's timing and ours; none on a clock that is not real.
    pub timing: Option<Timing>,
    /// The fast step's, on any clock.
    pub step: Percentiles,
    /// What was obtained: the driver's words, and the fast thread's.
    pub guarantees: Option<(String, SetupReport)>,
    /// What became of entities that stand still since, a line each.
    pub parked: Vec<String>,
    /// How many events of which kind there were.
    pub events: String,
    /// What became of orders; `None`: nobody may order anything.
    pub orders: Option<OrderTally>,
    /// What became of the fast and the slow list, if there are two.
    pub lists: Option<ListsEnd>,
    /// What became of the recordings.
    pub recordings: Vec<Recorded>,
    /// Inputs of the run that are in none of them, each with the reason.
    pub left_out: Vec<String>,
    /// What became of the pictures, if any were wanted.
    pub pictures: Option<Drawn>,
}

impl Report {
    /// Whether a recording went there, so that people are told elsewhere.
    pub fn takes_standard_output(&self) -> bool {
        self.recordings.iter().any(|recorded| is_standard_output(&recorded.path))
    }

    /// Whether a recording is not complete, or a picture could not be written, which has been told. In real time rows may
    /// be left out; no other clock leaves out any.
    pub fn lacks_a_recording(&self) -> bool {
        let lacks_pictures = self.pictures.as_ref().is_some_and(|drawn| drawn.failure.is_some());
        let has_waited = self.timing.is_none();
        let is_whole = |recorded: &Recorded| recorded.failure.is_none() && !(has_waited && recorded.lost > 0);
        lacks_pictures || !self.recordings.iter().all(is_whole)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (tally, counters) = (&self.tally, &self.counters);
        writeln!(f, "clock        {}, {:.6} kHz", self.clock, 1e6 / self.period_ns as f64)?;
        for (index, driver) in self.drivers.iter().enumerate() {
            let after = if index == 0 { "" } else { "after its end " };
            writeln!(f, "driver       {after}{}", Plain(driver))?;
        }
        if self.drivers.len() > 1 {
            writeln!(f, "             figures are of these {} drivers together", self.drivers.len())?;
        }
        writeln!(
            f,
            "ticks        {} under our lease, {} answered",
            counters.ticks_commanded, tally.answered
        )?;
        writeln!(
            f,
            "overruns     {} deadlines skipped by the driver, {} frames missed here",
            counters.overruns, tally.frames_missed
        )?;
        writeln!(
            f,
            "replies      {} in time, {} missed, {} torn, {} refused",
            counters.replies_fresh,
            counters.replies_missed,
            counters.commands_torn,
            counters.commands_refused
        )?;
        if counters.faults > 0 {
            writeln!(f, "faults       {} of the driver, whose motors were off", counters.faults)?;
        }
        if let Some(timing) = &self.timing {
            writeln!(f, "wake error   {}", timing.wake_error)?;
            writeln!(f, "driver work  {}", timing.cycle)?;
            writeln!(f, "round trip   {}", timing.round_trip)?;
        }
        if self.step.count > 0 {
            writeln!(f, "fast step    {}", self.step)?;
        }
        writeln!(
            f,
            "peak force   {:.3} N computed, {:.3} N rendered",
            tally.peak_force_n, tally.peak_applied_n
        )?;
        let [moving, awake] = tally.moving;
        if moving > 0 {
            writeln!(f, "objects      {moving}, {awake} of them awake in the last tick")?;
        }
        if tally.left_out > 0 {
            let left_out = tally.left_out;
            writeln!(
                f,
                "left out     {left_out} times a contact between objects that had no room; they may go through each other"
            )?;
        }
        if tally.held_ticks > 0 {
            let (ticks, most, mean) =
                (tally.held_ticks, tally.most_held, tally.stepped_then / tally.held_ticks);
            writeln!(
                f,
                "in turns     {ticks} ticks had no time for all that moves; it moved {mean} in the mean, and up to {most} waited for their turn"
            )?;
        }
        if tally.gave_way > 0 {
            let ticks = tally.gave_way;
            writeln!(
                f,
                "gave way     {ticks} ticks in which fingers felt less of things that had not been handed over to them yet, or waited for their turn"
            )?;
        }
        if tally.crowded > 0 {
            let crowded = tally.crowded;
            writeln!(
                f,
                "crowded      {crowded} ticks with more entities at a finger's place than it can feel at once"
            )?;
        }
        if tally.cuts > 0 {
            writeln!(
                f,
                "cut          {} times a force rose or turned though nothing moved for it, by up to {:.1} N: where a push \
                 has two ways out, or by a fault; the events say when",
                tally.cuts, tally.most_cut_n
            )?;
        }
        for line in &self.parked {
            writeln!(f, "parked       {line}")?;
        }
        let is_before = counters.faults > 0 && tally.rows == 0;
        let before = if is_before { "; the fault came before t = 0" } else { "" };
        writeln!(f, "events       {}{before}", self.events)?;
        if let Some(orders) = &self.orders {
            writeln!(f, "orders       {orders}")?;
        }
        if let Some(lists) = &self.lists {
            writeln!(f, "lists        {lists}")?;
        }
        if let Some((driver, fast)) = &self.guarantees {
            if !driver.trim().is_empty() {
                writeln!(f, "guarantees of the driver's loop")?;
                writeln!(f, "{}", driver.trim_end())?;
            }
            writeln!(f, "guarantees of the fast thread, where they differ")?;
            // What is true of the whole machine has been said above.
            for line in fast.to_string().lines().filter(|line| !driver.contains(line)) {
                writeln!(f, "{line}")?;
            }
        }
        if let Some(pictures) = &self.pictures {
            writeln!(f, "pictures     {pictures}")?;
        }
        if self.recordings.is_empty() {
            return write!(f, "recording    none; --record FILE makes one");
        }
        let lines: Vec<String> = self.recordings.iter().map(recording_line).collect();
        write!(f, "{}", lines.join("\n"))?;
        for input in &self.left_out {
            write!(f, "\n             without {}", Plain(input))?;
        }
        Ok(())
    }
}

/// True of a pipe, a terminal or a socket, named or the standard output.
fn has_reader(path: &Path) -> bool {
    if is_standard_output(path) {
        return fstat(io::stdout()).is_ok_and(|found| !FileType::from_raw_mode(found.st_mode).is_file());
    }
    path.metadata().is_ok_and(|found| !found.is_file())
}

/// The report's line of a recording.
pub(crate) fn recording_line(recorded: &Recorded) -> String {
    let Recorded { path, rows, unit, lost, is_left_behind, failure, is_as_before } = recorded;
    let who = if has_reader(path) { "its reader" } else { "the disk" };
    let lost = match lost {
        0 => String::new(),
        lost if *is_left_behind => format!(" at least, {lost} LOST at most: {who} was too slow"),
        lost => format!(", {lost} LOST: {who} was too slow"),
    };
    let end = match (failure, is_as_before) {
        (None, false) => "",
        (None, true) => ": there was no tick, and the file is as it was",
        (Some(_), false) => " NOT COMPLETE: see the message above",
        (Some(_), true) => " NOT WRITTEN: see the message above; the file is as it was",
    };
    format!("recording    {} ({rows} {unit}{lost}){end}", Plain(shown(path).display()))
}
