//! Output files of a command, checked before anything runs.

use crate::outcome::RunFailure;
use crate::record::destination::{EventFormat, FormatError, RunFormat, is_same_file, is_same_place, shown};
use io_driver::print::print_for;
use rt_core::plain_text::PlainLines;
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

    /// Of a scene that is made of others.
    pub(crate) fn scene(file: &'a Path) -> Self {
        Self { option: "--out", file, kind: Kind::Scene }
    }

    /// Of a model that was understood.
    pub(crate) fn model(file: &'a Path) -> Self {
        Self { option: "--repair", file, kind: Kind::Model }
    }

    /// Of an export; its format has been looked at.
    pub(crate) fn table(file: &'a Path) -> Self {
        Self { option: "the table", file, kind: Kind::Table }
    }

    fn format(&self) -> Result<(), FormatError> {
        match self.kind {
            Kind::Ticks => RunFormat::of(self.file).map(drop),
            Kind::Events => EventFormat::of(self.file).map(drop),
            Kind::Picture | Kind::Scene | Kind::Model | Kind::Table => Ok(()),
        }
    }
}

/// Refuses outputs that would overwrite an input or one another, or whose names say no format.
///
/// # Errors
/// The first that is wrong, with what to do.
pub(crate) fn check(outputs: &[Output<'_>], inputs: &[&PathBuf]) -> Result<(), RunFailure> {
    for (index, output) in outputs.iter().enumerate() {
        let Output { option, file, .. } = output;
        let place = file.display();
        if let Some(input) = inputs.iter().find(|input| is_same_file(file, input)) {
            let input = input.display();
            return refused(format_args!(
                "{option} {place} would overwrite the input {input}; name another file"
            ));
        }
        if let Some(other) = outputs[..index].iter().find(|other| is_same_place(other.file, file)) {
            return refused_twice(other, output);
        }
        output.format().or_else(|error| refused(format_args!("{option} {error}")))?;
    }
    Ok(())
}

fn refused_twice(first: &Output<'_>, second: &Output<'_>) -> Result<(), RunFailure> {
    let (place, both) = (second.file.display(), shown(second.file));
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
