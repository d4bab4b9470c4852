//! Contact points of two lines: edges, sides of cylinders and cones, axes of capsules.
//!
//! Model: lines that cross touch where they are nearest. The more they run alongside each other, the more the ends of the
//! piece that they share carry instead: the point between them counts with what the ends, as deep as they are, leave to it.
//! Away from the crossing the gap grows as the forms' roundness has it.

use nalgebra::Vector3;

use super::facet::Line;
use super::spots::{Spot, Spots};

/// Of a pair of lines, and where they are nearest.
pub(super) struct Alongside {
    pub(super) lines: [Line; 2],
    /// Which the lines' forms have around what was found \[m\].
    pub(super) radii_m: [f64; 2],
    pub(super) normal: Vector3<f64>,
    /// Between the surfaces at the nearest place.
    pub(super) gap_m: f64,
    /// On A's surface there.
    pub(super) on_a: Vector3<f64>,
}

const CROSSING_ID: u32 = 1100;
const END_IDS: [u32; 2] = [1101, 1102];
/// Lines at this sine or more only cross.
const PARALLEL: f64 = 0.3;

impl Alongside {
    /// Appends up to three points: the crossing, to which the ends give way where they are near it.
    pub(super) fn find(&self, spots: &mut Spots) {
        let crossing = Spot { id: CROSSING_ID, on_a: self.on_a, normal: self.normal, gap_m: self.gap_m };
        let Some((ends, alongside)) = self.shared() else { return spots.push(crossing) };
        let ends = ends.map(|at| self.at(at));
        let carries = |end: &Spot| {
            let apart = ((end.on_a - self.on_a).norm() / spots.fade_m).min(1.0);
            let deep = if self.gap_m < 0.0 { (end.gap_m / self.gap_m).clamp(0.0, 1.0) } else { 0.0 };
            alongside * apart * deep
        };
        spots.push_share(crossing, 1.0 - carries(&ends[0]).min(carries(&ends[1])));
        for (end, id) in ends.into_iter().zip(END_IDS) {
            spots.push_share(Spot { id, ..end }, alongside);
        }
    }

    /// From where to where on A's line B's runs alongside, and how much so: 1 where they are parallel.
    fn shared(&self) -> Option<([f64; 2], f64)> {
        let [a, b] = self.lines.map(|line| line.ends);
        let (along_a, along_b) = (a[1] - a[0], b[1] - b[0]);
        let across = along_a.cross(&along_b).norm_squared();
        let squared = along_a.norm_squared();
        let sine = (across / (squared * along_b.norm_squared())).sqrt();
        if sine.is_nan() || sine >= PARALLEL {
            return None;
        }
        let [first, last] = b.map(|end| (end - a[0]).dot(&along_a) / squared);
        let (first, last) = (first.min(last).max(0.0), first.max(last).min(1.0));
        (first < last).then_some(([first, last], 1.0 - sine / PARALLEL))
    }

    /// The contact at a place of A's line.
    fn at(&self, place: f64) -> Spot {
        let [a, b] = self.lines;
        let on_a = a.ends[0] + (a.ends[1] - a.ends[0]) * place;
        let along_b = b.ends[1] - b.ends[0];
        let on_b =
            b.ends[0] + along_b * ((on_a - b.ends[0]).dot(&along_b) / along_b.norm_squared()).clamp(0.0, 1.0);
        let away = on_a - on_b;
        let height_m = self.normal.dot(&away);
        let aside_m = (away - self.normal * height_m).norm();
        let bend_m = a.bend_m + b.bend_m;
        let gap_m = height_m + bend_m.hypot(aside_m) - bend_m - self.radii_m[0] - self.radii_m[1];
        Spot { id: 0, on_a: on_a - self.normal * self.radii_m[0], normal: self.normal, gap_m }
    }
}
