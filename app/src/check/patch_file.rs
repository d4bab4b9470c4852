//! `phantom3 check MODEL` of an OBJ file that has rational patches instead of polygons.

use super::CheckArgs;
use super::measures::{around, short};
use crate::outputs;
use haptics::Nurbs;
use rt_core::plain_text::{PlainJson, PlainLines};
use serde_json::json;
use std::process::ExitCode;
use world::model;

/// Tells how the patches are understood, and what a scene says to have them felt. `None`: it has none that can be, or
/// triangles of them are wanted.
pub(super) fn execute(args: &CheckArgs) -> Option<ExitCode> {
    if args.repair.is_some() || args.close_holes.is_some() {
        return None;
    }
    let bytes = model::read_file(&args.scene).ok()?;
    let (nurbs, report) = Nurbs::build(&model::read_nurbs(&args.scene, &bytes).ok()?).ok()?;
    let step = |k: u32| f64::from(k) / f64::from(STEPS);
    let grid = (0..=STEPS).flat_map(|i| (0..=STEPS).map(move |j| [step(i), step(j)]));
    let places = (0..nurbs.parts()).flat_map(|part| grid.clone().map(move |[u, v]| (part, u, v)));
    let [low, high] = around(places.map(|(part, u, v)| nurbs.at(part, u, v).0))?;
    let file = args.scene.display().to_string();
    let said = if args.json {
        let patches = json!({
            "patches": report.patches, "seams": report.seams, "creases": report.creases, "rims": report.rims,
            "poles": report.poles, "report": report.to_string(), "low": low.as_slice(), "high": high.as_slice(),
        });
        let all = json!({ "ok": true, "file": file, "problems": [], "warnings": [], "patches": patches });
        format!("{}\n", PlainJson(format_args!("{all:#}")))
    } else {
        let size = (high - low).map(short);
        let text = format!(
            "patches        {report}\n\
             size           {} x {} x {}\n\
             unit           the file's own; a scene takes it for metres, times the shape's `scale`\n\
             scene          shape = {{ kind = \"nurbs\", file = {file:?} }}\n\
             {file}: can be felt\n",
            size.x, size.y, size.z
        );
        PlainLines(text).to_string()
    };
    outputs::print(&said);
    Some(ExitCode::SUCCESS)
}

/// Places along either side of a patch, of which the size is told.
const STEPS: u32 = 32;
