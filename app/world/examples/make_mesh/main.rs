//! Writes a mesh as OBJ or STL to standard output: those in `config/meshes`, and large ones to try.
//!
//! `cargo run --release -p world --example make_mesh -- KIND [NUMBER [SIZE_M [FORMAT]]] > FILE`

mod written;

use std::io::Write;
use std::process::ExitCode;
use written::{Format, KINDS};

const USAGE: &str = "\
usage: make_mesh KIND [NUMBER [SIZE_M [FORMAT]]] > FILE
  KIND    sphere, bumpy, torus, klein, mobius (NUMBER: segments around, about NUMBER^2 triangles),
          star (NUMBER: rays), wedge (NUMBER: degrees), cuboid (NUMBER is not used)
  SIZE_M  about how large it is, in metres; default 0.04
  FORMAT  obj (default), stl (binary), stl-text
examples
  make_mesh bumpy 1000 0.1 stl > bumpy-1M.stl     # 998,000 triangles, 50 MB
  make_mesh cuboid 0 0.04 > cube.obj";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(bytes) = bytes(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match std::io::stdout().lock().write_all(&bytes) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("make_mesh: cannot write: {error}");
            ExitCode::FAILURE
        }
    }
}

fn bytes(arguments: &[String]) -> Option<Vec<u8>> {
    let [kind, rest @ ..] = arguments else { return None };
    let (_, usual, make) = KINDS.iter().find(|(name, ..)| name == kind)?;
    let number = rest.first().map_or(Some(*usual), |number| number.parse().ok())?;
    let size_m: f64 = rest.get(1).map_or(Some(0.04), |size| size.parse().ok())?;
    let format = rest.get(2).map_or(Some(Format::Obj), |format| format_named(format))?;
    let is_sound = rest.len() <= 3 && number <= 10_000 && size_m.is_finite() && size_m > 0.0;
    (is_sound && (number >= 3 || kind == "cuboid")).then(|| format.write(&make(number, size_m)))
}

fn format_named(name: &str) -> Option<Format> {
    match name {
        "obj" => Some(Format::Obj),
        "stl" => Some(Format::Stl),
        "stl-text" => Some(Format::StlText),
        _ => None,
    }
}
