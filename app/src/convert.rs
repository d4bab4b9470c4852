//! `phantom3 convert`: the scene files of the thesis' own program as a scene of ours (Melder figures 7.2 and 7.3).
//!
//! What the files may hold is told in [`world::thesis`].

use crate::outcome::{RunFailure, Stop};
use crate::outputs::{self, Output};
use clap::Args;
use io_driver::say::say;
use rt_core::plain_text::beginning;
use rt_core::{input_file, limits, replacement};
use std::path::{Path, PathBuf};
use world::MAX_FILE_BYTES;
use world::thesis::{Conversion, Converted, ObjectFile, ObjectKind, read_list, read_object};

/// The arguments of `phantom3 convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// A scene list (`objects.ini`), or a single object file, of which an entity to include is made
    file: PathBuf,
    /// Where the object files are [default: beside the list]
    #[arg(long, value_name = "DIR")]
    objects: Option<PathBuf>,
    /// What to write before the names of mesh files, relative to the scene
    #[arg(long, value_name = "DIR")]
    meshes: Option<PathBuf>,
    /// Where to write the scene [default: standard output]
    #[arg(long, short, value_name = "TOML")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read or holds what it may not; a result that cannot be written.
pub fn execute(args: &ConvertArgs) -> Result<Stop, RunFailure> {
    let mut inputs = vec![args.file.clone()];
    let outputs: Vec<_> = args.out.iter().map(|out| Output::scene(out)).collect();
    // A shell may have emptied it already, which would be told as a mistake in it.
    outputs::check(&outputs, &[&args.file])?;
    let converted = convert(args, &mut inputs)?;
    outputs::check(&outputs, &inputs.iter().collect::<Vec<_>>())?;
    for told in &converted.told {
        say(format_args!("phantom3: {told}"));
    }
    match &args.out {
        Some(out) => replacement::write(out, &converted.toml).map_err(|error| not_written(out, &error))?,
        None => outputs::print(&converted.toml),
    }
    Ok(Stop::Finished)
}

fn not_written(out: &Path, error: &std::io::Error) -> RunFailure {
    let why = limits::with_remedy_or(error, "name a file in a directory that exists and can be written");
    RunFailure::Results(format!("cannot write {}: {why}", out.display()))
}

/// The scene; what is read for it besides the list joins the inputs.
fn convert(args: &ConvertArgs, inputs: &mut Vec<PathBuf>) -> Result<Converted, RunFailure> {
    let text = read(&args.file)?;
    if text.lines().all(|line| line.split("//").next().is_none_or(|words| words.trim().is_empty())) {
        return Err(RunFailure::Start(format!(
            "{}: found nothing but comments and empty lines; expected a list of objects, or keys and values of one",
            args.file.display()
        )));
    }
    let meshes = args.meshes.as_ref().map_or_else(String::new, |dir| format!("{}/", dir.display()));
    if text.lines().any(|line| line.split("//").next().is_some_and(|words| words.contains('='))) {
        let object = parsed(&args.file, &text)?;
        let mut conversion = Conversion::of_part(&meshes);
        conversion.add(ObjectKind::GameObject, &object, &[]).map_err(|error| wrong(&error))?;
        return Ok(conversion.finish(false));
    }
    let beside = args.file.parent().unwrap_or(Path::new("")).to_path_buf();
    let objects = args.objects.clone().unwrap_or(beside);
    // The scene is called as its file, as scenes are.
    let name = args.out.as_ref().unwrap_or(&args.file).file_stem().unwrap_or_default().to_string_lossy();
    let mut conversion = Conversion::new(&name, &meshes);
    for entry in read_list(&text, &args.file).map_err(|error| wrong(&error))? {
        let named_by = format!("{}:{}", args.file.display(), entry.line);
        let object = open(&objects, &entry.object, &named_by)?;
        let named_by = object.file().display().to_string();
        let parts = object.parts().into_iter().map(|part| open(&objects, &part, &named_by));
        let parts: Vec<ObjectFile> = parts.collect::<Result<_, _>>()?;
        inputs.extend([&object].into_iter().chain(&parts).map(|read| read.file().to_path_buf()));
        conversion.add(entry.kind, &object, &parts).map_err(|error| wrong(&error))?;
    }
    Ok(conversion.finish(true))
}

/// The list leaves out the ending; the figures do not show it.
fn open(objects: &Path, name: &str, named_by: &str) -> Result<ObjectFile, RunFailure> {
    let tried = ["", ".ini", ".txt"].map(|ending| objects.join(format!("{name}{ending}")));
    let file = tried.iter().find(|file| file.is_file()).ok_or_else(|| {
        RunFailure::Start(format!(
            "{named_by}: no object file {}, with or without .ini or .txt; --objects says where they are",
            objects.join(&*beginning(name)).display()
        ))
    })?;
    parsed(file, &read(file)?)
}

fn parsed(file: &Path, text: &str) -> Result<ObjectFile, RunFailure> {
    read_object(text, file).map_err(|error| wrong(&error))
}

fn read(file: &Path) -> Result<String, RunFailure> {
    let unreadable = |what: String| RunFailure::Start(format!("{}: {what}", file.display()));
    let bytes = input_file::read(file, MAX_FILE_BYTES)
        .map_err(|error| unreadable(format!("cannot be read: {error}")))?;
    // Files of that time are in Latin-1 as often as not; what matters in them is ASCII.
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| error.into_bytes().iter().map(|byte| char::from(*byte)).collect()))
}

fn wrong(error: &world::thesis::ThesisError) -> RunFailure {
    RunFailure::Start(error.to_string())
}
