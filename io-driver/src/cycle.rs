//! One tick of the driver: read all devices, tell, take the reply, write all motors.
//!
//! Problem: the same tick has to run under three clocks (two processes in real time, two in lockstep, one
//! process on a virtual clock), and every way it can go wrong has to end in zero force.
//!
//! Model: the owner of the clock calls [`Cycle::sense`], waits as it likes while asking
//! [`Cycle::take_reply`], then calls [`Cycle::actuate`]. What the commander wrote is an allegation: it is
//! validated before a number of it is used, and what is not believed is counted and otherwise as if it had
//! not come.
//!
//! Frames and signs: forces are forces on the user in each device's base frame D.
//! Invariants: a motor value is finite and within the device's limits whatever the commander writes; when a
//! lease ends its force ramps out before another lease's begins; `sense` and `actuate` alternate.
//! Cost: linear in the devices; no allocation, lock, system call (but a wake-up, if the commander sleeps) or
//! panic.

use crate::bell_thread::BellRope;
use crate::device::{Device, Effort, Extras, Reading, TickTime};
use crate::meter::{bump, record};
use crate::reply::Reply;
use crate::safety::switches::{Inputs, Switches};
use crate::safety::{Elapsed, Guard, Limits, Safety, TickClock};
use crate::urgent::Urgent;
use crate::zeroing::{DeviceSet, ZeroRefusal, ZeroState, ZeroWatch};
use bytemuck::Zeroable;
use rt_core::clock::monotonic_ns;
use shm_abi::frame::{
    DEVICE_HAS_BUTTONS, DEVICE_NOT_ZEROED, DEVICE_POSITION_VALID, LIMIT_HEAT, LIMIT_PEAK, LIMIT_SLEW,
    LIMIT_WORKSPACE,
};
use shm_abi::layout::Counters;
use shm_abi::{CommanderView, DriverMemory, FaultReason, Frame, MAX_DEVICES, Outcome, ReplyKind};
use std::sync::Arc;

/// How old a reply may be to count as fresh: none in the same tick, one in the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Freshness(pub u64);

/// What keeps the devices from doing harm.
#[derive(Debug)]
pub struct Protection {
    /// How much is let through.
    pub safety: Safety,
    /// The switches that a person has in hand.
    pub switches: Switches,
    /// Beyond its workspace a device's force fades out over this distance (m); positive.
    pub workspace_margin_m: f64,
}

/// The driver's state from tick to tick.
pub struct Cycle {
    memory: Arc<DriverMemory>,
    devices: Vec<Box<dyn Device>>,
    /// One for each device.
    guards: Vec<Guard>,
    switches: Switches,
    safety: Safety,
    zeros: ZeroWatch,
    /// What became of the last request to zero, until somebody asks.
    zero_verdict: Option<Result<DeviceSet, ZeroRefusal>>,
    period_ns: u64,
    /// When the devices are read, and when they are written.
    read_clock: TickClock,
    write_clock: TickClock,
    /// When the last tick was due.
    deadline_ns: u64,
    freshness: Freshness,
    /// The lease whose commands are obeyed.
    lease: Option<CommanderView>,
    /// A lease that waits for the former's force to ramp out.
    next_lease: Option<CommanderView>,
    /// The next tick is its first.
    begins_lease: bool,
    /// The lease ended; its force still ramps out.
    is_ending: bool,
    reply: Reply,
    frame: Frame,
    started_ns: u64,
    rang_ns: u64,
    /// Told of every fault.
    urgent: Urgent,
    /// Way to wake a commander that sleeps; `None`: the cycle wakes it itself, which has no deadlines then.
    bell: Option<Arc<BellRope>>,
}

impl Cycle {
    /// A driver over its memory. The memory's description must list the same devices.
    pub fn new(
        memory: Arc<DriverMemory>,
        devices: Vec<Box<dyn Device>>,
        protection: Protection,
        period_ns: u64,
        freshness: Freshness,
    ) -> Self {
        let Protection { safety, switches, workspace_margin_m } = protection;
        assert!(devices.len() <= MAX_DEVICES, "the configuration allows at most {MAX_DEVICES} devices");
        let mut frame = Frame::zeroed();
        frame.device_count = devices.len() as u64;
        let guards =
            devices.iter().map(|device| Guard::new(Limits::of(device.info(), workspace_margin_m))).collect();
        Self {
            memory,
            devices,
            guards,
            switches,
            safety,
            zeros: ZeroWatch::new(),
            zero_verdict: None,
            period_ns,
            read_clock: TickClock::counting(period_ns),
            write_clock: TickClock::counting(period_ns),
            deadline_ns: 0,
            freshness,
            lease: None,
            next_lease: None,
            begins_lease: false,
            is_ending: false,
            reply: Reply::none(),
            frame,
            started_ns: 0,
            rang_ns: 0,
            urgent: Urgent::default(),
            bell: None,
        }
    }

    /// The same, for a loop with deadlines, whose commander somebody else wakes.
    pub fn with_bell(mut self, bell: Option<Arc<BellRope>>) -> Self {
        self.bell = bell;
        self
    }

    /// The same, whose faults cannot be left by requests of before.
    pub fn telling_of_faults(mut self, urgent: Urgent) -> Self {
        self.urgent = urgent;
        self
    }

    /// The same, whose deadlines are times of the monotonic clock; else its ticks take a period each.
    pub fn in_real_time(mut self) -> Self {
        self.read_clock = TickClock::real(self.period_ns);
        self.write_clock = self.read_clock;
        self
    }

    /// The driver's segment.
    pub fn memory(&self) -> &DriverMemory {
        &self.memory
    }

    /// The lease that is obeyed.
    pub fn lease(&self) -> Option<&CommanderView> {
        self.lease.as_ref().filter(|_| !self.is_ending)
    }

    /// The state machine.
    pub fn safety(&self) -> &Safety {
        &self.safety
    }

    /// The tick that was sensed last.
    pub fn tick(&self) -> u64 {
        self.frame.tick
    }

    /// A new commander. It is obeyed once the former's force is gone. Returns a lease that will never be
    /// obeyed any more, for dropping elsewhere.
    pub fn grant(&mut self, lease: CommanderView) -> Option<CommanderView> {
        self.next_lease.replace(lease)
    }

    /// The commander of this lease, and of any before it, is gone: its force ramps out, beginning with the next motor
    /// values. To say so again changes nothing.
    pub fn end_lease(&mut self, number: u64) -> Option<CommanderView> {
        if self.lease.as_ref().is_some_and(|lease| lease.lease() <= number) {
            self.is_ending = true;
        }
        self.next_lease.take_if(|lease| lease.lease() <= number)
    }

    /// Changes leases when the former's force is gone. Returns the former, for dropping elsewhere.
    pub fn change_lease(&mut self) -> Option<CommanderView> {
        let may_change = self.lease.is_none() || (self.is_ending && self.safety.is_released());
        if !may_change || (self.lease.is_none() && self.next_lease.is_none()) {
            return None;
        }
        let former = std::mem::replace(&mut self.lease, self.next_lease.take());
        self.is_ending = false;
        self.reply.forget();
        self.safety.begin_lease();
        self.begins_lease = self.lease.is_some();
        former
    }

    /// Somebody asked to leave the fault state. Without a fault nothing happens: amplifiers must not be armed anew
    /// under force, nor the guards made to forget what they watch.
    pub fn clear_fault(&mut self) {
        if self.safety.fault() == FaultReason::None {
            return;
        }
        self.safety.clear_fault();
        self.devices.iter_mut().for_each(|device| device.rearm());
        self.guards.iter_mut().for_each(Guard::lose_sight);
    }

    /// Somebody says that these devices (none named: all that count) are in their zeroing pose. What became of it
    /// is told by [`zero_verdict`](Self::zero_verdict).
    pub fn zero(&mut self, asked: DeviceSet) {
        let mut states = [ZeroState::Innate; MAX_DEVICES];
        for (state, device) in states.iter_mut().zip(&self.devices) {
            *state = device.zero_state();
        }
        let present = &states[..self.devices.len()];
        let verdict = self.zeros.choose(asked, !self.safety.may_zero(), present);
        if let Ok(chosen) = verdict {
            for index in (0..self.devices.len()).filter(|index| chosen.has(*index)) {
                self.devices[index].zero();
                self.guards[index].lose_sight();
            }
            self.zeros.withhold(chosen);
        }
        self.zero_verdict = Some(verdict);
    }

    /// What the devices tell besides their positions.
    pub fn extras(&self) -> Vec<Extras> {
        self.devices.iter().map(|device| device.extras()).collect()
    }

    /// The devices that have to be zeroed.
    pub fn not_zeroed(&self) -> DeviceSet {
        let needs =
            self.devices.iter().enumerate().filter(|(_, device)| device.zero_state() == ZeroState::Needed);
        DeviceSet(needs.map(|(index, _)| 1 << index).sum())
    }

    /// What became of the last request to zero; told once.
    pub fn zero_verdict(&mut self) -> Option<Result<DeviceSet, ZeroRefusal>> {
        self.zero_verdict.take()
    }

    /// Reads all devices and publishes the frame of `tick`, which was due at `deadline_ns`.
    pub fn sense(&mut self, tick: u64, deadline_ns: u64) {
        self.started_ns = monotonic_ns();
        self.deadline_ns = deadline_ns;
        let elapsed = self.read_clock.pass(tick, deadline_ns, self.started_ns);
        let time = TickTime {
            tick,
            period_ns: self.period_ns,
            time_ns: self.read_clock.time_ns(),
            run_tick: self.safety.run_tick(tick),
            begins_lease: std::mem::take(&mut self.begins_lease),
        };
        let answered = self.lease().and(self.reply.tick);
        self.zeros.begin_tick(tick, answered);
        let all_valid = self.read_devices(time, elapsed);
        self.safety.set_positions_valid(all_valid);
        self.read_switches();
        self.describe(time, deadline_ns);
        self.memory.write_frame(&self.frame);
        self.rang_ns = monotonic_ns();
        match &self.bell {
            Some(bell) => {
                if self.memory.tell_frame(tick, self.lease.as_ref()) {
                    bell.pull();
                }
            }
            None => {
                self.memory.ring(tick, self.lease.as_ref());
            }
        }
        self.reply.round_trip_ns = 0;
    }

    /// Takes in whatever the commander has written; whether the motors can be written now.
    pub fn take_reply(&mut self) -> bool {
        let tick = self.frame.tick;
        let Some(lease) = self.lease.as_ref().filter(|_| !self.is_ending) else { return true };
        let latest = lease.latest_tick();
        // A bell that named this tick before the tick had come was refused then and may be right now.
        let has_come = latest == Some(tick) && self.reply.examined_in != tick;
        if latest != self.reply.seen || has_come {
            self.reply.seen = latest;
            self.reply.examined_in = tick;
            self.reply.examine(lease, latest, tick, self.frame.device_count, &self.memory);
            if self.reply.tick == Some(tick) {
                self.reply.round_trip_ns = monotonic_ns().saturating_sub(self.rang_ns).max(1);
                record(&self.memory.round_trip_ns, self.reply.round_trip_ns);
            }
        }
        self.reply.age_ticks(tick).is_some_and(|age| age <= self.freshness.0)
    }

    /// The tick last answered, as far as the commander's bell has been looked at.
    pub fn seen_reply(&self) -> Option<u64> {
        self.reply.seen
    }

    /// Writes all motors for this tick with the newest command that may still be used.
    pub fn actuate(&mut self) {
        let actuated_ns = monotonic_ns();
        let elapsed = self.write_clock.pass(self.frame.tick, self.deadline_ns, actuated_ns);
        let reply = self.judge_reply(elapsed);
        let authority = self.safety.advance(reply, elapsed);
        self.write_devices(authority, elapsed);
        let written_ns = monotonic_ns();
        self.frame.previous = Outcome {
            reply: reply as u64,
            command_tick: self.reply.tick.unwrap_or(0),
            authority,
            round_trip_ns: self.reply.round_trip_ns,
            written_ns,
        };
        self.count(reply);
        let sensing = self.rang_ns.saturating_sub(self.started_ns);
        record(&self.memory.cycle_ns, sensing + written_ns.saturating_sub(actuated_ns));
    }

    /// Motors off, now and whatever has happened.
    pub fn release(&mut self) {
        for device in &mut self.devices {
            device.release();
        }
    }

    /// Enters the fault state from outside the tick.
    pub fn fault(&mut self, reason: FaultReason) {
        if self.safety.enter_fault(reason) {
            bump(&self.memory.counters.faults);
            self.urgent.fault_began();
        }
        self.release();
    }

    fn read_devices(&mut self, time: TickTime, elapsed: Elapsed) -> bool {
        let mut all_valid = true;
        for index in 0..self.devices.len() {
            let reading = self.devices[index].read(time).and_then(|reading| {
                if reading.is_finite() { Ok(reading) } else { Err(FaultReason::PositionNotFinite) }
            });
            match reading {
                Ok(reading) => all_valid &= self.take_reading(index, elapsed, reading),
                Err(reason) => {
                    // The last good position stays in the frame, marked as not to be trusted; nobody knows how
                    // fast it changes.
                    let frame = &mut self.frame.devices[index];
                    frame.flags = 0;
                    frame.velocity_m_per_s_estimated = [0.0; 3];
                    frame.joint_velocity_rad_per_s_estimated = [0.0; 3];
                    all_valid = false;
                    self.zeros.lose_sight(index);
                    self.guards[index].overlook(elapsed.passed_ns());
                    self.fault(reason);
                }
            }
            if self.devices[index].extras().buttons {
                self.frame.devices[index].flags |= DEVICE_HAS_BUTTONS;
            }
            if self.devices[index].zero_state() == ZeroState::Needed {
                let flags = &mut self.frame.devices[index].flags;
                *flags &= !DEVICE_POSITION_VALID;
                *flags |= DEVICE_NOT_ZEROED;
                all_valid = false;
            }
        }
        all_valid
    }

    /// Returns whether its position can be trusted.
    fn take_reading(&mut self, index: usize, elapsed: Elapsed, reading: Reading) -> bool {
        self.zeros.observe(index, reading.encoder_counts, elapsed);
        let knows = self.devices[index].zero_state() != ZeroState::Needed && !self.zeros.is_withheld(index);
        let reading = if knows { reading } else { reading.unknown() };
        reading.write_to(&mut self.frame.devices[index]);
        if knows {
            self.watch_speed(index, elapsed, &reading);
        } else {
            // Where it is then will have nothing to do with where it seems to be now.
            self.guards[index].lose_sight();
        }
        reading.is_valid
    }

    fn watch_speed(&mut self, device: usize, elapsed: Elapsed, reading: &Reading) {
        match self.guards[device].observe(elapsed.passed_ns(), reading.position_m, reading.velocity_m_per_s) {
            Ok(()) => {}
            // A hand may be as fast as it likes as long as no motor drives it.
            Err(FaultReason::Overspeed) if self.safety.is_released() => {}
            Err(reason) => {
                if reason == FaultReason::PositionJump {
                    // Nothing moves like that: its counters do not tell where it is any more.
                    self.devices[device].lose_zero();
                }
                self.fault(reason);
            }
        }
    }

    fn read_switches(&mut self) {
        let inputs: Inputs = self.switches.read(&self.frame);
        self.frame.inputs = inputs.0;
        self.safety.set_attended(inputs.is_attended());
        if inputs.is_emergency() {
            self.fault(FaultReason::EmergencyStop);
        }
    }

    fn describe(&mut self, time: TickTime, deadline_ns: u64) {
        let frame = &mut self.frame;
        frame.tick = time.tick;
        frame.deadline_ns = deadline_ns;
        frame.read_ns = monotonic_ns();
        frame.state = self.safety.state() as u64;
        frame.fault = self.safety.fault() as u64;
        frame.lease = self.lease.as_ref().filter(|_| !self.is_ending).map_or(0, CommanderView::lease);
        frame.authority = self.safety.authority();
        frame.run_tick = time.run_tick;
    }

    fn judge_reply(&mut self, elapsed: Elapsed) -> ReplyKind {
        let age = self.reply.grow_older(self.frame.tick, elapsed.passed_ns(), self.period_ns);
        match (&self.lease, self.is_ending) {
            (Some(_), false) => self.safety.judge(age, self.freshness.0),
            _ => ReplyKind::NoLease,
        }
    }

    fn write_devices(&mut self, authority: f64, elapsed: Elapsed) {
        let mut fault = None;
        for (index, device) in self.devices.iter_mut().enumerate() {
            let commanded = self.reply.force(index);
            let effort = |force_on_user_n| Effort { force_on_user_n, gravity_share: authority };
            let attainable = |force| device.attainable(effort(force));
            let restrained = self.guards[index].restrain(commanded, authority, elapsed, attainable);
            let frame = &mut self.frame.devices[index];
            frame.force_on_user_n_commanded = commanded.into();
            frame.limits = restrained.limits;
            match device.write(effort(restrained.force_on_user_n)) {
                Ok(written) => {
                    frame.force_on_user_n_applied = written.force_on_user_n.into();
                    frame.motor_codes = written.motor_codes;
                    frame.limits |= written.limits;
                    frame.motor_heat = written.motor_heat;
                }
                Err(reason) => {
                    frame.force_on_user_n_applied = [0.0; 3];
                    fault = Some(reason);
                }
            }
            count_limits(&self.memory.counters, frame.limits);
        }
        if let Some(reason) = fault {
            self.fault(reason);
        }
    }

    fn count(&self, reply: ReplyKind) {
        let counters = &self.memory.counters;
        bump(&counters.ticks);
        if self.lease.is_some() && !Inputs(self.frame.inputs).is_attended() {
            bump(&counters.ticks_unattended);
        }
        match reply {
            ReplyKind::NoLease => return,
            ReplyKind::Fresh => bump(&counters.replies_fresh),
            // Until the first command of a lease nobody has promised anything.
            ReplyKind::Held | ReplyKind::Expired if self.reply.tick.is_some() => {
                bump(&counters.replies_missed);
            }
            ReplyKind::Held | ReplyKind::Expired => return,
        }
        bump(&counters.ticks_commanded);
    }
}

fn count_limits(counters: &Counters, limits: u64) {
    let counted = [
        (LIMIT_PEAK, &counters.forces_limited),
        (LIMIT_WORKSPACE, &counters.forces_faded),
        (LIMIT_SLEW, &counters.forces_slewed),
        (LIMIT_HEAT, &counters.forces_derated),
    ];
    for (limit, counter) in counted {
        if limits & limit != 0 {
            bump(counter);
        }
    }
}

impl Drop for Cycle {
    fn drop(&mut self) {
        self.release();
    }
}
