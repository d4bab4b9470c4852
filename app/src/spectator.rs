//! A window on a run: tells it what happens, and does what people there ask for.
//!
//! Model: the slow side's turn. Rows come in from the fast thread's queue; the window is told of them some sixty times a
//! second, and what it asks for becomes orders, as if somebody had written them.

mod gauge;
mod happened;
mod notes;

use crate::book::Book;
use crate::control::desk::Desk;
use crate::displaced::Placed;
use crate::moments::Moments;
use crate::row::{BodyRow, Row};
use crate::shown::Shown;
use gauge::Gauge;
use happened::Happened;
use nalgebra::Vector3;
use notes::Notes;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use view::{Ask, Glimpse, KeyChange, News, OpenWindow, Sample, Status};
use world::events::Hub;

/// Between two glimpses at least: each turn of the slow side has one.
const GLIMPSE: Duration = Duration::from_millis(8);

/// Who is told what happens, and asks for something: a window, or what stands for one.
pub trait Onlooker {
    /// Takes news, or gives them back if there is no time to listen.
    fn tell(&mut self, news: News) -> Option<News>;
    /// What people want.
    fn asked(&mut self) -> Vec<Ask>;
    /// Whether anybody is there still.
    fn is_open(&self) -> bool;
    /// Loss of the display, which nobody closed.
    fn loss(&self) -> Option<Loss> {
        None
    }
}

/// Loss of a display.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Of the window alone.
    Window,
    /// Of the window and of the hand that moved the fingers there.
    Hand,
}

impl Onlooker for OpenWindow {
    fn tell(&mut self, news: News) -> Option<News> {
        OpenWindow::tell(self, news)
    }

    fn asked(&mut self) -> Vec<Ask> {
        OpenWindow::asked(self).collect()
    }

    fn is_open(&self) -> bool {
        OpenWindow::is_open(self)
    }

    fn loss(&self) -> Option<Loss> {
        view::is_display_lost().then(|| if self.has_reins() { Loss::Hand } else { Loss::Window })
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
    happened: Happened,
    notes: Notes,
    /// What the window had no time for and has to know.
    untold: VecDeque<News>,
    /// Of a driver in a process of its own.
    gauge: Option<Gauge>,
    /// Whether the run's ticks are due by the system's clock.
    is_real_time: bool,
    wants_record: Option<bool>,
    wants_end: bool,
}

impl Spectator {
    /// For a window that is open. It hears here what happens, and finds in this book what was ordered.
    pub fn new(window: impl Onlooker + 'static, moments: Moments, hub: &mut Hub, book: Book) -> Self {
        Self {
            window: Box::new(window),
            pause: GLIMPSE,
            moments,
            samples: Vec::new(),
            newest: None,
            told: Instant::now(),
            notes: Notes::new(hub, book.clone()),
            untold: VecDeque::new(),
            happened: Happened::new(hub, book),
            gauge: None,
            is_real_time: false,
            wants_record: None,
            wants_end: false,
        }
    }

    /// From now on tells how the loop of the driver goes that listens here.
    pub fn watch_driver(&mut self, socket: PathBuf) {
        self.gauge = Some(Gauge::new(socket));
    }

    /// The run's ticks are due by the system's clock: keys have their own times.
    #[must_use]
    pub fn in_real_time(self, is_real_time: bool) -> Self {
        Self { is_real_time, ..self }
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
        self.happened.step();
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
        self.untold.push_back(News::Scene(Box::new(stage)));
    }

    /// Loss of the display.
    pub fn loss(&self) -> Option<Loss> {
        self.window.loss()
    }

    /// The slow side's turn.
    pub fn step(&mut self, recording: Option<&Path>, desk: Option<&mut Desk>) {
        if let Some(gauge) = &mut self.gauge {
            gauge.step();
        }
        self.tell_what_must_be();
        if self.told.elapsed() >= self.pause
            && self.untold.is_empty()
            && !self.samples.is_empty()
            && let Some((row, bodies, placed)) = &self.newest
        {
            self.told = Instant::now();
            let status = self.status(row, bodies, recording);
            let mut moment = self.moments.moment(row, bodies, placed);
            moment.colliding = colliding(&status.touching, self.moments.bodies());
            let samples = std::mem::take(&mut self.samples);
            self.window.tell(News::Glimpse(Box::new(Glimpse { moment, samples, status })));
        }
        self.answer(desk);
    }

    fn status(&self, row: &Row, bodies: &[BodyRow], recording: Option<&Path>) -> Status {
        let told = self.gauge.as_ref().map(Gauge::told).unwrap_or_default();
        let so_far = self.happened.so_far();
        let fingers = row.fingers[..self.moments.fingers()].iter().enumerate();
        let slow = bodies.iter().filter(|body| body.is_slow).count();
        Status {
            rate_hz: told.rate_hz,
            overruns: told.counts[0],
            late: told.counts[1],
            latency_ns: told.latency_ns,
            lists: [bodies.len() - slow, slow],
            slow_ms: if slow == 0 { Vec::new() } else { self.slow_ms(row, bodies) },
            felt: fingers
                .map(|(number, finger)| so_far.felt(number, finger.entity.map(|entity| entity as usize)))
                .collect(),
            touching: so_far.pairs().collect(),
            recording: recording.map(|path| path.display().to_string()),
            is_paused: so_far.is_paused,
            is_overloaded: so_far.is_overloaded,
        }
    }

    fn slow_ms(&self, row: &Row, bodies: &[BodyRow]) -> Vec<Option<u64>> {
        let mut slow_ms = vec![None; self.moments.entities()];
        for (body, &entity) in bodies.iter().zip(self.moments.bodies()) {
            if let Some(place) = slow_ms.get_mut(entity).filter(|_| body.is_slow) {
                *place = Some(self.moments.age_ms(row, body));
            }
        }
        slow_ms
    }

    /// Moments may be left out; other scenes, and what people are to read, may not.
    fn tell_what_must_be(&mut self) {
        self.untold.extend(self.notes.taken().map(News::Text));
        while let Some(news) = self.untold.pop_front() {
            if let Some(news) = self.window.tell(news) {
                self.untold.push_front(news);
                break;
            }
        }
    }

    fn answer(&mut self, mut desk: Option<&mut Desk>) {
        for ask in self.window.asked() {
            match ask {
                Ask::Order(line) => {
                    let done = desk.as_mut().map(|desk| desk.order_now(&line));
                    if let Some(Err(error)) = done {
                        self.untold.push_back(News::Text(error.into()));
                    }
                }
                Ask::Key(key) => {
                    let line = self.key_order(&key);
                    // What has no room is one of a thousand that wait.
                    let _ = desk.as_mut().map(|desk| desk.order_now(&line));
                }
                Ask::Record(wanted) => self.wants_record = Some(wanted),
                Ask::End => self.wants_end = true,
            }
        }
        self.wants_end |= !self.window.is_open();
    }

    /// The order that tells of a key, as of when it went down or up.
    fn key_order(&self, key: &KeyChange) -> String {
        let change = if key.is_pressed { "down" } else { "up" };
        let newest = self.newest.as_ref().filter(|_| self.is_real_time);
        match newest.map(|(row, ..)| run_time_s(row, self.moments.time_s(row), key.at_ns)) {
            Some(t_s) => format!("key {} {change} at {t_s:.6}", key.code),
            None => format!("key {} {change}", key.code),
        }
    }

    /// Whether a recording shall begin, or end, since this was last asked.
    pub fn take_record(&mut self) -> Option<bool> {
        self.wants_record.take()
    }

    /// What had been ordered by now, in words.
    pub fn ordered(&self) -> Vec<String> {
        self.happened.ordered()
    }

    /// Tells people something.
    pub fn tell(&mut self, text: String) {
        self.untold.push_back(News::Text(text.into()));
    }

    /// Whether the run shall end.
    pub fn wants_end(&self) -> bool {
        self.wants_end
    }
}

/// The run's time (s) at this time of the system's clock (ns), by a row that was due at this time of the run (s).
fn run_time_s(row: &Row, row_s: f64, at_ns: u64) -> f64 {
    let later_ns = at_ns.cast_signed() - row.due_ns.cast_signed();
    (row_s + later_ns as f64 / 1e9).max(0.0)
}

/// Those of these entities that touch another one, in ascending order.
fn colliding(pairs: &[[usize; 2]], moving: &[usize]) -> Vec<usize> {
    let mut touching: Vec<usize> = pairs.iter().flatten().copied().collect();
    touching.sort_unstable();
    touching.dedup();
    touching.retain(|entity| moving.binary_search(entity).is_ok());
    touching
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_of_the_tick_in_which_it_went_down_however_late_its_window_tells() {
        let row = Row { due_ns: 5_000_000_000, run_tick: 1200, ..Row::empty() };
        let time_s = |at_ns| run_time_s(&row, 1.2, at_ns);
        assert!((time_s(4_670_000_000) - 0.87).abs() < 1e-9, "a third of a second ago");
        assert!((time_s(5_000_400_000) - 1.2004).abs() < 1e-9, "rows come some milliseconds late");
        assert_eq!(time_s(3_000_000_000), 0.0, "before the run began");
        assert!((time_s(5_020_000_000) - time_s(5_000_000_000) - 0.02).abs() < 1e-9, "a press of 20 ms");
    }

    #[test]
    fn what_collides_is_what_can_move_and_touches_anything() {
        assert_eq!(colliding(&[[0, 4], [0, 3], [3, 4], [1, 2]], &[2, 3, 4, 7]), [2, 3, 4]);
    }
}
