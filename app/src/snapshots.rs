//! Pictures of a run while it goes on: single ones, and one after the other for a film.
//!
//! Model: whoever takes the rows on the slow side looks at each ([`Snapshots::look`]); when a picture is due, the moment goes
//! to a thread of its own, which draws without a display and writes PNG. On a clock that waits it is waited for; in real
//! time pictures of a film that are due while the thread is busy are left out, and counted. A machine that cannot draw
//! says so once, and the run goes on; a picture that cannot be written, as into a pipe that nobody reads, is waited for
//! as long as rows of a recording are.

mod args;

pub use args::{Film, PictureArgs, Shot, Wanted};

use crate::displaced::Placed;
use crate::moments::Moments;
use crate::record::backpressure::{Progress, STUCK, Wait};
use crate::row::{BodyRow, Row};
use crate::shown::Shown;
use io_driver::say::say;
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
    /// Pictures of the film that were due.
    due: u64,
    left_out: u64,
    waits: bool,
    period_s: f64,
    moments: Moments,
    out: Option<SyncSender<Work>>,
    progress: Arc<Progress>,
    written: Arc<AtomicU64>,
    thread: Option<JoinHandle<Drawn>>,
}

/// What the drawing thread gets to do.
enum Work {
    /// A picture, and where to.
    Picture(Box<Moment>, PathBuf),
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
    /// What went wrong, which has been told.
    pub failure: Option<String>,
    /// Whether that is a file that could not be written, rather than a machine that cannot draw.
    pub is_fault: bool,
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
    /// A camera that the scene does not have, a directory that cannot be made, in words.
    pub fn start(
        wanted: &Wanted,
        Shown { stage, moments }: Shown,
        period_ns: u64,
        waits: bool,
    ) -> Result<Self, String> {
        camera_of(&stage, wanted.camera.as_deref())?;
        if let Some(film) = &wanted.film {
            std::fs::create_dir_all(&film.directory)
                .map_err(|error| format!("--frames {}: {error}", film.directory.display()))?;
        }
        let look = wanted.clone();
        let (out, to_draw) = sync_channel(WAITING);
        let progress = Arc::new(Progress::default());
        let written = Arc::new(AtomicU64::new(0));
        let told = (Arc::clone(&progress), Arc::clone(&written));
        let thread = std::thread::Builder::new()
            .name("pictures".into())
            .spawn(move || draw_all(stage, &look, &to_draw, &told.0, &told.1))
            .map_err(|error| format!("no thread for pictures: {error}"))?;
        let mut shots = wanted.shots.clone();
        shots.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
        Ok(Self {
            shots,
            film: wanted.film.clone(),
            due: 0,
            left_out: 0,
            waits,
            period_s: period_ns as f64 / 1e9,
            moments,
            out: Some(out),
            progress,
            written,
            thread: Some(thread),
        })
    }

    /// A tick, as it began.
    pub fn look(&mut self, row: &Row, bodies: &[BodyRow], placed: &[Placed]) {
        // The tick that is nearest to the time.
        let now_s = (row.run_tick as f64 + 0.5) * self.period_s;
        while self.shots.first().is_some_and(|shot| shot.t_s < now_s) {
            let shot = self.shots.remove(0);
            let moment = self.moments.moment(row, bodies, placed);
            self.send((moment, shot.file), true);
        }
        if let Some(Film { directory, fps }) = &self.film
            && self.due as f64 / fps < now_s
        {
            let file = directory.join(format!("frame-{:06}.png", self.due));
            self.due += 1;
            let moment = self.moments.moment(row, bodies, placed);
            self.send((moment, file), self.waits);
        }
    }

    /// Another scene goes on: pictures are of that from now on, and of its first camera where it has none of that name.
    pub fn go_on(&mut self, Shown { stage, moments }: Shown) {
        self.moments = moments;
        if !self.give(Work::Scene(Box::new(stage)), true) {
            // Pictures of the scene before would be none of this one.
            self.out = None;
        }
    }

    fn send(&mut self, (moment, file): (Moment, PathBuf), waits: bool) {
        if !self.give(Work::Picture(Box::new(moment), file), waits) {
            self.left_out += 1;
        }
    }

    /// Gives work to the thread, which fails where there is no room; `waits`: for as long as the thread gets on.
    fn give(&self, mut work: Work, waits: bool) -> bool {
        let Some(out) = &self.out else { return false };
        let mut wait = Wait::begin(&self.progress);
        loop {
            match out.try_send(work) {
                Err(TrySendError::Full(_)) if !waits || wait.is_in_vain(&self.progress, STUCK) => {
                    return false;
                }
                Err(TrySendError::Full(back)) => work = back,
                // A thread that has ended has said why.
                Ok(()) | Err(TrySendError::Disconnected(_)) => return true,
            }
            std::thread::sleep(TURN);
        }
    }

    /// Waits for the last picture, and says what became of all.
    pub fn finish(mut self) -> Drawn {
        drop(self.out.take());
        let drawn = self.thread.take().map_or_else(Drawn::default, |thread| self.wait_for(thread));
        Drawn { left_out: self.left_out, not_reached: self.shots.len(), ..drawn }
    }

    fn wait_for(&self, thread: JoinHandle<Drawn>) -> Drawn {
        let mut wait = Wait::begin(&self.progress);
        while !thread.is_finished() {
            if wait.is_in_vain(&self.progress, STUCK) {
                let stuck = format!("no picture was written for {} s", STUCK.as_secs());
                say(format_args!("phantom3: {stuck}; those that are missing are left out"));
                let written = self.written.load(Ordering::Relaxed);
                return Drawn { written, failure: Some(stuck), is_fault: true, ..Drawn::default() };
            }
            std::thread::sleep(TURN);
        }
        let lost = || Drawn { failure: Some("the drawing ended by itself".into()), ..Drawn::default() };
        thread.join().unwrap_or_else(|_| lost())
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
    fn new(stage: &Stage, wanted: &Wanted) -> Result<Self, String> {
        for line in &stage.not_drawn {
            say(format_args!("phantom3: not in pictures: {line}"));
        }
        let camera = camera_of(stage, wanted.camera.as_deref()).or_else(|_| camera_of(stage, None))?;
        let studio = Studio::new(stage, wanted.size).map_err(|missing| missing.to_string())?;
        Ok(Self { studio, camera, eyes: wanted.eyes })
    }
}

/// Tells `steps` of each scene that is made ready, and of each picture that is drawn and that is saved.
fn draw_all(
    first: Stage,
    wanted: &Wanted,
    work: &Receiver<Work>,
    steps: &Progress,
    written: &AtomicU64,
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
        match work.recv() {
            Ok(Work::Scene(stage)) => next = Some(*stage),
            Ok(Work::Picture(moment, file)) => {
                let Some(Drawer { studio, camera, eyes }) = &mut drawer else { continue };
                drawn.renderer = studio.renderer().to_owned();
                let picture = studio.take(&moment, camera, eyes);
                steps.take();
                drawn.note(&file, picture.save(&file));
                written.store(drawn.written, Ordering::Relaxed);
                steps.take();
            }
            Err(_) => return drawn,
        }
    }
}

impl Drawn {
    fn note(&mut self, file: &Path, saved: std::io::Result<()>) {
        let Err(error) = saved else {
            self.written += 1;
            return;
        };
        if self.failure.is_none() {
            say(format_args!("phantom3: the picture {} cannot be written: {error}", file.display()));
        }
        (self.failure, self.is_fault) = (Some(error.to_string()), true);
    }
}
