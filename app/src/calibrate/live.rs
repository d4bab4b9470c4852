//! Gathers pairs from a running driver while somebody moves the end points.
//!
//! Model: an observer, which never takes the lease: the motors stay as they are. Every tick in which both devices know
//! where they are is looked at; one that is far enough from all others is kept. Both positions of a tick were read
//! within microseconds, so moving fast does no harm.
//! A device that renders a force pulls on the joint that holds the end points together and bends its arm; such ticks
//! are not kept, and whoever commands is named.

use crate::progress::StatusLine;
use calibration::{Coverage, Gathering, Pair};
use io_driver::cli::say_line_if_late;
use io_driver::say::say;
use nalgebra::Vector3;
use rt_core::signals::StopSignals;
use shm_abi::client::{self, AttachError, Attachment};
use shm_abi::frame::DEVICE_POSITION_VALID;
use shm_abi::layout::RING_FRAMES;
use shm_abi::{DeviceFrame, DriverView, Frame, FrameUnavailable};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use thiserror::Error;

/// What to gather.
pub(super) struct Wish {
    pub(super) socket: PathBuf,
    pub(super) fiducial: usize,
    pub(super) other: usize,
    pub(super) seconds: f64,
}

/// What was gathered, however it ended.
pub(super) struct Gathered {
    pub(super) pairs: Vec<Pair>,
    pub(super) end: Result<(), LiveError>,
}

/// Why gathering came to nothing.
#[derive(Debug, Error)]
pub enum LiveError {
    /// No driver.
    #[error(transparent)]
    Attach(#[from] AttachError),
    /// Fewer devices than asked for.
    #[error("the driver has no device {wanted}; it has {}: choose with --device and --fiducial", list(.names))]
    NoDevice {
        /// The index asked for.
        wanted: usize,
        /// What it has.
        names: Vec<String>,
    },
    /// A device that does not know where it is.
    #[error("device {0} never knew where it is; put it into its zeroing pose and see `io-driver status`")]
    NotZeroed(usize),
    /// Somebody's forces all the time.
    #[error("a device rendered force in every tick; end the program that commands, or take its objects away")]
    AlwaysForce,
    /// The driver ended.
    #[error("the driver has ended; what was gathered until then is kept by --save-pairs")]
    DriverGone,
    /// The driver tells nothing.
    #[error("the driver has told nothing for {0} s; it may be stopped (see `ps`)")]
    Silent(u64),
}

impl LiveError {
    /// Whether it went wrong after it had begun.
    pub(super) fn is_fault(&self) -> bool {
        matches!(self, Self::DriverGone | Self::Silent(_))
    }
}

fn list(names: &[String]) -> String {
    let numbered = names.iter().enumerate().map(|(index, name)| format!("{index} ({name})"));
    numbered.collect::<Vec<_>>().join(", ")
}

/// A twentieth of a workspace's edge apart, and twenty times the accuracy of the tool that joins the end points.
const STEP_M: f64 = 0.002;
/// Force (N) beyond which a tick is not kept: it would bend a stiff arm (1 N/mm) by 0.05 mm.
const MOST_FORCE_N: f64 = 0.05;
const NAP: Duration = Duration::from_millis(5);
/// A driver tells a frame in each tick.
const SILENCE: Duration = Duration::from_secs(5);
/// Time of silence after which it is told: far more than a busy machine makes of a tick.
const WARNING: Duration = Duration::from_millis(500);

/// Gathers until there is enough, time is up, or a signal asks for the end.
pub(super) fn gather(wish: &Wish, signals: &StopSignals) -> Gathered {
    let mut session = match Session::open(wish) {
        Ok(session) => session,
        Err(error) => return Gathered { pairs: Vec::new(), end: Err(error) },
    };
    let end = session.run(wish.seconds, signals);
    Gathered { pairs: session.gathering.pairs().to_vec(), end }
}

struct Session {
    attachment: Attachment,
    devices: [usize; 2],
    gathering: Gathering,
    seen: Option<u64>,
    /// Whether each device ever knew where it is.
    was_valid: [bool; 2],
    was_free: bool,
    has_warned: bool,
    line: StatusLine,
}

impl Session {
    fn open(wish: &Wish) -> Result<Self, LiveError> {
        let late =
            "phantom3 calibrate: the driver has not answered yet; it may be stopped (see `ps`), waiting";
        let attachment =
            say_line_if_late(late.into(), || client::observe(&wish.socket, "phantom3 calibrate"))?;
        let names: Vec<String> =
            attachment.driver.info().devices.iter().map(|device| device.name.clone()).collect();
        let devices = [wish.fiducial, wish.other];
        if let Some(wanted) = devices.into_iter().find(|index| *index >= names.len()) {
            return Err(LiveError::NoDevice { wanted, names });
        }
        say(format_args!(
            "hold the end points of {} and {} together and move them through all the space that both reach; \
             Ctrl-C ends it before its time",
            names[devices[0]], names[devices[1]]
        ));
        Ok(Self {
            attachment,
            devices,
            gathering: Gathering::new(STEP_M),
            seen: None,
            was_valid: [false; 2],
            was_free: false,
            has_warned: false,
            line: StatusLine::default(),
        })
    }

    fn run(&mut self, seconds: f64, signals: &StopSignals) -> Result<(), LiveError> {
        let begun = Instant::now();
        let mut told = Instant::now();
        let mut is_warned = false;
        let mut coverage = self.gathering.coverage();
        while begun.elapsed().as_secs_f64() < seconds
            && signals.requested().is_none()
            && !coverage.is_enough()
        {
            if self.take_frames() {
                told = Instant::now();
                is_warned = false;
            } else if !self.attachment.connection.is_open() {
                return Err(LiveError::DriverGone);
            } else if told.elapsed() > SILENCE {
                return Err(LiveError::Silent(SILENCE.as_secs()));
            } else if told.elapsed() > WARNING && !is_warned {
                is_warned = true;
                self.line.end();
                say(format_args!(
                    "phantom3 calibrate: the driver has told nothing for {} ms; it may be stopped (see `ps`), looking on",
                    WARNING.as_millis()
                ));
            }
            if self.gathering.pairs().len() > coverage.count {
                coverage = self.gathering.coverage();
            }
            if !is_warned {
                self.line.show(|| advice(&coverage));
            }
            std::thread::sleep(NAP);
        }
        self.line.end();
        self.judge()
    }

    /// An empty harvest has a reason that is worth more than "too few pairs".
    fn judge(&self) -> Result<(), LiveError> {
        let lost = (0..2).find(|which| !self.was_valid[*which]);
        match lost {
            Some(which) => Err(LiveError::NotZeroed(self.devices[which])),
            None if !self.was_free => Err(LiveError::AlwaysForce),
            None => Ok(()),
        }
    }

    /// Takes the frames since the last time. Says whether there was any.
    fn take_frames(&mut self) -> bool {
        let Some(latest) = self.attachment.driver.latest_tick() else { return false };
        let first =
            self.seen.map_or(latest, |seen| (seen + 1).max(latest.saturating_sub(RING_FRAMES as u64)));
        if first > latest {
            return false;
        }
        let mut frame: Frame = bytemuck::Zeroable::zeroed();
        for tick in first..=latest {
            match read(&self.attachment.driver, tick, &mut frame) {
                Ok(()) => self.take(&frame),
                // Deadlines that were skipped have no frame; what was overwritten is gone.
                Err(
                    FrameUnavailable::NotYet(_)
                    | FrameUnavailable::Overwritten(_)
                    | FrameUnavailable::Torn(_),
                ) => {}
            }
        }
        self.seen = Some(latest);
        true
    }

    fn take(&mut self, frame: &Frame) {
        if frame.lease != 0 && !self.has_warned {
            self.has_warned = true;
            self.line.end();
            say(format_args!(
                "phantom3 calibrate: somebody commands the devices (lease {}); ticks with force are left out, \
                 since forces pull the end points apart and bend the arms",
                frame.lease
            ));
        }
        let present = frame.present_devices();
        let [Some(fiducial), Some(other)] = self.devices.map(|index| present.get(index)) else { return };
        let is_valid = [fiducial, other].map(|device| device.flags & DEVICE_POSITION_VALID != 0);
        for (was, is) in self.was_valid.iter_mut().zip(is_valid) {
            *was |= is;
        }
        let is_free = [fiducial, other].into_iter().all(|device| force_n(device) <= MOST_FORCE_N);
        self.was_free |= is_free;
        if is_free && is_valid == [true, true] {
            let place = |device: &DeviceFrame| Vector3::from(device.position_m_measured);
            self.gathering.offer(place(fiducial), place(other));
        }
    }
}

/// A frame that is half written is there a moment later.
fn read(driver: &DriverView, tick: u64, frame: &mut Frame) -> Result<(), FrameUnavailable> {
    const TRIES: usize = 4;
    let mut result = driver.read_frame(tick, frame);
    for _ in 1..TRIES {
        if !matches!(result, Err(FrameUnavailable::Torn(_))) {
            break;
        }
        result = driver.read_frame(tick, frame);
    }
    result
}

/// What is not finite counts as a force: nothing is known.
fn force_n(device: &DeviceFrame) -> f64 {
    let force = Vector3::from(device.force_on_user_n_applied).norm();
    if force.is_finite() { force } else { f64::INFINITY }
}

/// How far it is, and what to do next.
fn advice(coverage: &Coverage) -> String {
    const WAYS: [&str; 3] = ["left and right (x)", "up and down (y)", "forth and back (z)"];
    let [a, b, c] = coverage.rms_m.map(|extent| extent * 1e3);
    let next = match coverage.wanting_axis() {
        _ if coverage.count == 0 => "move the end points".into(),
        Some(axis) => format!("move more {} of the fiducial", WAYS[axis]),
        None => "go on, to places where you have not been".into(),
    };
    format!("{:5} pairs, extent {a:.0}, {b:.0}, {c:.0} mm: {next}", coverage.count)
}
