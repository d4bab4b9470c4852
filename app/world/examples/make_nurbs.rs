//! Writes rational patches as TOML to standard output: those in `config/nurbs`, and others to try.
//!
//! `cargo run --release -p world --example make_nurbs -- KIND [SIZE_M] > FILE.toml`

use haptics::NurbsPatch;
use haptics::nurbs::make;
use std::io::Write;
use std::process::ExitCode;

const USAGE: &str = "\
usage: make_nurbs KIND [SIZE_M] > FILE.toml
  KIND    ball, ring, cylinder, vase, mouse, sheet
  SIZE_M  about how large it is, in metres; default 0.08
example
  make_nurbs vase 0.1 > vase.toml";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(text) = text(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_nurbs: cannot write: {error}");
            ExitCode::FAILURE
        }
    }
}

fn text(arguments: &[String]) -> Option<String> {
    let (kind, size_m) = match arguments {
        [kind] => (kind, 0.08),
        [kind, size_m] => (kind, size_m.parse().ok().filter(|size: &f64| size.is_finite() && *size > 0.0)?),
        _ => return None,
    };
    let about = format!(
        "# Written by `make_nurbs {kind} {size_m}`. Metres, y up; points: x, y, z, weight; u runs first.\n\n"
    );
    Some(about + &world::model::write_patches(&patches(kind, size_m)?))
}

fn patches(kind: &str, size_m: f64) -> Option<Vec<NurbsPatch>> {
    Some(match kind {
        "ball" => make::sphere(0.5 * size_m),
        "ring" => make::torus(0.375 * size_m, 0.125 * size_m),
        "cylinder" => make::cylinder(0.25 * size_m, size_m),
        "vase" => make::vase(size_m),
        "mouse" => make::mouse(size_m),
        "sheet" => make::sheet(8, size_m, 0.05 * size_m),
        _ => return None,
    })
}
