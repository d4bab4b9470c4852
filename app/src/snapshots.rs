//! Pictures of a run while it goes on: single ones, and one after the other for a film.
//!
//! Model: whoever takes the rows on the slow side looks at each ([`Snapshots::look`]); when a picture is due, the moment goes
//! to a thread of its own, which draws without a display and writes PNG. On a clock that waits it is waited for, as rows of
//! a recording are: the first wait in vain is the last, pictures behind it are missing, and that is a fault. In real time
//! nobody waits for drawing: pictures of a film that are due while the thread is busy are left out, and counted; single
//! pictures, as many as were asked for at most, are kept until there is room. A machine that cannot draw says so once, and
//! the run goes on to its end, which is then that of a fault.

mod args;
mod film_files;

pub use args::{Film, PictureArgs, Shot, Wanted};

use crate::displaced::Placed;
use crate::moments::Moments;
use crate::record::backpressure::{Progress, STUCK, Wait};
use crate::row::{BodyRow, Row};
use crate::shown::Shown;
use film_files::FilmFiles;
use io_driver::say::say;
use rt_core::limits;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;
use view::{Eyes, Moment, Stage, Studio};
use world::SceneCamera;

/// So many moments wait to be drawn.
const WAITING: usize = 4;
/// Between two looks at a thread that is waited for.
const TURN: Duration = Duration::from_millis(1);

/// Who takes the pictures of a run.
pub struct Snapshots {
    /// In the order of their times.
    shots: Vec<Shot>,
    film: Option<Film>,
    files: Option<FilmFiles>,
    /// Pictures of the film that were due.
    due: u64,
    left_out: u64,
    waits: bool,
    patience: Duration,
    period_s: f64,
    moments: Moments,
    out: Option<SyncSender<Work>>,
    /// In real time, what found no room: single pictures, and between two of them no more than one scene.
    pending: VecDeque<Work>,
    /// Pictures that were due and not left out.
    asked: u64,
    /// Why nothing is tried any more, which has been told.
    given_up: Option<String>,
    progress: Arc<Progress>,
    written: Arc<AtomicU64>,
    thread: Option<JoinHandle<Drawn>>,
}

/// What the drawing thread gets to do.
enum Work {
    /// A picture, and where to.
    Picture(Box<Moment>, PathBuf),
    /// The one of a film with this number.
    Frame(Box<Moment>, u64),
    /// Another scene goes on.
    Scene(Box<Stage>),
}

/// What became of the pictures.
#[derive(Debug, Clone, Default)]
pub struct Drawn {
    /// How many were written.
    pub written: u64,
    /// Who drew them.
    pub renderer: String,
    /// Pictures of a film that were left out: drawing was too slow.
    pub left_out: u64,
    /// Single pictures whose time did not come.
    pub not_reached: usize,
    /// Pictures of an earlier, longer film in the same directory.
    pub older: usize,
    /// Pictures of another film in the places of those that were left out or are missing.
    pub strange: u64,
    /// Pictures that a fault cost.
    pub missing: u64,
    /// Fault that has been told: a file that could not be written, a limit, a machine that cannot draw.
    pub failure: Option<String>,
}

impl std::fmt::Display for Drawn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.written)?;
        if !self.renderer.is_empty() {
            write!(f, ", drawn by {}", self.renderer)?;
        }
        if self.left_out > 0 {
            write!(f, ", {} LEFT OUT: drawing was too slow", self.left_out)?;
        }
        if self.not_reached > 0 {
            write!(f, ", {} NOT TAKEN: the run ended before", self.not_reached)?;
        }
        if self.older > 0 {
            write!(f, ", {} OLDER ones of another film behind them", self.older)?;
        }
        if self.strange > 0 {
            write!(f, ", {} OLDER ones of another film AMONG them: they cannot be removed", self.strange)?;
        }
        if self.missing > 0 {
            write!(f, ", {} MISSING", self.missing)?;
        }
        if self.failure.is_some() {
            write!(f, " NOT COMPLETE: see the message above")?;
        }
        Ok(())
    }
}

impl Snapshots {
    /// Begins to take what is wanted of this stage. `waits`: the run's clock waits for the drawing.
    ///
    /// # Errors
    /// A camera that the scene does not have, a directory that cannot be made or has another run's film, in words.
    pub fn start(
        wanted: &Wanted,
        Shown { stage, moments }: Shown,
        period_ns: u64,
        waits: bool,
    ) -> Result<Self, String> {
        camera_of(&stage, wanted.camera.as_deref())?;
        let claimed = wanted.film.as_ref().map(|film| film_files::claim(&film.directory)).transpose()?;
        let look = wanted.clone();
        let files = wanted.film.as_ref().zip(claimed).map(|(film, claim)| FilmFiles::of(film, claim));
        let own = files.clone();
        let draw = move |work: Receiver<Work>, steps: &Progress, written: &AtomicU64| {
            draw_all(stage, &look, own.as_ref(), &work, (steps, written))
        };
        let snapshots = Self::drawn_by(draw, wanted, moments, period_ns, (waits, STUCK))?;
        Ok(Self { files, ..snapshots })
    }

    /// The same with somebody else who draws.
    fn drawn_by(
        draw: impl FnOnce(Receiver<Work>, &Progress, &AtomicU64) -> Drawn + Send + 'static,
        wanted: &Wanted,
        moments: Moments,
        period_ns: u64,
        (waits, patience): (bool, Duration),
    ) -> Result<Self, String> {
        let (out, to_draw) = sync_channel(WAITING);
        let progress = Arc::new(Progress::default());
        let written = Arc::new(AtomicU64::new(0));
        let told = (Arc::clone(&progress), Arc::clone(&written));
        let thread = std::thread::Builder::new()
            .name("pictures".into())
            .spawn(move || draw(to_draw, &told.0, &told.1))
            .map_err(|error| format!("cannot draw pictures: {}", limits::no_thread(&error)))?;
        let mut shots = wanted.shots.clone();
        shots.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        Ok(Self {
            shots,
            film: wanted.film.clone(),
            files: None,
            due: 0,
            left_out: 0,
            waits,
            patience,
            period_s: period_ns as f64 / 1e9,
            moments,
            out: Some(out),
            pending: VecDeque::new(),
            asked: 0,
            given_up: None,
            progress,
            written,
            thread: Some(thread),
        })
    }

    /// A tick, as it began.
    pub fn look(&mut self, row: &Row, bodies: &[BodyRow], placed: &[Placed]) {
        self.give_pending();
        // The tick that is nearest to the time.
        let now_s = (row.run_tick as f64 + 0.5) * self.period_s;
        while self.shots.first().is_some_and(|shot| shot.t_s < now_s) {
            let shot = self.shots.remove(0);
            let moment = self.moments.moment(row, bodies, placed);
            self.asked += 1;
            self.keep(Work::Picture(Box::new(moment), shot.file));
        }
        if let Some(Film { fps, .. }) = &self.film
            && self.due as f64 / fps < now_s
        {
            let number = self.due;
            self.due += 1;
            let moment = self.moments.moment(row, bodies, placed);
            self.give_to_film(Work::Frame(Box::new(moment), number));
        }
    }

    /// Another scene goes on: pictures are of that from now on, and of its first camera where it has none of that name.
    pub fn go_on(&mut self, Shown { stage, moments }: Shown) {
        self.moments = moments;
        if let Some(Work::Scene(_)) = self.pending.back() {
            self.pending.pop_back();
        }
        self.keep(Work::Scene(Box::new(stage)));
    }

    /// Gives what must not be left out: at once on a clock that waits, else when there is room.
    fn keep(&mut self, work: Work) {
        if self.waits {
            self.give(work);
        } else {
            self.pending.push_back(work);
            self.give_pending();
        }
    }

    /// Gives a picture of a film.
    fn give_to_film(&mut self, work: Work) {
        if self.waits {
            self.asked += 1;
            return self.give(work);
        }
        // None overtakes a scene that waits.
        let has_room = self.pending.is_empty()
            && self.out.as_ref().is_some_and(|out| !matches!(out.try_send(work), Err(TrySendError::Full(_))));
        let count = if has_room { &mut self.asked } else { &mut self.left_out };
        *count += 1;
    }

    /// Gives what waits, as far as there is room.
    fn give_pending(&mut self) {
        while let (Some(out), Some(work)) = (&self.out, self.pending.pop_front()) {
            if let Err(TrySendError::Full(work)) = out.try_send(work) {
                return self.pending.push_front(work);
            }
        }
    }

    /// Gives work to the thread, for whose room is waited as long as it gets on.
    fn give(&mut self, mut work: Work) {
        let mut wait = Wait::begin(&self.progress);
        while let Some(out) = &self.out {
            match out.try_send(work) {
                Err(TrySendError::Full(back)) => work = back,
                // A thread that has ended has said why.
                Ok(()) | Err(TrySendError::Disconnected(_)) => return,
            }
            if wait.is_in_vain(&self.progress, self.patience) {
                self.give_up();
            }
            std::thread::sleep(TURN);
        }
    }

    /// Nothing is tried any more.
    fn give_up(&mut self) {
        self.out = None;
        let stuck = format!("no picture was written for {} s", self.patience.as_secs());
        say(format_args!("phantom3: {stuck}; those that are missing are left out"));
        self.given_up = Some(stuck);
    }

    /// Waits for the last picture, and says what became of all.
    pub fn finish(mut self) -> Drawn {
        while let Some(work) = self.pending.pop_front() {
            self.give(work);
        }
        drop(self.out.take());
        let drawn = self.thread.take().map_or_else(Drawn::default, |thread| self.wait_for(thread));
        let (mut older, mut strange) = (0, 0);
        if let Some(files) = &self.files {
            // A disk that stands still would hold up the end.
            if self.given_up.is_none() {
                files.settle(self.due);
            }
            (older, strange) = (files.older(), files.stuck());
        }
        drop(self.files.take());
        let failure = self.given_up.or(drawn.failure);
        let missing = if failure.is_some() { self.asked.saturating_sub(drawn.written) } else { 0 };
        let (left_out, not_reached) = (self.left_out, self.shots.len());
        Drawn { left_out, not_reached, older, strange, missing, failure, ..drawn }
    }

    fn wait_for(&mut self, thread: JoinHandle<Drawn>) -> Drawn {
        let mut wait = Wait::begin(&self.progress);
        while !thread.is_finished() {
            if wait.is_in_vain(&self.progress, self.patience) {
                if self.given_up.is_none() {
                    self.give_up();
                }
                return Drawn { written: self.written.load(Ordering::Relaxed), ..Drawn::default() };
            }
            std::thread::sleep(TURN);
        }
        thread.join().unwrap_or_else(|_| {
            let failure = "the drawing ended by itself".to_owned();
            say(format_args!("phantom3: {failure}; pictures behind it are missing"));
            let written = self.written.load(Ordering::Relaxed);
            Drawn { written, failure: Some(failure), ..Drawn::default() }
        })
    }
}

fn camera_of(stage: &Stage, name: Option<&str>) -> Result<SceneCamera, String> {
    let Some(name) = name else {
        return stage.cameras.first().cloned().ok_or_else(|| "there is no camera".into());
    };
    stage.cameras.iter().find(|camera| camera.name == name).cloned().ok_or_else(|| {
        let all: Vec<&str> = stage.cameras.iter().map(|camera| camera.name.as_str()).collect();
        format!("--camera {name}: the scene has no such camera; allowed: {}", all.join(", "))
    })
}

/// Who draws one scene.
struct Drawer {
    studio: Studio,
    camera: SceneCamera,
    eyes: Eyes,
}

impl Drawer {
    /// Or what is missing.
    fn new(stage: &Stage, wanted: &Wanted) -> Result<Self, String> {
        for line in &stage.not_drawn {
            say(format_args!("phantom3: not in pictures as it should be: {line}"));
        }
        let camera = camera_of(stage, wanted.camera.as_deref()).or_else(|_| camera_of(stage, None));
        let studio = Studio::new(stage, wanted.size).map_err(|missing| missing.to_string())?;
        Ok(Self { studio, camera: camera?, eyes: wanted.eyes })
    }
}

/// Tells `steps` of each scene that is made ready, and of each picture that is drawn and that is saved.
fn draw_all(
    first: Stage,
    wanted: &Wanted,
    film: Option<&FilmFiles>,
    work: &Receiver<Work>,
    (steps, written): (&Progress, &AtomicU64),
) -> Drawn {
    let mut drawn = Drawn::default();
    let (mut next, mut drawer) = (Some(first), None);
    loop {
        if let Some(stage) = next.take() {
            // One graphics context at a time.
            drop(drawer.take());
            match Drawer::new(&stage, wanted) {
                Ok(made) => {
                    drawer = Some(made);
                    steps.take();
                }
                Err(missing) => {
                    say(format_args!("phantom3: {missing}"));
                    drawn.failure = Some(missing);
                    // Nobody is to wait for room.
                    work.iter().for_each(drop);
                    return drawn;
                }
            }
        }
        let (moment, file, number) = match work.recv() {
            Ok(Work::Scene(stage)) => {
                next = Some(*stage);
                continue;
            }
            Ok(Work::Picture(moment, file)) => (moment, file, None),
            Ok(Work::Frame(moment, number)) => {
                let Some(film) = film else { continue };
                (moment, film.name(number), Some((film, number)))
            }
            Err(_) => return drawn,
        };
        let Some(Drawer { studio, camera, eyes }) = &mut drawer else { continue };
        drawn.renderer = studio.renderer().to_owned();
        let picture = studio.take(&moment, camera, eyes);
        steps.take();
        let saved = match number {
            Some((film, number)) => {
                film.ready(number).and_then(|()| picture.save(&file)).and_then(|()| film.written(number))
            }
            None => picture.save(&file),
        };
        drawn.note(&file, saved);
        written.store(drawn.written, Ordering::Relaxed);
        steps.take();
    }
}

impl Drawn {
    /// True once it is written.
    fn note(&mut self, file: &Path, saved: std::io::Result<()>) -> bool {
        let Err(error) = saved else {
            self.written += 1;
            return true;
        };
        if self.failure.is_none() {
            say(format_args!("phantom3: the picture {} cannot be written: {error}", file.display()));
        }
        self.failure = Some(error.to_string());
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use patience::prelude::*;
    use std::sync::mpsc::{Sender, channel};

    /// Draws nothing, and saves a picture whenever it is told to.
    fn idle(turns: Receiver<()>) -> impl FnOnce(Receiver<Work>, &Progress, &AtomicU64) -> Drawn + Send {
        move |work, steps, written| {
            let mut drawn = Drawn::default();
            while turns.bounded_recv().is_ok()
                && let Ok(work) = work.bounded_recv()
            {
                drawn.written += u64::from(matches!(work, Work::Picture(..) | Work::Frame(..)));
                written.store(drawn.written, Ordering::Relaxed);
                steps.take();
            }
            drawn
        }
    }

    fn wanted(shots: usize, film: bool) -> Wanted {
        let shot = |index| Shot { t_s: index as f64 * 1e-3, file: format!("{index}.png").into() };
        let film = film.then(|| Film { directory: "film".into(), fps: 1000.0 });
        let shots = (0..shots).map(shot).collect();
        Wanted { shots, film, size: [16, 16], camera: None, eyes: Eyes::default() }
    }

    fn start(wanted: &Wanted, waits: bool, patience_ms: u64) -> (Snapshots, Sender<()>) {
        let (turn, turns) = channel();
        let how = (waits, Duration::from_millis(patience_ms));
        let moments = Moments::new(1, Vec::new(), Vec::new(), 1_000_000);
        (Snapshots::drawn_by(idle(turns), wanted, moments, 1_000_000, how).expect("a thread"), turn)
    }

    fn look(snapshots: &mut Snapshots, ticks: std::ops::Range<u64>) {
        ticks.for_each(|run_tick| snapshots.look(&Row { run_tick, ..Row::empty() }, &[], &[]));
    }

    #[test]
    fn behind_a_wait_in_vain_no_picture_is_tried_also_if_the_reader_comes_back() {
        let (mut snapshots, turn) = start(&wanted(0, true), true, 300);
        let room = WAITING as u64;
        look(&mut snapshots, 0..room + 3);
        for _ in 0..room {
            turn.send(()).expect("a thread");
        }
        let progress = Arc::clone(&snapshots.progress);
        patience::until("an empty queue", || progress.taken() == room);
        look(&mut snapshots, room + 3..room + 10);
        drop(turn);
        let drawn = snapshots.finish();
        assert_eq!((drawn.written, drawn.missing, drawn.left_out), (room, 10, 0), "{drawn:?}");
        assert!(drawn.failure.is_some(), "{drawn:?}");
        assert_eq!(drawn.to_string(), "4, 10 MISSING NOT COMPLETE: see the message above");
    }

    #[test]
    fn in_real_time_nobody_waits_for_drawing_and_single_pictures_come_when_there_is_room() {
        let (mut snapshots, turn) = start(&wanted(50, true), false, 60_000);
        let begun = std::time::Instant::now();
        look(&mut snapshots, 0..60);
        // A wait for the thread, which does nothing, would be a minute long.
        assert!(begun.elapsed() < Duration::from_secs(30), "{:?}", begun.elapsed());
        assert_eq!(snapshots.pending.len(), 50 - WAITING + 2, "two pictures of the film found room at first");
        for _ in 0..200 {
            turn.send(()).expect("a thread");
        }
        let drawn = snapshots.finish();
        assert_eq!((drawn.written, drawn.left_out, drawn.missing), (52, 58, 0), "{drawn:?}");
        assert!(drawn.failure.is_none(), "{drawn:?}");
    }

    #[test]
    fn a_single_picture_that_is_never_written_is_a_fault_at_the_end() {
        let (mut snapshots, turn) = start(&wanted(20, false), false, 300);
        look(&mut snapshots, 0..30);
        let drawn = snapshots.finish();
        drop(turn);
        assert_eq!((drawn.written, drawn.missing, drawn.not_reached), (0, 20, 0), "{drawn:?}");
        assert!(drawn.failure.is_some(), "{drawn:?}");
    }

    #[test]
    fn a_drawing_thread_that_panics_is_a_fault_with_the_pictures_that_were_written() {
        let draw = |work: Receiver<Work>, steps: &Progress, written: &AtomicU64| {
            for _ in work.iter().take(3) {
                written.fetch_add(1, Ordering::Relaxed);
                steps.take();
            }
            panic!("the graphics library is gone");
        };
        let moments = Moments::new(1, Vec::new(), Vec::new(), 1_000_000);
        let snapshots = Snapshots::drawn_by(draw, &wanted(0, true), moments, 1_000_000, (true, STUCK));
        let mut snapshots = snapshots.expect("a thread");
        look(&mut snapshots, 0..50);
        let drawn = snapshots.finish();
        assert_eq!((drawn.written, drawn.missing), (3, 47), "{drawn:?}");
        assert!(drawn.failure.is_some(), "{drawn:?}");
    }
}
