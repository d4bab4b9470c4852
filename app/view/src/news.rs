//! What goes to and fro between a run and a window on it.
//!
//! Model: some hundred times a second the run tells a [`Glimpse`]: where everything is, every tick since the last one, and
//! how the run goes. The window asks for what people want by [`Ask`]s, and pulls the fingers of hands that have no hardware.
//! Neither waits for the other.

use crate::hand::MouseHand;
use crate::moment::Moment;
use crate::stage::Stage;
use crate::text::Note;
use nalgebra::{UnitQuaternion, Vector3};

/// What a run tells.
#[derive(Debug, Clone)]
pub enum News {
    /// How it goes.
    Glimpse(Box<Glimpse>),
    /// Another scene goes on.
    Scene(Box<Stage>),
    /// Something to read.
    Text(Note),
    /// It is over: the window closes.
    Over,
}

/// A run at one time.
#[derive(Debug, Clone, Default)]
pub struct Glimpse {
    /// Where everything is.
    pub moment: Moment,
    /// Of each tick since the glimpse before, in order.
    pub samples: Vec<Sample>,
    /// How the run goes.
    pub status: Status,
}

/// What is drawn over time, of one tick.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sample {
    /// Since the first tick at full authority (s).
    pub t_s: f64,
    /// Of each finger, the force on the user (N) and how deep the HIP is below what it touches (m).
    pub fingers: Vec<[f64; 2]>,
}

/// How a run goes. What can be told only of real time is 0 on other clocks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Status {
    /// Ticks per second, as they came.
    pub rate_hz: f64,
    /// Deadlines that the driver skipped since the run began.
    pub overruns: u64,
    /// Ticks since then that were not answered in time.
    pub late: u64,
    /// From the reading of the devices to the reply, of the ticks of the last second (ns): median, 99 of 100, and the worst.
    pub latency_ns: Option<[u64; 3]>,
    /// Entities that can move, in the fast and in the slow list.
    pub lists: [usize; 2],
    /// Of each entity that is in the slow list, how long ago it stood where it is shown (ms); empty: none is.
    pub slow_ms: Vec<Option<u64>>,
    /// Of each finger, the entities that it touches.
    pub felt: Vec<Vec<usize>>,
    /// Pairs of entities that touch each other, in ascending order.
    pub touching: Vec<[usize; 2]>,
    /// Where it is being recorded on request, if it is.
    pub recording: Option<String>,
    /// Whether things stand still.
    pub is_paused: bool,
    /// True while all that moves is more than a tick has time for.
    pub is_overloaded: bool,
}

/// What people at a window want.
#[derive(Debug, Clone, PartialEq)]
pub enum Ask {
    /// An order, in the words of `run --orders -`.
    Order(String),
    /// A key that means nothing here went down or up: the run is to tell of it.
    Key(KeyChange),
    /// A recording shall begin, or end.
    Record(bool),
    /// The run shall end.
    End,
}

/// A key that went down or up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyChange {
    /// Which, by the number that X11 gives its symbol.
    pub code: u32,
    /// Whether it went down.
    pub is_pressed: bool,
    /// When, on the system's monotonic clock (ns).
    pub at_ns: u64,
}

/// Where a hand without hardware wants a finger to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Of its tip, in the world (m).
    pub place: Vector3<f64>,
    /// `R_WF` of its last link.
    pub orientation: UnitQuaternion<f64>,
    /// Bit `i`: button `i` is pressed.
    pub buttons: u32,
}

/// Who pulls fingers without hardware where a hand at a window wants them.
pub trait Reins: Send {
    /// The hand as it begins.
    fn hand(&self) -> MouseHand;
    /// The wishes of all fingers.
    fn pull(&mut self, wishes: &[Wish]);
}
