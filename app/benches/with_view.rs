//! Whether looking on slows rendering down: the fast loop's latency with and without pictures.
//!
//! Run `cargo bench -p phantom3 --bench with_view`. In turn, slices of two seconds in real time against a driver of their own:
//! nobody looks; or what a window would be told is drawn live, sixty pictures of 1280x720 places a second, without a
//! display, by a thread as the window's is. `reply` is from the frame's publication to the command's arrival, as the driver
//! measures it; `step` is what the fast thread takes for a tick. `all`: of all ticks of all slices together; `slices`: the
//! median over the slices of each slice's own. `PHANTOM3_SLICES` is how many slices there are of each kind.
#![allow(missing_docs, unused_crate_dependencies)]

use io_driver::config::period_of;
use phantom3::book::Book;
use phantom3::child::DriverChild;
use phantom3::fast_loop::{FastLoop, WhenFull};
use phantom3::fast_thread::{self, FastShared};
use phantom3::rig::{HandMode, Rig};
use phantom3::row_queue::row_queue;
use phantom3::shown::Shown;
use phantom3::slow::SlowSide;
use phantom3::spectator::{Onlooker, Spectator};
use rt_core::histogram::Histogram;
use shm_abi::segment::ClockMode;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use view::playback::Playback;
use view::{Ask, Eyes, News, Stage, Studio};
use world::Scene;
use world::events::Hub;

const SLICES: usize = 12;
const TICKS: u64 = 2000;
const SIZE: [u32; 2] = [1280, 720];
const PICTURE: Duration = Duration::from_micros(16_667);
const TURN: Duration = Duration::from_millis(10);

/// What a slice measured.
struct Slice {
    reply: Histogram,
    step: Histogram,
    lost: u64,
    /// Pictures a second.
    rate_hz: f64,
}

fn main() -> ExitCode {
    // The driver is this program as a child.
    if std::env::args().nth(1).is_some_and(|word| word == "driver") {
        return phantom3::cli::main();
    }
    let slices = std::env::var("PHANTOM3_SLICES").ok().and_then(|text| text.parse().ok()).unwrap_or(SLICES);
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/scenes/ten.toml"));
    let scene = Scene::load(file).expect("the scene");
    let rig = Rig::new(file, scene, None, None, HandMode::Kinematic, period_of(1000.0)).expect("a rig");
    println!("load before  {}", load());
    let mut measured: [Vec<Slice>; 2] = [Vec::new(), Vec::new()];
    for at in 0..2 * slices {
        match slice(&rig, at % 2 == 1) {
            Ok(slice) => measured[at % 2].push(slice),
            Err(missing) => {
                println!("skipped: {missing}");
                return ExitCode::SUCCESS;
            }
        }
    }
    println!("load after   {}", load());
    tell(&measured);
    ExitCode::SUCCESS
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg").unwrap_or_default().trim().to_owned()
}

fn slice(rig: &Rig, with_view: bool) -> Result<Slice, String> {
    let mut child = DriverChild::start(rig.driver_config(ClockMode::Real), rig.hand.as_ref())
        .map_err(|error| error.to_string())?;
    let attachment = child.attach("with_view").map_err(|error| error.to_string())?;
    let baseline = io_driver::meter::read(&attachment.driver.round_trip_ns);
    let step = rig.fast_step().expect("rendering");
    let (sender, receiver) = row_queue(step.bodies().len());
    let Shown { stage, moments } = Shown::new(rig, step.entities());
    let drawn = Arc::<AtomicU64>::default();
    let screen = with_view.then(|| Screen::start(stage, Arc::clone(&drawn))).transpose()?;
    let mut hub = Hub::new(Vec::new());
    let spectator = screen.map(|screen| Spectator::new(screen, moments, &mut hub, Book::default()));
    let mut slow = SlowSide::new(receiver, hub, Vec::new()).with_spectator(spectator);
    let fast = FastLoop::new(step, sender, WhenFull::Drop, TICKS, rig.period_ns);
    let commander = attachment.commander.expect("the lease");
    let begun = Instant::now();
    let (_, thread) = fast_thread::start(fast, attachment.driver, commander, FastShared::default())
        .map_err(|error| error.to_string())?;
    while !thread.is_finished() {
        slow.step();
        std::thread::sleep(TURN);
    }
    let rate_hz = drawn.load(Ordering::Relaxed) as f64 / begun.elapsed().as_secs_f64();
    let remains = thread.join().map_err(|_| "the fast thread panicked")?;
    let reply = io_driver::meter::read(&remains.driver.round_trip_ns);
    let reply = io_driver::meter::since(&baseline, &reply);
    Ok(Slice { reply, step: remains.step_ns, lost: remains.fast.tally.rows_lost, rate_hz })
}

/// What stands for a window.
struct Screen {
    news: Option<SyncSender<News>>,
    thread: Option<JoinHandle<()>>,
}

impl Screen {
    fn start(stage: Stage, drawn: Arc<AtomicU64>) -> Result<Self, String> {
        let ((news, told), (ready, is_ready)) = (sync_channel(64), sync_channel(1));
        let thread = std::thread::spawn(move || match Studio::new(&stage, SIZE) {
            Ok(studio) => {
                let _ = ready.send(Ok(()));
                show(studio, &stage, &told, &drawn);
            }
            Err(missing) => {
                let _ = ready.send(Err(missing.to_string()));
            }
        });
        is_ready.recv().map_err(|_| "who draws has ended".to_owned())??;
        Ok(Self { news: Some(news), thread: Some(thread) })
    }
}

fn show(mut studio: Studio, stage: &Stage, told: &Receiver<News>, drawn: &AtomicU64) {
    let (begun, mut playback, mut due) = (Instant::now(), Playback::default(), Instant::now());
    loop {
        let now_s = begun.elapsed().as_secs_f64();
        loop {
            match told.try_recv() {
                Ok(News::Glimpse(glimpse)) => playback.take(glimpse.moment, now_s),
                Ok(_) => {}
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return,
            }
        }
        if let Some(moment) = playback.shown(now_s) {
            studio.take(&moment, &stage.cameras[0], &Eyes::default());
            drawn.fetch_add(1, Ordering::Relaxed);
        }
        due = (due + PICTURE).max(Instant::now());
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

impl Onlooker for Screen {
    fn tell(&mut self, news: News) -> Option<News> {
        if let Some(out) = &self.news {
            let _ = out.try_send(news);
        }
        None
    }

    fn asked(&mut self) -> Vec<Ask> {
        Vec::new()
    }

    fn is_open(&self) -> bool {
        true
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        drop(self.news.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn tell([without, with]: &[Vec<Slice>; 2]) {
    let rate_hz = median(with.iter().map(|slice| slice.rate_hz));
    let lost: u64 = without.iter().chain(with).map(|slice| slice.lost).sum();
    println!("slices       {} of each kind, {rate_hz:.0} pictures a second, {lost} rows lost", with.len());
    println!(
        "             {:>32} {:>32}",
        "all: nobody, view (us), ratio", "slices: nobody, view (us), ratio"
    );
    for (what, of) in
        [("reply", (|slice| &slice.reply) as fn(&Slice) -> &Histogram), ("step", |slice| &slice.step)]
    {
        for (name, share) in [("median", 0.5), ("p99", 0.99), ("p99.9", 0.999)] {
            let all = [without, with].map(|slices| {
                let mut all = Histogram::new();
                slices.iter().for_each(|slice| all.merge(of(slice)));
                us(&all, share)
            });
            let each = [without, with].map(|slices| median(slices.iter().map(|slice| us(of(slice), share))));
            let columns = [all, each].map(|[a, b]| format!("{a:10.1} {b:10.1} {:10.3}", b / a));
            println!("{what:<6}{name:<7}{} {}", columns[0], columns[1]);
        }
    }
}

fn us(histogram: &Histogram, share: f64) -> f64 {
    histogram.percentile(share).unwrap_or_default() as f64 / 1e3
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
