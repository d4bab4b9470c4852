//! `phantom3 check MODEL`: how a model file is understood; and that written down as OBJ.
//!
//! Model: the file is read and its mesh is built as for a scene without a `scale`: lengths are in the file's own unit. What is
//! written (`--repair`) is what was built: equal vertices merged, faces turned, divided and left out, lids in a group of
//! their own. A file that was written so has nothing left to repair, but for edges along which parts touch: their vertices are
//! in the same places, and are merged and parted again.

use super::{CheckArgs, patch_file};
use crate::outputs::{self, Output};
use haptics::mesh::{CloseHoles, Mesh, MeshReport, Sides};
use io_driver::say::say;
use nalgebra::Vector3;
use rt_core::plain_text::{PlainJson, PlainLines};
use rt_core::{limits, replacement};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use world::model::{self, FaceNames, Format, ModelError};

/// Runs the command: status 0 if the model can be felt, 2 if it cannot, or the options do not fit, 3 if it can and is not
/// written.
pub(crate) fn execute(args: &CheckArgs) -> ExitCode {
    let found = understand(args);
    if let Err(NotUnderstood::Model(_)) = &found
        && let Some(told) = patch_file::execute(args)
    {
        return told;
    }
    let written = match (&found, &args.repair) {
        (Ok(understood), Some(out)) => understood.write(out),
        _ => Ok(()),
    };
    let file = args.scene.display();
    let said = match (&found, args.json) {
        (_, true) => format!("{}\n", PlainJson(format_args!("{:#}", to_json(args, &found, &written)))),
        (Ok(understood), false) => understood.text(args, written.is_ok()),
        (Err(NotUnderstood::Model(problem)), false) => {
            format!("{file}: {problem}\n{file}: cannot be felt\n")
        }
        (Err(NotUnderstood::Options(problem)), false) => format!("{problem}\n"),
    };
    outputs::print(&if args.json { said } else { PlainLines(said).to_string() });
    match (found, written) {
        (Ok(_), Ok(())) => ExitCode::SUCCESS,
        (Ok(_), Err(problem)) => {
            say(format_args!("phantom3: {problem}; the model itself can be felt"));
            ExitCode::from(EXIT_NOT_WRITTEN)
        }
        (Err(_), _) => ExitCode::from(2),
    }
}

/// As of all results that cannot be written.
const EXIT_NOT_WRITTEN: u8 = 3;

/// Why there is nothing to tell.
enum NotUnderstood {
    /// Unfit request, whatever the model is.
    Options(String),
    Model(String),
}

impl NotUnderstood {
    fn words(&self) -> &str {
        match self {
            Self::Options(words) | Self::Model(words) => words,
        }
    }
}

/// A model as a mesh.
struct Understood {
    mesh: Mesh,
    report: MeshReport,
    is_lid: Vec<bool>,
    /// Of each of its faces, which of the file it is a part of, or beside.
    origins: Vec<usize>,
    /// Names of its faces, if the format has any.
    names: Option<FaceNames>,
    /// Parts of its looks that cannot be read.
    unread: Vec<String>,
    low: Vector3<f64>,
    high: Vector3<f64>,
    /// Area of its surface and volume of the space in it.
    area: f64,
    volume: f64,
    /// Its format says so.
    is_in_metres: bool,
}

fn understand(args: &CheckArgs) -> Result<Understood, NotUnderstood> {
    check_options(args).map_err(NotUnderstood::Options)?;
    read(args).map_err(NotUnderstood::Model)
}

fn check_options(args: &CheckArgs) -> Result<(), String> {
    if args.hand.is_some() || args.layout.is_some() {
        return Err("--hand and --layout are for scenes, and this is a model; leave them out".into());
    }
    let Some(out) = &args.repair else { return Ok(()) };
    if !out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj")) {
        return Err(format!("--repair {} writes OBJ; let the name end in .obj", out.display()));
    }
    outputs::check(&[Output::model(out)], &[&args.scene]).map_err(|failure| failure.to_string())
}

fn read(args: &CheckArgs) -> Result<Understood, String> {
    let told = |error: ModelError| error.to_string();
    let bytes = model::read_file(&args.scene).map_err(told)?;
    let soup = model::read(&args.scene, &bytes).map_err(told)?;
    let names = model::read_names(&args.scene, &bytes).map_err(told)?;
    let looks = model::read_appearance(&args.scene, &bytes);
    let is_in_metres = Format::of(&args.scene, &bytes) == Some(Format::Gltf);
    let unread = looks.map_or_else(|error| vec![error.to_string()], |looks| looks.unwrap_or_default().unread);
    drop(bytes);
    let holes = args.close_holes.map_or(CloseHoles::Small, CloseHoles::UpTo);
    let (mut is_lid, mut origins) = (Vec::new(), Vec::new());
    let built = Mesh::build_and_tell(soup, holes, |origin, of_lid| {
        is_lid.push(of_lid);
        origins.push(origin);
    });
    let (mesh, report) = built.map_err(|error| error.to_string())?;
    let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    for vertex in mesh.vertices() {
        (low, high) = (low.inf(vertex), high.sup(vertex));
    }
    let (mut area, mut volume) = (0.0, 0.0);
    for face in mesh.faces() {
        let [a, b, c] = face.vertices.map(|vertex| mesh.vertices()[vertex as usize] - low);
        area += 0.5 * (b - a).cross(&(c - a)).norm();
        volume += a.dot(&b.cross(&c)) / 6.0;
    }
    Ok(Understood { mesh, report, is_lid, origins, names, unread, low, high, area, volume, is_in_metres })
}

impl Understood {
    fn write(&self, out: &Path) -> Result<(), String> {
        let names = |face: usize| match &self.names {
            Some(names) if !self.is_lid[face] => names.of(self.origins[face]),
            _ => &[],
        };
        let text = model::write_obj(&self.mesh, &self.is_lid, names);
        replacement::write(out, text).map_err(|error| {
            let why = limits::with_remedy_or(&error, "name a file that can be written");
            format!("cannot write {}: {why}", out.display())
        })
    }

    fn text(&self, args: &CheckArgs, is_written: bool) -> String {
        let mut text = String::new();
        let told = self.report.to_string();
        let mut row = |name: &str, value: &str| {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{name:<14} {value}");
        };
        row("mesh", told.lines().next().unwrap_or_default());
        told.lines().skip(1).for_each(|finding| row("", &format!("  {}", finding.trim())));
        row("felt", &self.felt());
        let size = self.high - self.low;
        let [low, high] = [self.low, self.high].map(|v| v.map(|x| rounded(x, size.amax())));
        let [x, y, z] = <[f64; 3]>::from(size).map(|x| Figure(short(without_noise(x, size.amax()))));
        row("size", &format!("{x} x {y} x {z}, from {} to {}", list(&low), list(&high)));
        row("surface", &format!("{} square", Figure(short(self.area))));
        if self.mesh.sides() == Sides::Solid {
            row("volume", &format!("{} cubic", Figure(short(self.volume))));
        }
        row(
            "unit",
            match self.is_in_metres {
                true => "metres, as glTF has it, times the mesh's `scale` in a scene",
                false => "the file's own; a scene takes it for metres, times the mesh's `scale`",
            },
        );
        if let Some(names) = self.names() {
            row("names", &names);
        }
        if let Some(out) = args.repair.as_ref().filter(|_| is_written) {
            row("written", &format!("{}: {}", out.display(), self.written()));
        }
        let file = args.scene.display();
        for advice in self.warnings() {
            let _ = writeln!(text, "warning: {advice}");
        }
        let _ = writeln!(text, "{file}: can be felt");
        text
    }

    /// Names of the file's faces, each with the number of faces of the mesh that are called so.
    fn faces_by_name(&self) -> Option<BTreeMap<&str, usize>> {
        let kept = self.origins.iter().zip(&self.is_lid).filter(|(_, is_lid)| !**is_lid);
        Some(self.names.as_ref()?.of_faces(kept.map(|(origin, _)| *origin)))
    }

    /// Names for `[[entity.faces]]`.
    fn names(&self) -> Option<String> {
        let all = self.faces_by_name()?;
        let mut shown: Vec<String> =
            all.iter().take(MOST_NAMES).map(|(name, faces)| format!("{name} ({faces})")).collect();
        if all.len() > MOST_NAMES {
            shown.push(format!("and {} more", all.len() - MOST_NAMES));
        }
        if self.names.as_ref().is_some_and(FaceNames::is_cut) {
            shown.push("and others: they are too many to be used".into());
        }
        (!shown.is_empty()).then(|| format!("{}: of faces, for `[[entity.faces]]`", shown.join(", ")))
    }

    /// Consequence for a finger.
    fn felt(&self) -> String {
        let sheets = self.report.sheets.count;
        // A point that walked would pass below what ends there.
        let is_sealed = self.report.open_parts.count == 0 && self.mesh.point_radius_m() > 0.0;
        match (self.mesh.sides(), self.mesh.has_inside()) {
            (Sides::Solid, _) => "from outside; a finger does not get in".into(),
            (Sides::Sheet, false) if is_sealed => {
                "from both sides, as sheets: their rims lie on each other's faces, and no finger comes in there".into()
            }
            (Sides::Sheet, true) if is_sealed => format!(
                "solid parts from outside; the others ({sheets}) from both sides, as sheets whose rims lie on other faces"
            ),
            (Sides::Sheet, false) => {
                "from both sides, as a sheet: a finger that comes in through a hole is free within, and feels it from inside".into()
            }
            (Sides::Sheet, true) => format!(
                "solid parts from outside; the others ({sheets}) from both sides, as sheets that a finger gets behind by their rims"
            ),
        }
    }

    fn written(&self) -> String {
        let lids = self.is_lid.iter().filter(|is_lid| **is_lid).count();
        let [faces, vertices] = [self.report.faces, self.report.vertices];
        match lids {
            0 => format!("{faces} faces, {vertices} vertices"),
            lids => format!("{faces} faces, {vertices} vertices; {lids} of the faces in the group `lid`"),
        }
    }

    fn warnings(&self) -> impl Iterator<Item = String> {
        let unread = self.unread.iter().map(|said| format!("{said}; it is for the window only"));
        suspicion((self.high - self.low).amax()).into_iter().chain(unread)
    }
}

/// Words about a size that is no thing's for a hand.
fn suspicion(size: f64) -> Option<String> {
    let (what, unit, scale) = match size {
        size if size > 3000.0 => {
            ("larger than what a hand reaches", "numbers in micrometres or inches of a large thing", 1e-6)
        }
        size if size > 3.0 => ("larger than what a hand reaches", "numbers in millimetres", 1e-3),
        size if size < 1e-4 => ("finer than a hair", "made smaller twice", 1e3),
        _ => return None,
    };
    Some(format!("{} m is {what}: {unit}? Then `scale = {scale:?}`", Figure(short(size))))
}

fn to_json(
    args: &CheckArgs,
    found: &Result<Understood, NotUnderstood>,
    written: &Result<(), String>,
) -> Value {
    let file = args.scene.display().to_string();
    let understood = match found {
        Ok(understood) => understood,
        Err(problem) => {
            return json!({ "ok": false, "file": file, "problems": [{ "message": problem.words() }] });
        }
    };
    let Understood { mesh, report, is_lid, low, high, area, volume, .. } = understood;
    let holes: Vec<Value> = report
        .open_holes
        .largest
        .iter()
        .flatten()
        .map(|hole| json!({ "size": hole.size_m, "at": hole.middle_B }))
        .collect();
    json!({
        "ok": written.is_ok(),
        "file": file,
        "problems": written.as_ref().err().map(|problem| json!({ "message": problem })).into_iter().collect::<Vec<_>>(),
        "warnings": understood.warnings().collect::<Vec<_>>(),
        "mesh": {
            "triangles": report.faces, "vertices": report.vertices, "parts": report.components,
            "is_clean": report.is_clean(), "report": report.to_string(),
            "is_solid": mesh.sides() == Sides::Solid, "has_inside": mesh.has_inside(),
            "faces_of_lids": is_lid.iter().filter(|is_lid| **is_lid).count(),
            "open_holes": report.open_holes.count, "largest_open_holes": holes,
            "short_rims": report.short_rims.edges, "widest_short_gap": report.short_rims.widest_m,
            "low": [low.x, low.y, low.z], "high": [high.x, high.y, high.z], "area": area,
            "volume": (mesh.sides() == Sides::Solid).then_some(volume),
            "names": understood.faces_by_name(),
        },
        "written": args.repair.as_ref().filter(|_| written.is_ok()).map(|out: &PathBuf| out.display().to_string()),
    })
}

/// In a line.
const MOST_NAMES: usize = 20;

/// Four digits.
fn short(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

/// To a thousandth of a size, or so: far away it shows where a thing begins and ends.
fn rounded(number: f64, size: f64) -> f64 {
    let digits = (3.0 - size.log10().floor()).clamp(0.0, 300.0);
    let rounded = format!("{number:.*}", digits as usize).parse().unwrap_or(number);
    // Not -0.
    rounded + 0.0
}

/// Zero where a number drowns in what it is part of, as roundings of CAD programs do.
fn without_noise(number: f64, size: f64) -> f64 {
    if number.abs() < 1e-12 * size { 0.0 } else { number }
}

fn list(v: &Vector3<f64>) -> String {
    format!("[{}, {}, {}]", Figure(v.x), Figure(v.y), Figure(v.z))
}

/// A number in words: with an exponent where it would be a row of zeros.
struct Figure(f64);

impl fmt::Display for Figure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number) = self;
        if *number == 0.0 || (1e-6..1e9).contains(&number.abs()) {
            write!(f, "{number}")
        } else {
            write!(f, "{number:e}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_are_no_things_for_a_hand_are_told_and_numbers_are_short() {
        let words = |size| suspicion(size).unwrap_or_default();
        assert_eq!(
            words(50.0),
            "50 m is larger than what a hand reaches: numbers in millimetres? Then `scale = 0.001`"
        );
        assert_eq!(words(5e-5), "0.00005 m is finer than a hair: made smaller twice? Then `scale = 1000.0`");
        assert!(words(5e4).contains("`scale = 1e-6`") && words(0.1).is_empty() && words(3e-4).is_empty());
        let figures = [0.0, 1e-40, -2.5e-7, 0.05, 123_456.0, 3e12].map(|number| Figure(number).to_string());
        assert_eq!(figures, ["0", "1e-40", "-2.5e-7", "0.05", "123456", "3e12"]);
    }

    #[test]
    fn bounds_are_rounded_to_the_size_of_the_thing_however_far_away_it_is() {
        for (number, size, expected) in [
            (1e6, 1.0, 1e6),
            (1_000_000.5, 1.0, 1_000_000.5),
            (0.123_456_7, 0.1, 0.123_5),
            (-1e-17, 0.1, 0.0),
            (123_456.7, 123_456.7, 123_457.0),
            (3e-9, 1e-8, 3e-9),
            (7.0, 0.0, 7.0),
        ] {
            assert_eq!(rounded(number, size), expected, "{number} of {size}");
        }
    }
}
