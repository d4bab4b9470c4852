//! Writes a picture of heights as a greyscale PNG to standard output: those in `config/pictures`, and others to try.
//!
//! `cargo run --release -p world --example make_picture -- KIND [SIDE [BITS]] > FILE`

mod drawn;

use drawn::{Depth, KINDS};
use std::io::Write;
use std::process::ExitCode;

const USAGE: &str = "\
usage: make_picture KIND [SIDE [BITS]] > FILE
  KIND  bumps, dimples, ridges, weave, pebbles; all can be repeated without a seam
  SIDE  texels along either side, 1 to 4096; default 64
  BITS  8 or 16 (default)
example
  make_picture bumps 64 16 > bumps.png";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(bytes) = bytes(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match std::io::stdout().lock().write_all(&bytes) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_picture: cannot write: {error}");
            ExitCode::FAILURE
        }
    }
}

fn bytes(arguments: &[String]) -> Option<Vec<u8>> {
    let [kind, rest @ ..] = arguments else { return None };
    let (_, draw) = KINDS.iter().find(|(name, _)| name == kind)?;
    let side: usize = rest.first().map_or(Some(64), |side| side.parse().ok())?;
    let depth = match rest.get(1).map(String::as_str) {
        None | Some("16") => Depth::Sixteen,
        Some("8") => Depth::Eight,
        Some(_) => return None,
    };
    ((1..=4096).contains(&side) && rest.len() <= 2).then(|| drawn::png(*draw, side, depth))
}
