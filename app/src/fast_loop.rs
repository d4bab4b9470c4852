//! The fast thread's turn in a tick, whatever moves the clock: read the frame, step, answer, record.
//!
//! Invariants: rows are in order and each is complete: it leaves only once the following frame has told
//! what the motors were made to do. A row that the queue has no room for is counted, never waited for,
//! except where the clock itself waits (virtual, lockstep).
//! Cost: bounded; no allocation, no system call but the wake-up of a sleeping driver.

use crate::control::carriage::Carriage;
use crate::control::order::Replacement;
use crate::control::queue::OrderReceiver;
use crate::control::{Control, OrderTally};
use crate::displaced::Displaced;
use crate::fast_step::{EventTeller, FastStep};
use crate::pace::Pace;
use crate::room_supply::RoomSupply;
use crate::row::{BodyRow, Row};
use crate::row_queue::RowSender;
use bytemuck::Zeroable;
use rt_core::histogram::Histogram;
use shm_abi::{Command, CommanderMemory, DriverState, DriverView, Frame};
use std::time::Instant;
use world::events::{Event, EventSender, Kind};

/// How far a missed frame is searched for in the ring: the next one is nearly always among these.
const SEARCH_TICKS: u64 = 64;

/// What the fast thread does with a full queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WhenFull {
    /// Count the row as lost: real time does not wait.
    Drop,
    /// Wait for room: the clock waits too.
    Wait,
}

/// What a frame meant for the run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// Answered.
    Answered,
    /// Not for this lease (yet, or any more): nothing was done.
    Skipped,
    /// Not readable: nothing was done.
    Unread,
    /// The run's last row is out.
    Finished,
    /// The driver is in its fault state; the word is the reason.
    Fault(u64),
}

/// The fast thread's state.
pub struct FastLoop {
    step: FastStep,
    /// More room for its contacts, when it needs that.
    supply: RoomSupply,
    /// Pace of what moves, if ticks have not as much time as they like.
    pace: Option<Pace>,
    /// What people change meanwhile, if anybody may.
    control: Option<Control>,
    /// Finds what happens, and where that is told, if anybody wants to know.
    teller: EventTeller,
    events: Option<EventSender>,
    /// Tick of the run of the last order or fault that was told, which may be behind the last row.
    told_tick: Option<u64>,
    /// Whether no other scene has taken over.
    is_first_scene: bool,
    rows: RowSender,
    when_full: WhenFull,
    /// Rows that the run shall have.
    total_ticks: u64,
    period_ns: u64,
    /// When t = 0 was due; fixed by the first lease.
    base_ns: Option<u64>,
    /// Added to the lease's own run tick; fixed by each lease's first row.
    offset_ticks: Option<u64>,
    /// The run's first tick that no row has told of.
    next_tick: u64,
    /// The driver's tick of the last row.
    row_tick: u64,
    /// The row that waits for what the motors did, and the driver's tick it belongs to.
    pending: Option<(u64, Row)>,
    /// The bodies that have changed since the last row that was sent, by their numbers in ascending order.
    pending_bodies: Vec<(u32, BodyRow)>,
    /// What else was moved.
    displaced: Displaced,
    frame: Frame,
    following: Frame,
    command: Command,
    row: Row,
    /// What happened so far.
    pub tally: Tally,
    /// Times of steps (ns): from the frame that was read to the answer, without waiting for anybody.
    pub step_ns: Histogram,
}

/// Counts of a run, kept by the fast thread.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Frames answered.
    pub answered: u64,
    /// Frames of the ring that were published and not seen in time.
    pub frames_missed: u64,
    /// Rows handed over for recording.
    pub rows: u64,
    /// Rows lost because the slow side was too slow.
    pub rows_lost: u64,
    /// The largest force computed for any finger (N).
    pub peak_force_n: f64,
    /// The largest force any device was made to render (N).
    pub peak_applied_n: f64,
    /// Entities that can move, and how many of them the last tick computed.
    pub moving: [usize; 2],
    /// Ticks in which there was more at a finger's place than it can feel at once.
    pub crowded: u64,
    /// Number of times that contacts between entities had no room, in the fast list.
    pub left_out: u64,
    /// Ticks in which not all that moves was stepped.
    pub held_ticks: u64,
    /// Number stepped in these, in all.
    pub stepped_then: u64,
    /// The most bodies that waited in one.
    pub most_held: usize,
    /// Ticks in which fingers felt less of what had not been handed over.
    pub gave_way: u64,
    /// How often a force was cut because nothing moved for it.
    pub cuts: u64,
    /// The most that was cut at once (N).
    pub most_cut_n: f64,
    /// Entities that left the world, or were lost, and stand still since.
    pub parked: u64,
    /// The first of them, and in which tick of the run.
    pub parked_first: [Option<(physics::Parked, u64)>; TOLD],
}

/// How many parked entities are told by name.
pub const TOLD: usize = 4;

impl Tally {
    /// By name only those of the scene with which the run began.
    fn park(&mut self, parked: &[physics::Parked], run_tick: u64, is_named: bool) {
        for parked in parked {
            if let Some(place) = self.parked_first.get_mut(self.parked as usize).filter(|_| is_named) {
                *place = Some((*parked, run_tick));
            }
            self.parked += 1;
        }
    }
}

impl FastLoop {
    /// A run of `total_ticks` rows.
    pub fn new(
        mut step: FastStep,
        rows: RowSender,
        when_full: WhenFull,
        total_ticks: u64,
        period_ns: u64,
    ) -> Self {
        Self {
            pending_bodies: (0..).zip(step.bodies().iter().copied()).collect(),
            teller: EventTeller::new(&mut step),
            displaced: Displaced::new(step.entities().len()),
            step,
            supply: RoomSupply::default(),
            pace: None,
            control: None,
            events: None,
            told_tick: None,
            is_first_scene: true,
            rows,
            when_full,
            total_ticks,
            period_ns,
            base_ns: None,
            offset_ticks: None,
            next_tick: 0,
            row_tick: 0,
            pending: None,
            frame: Frame::zeroed(),
            following: Frame::zeroed(),
            command: Command::zeroed(),
            row: Row::empty(),
            tally: Tally::default(),
            step_ns: Histogram::new(),
        }
    }

    /// With orders that come while it runs.
    #[must_use]
    pub fn with_control(mut self, orders: OrderReceiver) -> Self {
        self.control = Some(Control::new(orders, self.step.entities().len()));
        self
    }

    /// With devices that go with the camera, if orders come.
    #[must_use]
    pub fn with_carriage(mut self, carriage: Carriage) -> Self {
        self.control = self.control.map(|control| control.with_carriage(carriage));
        self
    }

    /// With room from somewhere else, where its ticks have deadlines.
    #[must_use]
    pub fn with_supply(mut self, supply: RoomSupply) -> Self {
        self.supply = supply;
        self
    }

    /// With ticks that have a deadline: what they have no time for waits for its turn.
    #[must_use]
    pub fn with_deadlines(mut self) -> Self {
        self.pace = Some(Pace::new(self.period_ns));
        self
    }

    /// What became of all orders so far.
    pub fn orders(&self) -> OrderTally {
        self.control.as_ref().map_or_else(OrderTally::default, Control::tally)
    }

    /// With a queue for what happens.
    #[must_use]
    pub fn with_events(mut self, events: EventSender) -> Self {
        self.events = Some(events);
        self
    }

    /// Takes the frame of `tick`, steps and answers.
    pub fn turn(&mut self, tick: u64, driver: &DriverView, commander: &CommanderMemory) -> Turn {
        if self.read(tick, driver) { self.answer_read(driver, commander) } else { Turn::Unread }
    }

    /// The first part of a turn: whether the frame of `tick` could be read whole.
    pub fn read(&mut self, tick: u64, driver: &DriverView) -> bool {
        driver.read_frame(tick, &mut self.frame).is_ok()
    }

    /// The rest of it: steps and answers what was read.
    pub fn answer_read(&mut self, driver: &DriverView, commander: &CommanderMemory) -> Turn {
        self.complete_pending(driver);
        if self.frame.state == DriverState::Fault as u64 {
            self.tell_fault();
            return Turn::Fault(self.frame.fault);
        }
        if self.frame.lease != commander.lease() {
            return Turn::Skipped;
        }
        self.answer(commander, driver);
        self.keep_row();
        if self.is_finished() { Turn::Finished } else { Turn::Answered }
    }

    /// So long after the last row as the driver's ticks say. Before the first one nothing has happened.
    fn tell_fault(&mut self) {
        if self.next_tick == 0 {
            return;
        }
        let since = self.frame.tick.saturating_sub(self.row_tick);
        let run_tick = self.row.run_tick.saturating_add(since);
        if let Some(events) = &mut self.events {
            events.send(Event { run_tick, kind: Kind::Fault { reason: self.frame.fault } });
            self.told_tick = Some(run_tick);
        }
    }

    /// The run is over: tells that all ends that touched in its last tick. Nothing is told any more after that.
    pub fn end_events(&mut self) {
        if let Some(mut events) = self.events.take() {
            self.teller.end_run(self.told_tick, &mut events);
        }
    }

    /// Answers a frame after the run's last row: with the same forces, and nothing that anybody keeps. False when the
    /// lease is over.
    pub fn answer_on(&mut self, tick: u64, driver: &DriverView, commander: &CommanderMemory) -> bool {
        if driver.read_frame(tick, &mut self.frame).is_err() {
            return true;
        }
        let is_ours = self.frame.lease == commander.lease() && self.frame.state != DriverState::Fault as u64;
        if is_ours {
            self.render(commander, driver);
            self.tally.answered += 1;
        }
        is_ours
    }

    /// Its rendering, between two turns.
    pub fn step_mut(&mut self) -> &mut FastStep {
        &mut self.step
    }

    /// Number of devices that a frame must have for its fingers.
    pub fn devices(&self) -> usize {
        self.step.devices()
    }

    /// The frame read last.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Ticks of the run so far; zero before t = 0.
    pub fn run_ticks(&self) -> u64 {
        let of_lease = self.frame.run_tick.max(0).unsigned_abs();
        self.offset_ticks.map_or(0, |offset| offset.saturating_add(of_lease))
    }

    /// The connection was lost: no contact survives it. The run's time goes on meanwhile.
    pub fn reset(&mut self) {
        self.step.reset();
        self.pending = None;
        self.offset_ticks = None;
        // Another driver counts from elsewhere.
        self.row_tick = u64::MAX;
    }

    fn answer(&mut self, commander: &CommanderMemory, driver: &DriverView) {
        self.take_orders();
        self.render(commander, driver);
        self.tally.answered += 1;
    }

    fn render(&mut self, commander: &CommanderMemory, driver: &DriverView) {
        self.command = Command::zero(self.frame.tick, commander.lease(), self.frame.device_count);
        self.step.meet_driver(driver.abi_minor(), driver.ramp_in_ticks());
        let begin = Instant::now();
        self.step.step_at_most(self.pace.map_or(usize::MAX, |pace| pace.bodies()));
        self.step.count_from(self.offset_ticks.unwrap_or(0));
        self.step.step(&self.frame, &mut self.command, &mut self.row);
        commander.publish(&self.command, driver);
        let took_ns = begin.elapsed().saturating_sub(self.step.slow_turn()).as_nanos() as u64;
        self.step_ns.record(took_ns);
        if let Some(pace) = &mut self.pace {
            let made = self.step.made();
            pace.take(took_ns, made.awake, made.held > 0);
        }
        self.supply.serve(&mut self.step);
    }

    /// Not before t = 0: until then a scene is what it says.
    fn take_orders(&mut self) {
        if self.frame.run_tick < 0 {
            return;
        }
        self.place_in_time();
        let run_tick = self.run_ticks();
        let Some(control) = &mut self.control else { return };
        let turned = control.turn(&mut self.step, run_tick, self.period_ns as f64 / 1e9);
        if let Some(events) = &mut self.events {
            for number in turned.taken.into_iter().flatten() {
                events.send(Event { run_tick, kind: Kind::Order { number } });
                self.told_tick = Some(run_tick);
            }
            for event in turned.told.into_iter().flatten() {
                events.send(event);
            }
        }
        if let Some(replaced) = turned.replaced {
            self.take_over(replaced, run_tick);
        }
    }

    /// Another world goes on from here. What is of the old one goes back with it.
    fn take_over(&mut self, mut replaced: Box<Replacement>, run_tick: u64) {
        std::mem::swap(&mut self.teller, &mut replaced.teller);
        let why = replaced.other.as_ref().map_or(Kind::Reset, |other| Kind::Scene { number: other.number });
        if let Some(events) = &mut self.events {
            replaced.teller.end(&mut self.teller, run_tick, why, events);
        }
        self.row = Row::empty();
        self.pending_bodies.clear();
        if let Some(other) = &mut replaced.other {
            self.is_first_scene = false;
            std::mem::swap(&mut self.rows, &mut other.rows);
            std::mem::swap(&mut self.pending_bodies, &mut other.bodies);
            std::mem::swap(&mut self.displaced, &mut other.displaced);
        }
        self.displaced.begin_anew(self.step.entities());
        self.step.begin_at(run_tick);
        // Room for all of them was made with the world.
        self.pending_bodies.extend((0..).zip(self.step.bodies().iter().copied()));
        if let Some(control) = &mut self.control {
            control.give_back(replaced);
        }
    }

    fn keep_row(&mut self) {
        if self.frame.run_tick < 0 {
            return;
        }
        self.place_in_time();
        self.row.run_tick = self.run_ticks();
        self.row_tick = self.frame.tick;
        self.row.due_ns = self.frame.deadline_ns;
        self.tally.park(self.step.parked_now(), self.row.run_tick, self.is_first_scene);
        self.tally.crowded += u64::from(self.step.is_crowded());
        self.tally.left_out = self.tally.left_out.max(self.step.left_out());
        let physics::Made { held, awake, .. } = self.step.made();
        self.tally.held_ticks += u64::from(held > 0);
        self.tally.stepped_then += if held > 0 { awake as u64 } else { 0 };
        self.tally.most_held = self.tally.most_held.max(held);
        self.tally.gave_way += u64::from(self.step.gives_way().contains(&true));
        for cut in self.step.cuts() {
            self.tally.cuts += 1;
            self.tally.most_cut_n = self.tally.most_cut_n.max(cut.force_n);
        }
        self.tally.moving = [self.step.bodies().len(), self.step.made().awake];
        self.next_tick = self.row.run_tick + 1;
        if self.row.run_tick < self.total_ticks {
            // Before the row is sent, and after the command was.
            if let Some(events) = &mut self.events {
                self.teller.tell(&self.step, &self.row, events);
            }
            self.pending = Some((self.frame.tick, self.row));
            self.keep_bodies();
            for finger in &self.row.fingers {
                self.tally.peak_force_n = self.tally.peak_force_n.max(finger.force_on_user.norm());
            }
        }
    }

    fn keep_bodies(&mut self) {
        self.displaced.note(self.step.placed());
        let (pending, bodies) = (&mut self.pending_bodies, self.step.bodies());
        for &number in self.step.changed_bodies() {
            let body = bodies[number as usize];
            // In order they come at the end, but for those of a row that was not sent.
            match pending.binary_search_by_key(&number, |(number, _)| *number) {
                Ok(at) => pending[at].1 = body,
                Err(at) => pending.insert(at, (number, body)),
            }
        }
    }

    /// The first lease's t = 0 is the run's; a later lease's is as much later as its deadline is, except
    /// that time never goes back, which in lockstep, where ticks are shorter than their length, it would.
    fn place_in_time(&mut self) {
        if self.offset_ticks.is_some() {
            return;
        }
        let of_lease = self.frame.run_tick.max(0).unsigned_abs();
        let lease_zero_ns = self.frame.deadline_ns.saturating_sub(of_lease.saturating_mul(self.period_ns));
        let base_ns = *self.base_ns.get_or_insert(lease_zero_ns);
        let later_ns = lease_zero_ns.saturating_sub(base_ns);
        let later_ticks = (later_ns + self.period_ns / 2) / self.period_ns;
        self.offset_ticks = Some(later_ticks.max(self.next_tick.saturating_sub(of_lease)));
    }

    fn is_finished(&self) -> bool {
        self.frame.run_tick >= 0 && self.pending.is_none() && self.run_ticks() >= self.total_ticks
    }

    fn complete_pending(&mut self, driver: &DriverView) {
        let Some((tick, mut row)) = self.pending.take() else { return };
        if self.frame.tick == tick + 1 {
            self.step.complete(&mut row, &self.frame);
        } else {
            self.find_following(tick, driver);
            self.step.complete(&mut row, &self.following);
        }
        for finger in &row.fingers {
            self.tally.peak_applied_n = self.tally.peak_applied_n.max(finger.applied_on_user.norm());
        }
        self.push(row);
    }

    /// Frames were missed; the one after `tick` still lies in the ring, unless the driver skipped it.
    fn find_following(&mut self, tick: u64, driver: &DriverView) {
        self.tally.frames_missed += self.frame.tick.saturating_sub(tick + 1);
        let last = self.frame.tick.min(tick + SEARCH_TICKS);
        for candidate in tick + 1..last {
            if driver.read_frame(candidate, &mut self.following).is_ok() {
                return;
            }
        }
        self.following = self.frame;
    }

    /// True if the next row would not have to wait, whatever moves.
    pub fn has_room(&self) -> bool {
        self.rows.has_room(self.step.bodies().len(), usize::MAX)
    }

    /// True if the next tick would bring a world that is not made yet.
    pub fn wants_world(&self) -> bool {
        self.control.as_ref().is_some_and(|control| control.wants_world(self.run_ticks() + 1))
    }

    fn push(&mut self, row: Row) {
        if self.when_full == WhenFull::Wait {
            let others = self.displaced.pending().len();
            while !self.rows.has_room(self.pending_bodies.len(), others) && !self.rows.is_abandoned() {
                std::thread::yield_now();
            }
        }
        match self.rows.send_with(row, &self.pending_bodies, self.displaced.pending()) {
            true => {
                self.tally.rows += 1;
                self.pending_bodies.clear();
            }
            false => {
                self.rows.lose();
                self.tally.rows_lost += 1;
            }
        }
    }
}
