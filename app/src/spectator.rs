//! A window on a run: tells it what happens, and does what people there ask for.
//!
//! Model: the slow side's turn. Rows come in from the fast thread's queue; the window is told of them some sixty times a
//! second, and what it asks for becomes orders, as if somebody had written them.

use crate::control::desk::Desk;
use crate::moments::Moments;
use crate::row::{BodyRow, Row};
use nalgebra::Vector3;
use std::time::{Duration, Instant};
use view::{Ask, Glimpse, News, OpenWindow, Sample};

/// Between two glimpses.
const GLIMPSE: Duration = Duration::from_millis(12);

/// Who looks on.
pub struct Spectator {
    window: OpenWindow,
    moments: Moments,
    samples: Vec<Sample>,
    newest: Option<(Row, Vec<BodyRow>)>,
    told: Instant,
    wants_end: bool,
}

impl Spectator {
    /// For a window that is open.
    pub fn new(window: OpenWindow, moments: Moments) -> Self {
        Self { window, moments, samples: Vec::new(), newest: None, told: Instant::now(), wants_end: false }
    }

    /// A tick, as it began.
    pub fn look(&mut self, row: &Row, bodies: &[BodyRow]) {
        let fingers = row.fingers[..self.moments.fingers()].iter();
        let depth_m = |hip: &Vector3<f64>, god: Vector3<f64>| (hip - god).norm();
        let felt = fingers
            .map(|finger| [finger.force_on_user.norm(), depth_m(&finger.hip, finger.god_object)])
            .collect();
        self.samples.push(Sample { t_s: self.moments.time_s(row), fingers: felt });
        let newest = self.newest.get_or_insert_with(|| (*row, Vec::new()));
        newest.0 = *row;
        newest.1.clear();
        newest.1.extend_from_slice(bodies);
    }

    /// The slow side's turn.
    pub fn step(&mut self, desk: Option<&mut Desk>) {
        if self.told.elapsed() >= GLIMPSE
            && let Some((row, bodies)) = &self.newest
        {
            self.told = Instant::now();
            let moment = self.moments.moment(row, bodies);
            let samples = std::mem::take(&mut self.samples);
            self.window.tell(News::Glimpse(Box::new(Glimpse { moment, samples, ..Glimpse::default() })));
        }
        self.answer(desk);
    }

    fn answer(&mut self, mut desk: Option<&mut Desk>) {
        let asked: Vec<Ask> = self.window.asked().collect();
        for ask in asked {
            match ask {
                Ask::Order(line) => {
                    let done = desk.as_mut().map(|desk| desk.order(0, &line));
                    if let Some(Err(error)) = done {
                        self.window.tell(News::Text(error));
                    }
                }
                Ask::Record(_) => {}
                Ask::End => self.wants_end = true,
            }
        }
        self.wants_end |= !self.window.is_open();
    }

    /// Whether the run shall end.
    pub fn wants_end(&self) -> bool {
        self.wants_end
    }
}
