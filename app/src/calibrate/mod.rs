//! `phantom3 calibrate`: where one device's base stands, from points that it and another one measured together.
//!
//! Model: pairs come from a file or from a running driver (`live`); the crate `calibration` fits them; what was
//! found goes into a layout (`layout_file`), which a run with `--attach` reads ([`default_layout`]).
//! Output: what programs want (the layout, with `--json` the result) on standard output, what people want on standard
//! error.
//!
//! Exit status: 0 done; 2 bad usage or bad input, and pairs that determine nothing; 3 the driver went away meanwhile, or
//! pairs, the layout or the figure could not be written.

#![allow(non_snake_case)] // Frames are capital letters: X_WF takes F to W.

pub mod default_layout;
mod figure;
mod layout_file;
mod live;
mod report;

use crate::outcome::RunFailure;
use crate::outputs::{self, Output};
use crate::record::destination::{is_same_file, is_same_place};
use calibration::{Calibration, CalibrationError, Fit, Model, Pair, PairsError, calibrate, parse_pairs};
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{ArgGroup, Args};
use default_layout::DefaultLayoutError;
use io_driver::cli::usual_socket;
use io_driver::say::say;
use layout_file::LayoutFileError;
use live::LiveError;
use plot::PlotError;
use report::Report;
use rt_core::file_kind;
use rt_core::input_file;
use rt_core::limits;
use rt_core::replacement::{self, Replacement};
use rt_core::separators;
use rt_core::signals::StopSignals;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use thiserror::Error;
use world::{Layout, MAX_DEVICES, Placement, SceneError};

const AFTER_HELP: &str = "The end points of both devices are held together and moved through the space that both reach, in all three \
directions; a tool that joins them does it best. Each pair is one place as both measured it.\n\n\
The fiducial's own place in the world is taken as known: --layout, or the file that --write edits, or the world's origin. \
Without --write the new layout goes to standard output.\n\n\
  phantom3 calibrate --live --device 1 --write        hold the end points together, follow the words, done\n  \
phantom3 calibrate --pairs pairs.csv --plot residuals.svg\n  \
phantom3 run SCENE.toml --attach                    uses what --write wrote\n\n\
Exit status: 0 done; 2 bad usage, bad input, or pairs that determine nothing; 3 the driver went away, or \
pairs or an edited layout were not written.";

/// Arguments of `calibrate`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP, group(ArgGroup::new("source").required(true).args(["pairs", "live"])))]
pub struct CalibrateArgs {
    /// Six numbers a line (m): x y z of the fiducial, x y z of the other device; commas or blanks, header or not
    #[arg(long, value_name = "FILE")]
    pairs: Option<PathBuf>,
    /// Gather the pairs from a running driver, at this socket or the usual place, while you move the end points
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, default_missing_value = "", value_parser = path_or_nothing())]
    live: Option<PathBuf>,
    /// Which device's place is sought
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_device)]
    device: usize,
    /// Which device's place is known
    #[arg(long, value_name = "M", default_value_t = 0, value_parser = parse_device)]
    fiducial: usize,
    /// Allow scale and shear, as the thesis does; for arms whose link lengths are not known well
    #[arg(long)]
    affine: bool,
    /// Leave out the pairs that do not belong
    #[arg(long)]
    reject_outliers: bool,
    /// Where the fiducial stands (TOML)
    #[arg(long, value_name = "FILE")]
    layout: Option<PathBuf>,
    /// Write the layout here, or where `run --attach` looks for it; other devices' entries and comments are kept
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "", value_parser = path_or_nothing())]
    write: Option<PathBuf>,
    /// Draw residuals and points here (.svg or .png)
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the result as JSON instead of the layout
    #[arg(long)]
    json: bool,
    /// With --live: gather at most so long
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = parse_patience, conflicts_with = "pairs")]
    seconds: f64,
    /// With --live: keep the pairs here
    #[arg(long, value_name = "CSV", conflicts_with = "pairs")]
    save_pairs: Option<PathBuf>,
}

/// Why there is no calibration.
#[derive(Debug, Error)]
pub enum CalibrateFailure {
    /// One device cannot be placed relative to itself.
    #[error("--device {0} and --fiducial {0} are the same device; name two")]
    SameDevice(usize),
    /// Moving the master moves the fiducial with it.
    #[error(
        "{}: device {device} is the layout's master, and device {fiducial} is placed relative to it; calibrate the others against the master: --fiducial {device} --device {fiducial}",
        file.display()
    )]
    DeviceIsMaster {
        /// The layout.
        file: PathBuf,
        /// The master.
        device: usize,
        /// The fiducial.
        fiducial: usize,
    },
    /// The figure's name does not say what it is.
    #[error("--plot {}: found another ending; allowed: .svg or .png", .0.display())]
    PlotKind(PathBuf),
    /// The standard output is no file.
    #[error(
        "--{0} -: found `-`, allowed: a file (./- is one); without --write the layout goes to the standard output"
    )]
    NoStream(&'static str),
    /// Two files under one name.
    #[error("--{a} and --{b} name the same file {}; name two", file.display())]
    SameFile {
        /// An argument.
        a: &'static str,
        /// Another.
        b: &'static str,
        /// Their file.
        file: PathBuf,
    },
    /// A standard stream is one of the files.
    #[error(transparent)]
    Stream(RunFailure),
    /// The pairs cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The pairs are none.
    #[error("{}: {source}", file.display())]
    Pairs {
        /// The file.
        file: PathBuf,
        /// Why.
        source: PairsError,
    },
    /// The pairs determine nothing.
    #[error("{origin}: {source}")]
    Fit {
        /// Where the pairs come from.
        origin: String,
        /// Why.
        source: CalibrationError,
    },
    /// Some pairs spoil all others.
    #[error(
        "{origin}: {source} Without outliers (found: {count}, the first on line {line}) they do: look at those, or leave them out with --reject-outliers"
    )]
    Spoilt {
        /// Where the pairs come from.
        origin: String,
        /// What is wrong with all of them together.
        source: CalibrationError,
        /// How many do not belong.
        count: usize,
        /// Where the first is.
        line: usize,
    },
    /// An affine fit that is no device's.
    #[error(
        "the affine fit stretches by {:.3}, {:.3} and {:.3}; allowed: {} to {}. Are the right devices and units taken?",
        .scale[0], .scale[1], .scale[2], world::LEAST_STRETCH, world::MOST_STRETCH
    )]
    NotADevice {
        /// Stretch along the device's axes.
        scale: [f64; 3],
    },
    /// The layout to start from is wrong.
    #[error(transparent)]
    Layout(#[from] SceneError),
    /// The layout cannot be written.
    #[error(transparent)]
    Write(#[from] LayoutFileError),
    /// There is no place for the default layout.
    #[error(transparent)]
    Default(#[from] DefaultLayoutError),
    /// Gathering came to nothing.
    #[error(transparent)]
    Live(#[from] LiveError),
    /// The figure cannot be drawn.
    #[error("{}: {source}", file.display())]
    Plot {
        /// The file.
        file: PathBuf,
        /// Why.
        source: PlotError,
    },
    /// A result cannot be written.
    #[error("{}: cannot be written: {}", file.display(), limits::with_remedy(.source))]
    Output {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file for pairs cannot be written, which is found out before they are gathered.
    #[error(
        "--save-pairs {}: cannot be written: {}", file.display(),
        limits::with_remedy_or(.source, "name a file in a directory that can be written")
    )]
    PairsUnwritable {
        /// The file.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The layout is there, the figure is not.
    #[error("{failure}; the layout is written to {}: only the figure is missing", layout.display())]
    OnlyWritten {
        /// The layout.
        layout: PathBuf,
        /// Of the figure.
        failure: Box<CalibrateFailure>,
    },
    /// The result is told, and so was what could not be written beside it.
    #[error("what is told above is not written; all else is done")]
    AllElse,
    /// Pairs would take the place of something else.
    #[error(
        "--save-pairs {}: found a file that holds no pairs; name another one, or move it away", .0.display()
    )]
    NotPairs(PathBuf),
    /// Signals cannot be caught.
    #[error("cannot catch signals: {0}")]
    Signals(io::Error),
}

/// Runs the command.
pub fn run(args: &CalibrateArgs) -> ExitCode {
    match run_to_end(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            say(format_args!("phantom3 calibrate: {failure}"));
            ExitCode::from(if failure.is_fault() { 3 } else { 2 })
        }
    }
}

impl CalibrateFailure {
    /// True if it went wrong after it had begun.
    fn is_fault(&self) -> bool {
        match self {
            Self::Live(error) => error.is_fault(),
            Self::Write(error) => matches!(error, LayoutFileError::Write { .. }),
            Self::Plot { .. } | Self::Output { .. } | Self::OnlyWritten { .. } | Self::AllElse => true,
            _ => false,
        }
    }
}

fn run_to_end(args: &CalibrateArgs) -> Result<(), CalibrateFailure> {
    let mut plan = Plan::check(args)?;
    let (origin, pairs, is_saved) = get_pairs(args)?;
    // Others may have edited it since: devices are gathered at for minutes.
    let is_current = args.pairs.is_some() || is_done(plan.read_layout());
    if !is_current {
        plan.write = None;
    }
    let model = if args.affine { Model::Affine } else { Model::Rigid };
    let found = calibrate(&pairs, model)
        .map_err(|source| CalibrateFailure::Fit { origin: origin.clone(), source })?;
    if !args.reject_outliers {
        refuse_spoilt(&found, &origin)?;
    }
    let used = used_fit(&found, args.reject_outliers);
    let X_WN = plan.layout.placement(args.fiducial).then(&placement_of(used, model)?);
    let entry = plan.layout.entry_of(args.device, &X_WN);
    let text = layout_file::with_entry(&plan.base, plan.base_name(), args, &entry, &X_WN, used)?;
    let report = Report { origin: &origin, args, found: &found, used, X_WN: &X_WN, entry: &entry };
    // Each line by itself: lines behind the first of what is said are indented.
    for line in report.to_string().lines() {
        say(format_args!("{line}"));
    }
    if let Some(file) = &plan.write {
        // Whoever held two arms together for a minute shall not have to do it again for a full disk.
        layout_file::replace(file, &text).inspect_err(|_| {
            let _ = print(text.trim_end());
        })?;
        say(format_args!("layout       written to {}", file.display()));
    }
    if args.json {
        print(&report.json(plan.write.as_deref()))?;
    } else if plan.write.is_none() {
        print(text.trim_end())?;
    }
    let drawn = args.plot.as_ref().map_or(Ok(()), |file| draw(file, &pairs, &found, used));
    drawn.map_err(|failure| match plan.write {
        Some(layout) => CalibrateFailure::OnlyWritten { layout, failure: Box::new(failure) },
        None => failure,
    })?;
    if is_saved && is_current { Ok(()) } else { Err(CalibrateFailure::AllElse) }
}

/// False, once told, for what is to cost nothing else.
fn is_done(result: Result<(), CalibrateFailure>) -> bool {
    result.inspect_err(|failure| say(format_args!("phantom3 calibrate: {failure}"))).is_ok()
}

/// What can be checked before anybody moves a device.
struct Plan {
    /// Where the layout will be written.
    write: Option<PathBuf>,
    /// The layout that will be edited.
    base: String,
    base_file: Option<PathBuf>,
    layout: Layout,
}

impl Plan {
    fn check(args: &CalibrateArgs) -> Result<Self, CalibrateFailure> {
        if args.device == args.fiducial {
            return Err(CalibrateFailure::SameDevice(args.device));
        }
        if let Some(file) = &args.plot {
            figure::kind_of(file).ok_or_else(|| CalibrateFailure::PlotKind(file.clone()))?;
        }
        let stream = [("write", &args.write), ("plot", &args.plot), ("save-pairs", &args.save_pairs)]
            .into_iter()
            .find(|(_, file)| file.as_deref() == Some(Path::new("-")));
        if let Some((option, _)) = stream {
            return Err(CalibrateFailure::NoStream(option));
        }
        let write = match &args.write {
            Some(file) if file.as_os_str().is_empty() => Some(default_layout::path()?),
            other => other.clone(),
        };
        refuse_same_file(args, write.as_deref())?;
        refuse_streams(args, write.as_deref())?;
        write.as_deref().map_or(Ok(()), layout_file::refuse_other_than_file)?;
        let edited = write.as_ref().filter(|file| file.exists());
        if let (Some(edited), Some(given)) = (edited, &args.layout)
            && !is_same_file(edited, given)
        {
            return Err(LayoutFileError::WouldReplace { file: edited.clone(), given: given.clone() }.into());
        }
        let base_file = args.layout.clone();
        let mut plan = Self { write, base: String::new(), base_file, layout: Layout::default() };
        plan.read_layout()?;
        if plan.layout.master() == Some(args.device) {
            let file = plan.base_name().into();
            let (device, fiducial) = (args.device, args.fiducial);
            return Err(CalibrateFailure::DeviceIsMaster { file, device, fiducial });
        }
        Ok(plan)
    }

    /// The layout as it is now; one that is edited may be there only since a moment. One that is wrong leaves that of before.
    fn read_layout(&mut self) -> Result<(), CalibrateFailure> {
        if self.base_file.is_none() {
            self.base_file = self.write.clone().filter(|file| file.exists());
        }
        let base = self.base_file.as_deref().map(layout_file::read).transpose()?.unwrap_or_default();
        self.layout = Layout::parse(&base, self.base_file.as_deref().unwrap_or(Path::new("layout")))?;
        self.base = base;
        Ok(())
    }

    fn base_name(&self) -> &Path {
        self.base_file.as_deref().unwrap_or(Path::new("the new layout"))
    }
}

/// Nothing that is read may be written, and nothing be written twice.
fn refuse_same_file(args: &CalibrateArgs, write: Option<&Path>) -> Result<(), CalibrateFailure> {
    let outputs =
        [("write", write), ("plot", args.plot.as_deref()), ("save-pairs", args.save_pairs.as_deref())];
    let inputs = [("pairs", args.pairs.as_deref()), ("layout", args.layout.as_deref())];
    let all: Vec<_> =
        inputs.into_iter().chain(outputs).filter_map(|(name, file)| Some((name, file?))).collect();
    for (index, (b, file)) in all.iter().enumerate() {
        for (a, other) in &all[..index] {
            let may_be_edited = (*a, *b) == ("layout", "write");
            if !may_be_edited && (file == other || is_same_place(file, other)) {
                return Err(CalibrateFailure::SameFile { a, b, file: file.to_path_buf() });
            }
        }
    }
    Ok(())
}

/// The same, where a shell leads a standard stream into the file.
fn refuse_streams(args: &CalibrateArgs, write: Option<&Path>) -> Result<(), CalibrateFailure> {
    let outputs =
        [("--write", write), ("--plot", args.plot.as_deref()), ("--save-pairs", args.save_pairs.as_deref())];
    let outputs = outputs.into_iter().filter_map(|(option, file)| Some(Output::of_option(option, file?)));
    let inputs: Vec<&PathBuf> = args.pairs.iter().chain(&args.layout).collect();
    outputs::check_streams(&outputs.collect::<Vec<_>>(), &inputs).map_err(CalibrateFailure::Stream)
}

/// Origin of the pairs in words, the pairs, and whether they are saved as was asked.
fn get_pairs(args: &CalibrateArgs) -> Result<(String, Vec<Pair>, bool), CalibrateFailure> {
    if let Some(file) = &args.pairs {
        let text =
            read_pairs(file).map_err(|source| CalibrateFailure::Unreadable { file: file.clone(), source })?;
        let pairs =
            parse_pairs(&text).map_err(|source| CalibrateFailure::Pairs { file: file.clone(), source })?;
        return Ok((file.display().to_string(), pairs, true));
    }
    let signals = StopSignals::install().map_err(CalibrateFailure::Signals)?;
    let socket = args.live.as_ref().filter(|socket| !socket.as_os_str().is_empty());
    let wish = live::Wish {
        socket: socket.cloned().unwrap_or_else(|| usual_socket("phantom3")),
        fiducial: args.fiducial,
        other: args.device,
        seconds: args.seconds,
    };
    // Found out now, not after a minute of holding two arms together.
    args.save_pairs.as_ref().map_or(Ok(()), |file| refuse_unwritable(file))?;
    let gathered = live::gather(&wish, &signals);
    // Pairs that determine nothing do not replace a file.
    let is_worth = |file: &&PathBuf| gathered.pairs.len() >= FEWEST_PAIRS || !file.exists();
    let has_result = gathered.end.is_ok() || !gathered.pairs.is_empty();
    let file = args.save_pairs.as_ref().filter(|_| has_result).filter(is_worth);
    let is_saved = file.is_none_or(|file| is_done(save_pairs(file, &gathered.pairs)));
    gathered.end?;
    Ok((wish.socket.display().to_string(), gathered.pairs, is_saved))
}

/// Pairs that a rigid transform takes.
const FEWEST_PAIRS: usize = 3;

/// Pipes that somebody writes are welcome; what never begins or never ends is not.
fn read_pairs(file: &Path) -> io::Result<String> {
    let bytes = input_file::read_all(input_file::open_stream(file)?, MAX_PAIRS_BYTES)?;
    if let Some(words) = file_kind::mistaken(&bytes) {
        return Err(io::Error::new(io::ErrorKind::InvalidData, words));
    }
    let text = input_file::text(bytes)?;
    match separators::mistaken_ends(&text) {
        Some(words) => Err(io::Error::new(io::ErrorKind::InvalidData, words)),
        None => Ok(text),
    }
}

/// Room for as many pairs as there may be, with all their digits.
const MAX_PAIRS_BYTES: u64 = 256 << 20;

/// Earlier pairs stay until there are others, and everything else stays.
fn refuse_unwritable(file: &Path) -> Result<(), CalibrateFailure> {
    let is_table = |file: &Path| file.metadata().is_ok_and(|found| found.is_file() && found.len() > 0);
    if is_table(file)
        && !read_pairs(file).is_ok_and(|text| parse_pairs(&text).is_ok() || text.trim_end() == HEADER)
    {
        return Err(CalibrateFailure::NotPairs(file.into()));
    }
    let begun = Replacement::begin(file).map(drop);
    begun.map_err(|source| CalibrateFailure::PairsUnwritable { file: file.into(), source })
}

/// Numbers as short as they can be read back exactly.
fn save_pairs(file: &Path, pairs: &[Pair]) -> Result<(), CalibrateFailure> {
    let mut text = format!("{HEADER}\n");
    for pair in pairs {
        let numbers: Vec<String> =
            pair.fiducial.iter().chain(pair.other.iter()).map(|number| format!("{number:?}")).collect();
        text += &numbers.join(",");
        text.push('\n');
    }
    replacement::write(file, text).map_err(|source| CalibrateFailure::Output { file: file.into(), source })
}

const HEADER: &str = "fiducial_x_m,fiducial_y_m,fiducial_z_m,other_x_m,other_y_m,other_z_m";

fn refuse_spoilt(found: &Calibration, origin: &str) -> Result<(), CalibrateFailure> {
    let Some(source) = found.all_refused.clone() else { return Ok(()) };
    let listed = &found.outliers.listed;
    let line = listed.first().map_or(0, |outlier| outlier.line);
    Err(CalibrateFailure::Spoilt { origin: origin.into(), source, count: listed.len(), line })
}

fn used_fit(found: &Calibration, reject_outliers: bool) -> &Fit {
    found.without_outliers.as_ref().filter(|_| reject_outliers).unwrap_or(&found.all)
}

fn placement_of(fit: &Fit, model: Model) -> Result<Placement, CalibrateFailure> {
    match model {
        Model::Rigid => Ok(Placement::Rigid(fit.transform.rigid())),
        Model::Affine => Placement::affine(fit.transform.matrix, fit.transform.position)
            .ok_or_else(|| CalibrateFailure::NotADevice { scale: fit.transform.shape().scale }),
    }
}

fn draw(file: &Path, pairs: &[Pair], found: &Calibration, used: &Fit) -> Result<(), CalibrateFailure> {
    let plot = |source| CalibrateFailure::Plot { file: file.into(), source };
    let figure = figure::figure(pairs, found, used);
    let bytes = match figure::kind_of(file) {
        Some(figure::Kind::Png) => figure.png().map_err(plot)?,
        _ => figure.svg().map_err(plot)?.into_bytes(),
    };
    replacement::write(file, bytes).map_err(|source| CalibrateFailure::Output { file: file.into(), source })
}

/// A closed pipe is no reason to fail: nobody wants to know. A full disk is: the result is lost.
fn print(text: &str) -> Result<(), CalibrateFailure> {
    use std::io::Write;
    match writeln!(io::stdout(), "{text}") {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(CalibrateFailure::Output { file: "standard output".into(), source })
        }
        _ => Ok(()),
    }
}

/// Clap's own paths are never empty, not even by default.
fn path_or_nothing() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

fn parse_device(text: &str) -> Result<usize, String> {
    let index = text.parse().ok().filter(|index| *index < MAX_DEVICES);
    index.ok_or_else(|| format!("found {text}, allowed: a device's index, 0 to {}", MAX_DEVICES - 1))
}

fn parse_patience(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.1..=3600.0).contains(seconds));
    seconds.ok_or_else(|| format!("found {text}, allowed: 0.1 to 3600 seconds"))
}
