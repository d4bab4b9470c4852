//! The measurement: styles take turns in slices, one process at a time on the measured CPU.
//!
//! Model: run 1 takes the styles in their order, run 2 in the reverse, and so on, so that a drift of the machine
//! favours none. Everything is polled from this one thread, which starts all children: they end with it.
//! A slice that fails is noted and the next one has its turn; too many failures on end stop the measurement.
//! Invariants: whatever ends it, what was measured is in the bank, and no child is left.

use crate::jitter::bank::Bank;
use crate::jitter::cyclictest_slice::CyclictestSlice;
use crate::jitter::document::{Document, Surroundings};
use crate::jitter::driver_slice::DriverSlice;
use crate::jitter::error::JitterError;
use crate::jitter::live::Live;
use crate::jitter::load::Load;
use crate::jitter::loop_slice::LoopSlice;
use crate::jitter::metric::Style;
use crate::jitter::neighbours::Neighbours;
use crate::jitter::plan::{Plan, Reference, WARM_UP};
use crate::jitter::save::Saver;
use crate::jitter::waiting_loop::Wait;
use rt_core::clock::monotonic_ns;
use rt_core::signals::StopSignals;
use shm_abi::DriverView;
use shm_abi::segment::ClockMode;
use std::time::{Duration, Instant};

/// One failed slice may be bad luck.
const FAILURES_ON_END: usize = 3;

/// How it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// All runs are done.
    Completed,
    /// This signal ended it early.
    Signal(i32),
    /// This did.
    Fault(String),
}

/// A measurement in progress.
#[derive(Debug)]
pub struct Session<'a> {
    plan: &'a Plan,
    cpus: Vec<usize>,
    signals: &'a StopSignals,
    /// What was measured.
    pub bank: Bank,
    /// What is known besides.
    pub surroundings: Surroundings,
    saver: &'a mut Saver,
    live: Live,
    load: Option<Load>,
    neighbours: Neighbours,
    /// A driver that is only looked on at.
    attached: Option<DriverSlice>,
}

impl<'a> Session<'a> {
    /// Ready to run, with all CPUs that children may have.
    pub fn new(
        plan: &'a Plan,
        cpus: Vec<usize>,
        signals: &'a StopSignals,
        bank: Bank,
        surroundings: Surroundings,
        saver: &'a mut Saver,
        live: Live,
    ) -> Self {
        Self {
            plan,
            cpus,
            signals,
            bank,
            surroundings,
            saver,
            live,
            load: None,
            neighbours: Neighbours::default(),
            attached: None,
        }
    }

    /// Instead of taking turns it looks on at this driver.
    pub fn look_on_at(&mut self, driver: Option<DriverSlice>) {
        self.attached = driver;
    }

    /// Measures to the end.
    pub fn run(&mut self) -> End {
        let end = self.try_run().unwrap_or_else(|error| match self.signals.requested() {
            Some(signal) => End::Signal(signal),
            None => End::Fault(error.to_string()),
        });
        self.load = None;
        self.live.end();
        end
    }

    fn try_run(&mut self) -> Result<End, JitterError> {
        if let Some(load) = &self.plan.load {
            self.load = Some(Load::start(load, self.saver.directory(), &self.cpus)?);
        }
        match self.attached.take() {
            Some(slice) => self.look_on(slice),
            None => self.take_turns(),
        }
    }

    fn take_turns(&mut self) -> Result<End, JitterError> {
        let mut failures = 0;
        for run in 1..=self.plan.runs {
            let mut styles = self.plan.styles.clone();
            if run.is_multiple_of(2) {
                styles.reverse();
            }
            for style in styles {
                let outcome = self.slice(run, style);
                if let Some(signal) = self.signals.requested() {
                    return Ok(End::Signal(signal));
                }
                match outcome {
                    Ok(()) => failures = 0,
                    Err(error) => {
                        failures += 1;
                        self.bank.count(style, "slices_failed", 1);
                        self.note(&format!("run {run}, {}: {error}", style.name()));
                        if failures >= FAILURES_ON_END {
                            return Err(JitterError::Fault(format!(
                                "{FAILURES_ON_END} slices on end failed: {error}"
                            )));
                        }
                    }
                }
            }
        }
        Ok(End::Completed)
    }

    fn slice(&mut self, run: usize, style: Style) -> Result<(), JitterError> {
        self.bank.begin_slice(run);
        self.live.begin_slice(run, style);
        let real_time = &self.plan.config.real_time;
        for newcomer in self.neighbours.newcomers(real_time.cpu, real_time.priority) {
            self.note(&newcomer);
        }
        let mut begun_ns = monotonic_ns();
        let outcome = match (style, &self.plan.reference) {
            (Style::Hybrid, _) => self.loop_slice(Wait::Hybrid, style, &mut begun_ns),
            (Style::Reference, Reference::Sleep) => self.loop_slice(Wait::Sleep, style, &mut begun_ns),
            (Style::Reference, Reference::Cyclictest(_)) => self.cyclictest_slice(),
            (Style::Driver, _) => self.driver_slice(&mut begun_ns),
        };
        self.bank.end_slice(begun_ns, outcome.is_ok() && self.signals.requested().is_none());
        outcome
    }

    fn loop_slice(&mut self, wait: Wait, style: Style, begun_ns: &mut u64) -> Result<(), JitterError> {
        let mut slice = LoopSlice::start(&self.plan.order(wait), style, &self.cpus)?;
        self.surroundings.guarantees.entry(style).or_insert_with(|| slice.hello.guarantees.clone());
        *begun_ns = monotonic_ns() + WARM_UP.as_nanos() as u64;
        while self.pause() {
            if slice.poll(&mut self.bank)? {
                return Ok(());
            }
        }
        slice.poll(&mut self.bank).map(|_| ())
    }

    fn cyclictest_slice(&mut self) -> Result<(), JitterError> {
        let Reference::Cyclictest(call) = &self.plan.reference else { return Ok(()) };
        let mut slice = CyclictestSlice::start(call, self.plan.slice.as_secs().max(1), &self.cpus)?;
        while self.pause() {
            if slice.poll(&mut self.bank)? {
                return Ok(());
            }
        }
        slice.cut_short(&mut self.bank)
    }

    fn driver_slice(&mut self, begun_ns: &mut u64) -> Result<(), JitterError> {
        let signals = self.signals.clone();
        let go_on = move || signals.requested().is_none();
        let mut slice = DriverSlice::start(&self.plan.config, &self.plan.scene, &self.cpus, &go_on)?;
        self.remember_guarantees(slice.view());
        std::thread::sleep(WARM_UP);
        slice.forget();
        *begun_ns = monotonic_ns();
        self.observe(&mut slice, self.plan.slice)
    }

    fn look_on(&mut self, slice: DriverSlice) -> Result<End, JitterError> {
        let mut slice = slice;
        if slice.view().info().clock_mode != ClockMode::Real {
            let clock = slice.view().info().clock_mode.name();
            self.note(&format!("the driver's clock is {clock}: its latencies mean little"));
        }
        self.remember_guarantees(slice.view());
        slice.forget();
        for run in 1..=self.plan.runs {
            self.bank.begin_slice(run);
            self.live.begin_slice(run, Style::Driver);
            let begun_ns = monotonic_ns();
            let outcome = self.observe(&mut slice, self.plan.slice);
            self.bank.end_slice(begun_ns, outcome.is_ok() && self.signals.requested().is_none());
            outcome?;
            if let Some(signal) = self.signals.requested() {
                return Ok(End::Signal(signal));
            }
        }
        Ok(End::Completed)
    }

    fn observe(&mut self, slice: &mut DriverSlice, length: Duration) -> Result<(), JitterError> {
        let begun = Instant::now();
        while begun.elapsed() < length && self.pause() {
            slice.poll(&mut self.bank)?;
        }
        slice.poll(&mut self.bank)
    }

    fn remember_guarantees(&mut self, view: &DriverView) {
        let lines = || view.info().setup_report.lines().map(|line| line.trim().to_owned()).collect();
        self.surroundings.guarantees.entry(Style::Driver).or_insert_with(lines);
    }

    /// Between two polls: waits, shows, saves. False: somebody asked us to end.
    fn pause(&mut self) -> bool {
        std::thread::sleep(self.plan.poll);
        self.live.show(&self.bank);
        for casualty in self.load.as_mut().map(Load::casualties).unwrap_or_default() {
            self.note(&casualty);
        }
        if self.saver.is_due() {
            self.saver.begin_save(&Document::new(&self.bank, &self.surroundings, "running"));
        }
        if let Some(news) = self.saver.news() {
            self.note(&news);
        }
        self.signals.requested().is_none()
    }

    fn note(&mut self, note: &str) {
        self.live.tell(note);
        // Days of trouble must not fill the memory.
        if self.surroundings.notes.len() < 200 {
            self.surroundings.notes.push(format!("{}: {note}", crate::jitter::origin::utc_now()));
        }
    }
}
