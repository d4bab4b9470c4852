//! `phantom3 check`: what is wrong with a scene, all of it, without running it; and what is in it. Of a model file, how it is
//! understood (`model_file`).
//!
//! Model: the scene is read, its models and pictures are loaded and everything is made ready to run, as `run` does. What
//! stands in the way is a *problem*: `run` would refuse the scene, with the first of them. What runs, but hardly as
//! meant, is a *warning*.

mod capacities;
mod common_places;
mod contacts;
mod explicit;
mod height_maps;
mod measures;
pub(crate) mod model_file;
mod near;
mod patch_file;
mod remainder;
mod report;
mod stands;
mod summary;
mod suspicions;
mod together;
mod warnings;
mod whereabouts;

use crate::loading::while_reading;
use crate::outputs;
use crate::rig::{HandMode, Problems, Rig};
use crate::settings;
use capacities::Capacities;
use clap::Args;
use io_driver::arguments::shortened;
use io_driver::config::period_of;
use measures::Measures;
use rt_core::plain_text::PlainJson;
use rt_core::signals::StopSignals;
use serde_json::{Value, json};
use std::fmt::Display;
use std::path::PathBuf;
use std::process::ExitCode;
use summary::Summary;
use world::{Layout, Location, Scene, Settings, model};

/// The arguments of `phantom3 check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The scene (TOML), or a model file (OBJ, STL, PLY, glTF, ASE, 3DS)
    #[arg(value_name = "SCENE|MODEL")]
    scene: PathBuf,
    /// The hand file that it is to be run with (CSV); default: the scene's own
    #[arg(long, value_name = "CSV")]
    hand: Option<PathBuf>,
    /// Where the devices will stand (TOML)
    #[arg(long, value_name = "FILE")]
    layout: Option<PathBuf>,
    /// At how many ticks per second it is to run
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, value_parser = crate::cli::parse_rate)]
    rate_hz: f64,
    /// Write how the model is understood, as OBJ: merged, turned, divided, with lids as a group
    #[arg(long, value_name = "OBJ")]
    repair: Option<PathBuf>,
    /// Close all holes of the model up to this size, in its own unit; 0: none
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    close_holes: Option<f64>,
    /// Tell everything as JSON
    #[arg(long)]
    json: bool,
}

impl CheckArgs {
    /// True of a model, false of a scene.
    pub(crate) fn is_model(&self) -> bool {
        model::is_model(&self.scene)
    }
}

fn parse_size(text: &str) -> Result<f64, String> {
    let size = text.parse().ok().filter(|size: &f64| size.is_finite() && *size >= 0.0);
    size.ok_or_else(|| "allowed: a size in the unit of the model, 0 or more".into())
}

/// What came of it.
#[derive(Debug, Default)]
struct Checked {
    problems: Vec<Problem>,
    warnings: Vec<String>,
    /// Of a scene that can be run.
    summary: Option<Summary>,
}

/// Something that `run` refuses.
#[derive(Debug)]
struct Problem {
    message: String,
    /// Where it is, if it has one place in a file of ours.
    at: Option<Location>,
}

impl Problem {
    fn new(error: &dyn Display, at: Option<Location>) -> Self {
        Self { message: error.to_string(), at }
    }

    fn to_json(&self) -> Value {
        match &self.at {
            Some(at) => {
                json!({ "message": self.message, "file": at.file.display().to_string(), "line": at.line, "key": at.key })
            }
            None => json!({ "message": self.message }),
        }
    }
}

/// Runs the command: status 0 if the scene can be run, else 2.
pub fn execute(args: &CheckArgs, settings: &Settings) -> ExitCode {
    let checked = check(args, settings);
    let said = if args.json {
        format!("{}\n", PlainJson(format_args!("{:#}", to_json(&checked))))
    } else {
        shortened(report::text(&checked, &args.scene))
    };
    outputs::print(&said);
    ExitCode::from(if checked.problems.is_empty() { 0 } else { 2 })
}

/// What `run` says of a hand file, too: whoever runs a hand of a wrong unit feels nothing and is told nothing else.
pub fn suspicions_of_the_hand(rig: &Rig) -> Vec<String> {
    suspicions::of_the_hand(rig)
}

fn check(args: &CheckArgs, settings: &Settings) -> Checked {
    let file = settings::find(&args.scene, &settings.scenes.value);
    let mut checked = Checked::default();
    if args.repair.is_some() || args.close_holes.is_some() {
        let words = "--repair and --close-holes are for a model file: `phantom3 check MODEL.obj --repair OUT.obj`; a scene's \
                     meshes have the key `close_holes_m`";
        checked.problems.push(Problem::new(&words, None));
        return checked;
    }
    let layout = args.layout.as_ref().map(Layout::load).transpose();
    let layout = layout.unwrap_or_else(|error| {
        checked.problems.push(Problem::new(&error, error.location().cloned()));
        None
    });
    let mut scene = match Scene::load_whole(&file) {
        Ok(scene) => scene,
        Err(errors) => {
            checked
                .problems
                .extend(errors.iter().map(|error| Problem::new(error, error.location().cloned())));
            return checked;
        }
    };
    let mut problems = Problems::default();
    settings::find_data(&mut scene, &file, settings);
    let hand = args.hand.as_ref().map(|hand| settings::find(hand, &settings.hands.value));
    let (hand, period_ns) = (hand.as_deref(), period_of(args.rate_hz));
    let whole = scene.clone();
    let rig = while_reading(&file, &StopSignals::default(), || {
        Rig::examine(&file, scene, layout, hand, HandMode::Kinematic, period_ns, &mut problems)
    });
    checked.problems.extend(problems.all().iter().map(|error| Problem::new(error, error.location())));
    let Some((rig, mut step)) = rig.and_then(|rig| rig.fast_step().ok().map(|step| (rig, step))) else {
        return checked;
    };
    let measures = Measures::all(&rig, step.entities());
    checked.warnings = suspicions::all(&rig, &measures);
    checked.warnings.extend(height_maps::all(&rig, step.entities(), &measures));
    checked.warnings.extend(warnings::all(&rig, &whole, step.entities()));
    let suspected = suspicions::suspected(&rig, &measures);
    let mut summary = Summary::of(&rig, &whole, step.entities(), measures, suspected);
    summary.capacities = Capacities::measure(&rig, &mut step);
    checked.summary = Some(summary);
    checked
}

fn to_json(checked: &Checked) -> Value {
    json!({
        "ok": checked.problems.is_empty(),
        "problems": checked.problems.iter().map(Problem::to_json).collect::<Vec<_>>(),
        "warnings": checked.warnings,
        "summary": checked.summary.as_ref().map(Summary::to_json),
    })
}
