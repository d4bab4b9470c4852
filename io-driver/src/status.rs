//! What a running driver is doing, for people and for programs.

use crate::meter;
use rt_core::clock::monotonic_ns;
use rt_core::histogram::{Histogram, Summary};
use rt_core::time_namespace;
use serde::Serialize;
use shm_abi::frame::{
    DEVICE_NOT_ZEROED, DEVICE_ORIENTATION_MEASURED, DEVICE_POSITION_VALID, INPUT_DEAD_MAN_HELD,
    INPUT_DEAD_MAN_PRESENT, INPUT_EMERGENCY_STOP, LIMIT_HEAT, LIMIT_PEAK, LIMIT_SATURATION, LIMIT_SLEW,
    LIMIT_WORKSPACE,
};
use shm_abi::peer::ProcessWords;
use shm_abi::segment::{ClockMode, DriverInfo};
use shm_abi::{DriverState, DriverView, FaultReason, Frame};
use std::borrow::Cow;
use std::fmt;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// A driver at one moment. Units are in the names.
#[derive(Debug, Clone, Serialize)]
pub struct Status {
    /// Process id.
    pub driver_pid: u64,
    /// Which clock moves the ticks.
    pub clock: &'static str,
    /// Ticks per second.
    pub rate_hz: f64,
    /// How long it waits for a reply; `None`: for ever.
    pub reply_budget_ns: Option<u64>,
    /// How it waits: "spin" or "futex".
    pub wait: &'static str,
    /// CPU of the loop.
    pub cpu: Option<usize>,
    /// Number of the newest tick.
    pub tick: Option<u64>,
    /// Age of that tick (s), if a loop in real time should have had others since: it hangs, or is stopped.
    pub silent_for_s: Option<f64>,
    /// True if its clock is shifted against ours, so that ages are not known: one of us lives in another time namespace.
    pub other_time_namespace: bool,
    /// State of the driver.
    pub state: &'static str,
    /// Why it is in the fault state.
    pub fault: Option<Cow<'static, str>>,
    /// Lease in force; 0: none.
    pub lease: u64,
    /// Share of the force that is let through.
    pub authority: f64,
    /// Whether forces and speeds are cut to those of a first trial.
    pub commissioning: bool,
    /// Whether an emergency stop is pressed.
    pub emergency_stop_pressed: bool,
    /// Whether somebody holds the dead-man's switch; `None`: there is none.
    pub dead_man_held: Option<bool>,
    /// Counts since the start.
    pub counters: CounterStatus,
    /// How late the loop woke.
    pub wake_error_ns: Percentiles,
    /// Its own work in a tick.
    pub cycle_ns: Percentiles,
    /// From frame to reply.
    pub round_trip_ns: Percentiles,
    /// The devices.
    pub devices: Vec<DeviceStatus>,
    /// Which real-time guarantees its loop obtained, a line each.
    pub guarantees: Vec<String>,
    /// Last words, if it has died.
    pub epitaph: Option<String>,
}

/// The driver's counters, each under its name in the driver's segment.
macro_rules! counters {
    ($($(#[$doc:meta])* $name:ident,)+) => {
        /// The driver's counters.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
        pub struct CounterStatus {
            $($(#[$doc])* pub $name: u64,)+
        }

        impl CounterStatus {
            /// Reads a driver's counters.
            pub fn of(driver: &DriverView) -> Self {
                Self { $($name: driver.counters.$name.load(Ordering::Relaxed),)+ }
            }

            /// What was counted in both.
            pub fn plus(&self, other: &Self) -> Self {
                Self { $($name: self.$name.saturating_add(other.$name),)+ }
            }

            /// What was counted after `before`.
            pub fn since(&self, before: &Self) -> Self {
                Self { $($name: self.$name.saturating_sub(before.$name),)+ }
            }
        }
    };
}

counters! {
    /// Ticks done.
    ticks,
    /// Deadlines skipped.
    overruns,
    /// Ticks under a lease.
    ticks_commanded,
    /// Of these, answered in time.
    replies_fresh,
    /// Of these, not answered in time.
    replies_missed,
    /// Torn commands.
    commands_torn,
    /// Commands not believed.
    commands_refused,
    /// Forces cut to a peak.
    forces_limited,
    /// Forces that grew slower than commanded.
    forces_slewed,
    /// Forces cut because motors were warm.
    forces_derated,
    /// Forces cut outside the workspace.
    forces_faded,
    /// Ticks without force because the dead-man's switch was not held.
    ticks_unattended,
    /// Leases granted.
    leases_granted,
    /// Would-be commanders refused.
    leases_refused,
    /// Faults entered.
    faults,
    /// Lines of the log that were dropped because nobody took them.
    log_dropped,
}

/// A histogram in short; `None` without values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Percentiles {
    /// Values.
    pub count: u64,
    /// Half are not above this.
    pub p50: u64,
    /// 99 % are not above this.
    pub p99: u64,
    /// 99.9 % are not above this.
    pub p999: u64,
    /// None is above this.
    pub max: u64,
}

/// A device at that moment.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceStatus {
    /// Name.
    pub name: String,
    /// Kind.
    pub kind: String,
    /// Whether the position can be trusted.
    pub position_valid: bool,
    /// Whether it does not know where it is until it is zeroed.
    pub zero_needed: bool,
    /// Orientation of the gimbal's last link in the base frame, w x y z; `None`: not measured.
    pub orientation_wxyz: Option<[f64; 4]>,
    /// The tip in the base frame (m).
    pub position_m: [f64; 3],
    /// Its velocity (m/s), estimated.
    pub velocity_m_per_s: [f64; 3],
    /// Bit `i`: button `i` is pressed.
    pub buttons: u64,
    /// The force on the user that the motors render (N).
    pub force_on_user_n_applied: [f64; 3],
    /// What came between that and the force commanded.
    pub limits: Vec<&'static str>,
    /// Warmth of the warmest motor; 1 is the rated.
    pub motor_heat: f64,
    /// The largest force it may render (N); `None`: no limit.
    pub peak_force_n: Option<f64>,
}

impl Status {
    /// Looks at a driver.
    pub fn of(driver: &DriverView, driver_pid: u64) -> Self {
        let info = driver.info();
        let frame = driver.read_latest();
        let has_other_clock = frame.is_some_and(|frame| has_other_clock(driver, &info, &frame, driver_pid));
        let fault = frame.map(|f| f.fault).filter(|word| *word != FaultReason::None as u64);
        let inputs = frame.map_or(0, |f| f.inputs);
        Self {
            driver_pid,
            clock: info.clock_mode.name(),
            rate_hz: 1e9 / info.period_ns as f64,
            reply_budget_ns: (info.reply_budget_ns != u64::MAX).then_some(info.reply_budget_ns),
            wait: info.wait_mode.name(),
            cpu: info.cpu,
            tick: frame.map(|f| f.tick),
            silent_for_s: frame
                .filter(|_| !has_other_clock)
                .and_then(|f| silence_s(&info, &f, monotonic_ns())),
            other_time_namespace: has_other_clock,
            state: frame.map_or(DriverState::Starting.name(), |f| state_name(f.state)),
            fault: fault.map(FaultReason::sentence_for),
            lease: frame.map_or(0, |f| f.lease),
            authority: frame.map_or(0.0, |f| f.authority),
            commissioning: info.is_commissioning,
            emergency_stop_pressed: inputs & INPUT_EMERGENCY_STOP != 0,
            dead_man_held: (inputs & INPUT_DEAD_MAN_PRESENT != 0)
                .then_some(inputs & INPUT_DEAD_MAN_HELD != 0),
            counters: CounterStatus::of(driver),
            wake_error_ns: Percentiles::of(&meter::read(&driver.wake_error_ns)),
            cycle_ns: Percentiles::of(&meter::read(&driver.cycle_ns)),
            round_trip_ns: Percentiles::of(&meter::read(&driver.round_trip_ns)),
            devices: devices(&info, frame.as_ref()),
            guarantees: info.setup_report.lines().map(|line| line.trim().to_owned()).collect(),
            epitaph: rt_core::epitaph::read(&driver.epitaph).map(|words| words.to_string()),
        }
    }

    fn write_switches(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.emergency_stop_pressed {
            writeln!(f, "switches    emergency stop pressed")?;
        }
        if let Some(held) = self.dead_man_held {
            writeln!(f, "switches    dead-man's switch {}", if held { "held" } else { "let go: no force" })?;
        }
        if self.commissioning {
            writeln!(f, "mode        commissioning: little force, little speed")?;
        }
        Ok(())
    }

    /// One line, for watching.
    pub fn line(&self) -> String {
        let tips: Vec<String> = self.devices.iter().map(DeviceStatus::short).collect();
        let ago = self.silent_for_s.map_or_else(String::new, |s| format!(" ({s:.1} s ago)"));
        format!(
            "tick {}{ago} {} lease {} overruns {} missed {} | {}",
            self.tick.unwrap_or(0),
            self.state,
            self.lease,
            self.counters.overruns,
            self.counters.replies_missed,
            tips.join(" | "),
        )
    }
}

impl Percentiles {
    /// A histogram in short; zeros where nothing was recorded.
    pub fn of(histogram: &Histogram) -> Self {
        let Summary { count, p50, p99, p999, max } = histogram.summary();
        Self { count, p50, p99, p999, max }
    }
}

impl fmt::Display for Percentiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.count == 0 {
            return f.write_str("nothing recorded");
        }
        let us = |ns: u64| format!("{:.2}", ns as f64 / 1e3);
        write!(
            f,
            "p50 {}  p99 {}  p99.9 {}  max {} us",
            us(self.p50),
            us(self.p99),
            us(self.p999),
            us(self.max)
        )
    }
}

impl DeviceStatus {
    fn short(&self) -> String {
        let [x, y, z] = self.position_m.map(|m| m * 1e3);
        let force = nalgebra::Vector3::from(self.force_on_user_n_applied).norm();
        format!("{} ({x:.1}, {y:.1}, {z:.1}) mm {force:.2} N", self.name)
    }
}

/// The names of the bits of a device's `limits`.
fn names_of(limits: u64) -> Vec<&'static str> {
    let names = [
        (LIMIT_PEAK, "peak"),
        (LIMIT_WORKSPACE, "workspace"),
        (LIMIT_SLEW, "slew"),
        (LIMIT_HEAT, "heat"),
        (LIMIT_SATURATION, "saturation"),
    ];
    names.into_iter().filter(|(bit, _)| limits & bit != 0).map(|(_, name)| name).collect()
}

fn devices(info: &DriverInfo, frame: Option<&Frame>) -> Vec<DeviceStatus> {
    let states = frame.map_or(&[][..], Frame::present_devices);
    info.devices
        .iter()
        .enumerate()
        .map(|(index, device)| {
            let state = states.get(index);
            DeviceStatus {
                name: device.name.clone(),
                kind: device.kind.clone(),
                position_valid: state.is_some_and(|s| s.flags & DEVICE_POSITION_VALID != 0),
                zero_needed: state.is_some_and(|s| s.flags & DEVICE_NOT_ZEROED != 0),
                orientation_wxyz: state
                    .filter(|s| s.flags & DEVICE_ORIENTATION_MEASURED != 0)
                    .map(|s| s.orientation_wxyz_measured),
                position_m: state.map_or([0.0; 3], |s| s.position_m_measured),
                velocity_m_per_s: state.map_or([0.0; 3], |s| s.velocity_m_per_s_estimated),
                buttons: state.map_or(0, |s| s.buttons),
                force_on_user_n_applied: state.map_or([0.0; 3], |s| s.force_on_user_n_applied),
                limits: names_of(state.map_or(0, |s| s.limits)),
                motor_heat: state.map_or(0.0, |s| s.motor_heat),
                peak_force_n: Some(device.peak_force_n).filter(|peak| peak.is_finite()),
            }
        })
        .collect()
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cpu = self.cpu.map_or_else(|| "any CPU".into(), |cpu| format!("CPU {cpu}"));
        writeln!(
            f,
            "driver      {}, {} clock, {} Hz, {cpu}, {} wait",
            ProcessWords(self.driver_pid),
            self.clock,
            self.rate_hz,
            self.wait
        )?;
        let fault = self.fault.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        write!(
            f,
            "state       {}{fault}, lease {}, authority {:.2}",
            self.state, self.lease, self.authority
        )?;
        match self.silent_for_s {
            Some(s) => writeln!(f, "; all of this was so {s:.1} s ago, its loop has had no tick since")?,
            None if self.other_time_namespace => {
                writeln!(f, "; how old this is is not known: the driver lives in another time namespace")?;
            }
            None => writeln!(f)?,
        }
        let c = &self.counters;
        writeln!(f, "ticks       {} done, {} overruns", c.ticks, c.overruns)?;
        writeln!(
            f,
            "replies     {} fresh, {} missed, {} torn, {} refused",
            c.replies_fresh, c.replies_missed, c.commands_torn, c.commands_refused
        )?;
        writeln!(f, "leases      {} granted, {} refused", c.leases_granted, c.leases_refused)?;
        writeln!(
            f,
            "safety      {} faults; forces cut: {} to a peak, {} in growth, {} outside, {} by warmth",
            c.faults, c.forces_limited, c.forces_slewed, c.forces_faded, c.forces_derated
        )?;
        if c.log_dropped > 0 {
            writeln!(f, "log         {} lines dropped: standard error took none", c.log_dropped)?;
        }
        self.write_switches(f)?;
        writeln!(f, "wake error  {}", self.wake_error_ns)?;
        writeln!(f, "cycle       {}", self.cycle_ns)?;
        write!(f, "round trip  {}", self.round_trip_ns)?;
        for device in &self.devices {
            let valid = if device.position_valid { "" } else { " (position not valid)" };
            write!(f, "\ndevice      {} [{}]{valid}", device.short(), device.kind)?;
            if device.zero_needed {
                let name = &device.name;
                let how =
                    format_args!("bring it into its zeroing pose, then `io-driver zero --device {name}`");
                write!(f, ", not zeroed: {how}")?;
            }
            if device.motor_heat > 0.0 {
                write!(f, ", motors at {:.0} % of their warmth", 100.0 * device.motor_heat)?;
            }
            if !device.limits.is_empty() {
                write!(f, ", limited by {}", device.limits.join(" and "))?;
            }
        }
        for line in &self.guarantees {
            write!(f, "\nguarantee   {line}")?;
        }
        if let Some(words) = &self.epitaph {
            write!(f, "\nlast words  {words}")?;
        }
        Ok(())
    }
}

/// Names of the devices that have to be zeroed; as long as there is one, no device gets force.
pub fn not_zeroed(driver: &DriverView) -> Vec<String> {
    let Some(frame) = driver.read_latest() else { return Vec::new() };
    let needs = |(_, state): &(_, &shm_abi::DeviceFrame)| state.flags & DEVICE_NOT_ZEROED != 0;
    let devices = driver.info().devices.into_iter().zip(frame.present_devices());
    devices.filter(needs).map(|(device, _)| device.name).collect()
}

/// A state of a later version is none of those that we know.
fn state_name(word: u64) -> &'static str {
    DriverState::from_word(word).map_or("unknown", DriverState::name)
}

/// Age of a frame at `now_ns` (s), if it is older than that of a loop in real time that ticks.
fn silence_s(info: &DriverInfo, frame: &Frame, now_ns: u64) -> Option<f64> {
    let age_ns = now_ns.saturating_sub(frame.read_ns);
    let is_silent = info.clock_mode == ClockMode::Real && age_ns > SILENCE_NS + 5 * info.period_ns;
    is_silent.then_some(age_ns as f64 / 1e9)
}

/// True if the driver's clock is shifted against ours. Where the kernel does not tell, frames do: one of the future, or
/// another one that is old when it is new.
fn has_other_clock(driver: &DriverView, info: &DriverInfo, frame: &Frame, driver_pid: u64) -> bool {
    if let Some(is_shared) = time_namespace::is_clock_shared_with(driver_pid) {
        return !is_shared;
    }
    let now_ns = monotonic_ns();
    if frame.read_ns > now_ns + AHEAD_NS {
        return true;
    }
    if silence_s(info, frame, now_ns).is_none() {
        return false;
    }
    let until_ns = now_ns + NEXT_FRAME_NS + 5 * info.period_ns;
    while monotonic_ns() < until_ns {
        let next = driver.read_latest().filter(|next| next.tick > frame.tick);
        if let Some(next) = next {
            return silence_s(info, &next, monotonic_ns()).is_some();
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

/// No frame is read so far in the future.
const AHEAD_NS: u64 = 1_000_000_000;
/// A loop that ticks has another frame by then.
const NEXT_FRAME_NS: u64 = 20_000_000;

/// Time without a tick, beyond a few periods, that a busy machine does not explain.
const SILENCE_NS: u64 = 100_000_000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::DriverConfig;
    use crate::driver::describe;
    use bytemuck::Zeroable;
    use shm_abi::DriverMemory;
    use shm_abi::doorbell::WaitMode;

    #[test]
    fn a_fault_and_a_state_of_a_later_version_are_told_as_what_they_are() {
        let config = DriverConfig::parse("[[device]]\nbackend = \"ideal\"\n", "test.toml".as_ref()).unwrap();
        let devices = crate::open::open_devices(&config).unwrap();
        let memory = DriverMemory::create(&describe(&config, &devices, WaitMode::Futex)).unwrap();
        memory.write_frame(&Frame { state: 77, fault: 99, ..Frame::zeroed() });
        memory.ring(0, None);
        let status = Status::of(&DriverView::map(memory.fd()).unwrap(), 1).to_string();
        let line = "state       unknown: a fault of a kind this version does not know (99), lease 0";
        assert!(status.contains(line), "{status}");
    }

    /// Of process 0 the kernel tells nothing.
    #[test]
    fn a_frame_of_the_future_is_of_another_clock_and_has_no_age() {
        let config = DriverConfig::parse("[[device]]\nbackend = \"ideal\"\n", "test.toml".as_ref()).unwrap();
        let devices = crate::open::open_devices(&config).unwrap();
        let memory = DriverMemory::create(&describe(&config, &devices, WaitMode::Futex)).unwrap();
        for (ahead_ns, is_other) in [(10_000_000_000, true), (0, false)] {
            memory.write_frame(&Frame { read_ns: monotonic_ns() + ahead_ns, ..Frame::zeroed() });
            memory.ring(0, None);
            let status = Status::of(&DriverView::map(memory.fd()).unwrap(), 0);
            assert_eq!((status.other_time_namespace, status.silent_for_s), (is_other, None));
            assert_eq!(status.to_string().contains("lives in another time namespace"), is_other);
        }
    }

    /// A loop that hangs leaves its last frame, which says that it pushes.
    #[test]
    fn a_frame_of_before_is_told_as_such_where_a_loop_should_tick() {
        let text_of = |clock, age_ns| {
            let text = format!("clock = \"{clock}\"\nrate_hz = 100\n[[device]]\nbackend = \"ideal\"\n");
            let config = DriverConfig::parse(&text, "test.toml".as_ref()).unwrap();
            let devices = crate::open::open_devices(&config).unwrap();
            let memory = DriverMemory::create(&describe(&config, &devices, WaitMode::Futex)).unwrap();
            memory.write_frame(&Frame { read_ns: monotonic_ns() - age_ns, ..Frame::zeroed() });
            memory.ring(0, None);
            let status = Status::of(&DriverView::map(memory.fd()).unwrap(), 1);
            (status.to_string(), status.line())
        };
        const S: u64 = 1_000_000_000;
        let (told, line) = text_of("real", 3 * S);
        assert!(!told.contains("time namespace"), "{told}");
        assert!(told.contains("; all of this was so 3.0 s ago, its loop has had no tick since"), "{told}");
        assert!(line.starts_with("tick 0 (3.0 s ago) "), "{line}");
        // Far less than 100 ms and five periods of 10 ms; a loop in lockstep waits as long as its commander.
        for (clock, age_ns) in [("real", 0), ("lockstep", 3 * S)] {
            let (told, line) = text_of(clock, age_ns);
            assert!(!told.contains(" ago") && !line.contains(" ago"), "{told} {line}");
        }
    }
}
