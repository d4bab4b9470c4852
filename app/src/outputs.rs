//! Output files of a command, checked before anything runs.

use crate::outcome::RunFailure;
use crate::record::destination::{
    EventFormat, FormatError, RunFormat, STANDARD_OUTPUT, Stream, is_same_file, is_same_place,
    is_standard_output, place_of, shown,
};
use io_driver::print::print_for;
use rt_core::plain_text::PlainLines;
use std::ffi::OsStr;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file to be written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Output<'a> {
    option: &'static str,
    file: &'a Path,
    kind: Kind,
}

/// What goes into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Ticks,
    Events,
    Picture,
    /// A directory of them.
    Film,
    /// Named by a stem: an SVG and perhaps a PNG.
    Chart,
    Scene,
    Model,
    Table,
}

impl<'a> Output<'a> {
    /// Of `--record`.
    pub(crate) fn ticks(file: &'a Path) -> Self {
        Self { option: "--record", file, kind: Kind::Ticks }
    }

    /// Of `--events`.
    pub(crate) fn events(file: &'a Path) -> Self {
        Self { option: "--events", file, kind: Kind::Events }
    }

    /// Of `--snapshot`.
    pub(crate) fn picture(file: &'a Path) -> Self {
        Self { option: "--snapshot", file, kind: Kind::Picture }
    }

    /// Of `--frames`.
    pub(crate) fn film(directory: &'a Path) -> Self {
        Self { option: "--frames", file: directory, kind: Kind::Film }
    }

    /// Of a plot, with its ending.
    pub(crate) fn chart(file: &'a Path) -> Self {
        Self { option: "the picture", file, kind: Kind::Chart }
    }

    /// Of a scene that is made of others.
    pub(crate) fn scene(file: &'a Path) -> Self {
        Self { option: "--out", file, kind: Kind::Scene }
    }

    /// Of a model that was understood.
    pub(crate) fn model(file: &'a Path) -> Self {
        Self { option: "--repair", file, kind: Kind::Model }
    }

    /// Of an option of calibration.
    pub(crate) fn of_option(option: &'static str, file: &'a Path) -> Self {
        Self { option, file, kind: Kind::Table }
    }

    /// Of an export; its format has been looked at.
    pub(crate) fn table(file: &'a Path) -> Self {
        Self { option: "the table", file, kind: Kind::Table }
    }

    fn format(&self) -> Result<(), FormatError> {
        match self.kind {
            Kind::Ticks => RunFormat::of(self.file).map(drop),
            Kind::Events => EventFormat::of(self.file).map(drop),
            Kind::Picture | Kind::Film | Kind::Chart | Kind::Scene | Kind::Model | Kind::Table => Ok(()),
        }
    }

    /// True if it would be written over this file.
    fn replaces(&self, other: &Path) -> bool {
        match self.kind {
            Kind::Film => is_frame_in(self.file, other),
            _ => is_same_file(self.file, other),
        }
    }

    /// True if both would be written to the same place.
    fn meets(&self, other: &Self) -> bool {
        match (self.kind, other.kind) {
            (Kind::Film, Kind::Film) => false,
            (Kind::Film, _) => is_frame_in(self.file, other.file),
            (_, Kind::Film) => is_frame_in(other.file, self.file),
            _ => is_same_place(self.file, other.file),
        }
    }
}

/// True if a film into this directory may have a picture of this name, by whichever links.
fn is_frame_in(directory: &Path, file: &Path) -> bool {
    let place = place_of(file);
    let is_frame = |name: &str| {
        let number = name.strip_prefix("frame-").and_then(|name| name.strip_suffix(".png"));
        number.is_some_and(|number| number.len() >= 6 && number.bytes().all(|byte| byte.is_ascii_digit()))
    };
    place.file_name().and_then(OsStr::to_str).is_some_and(is_frame)
        && place.parent().is_some_and(|parent| is_same_place(parent, &place_of(directory)))
}

/// Refuses standard streams that a shell has led into one of these files.
///
/// # Errors
/// The first, with what to do.
pub(crate) fn check_streams(outputs: &[Output<'_>], inputs: &[&PathBuf]) -> Result<(), RunFailure> {
    check_standard_output(inputs)?;
    outputs.iter().try_for_each(refuse_stream)
}

/// Refuses outputs that would overwrite an input or one another, or whose names say no format; the standard output, where
/// a report goes if nothing else does, is one of them.
///
/// # Errors
/// The first that is wrong, with what to do.
pub(crate) fn check(outputs: &[Output<'_>], inputs: &[&PathBuf]) -> Result<(), RunFailure> {
    check_standard_output(inputs)?;
    for (index, output) in outputs.iter().enumerate() {
        let Output { option, file, .. } = output;
        let place = file.display();
        if let Some(input) = inputs.iter().find(|input| output.replaces(input)) {
            let input = input.display();
            let what = if output.kind == Kind::Film { "directory" } else { "file" };
            return refused(format_args!(
                "{option} {place} would overwrite the input {input}; name another {what}"
            ));
        }
        if let Some(other) = outputs[..index].iter().find(|other| other.meets(output)) {
            return refused_twice(other, output);
        }
        refuse_stream(output)?;
        output.format().or_else(|error| refused(format_args!("{option} {error}")))?;
    }
    Ok(())
}

/// A shell may have led it into a file that is read.
fn check_standard_output(inputs: &[&PathBuf]) -> Result<(), RunFailure> {
    let is_replaced = |input: &&&PathBuf| {
        // What stands for the standard output stands for the standard input here.
        let is_stream = input.as_os_str() == STANDARD_OUTPUT;
        if is_stream { Stream::Output.is_also(Stream::Input) } else { Stream::Output.is(input) }
    };
    let Some(input) = inputs.iter().find(is_replaced) else { return Ok(()) };
    let input = input.display();
    refused(format_args!("the standard output would overwrite the input {input}; send it to another file"))
}

/// Refusal of an output into whose file a shell has led a standard stream: both would be written or read there.
fn refuse_stream(Output { option, file, kind }: &Output<'_>) -> Result<(), RunFailure> {
    if is_standard_output(file) || *kind == Kind::Film {
        return Ok(());
    }
    let Some(stream) = Stream::that_is(file) else { return Ok(()) };
    let (place, verb) = (file.display(), if stream == Stream::Input { "comes from" } else { "goes to" });
    refused(format_args!(
        "{option} {place} is the file that {} {verb}; each needs a file of its own",
        stream.name()
    ))
}

fn refused_twice(first: &Output<'_>, second: &Output<'_>) -> Result<(), RunFailure> {
    let place = second.file.display();
    // That of a film is a directory.
    let both = shown(if second.kind == Kind::Film { first.file } else { second.file });
    if first.option == second.option {
        let option = second.option;
        return refused(format_args!("{option} {place} is given twice; each needs a file of its own"));
    }
    refused(format_args!(
        "{} {} and {} {place} would both write to {}; each needs a file of its own",
        first.option,
        first.file.display(),
        second.option,
        both.display()
    ))
}

fn refused(words: std::fmt::Arguments<'_>) -> Result<(), RunFailure> {
    Err(RunFailure::Start(words.to_string()))
}

/// Tells people a result: on the standard output, or on standard error where that is a table.
pub(crate) fn tell(words: &dyn Display, is_output_taken: bool) {
    let words = PlainLines(words);
    if is_output_taken {
        // Where nothing else can be said.
        let _ = writeln!(io::stderr(), "{words}");
    } else {
        print(&format!("{words}\n"));
    }
}

/// Prints on the standard output, as [`io_driver::print`] says.
pub(crate) fn print(text: &str) {
    print_for("phantom3", text);
}
