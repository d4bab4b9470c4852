//! `phantom3 study stiffness`: the stiffest wall that does not buzz.
//!
//! Problem: a virtual wall is a spring that is looked at in steps of place and time and pushes late, so beyond some
//! stiffness it oscillates under the hand. How stiff it may be depends on the way of replying, the rate, damping,
//! friction and the hand; each paper has its own formula for a part of that.
//!
//! Model: for each case the whole system on the virtual clock ([`trial`]), a simulated arm and hand in front of a
//! wall; the stiffness is raised until the oscillation after a push does not settle ([`search`]). Beside it stand what theory
//! says: the sampled linear loop without friction and encoder ([`linear`]), passivity, and friction against
//! encoder steps ([`bounds`]). With `--passivity` each search is done once more with a finger that is kept passive, and
//! it is told what that costs ([`kept`]).
//!
//! Cost: some minutes of one CPU for all cases; as many at once as there are CPUs.

pub mod bounds;
pub mod case;
pub mod kept;
pub mod linear;
pub mod picture;
pub mod plant;
pub mod search;
pub mod table;
pub mod trial;

use crate::outcome::{RunFailure, Stop};
use crate::outputs::{print, tell};
use crate::progress::StatusLine;
use case::{Axis, Case};
use clap::Args;
use io_driver::say::say;
use rt_core::plain_text::Plain;
use rt_core::signals::StopSignals;
use search::{Found, Search};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use trial::Bench;

/// What is asked.
#[derive(Debug, Args)]
pub struct StiffnessArgs {
    /// Rates (Hz)
    #[arg(long, value_name = "HZ,...", value_delimiter = ',', default_values_t = [1000.0, 2000.0, 4000.0, 8000.0], value_parser = parse_rate)]
    rates: Vec<f64>,
    /// Ways of replying: same-tick, fixed-phase, next-tick
    #[arg(long, value_name = "MODE,...", value_delimiter = ',', default_values = ["same-tick", "fixed-phase", "next-tick"])]
    modes: Vec<case::Mode>,
    /// Contact damping of the wall, N s/m
    #[arg(long, value_name = "B,...", value_delimiter = ',', default_values_t = [0.0, 2.0], value_parser = parse_damping)]
    dampings: Vec<f64>,
    /// Hands: built-in names or files (TOML), with :light or :firm; nobody: nobody holds the arm, and nothing pushes it
    #[arg(long, value_name = "HAND,...", value_delimiter = ',', default_values = ["pen-grip:light", "pen-grip:firm"])]
    hands: Vec<case::Hand>,
    /// Which device is simulated: a built-in's name or a description (TOML)
    #[arg(long, value_name = "DEVICE", default_value = "premium-1.5")]
    device: PathBuf,
    /// The wall's normal, in the device's frame
    #[arg(long, value_enum, default_value_t = Axis::Y)]
    axis: Axis,
    /// How deep behind the surface the hand wants to be at first (mm); negative: above it, so that it taps
    #[arg(long, value_name = "MM", default_value_t = 2.0, value_parser = parse_press, allow_negative_numbers = true)]
    press_mm: f64,
    /// How much deeper the hand wants to be after its push (mm)
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = parse_push)]
    push_mm: f64,
    /// Searches again with a finger that is kept passive: takes twice as long
    #[arg(long)]
    passivity: bool,
    /// Where the results go: stiffness.csv, stiffness.svg, stiffness.png
    #[arg(long, value_name = "DIR", default_value = "study-stiffness")]
    out: PathBuf,
    /// How many cases at once [default: as many as there are CPUs]
    #[arg(long, value_name = "N")]
    jobs: Option<std::num::NonZeroUsize>,
}

/// A case and all that is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// The case.
    pub case: Case,
    /// Up to where the simulation settled below two counts.
    pub settled: Found,
    /// Up to where nothing flickered either.
    pub quiet: Found,
    /// What theory says.
    pub theory: bounds::Theory,
    /// What became of it with a finger that is kept passive, if that was asked.
    pub kept: Option<kept::Kept>,
}

/// Does the study.
///
/// # Errors
/// Bad arguments, and results that cannot be written.
pub fn execute(args: &StiffnessArgs, signals: &StopSignals) -> Result<Stop, RunFailure> {
    let start = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let bench = Bench::new(&args.device, args.axis, [args.press_mm * 1e-3, args.push_mm * 1e-3])
        .map_err(|error| start(&error))?;
    let cases = case::all(&args.modes, &args.rates, &args.dampings, &args.hands);
    for case in &cases {
        // Whatever is wrong with the arguments is said before the first long run.
        bench.hand_model(case)?;
        bench.open(case, search::LEAST_N_PER_M).map_err(|error| start(&error))?;
    }
    std::fs::create_dir_all(&args.out)
        .map_err(|error| start(&format!("cannot make the directory {}: {error}", args.out.display())))?;
    let jobs = args.jobs.or(std::thread::available_parallelism().ok()).map_or(1, usize::from);
    // Before minutes of work, not after them.
    let writable = tempfile::tempfile_in(&args.out);
    writable.map_err(|error| {
        start(&format!(
            "cannot write into {}: {error}; name a directory that can be written with --out",
            args.out.display()
        ))
    })?;
    say(format_args!("phantom3: {} cases, {jobs} at a time; some seconds each", cases.len()));
    let Some(answers) = answer_all(&bench, &cases, args.passivity, jobs, signals)? else {
        return Ok(Stop::Signal(signals.requested().unwrap_or(rustix::process::Signal::INT.as_raw())));
    };
    print(&table::text(&bench, &answers));
    let late = |error: &dyn std::fmt::Display| RunFailure::Results(error.to_string());
    table::write_csv(&args.out.join("stiffness.csv"), &bench, &answers).map_err(|error| late(&error))?;
    picture::figure(&bench, &answers)
        .write(&args.out.join("stiffness"))
        .map_err(|error| late(&format_args!("cannot write the picture: {error}")))?;
    tell(&format_args!("written      {}/stiffness.csv, .svg, .png", Plain(args.out.display())), false);
    Ok(Stop::Finished)
}

/// `None`: a signal came.
fn answer_all(
    bench: &Bench,
    cases: &[Case],
    with_passivity: bool,
    jobs: usize,
    signals: &StopSignals,
) -> Result<Option<Vec<Answer>>, RunFailure> {
    let next = AtomicUsize::new(0);
    let progress = Mutex::new((0usize, StatusLine::default()));
    let answers: Mutex<Vec<Option<Result<Answer, RunFailure>>>> = Mutex::new(vec_of_none(cases.len()));
    let work = || {
        while signals.requested().is_none() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(case) = cases.get(index) else { break };
            let answer = answer(bench, case, with_passivity, signals);
            if let Ok(mut answers) = answers.lock() {
                answers[index] = Some(answer);
            }
            if let Ok(mut progress) = progress.lock() {
                let (done, line) = &mut *progress;
                *done += 1;
                line.show(|| format!("{done} of {} cases", cases.len()));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..jobs.min(cases.len()) {
            scope.spawn(work);
        }
        work();
    });
    if signals.requested().is_some() {
        return Ok(None);
    }
    let answers = answers.into_inner().unwrap_or_default();
    answers.into_iter().flatten().collect::<Result<Vec<_>, _>>().map(Some)
}

fn vec_of_none<T>(count: usize) -> Vec<Option<T>> {
    std::iter::repeat_with(|| None).take(count).collect()
}

fn answer(
    bench: &Bench,
    case: &Case,
    with_passivity: bool,
    signals: &StopSignals,
) -> Result<Answer, RunFailure> {
    // What is quiet has settled, so what is known of one helps the other.
    let (mut settled, mut quiet) = (Search::default(), Search::default());
    while signals.requested().is_none() {
        let Some(stiffness) = quiet.next().or_else(|| settled.next()) else { break };
        let outcome = bench.open(case, stiffness)?.run()?;
        quiet.learn(stiffness, outcome.is_quiet());
        settled.learn(stiffness, outcome.settles());
    }
    let theory = bounds::Theory::of(bench, case)?;
    let (settled, quiet) = (settled.found(), quiet.found());
    let kept = with_passivity.then(|| kept::Kept::of(bench, case, [quiet, settled], signals)).transpose()?;
    Ok(Answer { case: case.clone(), settled, quiet, theory, kept })
}

fn parse_rate(text: &str) -> Result<f64, String> {
    within(text, 100.0, 20_000.0, "Hz")
}

fn parse_damping(text: &str) -> Result<f64, String> {
    within(text, 0.0, 100.0, "N s/m")
}

fn parse_press(text: &str) -> Result<f64, String> {
    within(text, -20.0, 20.0, "mm")
}

fn parse_push(text: &str) -> Result<f64, String> {
    within(text, 0.01, 20.0, "mm")
}

fn within(text: &str, least: f64, most: f64, unit: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (least..=most).contains(&number) => Ok(number),
        _ => Err(format!("found {text}, allowed: {least} to {most} {unit}")),
    }
}
