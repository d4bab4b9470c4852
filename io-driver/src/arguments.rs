//! Parsing of command lines whose refusals are plain text.
//!
//! Model: `clap` repeats an argument that it refuses as it was given. Where one holds what a terminal would act on, the
//! refusal is told without colours and with that argument escaped. One that would fill screens is cut short.

use crate::cli::EXIT_FAULT;
use crate::say::say;
use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use rt_core::plain_text::{PlainLines, beginning, plain};
use rt_core::{limits, separators};
use std::io::Write;
use std::sync::OnceLock;

/// The process's own command line; refusals and `--help` end the process as `clap` would.
pub fn parse<P: Parser>() -> P {
    parse_with(|_| ())
}

/// The same; `advise` may add a tip to a refusal.
pub fn parse_with<P: Parser>(advise: impl FnOnce(&mut clap::Error)) -> P {
    P::try_parse().unwrap_or_else(|mut error| {
        advise(&mut error);
        advise_of_decimal_comma(&mut error);
        refuse(&error, P::command().get_name())
    })
}

/// `--from 0,5`
fn advise_of_decimal_comma(error: &mut clap::Error) {
    let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue) else { return };
    let tip = separators::hint_for_cell(value).trim_start_matches("; ");
    if error.kind() == ErrorKind::ValueValidation && !tip.is_empty() && !error.to_string().contains(tip) {
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip.into()]));
    }
}

fn refuse(error: &clap::Error, program: &str) -> ! {
    let said = error.render().to_string();
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        answer(error, program);
    }
    let plain = plain_refusal(&said, words());
    if plain == said {
        error.exit();
    }
    // Nobody to tell is no reason for another status.
    let _ = std::io::stderr().write_all(plain.as_bytes());
    std::process::exit(error.exit_code())
}

/// Prints help or a version, and ends the process: with status 3 if that is lost.
fn answer(error: &clap::Error, program: &str) -> ! {
    let printed = error.print().and_then(|()| std::io::stdout().flush());
    match printed {
        Err(lost) if lost.kind() != std::io::ErrorKind::BrokenPipe => {
            let why = limits::with_remedy(&lost);
            say(format_args!("{program}: cannot write the standard output: {why}"));
            std::process::exit(EXIT_FAULT.into())
        }
        _ => std::process::exit(error.exit_code()),
    }
}

fn words() -> impl Iterator<Item = String> {
    std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned())
}

/// A text in which words of the command line that fill screens are cut short; paths that can be are not so long.
pub fn shortened(text: String) -> String {
    static LONG: OnceLock<Vec<String>> = OnceLock::new();
    let long = LONG.get_or_init(|| words().flat_map(|word| long_parts(&word)).collect());
    long.iter().fold(text, |text, word| text.replace(word.as_str(), &beginning(word)))
}

/// The word, and what stands behind its `=`.
fn long_parts(word: &str) -> Vec<String> {
    let value = word.split_once('=').map(|(_, value)| value);
    let parts = value.into_iter().chain([word]);
    parts.filter(|part| part.len() > MOST_BYTES).map(str::to_owned).collect()
}

/// Longer than a path that is used, and far less than the longest that Linux takes (4096).
const MOST_BYTES: usize = 1000;

/// A refusal of several lines, in which words of the command line are escaped as a whole, line breaks included.
fn plain_refusal(said: &str, words: impl Iterator<Item = String>) -> String {
    let escaped = words.fold(said.to_owned(), |said, word| {
        let said = long_parts(&word).iter().fold(said, |said, long| said.replace(long, &beginning(long)));
        let value = word.split_once('=').map(|(_, value)| value.to_owned());
        let harmful = [Some(word), value].into_iter().flatten().filter(|word| plain(word) != word.as_str());
        harmful.fold(said, |said, word| said.replace(&word, &plain(&word)))
    });
    PlainLines(escaped).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refused_words_cannot_act_on_the_terminal_nor_forge_lines() {
        let said = "error: invalid value 'a\n\u{1b}[2J' for '--rate-hz <HZ>'\n\nUsage: x\n";
        let words = ["x", "--rate-hz=a\n\u{1b}[2J"].map(str::to_owned);
        let plain = plain_refusal(said, words.into_iter());
        assert_eq!(plain, "error: invalid value 'a\\n\\u{1b}[2J' for '--rate-hz <HZ>'\n\nUsage: x\n");
        let long = "x".repeat(100_000);
        let said = format!("error: invalid value '{long}' for '--seconds <S>': found {long}\n");
        let short = plain_refusal(&said, [format!("--seconds={long}")].into_iter());
        let begin = "x".repeat(60) + "...";
        assert_eq!(short, format!("error: invalid value '{begin}' for '--seconds <S>': found {begin}\n"));
        let harmless = plain_refusal("error: b\n", ["x", "b"].map(str::to_owned).into_iter());
        assert_eq!(harmless, "error: b\n");
    }
}
