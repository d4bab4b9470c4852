//! Parsing of command lines whose refusals are plain text.
//!
//! Model: `clap` repeats an argument that it refuses as it was given. Where one holds what a terminal would act on, the
//! refusal is told without colours and with that argument escaped.

use clap::Parser;
use clap::error::ErrorKind;
use rt_core::plain_text::{PlainLines, plain};
use std::io::Write;

/// The process's own command line; refusals and `--help` end the process as `clap` would.
pub fn parse<P: Parser>() -> P {
    parse_with(|_| ())
}

/// The same; `advise` may add a tip to a refusal.
pub fn parse_with<P: Parser>(advise: impl FnOnce(&mut clap::Error)) -> P {
    P::try_parse().unwrap_or_else(|mut error| {
        advise(&mut error);
        refuse(&error)
    })
}

fn refuse(error: &clap::Error) -> ! {
    let said = error.render().to_string();
    let plain = plain_refusal(&said, std::env::args_os().map(|word| word.to_string_lossy().into_owned()));
    let is_an_answer = matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion);
    if is_an_answer || plain == said {
        error.exit();
    }
    // Nobody to tell is no reason for another status.
    let _ = std::io::stderr().write_all(plain.as_bytes());
    std::process::exit(error.exit_code())
}

/// A refusal of several lines, in which words of the command line are escaped as a whole, line breaks included.
fn plain_refusal(said: &str, words: impl Iterator<Item = String>) -> String {
    let escaped = words.fold(said.to_owned(), |said, word| {
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
        let harmless = plain_refusal("error: b\n", ["x", "b"].map(str::to_owned).into_iter());
        assert_eq!(harmless, "error: b\n");
    }
}
