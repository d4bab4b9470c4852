//! What is to be measured, checked before anything starts.

use crate::jitter::cyclictest::Call;
use crate::jitter::driver_slice::DefaultScene;
use crate::jitter::error::JitterError;
use crate::jitter::load::{Kind, LoadPlan};
use crate::jitter::metric::Style;
use crate::jitter::options::{Measure, ReferenceChoice};
use crate::jitter::waiting_loop::{Margin, Order, Wait};
use io_driver::cli::usual_socket;
use io_driver::config::{DriverConfig, SpinMargin};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Not measured, at the beginning of each slice: caches, the clock's frequency and the kernel's balancing settle.
pub const WARM_UP: Duration = Duration::from_millis(500);
const DEFAULT_RUNS: usize = 5;
const DEFAULT_SLICE_S: f64 = 4.0;
/// What a short duration is divided into; cyclictest knows no fraction of it.
const SHORTEST_SLICE_S: f64 = 1.0;
/// From an hour on, longer slices: each costs a start.
const LONG: Duration = Duration::from_secs(3600);
const LONG_SLICE_S: f64 = 60.0;
const MOST_RUNS: usize = 10_000;

/// A measurement.
#[derive(Debug)]
pub struct Plan {
    /// How often each style has its turn.
    pub runs: usize,
    /// How long a turn is.
    pub slice: Duration,
    /// Which styles, in the order of the first run.
    pub styles: Vec<Style>,
    /// What the reference is.
    pub reference: Reference,
    /// The driver that is attached to, instead of all that.
    pub attach: Option<PathBuf>,
    /// The driver's configuration; period, CPU and priority of all styles are its own.
    pub config: DriverConfig,
    /// The application's scene.
    pub scene: PathBuf,
    /// Between two looks at the ring.
    pub poll: Duration,
    /// Load.
    pub load: Option<LoadPlan>,
    /// What one should know before believing the figures.
    pub notes: Vec<String>,
    _default_scene: DefaultScene,
}

/// The reference.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reference {
    /// cyclictest, called like this.
    Cyclictest(Call),
    /// A plain absolute sleep of our own.
    Sleep,
}

impl Plan {
    /// Checks the options.
    ///
    /// # Errors
    /// If they make no sense; with what is allowed.
    pub fn new(options: &Measure) -> Result<Self, JitterError> {
        let default_scene = DefaultScene::unpack()?;
        let config = driver_config(options, &default_scene)?;
        let mut notes = Vec::new();
        let reference = choose_reference(options, &config, &mut notes)?;
        let attach = options.attach.as_ref().map(|socket| match socket.as_os_str().is_empty() {
            true => usual_socket("jitter"),
            false => socket.clone(),
        });
        let styles = if attach.is_some() { vec![Style::Driver] } else { styles(&options.styles)? };
        let (runs, slice) = turns(options, styles.len(), styles.contains(&Style::Reference))?;
        if config.real_time.cpu.is_none() {
            notes.push("there is one CPU only: the measured loop shares it with everything else".into());
        }
        let scene = options.scene.clone().unwrap_or_else(|| default_scene.scene());
        Ok(Self {
            runs,
            slice,
            styles,
            reference,
            attach,
            scene,
            poll: Duration::from_millis(options.poll_ms),
            load: load(options)?,
            config,
            notes,
            _default_scene: default_scene,
        })
    }

    /// How long it takes altogether; starting programs and ramping in take about as long as the warm-up.
    pub fn expected(&self) -> Duration {
        let warm_up = if self.attach.is_some() { Duration::ZERO } else { WARM_UP };
        (self.slice + warm_up) * (self.runs * self.styles.len()) as u32
    }

    /// What is about to be done, in a line.
    pub fn announce(&self) -> String {
        let (runs, slice_s) = (self.runs, self.slice.as_secs_f64());
        let styles: Vec<_> = self.styles.iter().map(|style| style.name()).collect();
        let measured_s = self.runs as f64 * slice_s;
        format!(
            "plan: {runs} runs of {slice_s:.3} s of each style ({}), {measured_s:.3} s a style, about {:.0} s altogether",
            styles.join(", "),
            self.expected().as_secs_f64()
        )
    }

    /// What a bare loop is to do.
    pub fn order(&self, wait: Wait) -> Order {
        let ticks = |duration: Duration| (duration.as_nanos() as u64 / self.config.period_ns).max(1);
        Order {
            wait,
            period_ns: self.config.period_ns,
            phase_offset_ns: self.config.real_time.phase_offset_ns,
            phase_steps_aside: self.config.real_time.phase_steps_aside,
            spin_margin: match self.config.real_time.spin_margin {
                SpinMargin::Fixed(ns) => Margin::Fixed(ns),
                SpinMargin::Calibrated { at_most_ns } => Margin::Calibrated(at_most_ns),
            },
            priority: self.config.real_time.priority,
            cpu: self.config.real_time.cpu,
            lock_memory: self.config.real_time.lock_memory,
            warm_up_ticks: ticks(WARM_UP),
            ticks: ticks(self.slice),
        }
    }

    /// The same in words, for the record and for comparisons.
    pub fn describe(&self) -> BTreeMap<String, String> {
        let real_time = &self.config.real_time;
        let words = |text: &dyn std::fmt::Debug| format!("{text:?}");
        let cpu = real_time.cpu.map_or_else(|| "any".into(), |cpu| cpu.to_string());
        let priority = real_time.priority.map_or_else(|| "none".into(), |priority| priority.to_string());
        let styles: Vec<_> = self.styles.iter().map(|style| style.name()).collect();
        let reference = match &self.reference {
            Reference::Cyclictest(call) => call.to_string(),
            Reference::Sleep => "plain absolute sleep".into(),
        };
        let mut found: BTreeMap<String, String> = [
            ("runs", self.runs.to_string()),
            ("slice (s)", self.slice.as_secs_f64().to_string()),
            ("styles", styles.join(",")),
            ("reference", reference),
            ("period (ns)", self.config.period_ns.to_string()),
            ("cpu", cpu),
            ("priority", priority),
            ("lock memory", real_time.lock_memory.to_string()),
            ("phase offset (ns)", real_time.phase_offset_ns.to_string()),
            ("phase steps aside", real_time.phase_steps_aside.to_string()),
            ("spin margin", words(&real_time.spin_margin)),
            ("wait for replies", words(&real_time.wait)),
            ("reply", words(&self.config.reply)),
            ("devices", self.config.devices.len().to_string()),
            ("poll (ms)", self.poll.as_millis().to_string()),
            ("load", self.load.as_ref().map_or_else(|| "none".into(), ToString::to_string)),
            ("build", if cfg!(debug_assertions) { "debug" } else { "release" }.into()),
        ]
        .map(|(key, value)| (key.to_owned(), value))
        .into();
        if let Some(socket) = &self.attach {
            found.retain(|key, _| ["runs", "slice (s)", "poll (ms)", "build"].contains(&key.as_str()));
            found.insert("attached to".into(), socket.display().to_string());
        }
        found
    }
}

fn driver_config(options: &Measure, scene: &DefaultScene) -> Result<DriverConfig, JitterError> {
    let usage = |error: &dyn std::fmt::Display| JitterError::Usage(error.to_string());
    let mut config = match &options.config {
        Some(file) => DriverConfig::load(file).map_err(|error| usage(&error))?,
        None => {
            let text = scene.driver_toml(options.rate_hz.unwrap_or(1000.0));
            DriverConfig::parse(&text, Path::new("jitter's own")).map_err(|error| usage(&error))?
        }
    };
    let online = rt_core::cpu::online_cpus();
    if let Some(cpu) = options.cpu.filter(|cpu| !online.contains(cpu)) {
        return Err(JitterError::Usage(format!("--cpu {cpu}: open to this process are the CPUs {online:?}")));
    }
    // All styles on the CPU that the driver would take.
    let last = online.last().copied().filter(|_| online.len() > 1);
    config.real_time.cpu = options.cpu.or(config.real_time.cpu).or(last);
    if let Some(priority) = options.priority {
        config.real_time.priority = (priority > 0).then_some(priority);
    }
    let within = |name: &str, us: u64| match us.checked_mul(1000).filter(|ns| *ns <= config.period_ns) {
        Some(ns) => Ok(ns),
        None => {
            let most = config.period_ns / 1000;
            Err(JitterError::Usage(format!("--{name} {us}: allowed are 0 to {most}, a whole period")))
        }
    };
    if let Some(us) = options.phase_us {
        config.real_time.phase_offset_ns = within("phase-us", us)?;
        config.real_time.phase_steps_aside = false;
    }
    if let Some(us) = options.spin_margin_us {
        config.real_time.spin_margin = SpinMargin::Fixed(within("spin-margin-us", us)?);
    }
    Ok(config)
}

fn choose_reference(
    options: &Measure,
    config: &DriverConfig,
    notes: &mut Vec<String>,
) -> Result<Reference, JitterError> {
    if options.attach.is_some() || options.reference == ReferenceChoice::Sleep {
        return Ok(Reference::Sleep);
    }
    let real_time = &config.real_time;
    let call = Call { period_us: config.period_ns / 1000, priority: real_time.priority, cpu: real_time.cpu };
    let refused = if config.period_ns.is_multiple_of(1000) {
        match call.try_out() {
            Ok(()) => return Ok(Reference::Cyclictest(call)),
            Err(why) => why,
        }
    } else {
        format!("cyclictest cannot wake every {} ns, only every whole microsecond", config.period_ns)
    };
    let ordinary = Call { priority: None, ..call };
    if ordinary.period_us * 1000 == config.period_ns && ordinary.try_out().is_ok() {
        notes.push(format!("{refused}; the reference runs without a real-time priority"));
        return Ok(Reference::Cyclictest(ordinary));
    }
    if options.reference == ReferenceChoice::Cyclictest {
        return Err(JitterError::Usage(format!(
            "--reference cyclictest: {refused}; --reference sleep needs nothing"
        )));
    }
    notes.push(format!("{refused}; the reference is a plain absolute sleep of our own"));
    Ok(Reference::Sleep)
}

fn styles(names: &[String]) -> Result<Vec<Style>, JitterError> {
    let mut found = Vec::new();
    for name in names {
        let style = Style::from_name(name).ok_or_else(|| {
            JitterError::Usage(format!("--styles: {name:?} is none; allowed: hybrid, reference, driver"))
        })?;
        if !found.contains(&style) {
            found.push(style);
        }
    }
    Ok(found)
}

/// How often each of so many styles has its turn, and how long a turn is.
fn turns(options: &Measure, styles: usize, whole_seconds: bool) -> Result<(usize, Duration), JitterError> {
    let (runs, slice_s) = match options.duration {
        None => (options.runs.unwrap_or(DEFAULT_RUNS), options.slice.unwrap_or(DEFAULT_SLICE_S)),
        Some(duration) => divide(duration, options.slice, styles, whole_seconds)?,
    };
    // cyclictest runs for whole seconds, and the turns are to be equal.
    let slice_s = if whole_seconds { slice_s.ceil() } else { slice_s };
    if runs > MOST_RUNS {
        return Err(JitterError::Usage(format!(
            "{runs} runs of {slice_s} s: at most {MOST_RUNS}; make the slices longer (--slice)"
        )));
    }
    Ok((runs, Duration::from_secs_f64(slice_s)))
}

/// Divides a duration, which is that of all turns with their warm-ups, into runs and slices. Several short runs say
/// more than one long one: the spread between runs is what a comparison goes by.
fn divide(
    duration: Duration,
    slice: Option<f64>,
    styles: usize,
    whole_seconds: bool,
) -> Result<(usize, f64), JitterError> {
    let (total_s, warm_up_s, styles) = (duration.as_secs_f64(), WARM_UP.as_secs_f64(), styles as f64);
    let whole = |slice_s: f64| if whole_seconds { slice_s.ceil() } else { slice_s };
    let runs_of = |slice_s: f64| (total_s / ((whole(slice_s) + warm_up_s) * styles)).floor();
    let shortest_s = slice.unwrap_or(SHORTEST_SLICE_S);
    if runs_of(shortest_s) < 1.0 {
        return Err(JitterError::Usage(format!(
            "--duration {total_s}s is for all {styles} styles together; one turn of each takes {} s ({} s after {warm_up_s} s \
             of warm-up): take longer, fewer --styles, or --runs",
            (whole(shortest_s) + warm_up_s) * styles,
            whole(shortest_s)
        )));
    }
    if let Some(slice_s) = slice {
        return Ok((runs_of(slice_s) as usize, slice_s));
    }
    let usual_s = if duration >= LONG { LONG_SLICE_S } else { DEFAULT_SLICE_S };
    if runs_of(usual_s) >= DEFAULT_RUNS as f64 {
        return Ok((runs_of(usual_s) as usize, usual_s));
    }
    let runs = runs_of(SHORTEST_SLICE_S).min(DEFAULT_RUNS as f64);
    let slice_s = total_s / (runs * styles) - warm_up_s;
    Ok((runs as usize, if whole_seconds { slice_s.floor() } else { slice_s }))
}

fn load(options: &Measure) -> Result<Option<LoadPlan>, JitterError> {
    let mut kinds = Vec::new();
    for name in &options.load {
        let kind = Kind::from_name(name).ok_or_else(|| {
            JitterError::Usage(format!("--load: {name:?} is none; allowed: {}", Kind::names().join(", ")))
        })?;
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    Ok((!kinds.is_empty()).then_some(LoadPlan { kinds, workers: options.load_workers }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs, length of a turn and what they take altogether, warm-up included.
    fn divided(seconds: u64, styles: usize, whole: bool) -> (usize, f64, f64) {
        let (runs, slice_s) = divide(Duration::from_secs(seconds), None, styles, whole).unwrap();
        (runs, slice_s, runs as f64 * styles as f64 * (slice_s + WARM_UP.as_secs_f64()))
    }

    #[test]
    fn a_duration_is_that_of_all_styles_together_and_is_used() {
        assert_eq!(divided(20, 3, true), (4, 1.0, 18.0));
        assert_eq!(divided(20, 1, false), (5, 3.5, 20.0));
        assert_eq!(divided(5, 3, true), (1, 1.0, 4.5));
        assert_eq!(divided(90, 3, true), (6, 4.0, 81.0));
        assert_eq!(divided(7200, 3, true).1, LONG_SLICE_S);
        for (seconds, styles) in (5..400).flat_map(|seconds| [1, 2, 3].map(|styles| (seconds, styles))) {
            let (runs, slice_s, total_s) = divided(seconds, styles, true);
            assert!(slice_s >= 1.0 && slice_s.fract() == 0.0 && runs >= 1);
            assert!(
                total_s <= seconds as f64 && total_s > 0.6 * seconds as f64,
                "{seconds} {styles}: {total_s}"
            );
        }
    }

    #[test]
    fn a_duration_too_short_for_one_turn_of_each_style_is_refused_with_what_it_takes() {
        let refused = |slice| divide(Duration::from_secs(4), slice, 3, true).unwrap_err().to_string();
        assert!(
            refused(None)
                .contains("--duration 4s is for all 3 styles together; one turn of each takes 4.5 s")
        );
        assert!(refused(Some(10.0)).contains("takes 31.5 s"), "{}", refused(Some(10.0)));
    }
}
