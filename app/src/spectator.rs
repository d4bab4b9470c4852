//! A window on a run: tells it what happens, and does what people there ask for.
//!
//! Model: the slow side's turn. Rows come in from the fast thread's queue; the window is told of them some sixty times a
//! second, and what it asks for becomes orders, as if somebody had written them.

use crate::control::desk::Desk;
use crate::displaced::Placed;
use crate::moments::Moments;
use crate::row::{BodyRow, Row};
use crate::shown::Shown;
use nalgebra::Vector3;
use std::time::{Duration, Instant};
use view::{Ask, Glimpse, News, OpenWindow, Sample};

/// Between two glimpses at least: each turn of the slow side has one.
const GLIMPSE: Duration = Duration::from_millis(8);

/// Who is told what happens, and asks for something: a window, or what stands for one.
pub trait Onlooker {
    /// Takes news, if there is time to listen.
    fn tell(&mut self, news: News);
    /// What people want.
    fn asked(&mut self) -> Vec<Ask>;
    /// Whether anybody is there still.
    fn is_open(&self) -> bool;
}

impl Onlooker for OpenWindow {
    fn tell(&mut self, news: News) {
        OpenWindow::tell(self, news);
    }

    fn asked(&mut self) -> Vec<Ask> {
        OpenWindow::asked(self).collect()
    }

    fn is_open(&self) -> bool {
        OpenWindow::is_open(self)
    }
}

/// Who looks on.
pub struct Spectator {
    window: Box<dyn Onlooker>,
    pause: Duration,
    moments: Moments,
    samples: Vec<Sample>,
    newest: Option<(Row, Vec<BodyRow>, Vec<Placed>)>,
    told: Instant,
    wants_end: bool,
}

impl Spectator {
    /// For a window that is open.
    pub fn new(window: impl Onlooker + 'static, moments: Moments) -> Self {
        Self {
            window: Box::new(window),
            pause: GLIMPSE,
            moments,
            samples: Vec::new(),
            newest: None,
            told: Instant::now(),
            wants_end: false,
        }
    }

    /// Told no more often than after so long.
    #[must_use]
    pub fn every(self, pause: Duration) -> Self {
        Self { pause, ..self }
    }

    /// A tick, as it began.
    pub fn look(&mut self, row: &Row) {
        let fingers = row.fingers[..self.moments.fingers()].iter();
        let depth_m = |hip: &Vector3<f64>, god: Vector3<f64>| (hip - god).norm();
        let felt = fingers
            .map(|finger| [finger.force_on_user.norm(), depth_m(&finger.hip, finger.god_object)])
            .collect();
        self.samples.push(Sample { t_s: self.moments.time_s(row), fingers: felt });
    }

    /// The newest tick, and where everything was then.
    pub fn see(&mut self, row: &Row, bodies: &[BodyRow], placed: &[Placed]) {
        let newest = self.newest.get_or_insert_with(|| (*row, Vec::new(), Vec::new()));
        newest.0 = *row;
        newest.1.clear();
        newest.1.extend_from_slice(bodies);
        newest.2.clear();
        newest.2.extend_from_slice(placed);
    }

    /// Another scene goes on.
    pub fn go_on(&mut self, Shown { stage, moments }: Shown) {
        self.moments = moments;
        self.newest = None;
        self.samples.clear();
        self.window.tell(News::Scene(Box::new(stage)));
    }

    /// The slow side's turn.
    pub fn step(&mut self, desk: Option<&mut Desk>) {
        if self.told.elapsed() >= self.pause
            && let Some((row, bodies, placed)) = &self.newest
        {
            self.told = Instant::now();
            let moment = self.moments.moment(row, bodies, placed);
            let samples = std::mem::take(&mut self.samples);
            self.window.tell(News::Glimpse(Box::new(Glimpse { moment, samples, ..Glimpse::default() })));
        }
        self.answer(desk);
    }

    fn answer(&mut self, mut desk: Option<&mut Desk>) {
        for ask in self.window.asked() {
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
