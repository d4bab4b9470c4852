//! `phantom3 plot`: a recording as a picture of what the fingers felt.
//!
//! Model: the force on the user along the time, or, with `--by-entity`, along the way that the finger went on each
//! entity, one picture per entity: this is where two ways to render the same thing are compared (`--against`). With
//! `--objects`, how far what moves went and turned, each for itself or together. Of a recording that is damaged behind its first row the rows before are
//! drawn, and then it is a fault (status 3), as it is for `export`.

mod figure;
mod recorded;
mod table;
mod visit;

use crate::outcome::{RunFailure, Stop};
use crate::outputs::{self, Output, tell};
use clap::Args;
use figure::{of_entity, of_objects, of_objects_together, of_run};
use plot::{Figure, PlotError};
use recorded::{Recorded, RecordedFinger};
use rt_core::plain_text::Plain;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use visit::{file_stems, visits};

/// What is to be drawn.
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// The recording (MCAP or CSV, as `run --record` wrote it, or Parquet, as `export` did)
    recording: PathBuf,
    /// Another one, dashed: the same hand on something that differs
    #[arg(long, value_name = "RECORDING")]
    against: Option<PathBuf>,
    /// Which finger [default: each has a panel; with --by-entity: the first]
    #[arg(long, value_name = "NAME")]
    finger: Option<String>,
    /// Only from here on (s)
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    from: f64,
    /// Only up to here (s) [default: the end]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// A picture for each entity, along the way that the finger went on it
    #[arg(long)]
    by_entity: bool,
    /// How far the objects moved and turned, instead of what the fingers felt
    #[arg(long, conflicts_with_all = ["by_entity", "finger"])]
    objects: bool,
    /// With --objects: all of them in one panel, how far they moved along the axis on which they moved most, or turned
    #[arg(long, value_name = "WHAT", requires = "objects", conflicts_with = "against")]
    together: Option<Together>,
    /// Pictures for the web alone, without PNG
    #[arg(long)]
    svg_only: bool,
    /// Where: OUT.svg and OUT.png, called as the recording in OUT/; with --by-entity a directory for ENTITY.svg and
    /// ENTITY.png. Earlier charts are replaced, and told; other files are not
    /// [default: the recording's name without its ending; with --objects and -objects behind it]
    #[arg(long, value_name = "OUT")]
    out: Option<PathBuf>,
}

/// What a panel shows of all objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Together {
    Moved,
    Turned,
}

/// Draws.
///
/// # Errors
/// A recording that cannot be read or is none, nothing to draw, and pictures that cannot be written.
pub fn execute(args: &PlotArgs) -> Result<Stop, RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let read = |file: &Path| {
        let recorded = Recorded::read(file).map_err(|error| wrong(&error))?;
        recorded.between(args.from, args.to.unwrap_or(f64::INFINITY)).map_err(|error| wrong(&error))
    };
    let out = args.stem();
    if !args.by_entity {
        args.check_name()?;
        check_place(&out)?;
    }
    let inputs: Vec<&PathBuf> = [&args.recording].into_iter().chain(&args.against).collect();
    if !args.by_entity {
        check_files(&out, args.svg_only, &inputs)?;
    }
    let recorded = read(&args.recording)?;
    let against = args.against.as_deref().map(read).transpose()?;
    draw(args, &out, &recorded, against.as_ref())?;
    let damage = recorded.damage().or_else(|| against.and_then(|against| against.damage()));
    damage.map_or(Ok(Stop::Finished), Err)
}

fn draw(
    args: &PlotArgs,
    out: &Path,
    recorded: &Recorded,
    against: Option<&Recorded>,
) -> Result<(), RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let finger = |recorded: &Recorded| recorded.choose(args.finger.as_deref()).map_err(|error| wrong(&error));
    if args.objects {
        let others = against.map(|against| (against, &*against.bodies));
        let bodies = recorded.moving().map_err(|error| wrong(&error))?;
        if let Some(what) = args.together {
            return write(&of_objects_together(recorded, bodies, what), out, args.svg_only);
        }
        return write(&of_objects(recorded, bodies, others), out, args.svg_only);
    }
    if !args.by_entity {
        let fingers = finger(recorded)?;
        let others = against.map(finger).transpose()?.unwrap_or_default();
        let figure = of_run(recorded, &fingers, against.map(|against| (against, &*others)));
        return write(&figure, out, args.svg_only);
    }
    std::fs::create_dir_all(out)
        .map_err(|error| wrong(&format_args!("cannot make the directory {}: {error}", out.display())))?;
    let first = |fingers: Vec<RecordedFinger>| fingers.into_iter().next();
    let felt = visits(first(finger(recorded)?).as_ref());
    let felt_against = match against {
        Some(against) => visits(first(finger(against)?).as_ref()),
        None => Vec::new(),
    };
    if felt.is_empty() {
        return Err(wrong(&format_args!(
            "{}: this finger touches nothing; choose another with --finger, or leave --by-entity out",
            args.recording.display()
        )));
    }
    let stems: Vec<PathBuf> = file_stems(&felt).into_iter().map(|stem| out.join(stem)).collect();
    let inputs: Vec<&PathBuf> = [&args.recording].into_iter().chain(&args.against).collect();
    stems.iter().try_for_each(|stem| check_files(stem, args.svg_only, &inputs))?;
    for (visit, stem) in felt.iter().zip(stems) {
        let other = felt_against.iter().find(|other| other.entity == visit.entity);
        let other = against.map(Recorded::label).zip(other);
        let other = other.as_ref().map(|(label, other)| (label.as_str(), *other));
        write(&of_entity(visit, other), &stem, args.svg_only)?;
    }
    Ok(())
}

impl PlotArgs {
    /// Where pictures go, without the ending, which says what they are and not where.
    fn stem(&self) -> PathBuf {
        let Some(out) = &self.out else {
            let stem = self.recording.with_extension("");
            // Beside the picture of what the fingers felt, which is called as the recording.
            return if self.objects { with_end(&stem, "-objects") } else { stem };
        };
        if !self.by_entity && is_directory_name(out) {
            let name = self.recording.file_stem().unwrap_or_default();
            return if self.objects { with_end(&out.join(name), "-objects") } else { out.join(name) };
        }
        let is_picture = |ending: &OsStr| ending == "svg" || ending == "png";
        if out.extension().is_some_and(is_picture) { out.with_extension("") } else { out.clone() }
    }

    /// Two files are written, SVG and PNG.
    fn check_name(&self) -> Result<(), RunFailure> {
        let Some(out) = &self.out else { return Ok(()) };
        let ending = out.extension().unwrap_or_default();
        let wrong = if out.as_os_str() == "-" {
            "the standard output, which takes one file".to_owned()
        } else if OTHER_KINDS.iter().any(|kind| ending.eq_ignore_ascii_case(kind)) {
            format!("{}, a kind of picture that is not drawn", Plain(out.display()))
        } else {
            return Ok(());
        };
        Err(RunFailure::Start(format!(
            "--out: found {wrong}; allowed: a name without ending, to which .svg and .png are added"
        )))
    }
}

/// Kinds of pictures that are not drawn.
const OTHER_KINDS: [&str; 7] = ["pdf", "jpg", "jpeg", "eps", "ps", "gif", "webp"];

/// `pictures/`, `.` and `..`
fn is_directory_name(path: &Path) -> bool {
    path.as_os_str().as_encoded_bytes().ends_with(b"/") || path.file_name().is_none()
}

/// With something behind its last letter, whatever points it holds.
fn with_end(path: &Path, end: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(end);
    name.into()
}

/// The files of a picture.
fn files_of(stem: &Path, svg_only: bool) -> Vec<PathBuf> {
    let endings: &[&str] = if svg_only { &[".svg"] } else { &[".svg", ".png"] };
    endings.iter().map(|ending| with_end(stem, ending)).collect()
}

/// No picture takes the place of a recording, nor of anything else but an earlier chart: it may be an input of a run.
fn check_files(stem: &Path, svg_only: bool, inputs: &[&PathBuf]) -> Result<(), RunFailure> {
    let files = files_of(stem, svg_only);
    let outputs: Vec<_> = files.iter().map(|file| Output::chart(file)).collect();
    outputs::check(&outputs, inputs)?;
    files.iter().try_for_each(|file| refuse_others(file))
}

fn refuse_others(file: &Path) -> Result<(), RunFailure> {
    let Ok(found) = file.metadata() else { return Ok(()) };
    let what = if found.is_dir() {
        "a directory"
    } else if is_earlier(file) && !plot::is_drawn_here(file).unwrap_or(false) {
        "a file that is not known as a chart of this program"
    } else {
        return Ok(());
    };
    Err(RunFailure::Start(format!(
        "the picture {} would take the place of {what}; name another place with --out",
        Plain(file.display())
    )))
}

/// True of a file that has a content.
fn is_earlier(file: &Path) -> bool {
    file.metadata().is_ok_and(|found| found.is_file() && found.len() > 0)
}

/// Before the work, not after it.
fn check_place(stem: &Path) -> Result<(), RunFailure> {
    let directory = stem.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(directory).map(drop).map_err(|error| {
        let place = directory.display();
        RunFailure::Start(format!(
            "cannot write pictures into {place}: {error}; name another place with --out"
        ))
    })
}

fn write(figure: &Figure, stem: &Path, svg_only: bool) -> Result<(), RunFailure> {
    let late = |error: PlotError| RunFailure::Results(error.to_string());
    let files = files_of(stem, svg_only);
    let was_there: Vec<bool> = files.iter().map(|file| is_earlier(file)).collect();
    let mut endings = ".svg";
    figure.write_svg(stem).map_err(late)?;
    let whole = if svg_only { Ok(()) } else { figure.write_png(stem).map(|()| endings = ".svg, .png") };
    tell(&format_args!("written      {}{endings}", Plain(stem.display())), false);
    let written = if whole.is_ok() { files.len() } else { 1 };
    for (file, _) in files.iter().zip(was_there).take(written).filter(|(_, was_there)| *was_there) {
        tell(&format_args!("replaced     {}", Plain(file.display())), false);
    }
    whole.map_err(late)
}
