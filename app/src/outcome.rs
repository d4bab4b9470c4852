//! How a run can end.

use crate::fast_loop::Tally;
use crate::not_zeroed;
use crate::plausible::Implausible;
use crate::recording::RecordingError;
use io_driver::open::OpenError;
use io_driver::say::say;
use shm_abi::FaultReason;
use shm_abi::client::AttachError;
use shm_abi::segment::SegmentError;
use std::borrow::Cow;
use std::path::Path;
use std::process::ExitCode;
use thiserror::Error;
use view::NoWindow;

/// Reason for the end of something that was begun.
#[derive(Debug)]
pub enum Stop {
    /// It is over.
    Finished,
    /// Nobody looks on any more: its window was closed, or the reader of its standard output.
    Closed,
    /// This signal asked for it.
    Signal(i32),
    /// It could not go on.
    Failed(RunFailure),
}

impl Stop {
    /// The same, of a run, whose failure is told at once: whoever reads its recordings may take long. One that failed before it
    /// answered a tick has nothing to report.
    ///
    /// # Errors
    /// That failure.
    pub fn of_run(self, tally: &Tally) -> Result<Self, RunFailure> {
        match self {
            Self::Failed(failure) if tally.answered == 0 => Err(failure),
            Self::Failed(failure) => {
                say(format_args!("phantom3: {failure}"));
                Ok(Self::Failed(failure))
            }
            other => Ok(other),
        }
    }

    /// Tells a signal; a failure has been told. Returns the exit status, which after a signal is 128 and its number.
    pub fn conclude(self) -> ExitCode {
        match self {
            Self::Finished | Self::Closed => ExitCode::SUCCESS,
            Self::Signal(signal) => {
                say(format_args!("phantom3: ended by signal {signal} before its time"));
                ExitCode::from(128u8.saturating_add(u8::try_from(signal).unwrap_or(0)))
            }
            Self::Failed(failure) => ExitCode::from(failure.exit_status()),
        }
    }
}

/// What went wrong.
#[derive(Debug, Error)]
pub enum RunFailure {
    /// It could not be started.
    #[error("{0}")]
    Start(String),
    /// Nobody could see where the hand goes.
    #[error(
        "{0}; whoever moves a hand with a mouse needs one: see `phantom3 run --help` for hands that follow a file"
    )]
    NoWindow(#[from] NoWindow),
    /// The driver could not be attached to.
    #[error(transparent)]
    Attach(#[from] AttachError),
    /// There is no shared memory.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// A device of the virtual clock's driver cannot be had.
    #[error(transparent)]
    Device(#[from] OpenError),
    /// The driver is in its fault state.
    #[error("the driver is in its fault state: {0}; the motors are off")]
    DriverFault(Cow<'static, str>),
    /// The driver that somebody runs is in its fault state.
    #[error(
        "the driver is in its fault state: {why}; the motors are off; find the cause, then `io-driver clear-fault{place}` (or \
         `phantom3 driver clear-fault{place}`), and start a new run"
    )]
    RunningDriverFault {
        /// The fault.
        why: Cow<'static, str>,
        /// Option that names the driver, where it needs one.
        place: String,
    },
    /// The driver is gone.
    #[error("the driver is gone: {0}")]
    DriverGone(String),
    /// Another driver came in its place.
    #[error(
        "the driver that came back is not the one that this run began with: {0}; start that one again, and then a new run"
    )]
    OtherDriver(String),
    /// Somebody ended the lease of a run whose driver goes on.
    #[error(
        "this run's lease has ended, and its force with it; the driver goes on for whoever commands next: somebody ended it \
         (`io-driver end-lease`), or the driver gave it to somebody else or could not put it in force, which it says in its log"
    )]
    LeaseEnded,
    /// The driver publishes no frames any more.
    #[error("the driver has published no frame for {seconds} s though its process lives; it may be stopped")]
    DriverSilent {
        /// For how long.
        seconds: f64,
    },
    /// The driver tells what no sound driver tells.
    #[error("the driver tells what cannot be: {0}; do not trust this driver, end it and start it again")]
    DriverImplausible(#[from] Implausible),
    /// What a study found cannot be written.
    #[error("{0}")]
    Results(String),
    /// The recording cannot be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Refusal of a run for which a thread could not be started.
pub fn no_thread(whose: &str, error: &std::io::Error) -> RunFailure {
    RunFailure::Start(format!("cannot start {whose}: {}", rt_core::limits::no_thread(error)))
}

impl RunFailure {
    /// The fault behind a word of the frame.
    pub fn driver_fault(word: u64) -> Self {
        Self::DriverFault(FaultReason::sentence_for(word))
    }

    /// The same of a driver that somebody runs at this socket: it goes on, and its fault stays.
    pub fn driver_fault_at(word: u64, socket: &Path) -> Self {
        Self::RunningDriverFault { why: FaultReason::sentence_for(word), place: not_zeroed::place(socket) }
    }

    /// Tells it; returns the exit status.
    pub fn conclude(&self) -> ExitCode {
        say(format_args!("phantom3: {self}"));
        ExitCode::from(self.exit_status())
    }

    /// The exit status of the run contract: 2 nothing was started, 3 a fault during the run.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Start(_) | Self::NoWindow(_) | Self::Attach(_) | Self::Segment(_) | Self::Device(_) => 2,
            Self::Recording(error) if error.is_of_the_start() => 2,
            _ => 3,
        }
    }
}
