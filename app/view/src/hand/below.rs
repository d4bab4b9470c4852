//! What is below a hand: pictures do not tell how far away something floats.

use super::middle;
use super::seen::Seen;
use crate::moment::Moment;
use crate::pick::{Picker, Ray};
use eframe::egui::{Color32, Painter, Pos2, Shape, Stroke};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Of the ring on what is below (m).
const RING_M: f64 = 0.01;
const CORNERS: u32 = 32;
/// Of the dot below each finger (points).
const DOT: f32 = 2.5;
const DARK: Color32 = Color32::from_rgba_premultiplied(15, 15, 15, 190);
const BRIGHT: Color32 = Color32::from_rgba_premultiplied(130, 130, 130, 130);

/// Where a hand is, and what is below it (m).
#[derive(Debug, Clone, PartialEq)]
pub struct Cue {
    /// The middle of its fingers.
    pub from: Vector3<f64>,
    /// Straight below that.
    pub to: Vector3<f64>,
    /// Straight below each finger, if there is anything.
    pub feet: Vec<Vector3<f64>>,
}

impl Cue {
    /// Of fingers that are here (m) at this moment; without what they hold. `None`: nothing is below them.
    pub fn below(
        picker: &Picker,
        moment: &Moment,
        fingers: &[Vector3<f64>],
        is_held: impl Fn(usize) -> bool,
    ) -> Option<Self> {
        let first = |from: &Vector3<f64>| {
            let ray = Ray { origin: (*from).into(), direction: -Vector3::y() };
            Some(picker.pick_felt(moment, &ray, |entity| !is_held(entity))?.place.coords)
        };
        let from = middle(fingers);
        Some(Self { from, to: first(&from)?, feet: fingers.iter().filter_map(first).collect() })
    }

    /// Draws a line down, a ring where it ends, and a dot below each finger.
    pub fn paint(&self, painter: &Painter, seen: &Seen) {
        let at = |place: &Vector3<f64>| seen.project(place);
        let corner = |k: u32| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(CORNERS)).sin_cos();
            at(&(self.to + RING_M * Vector3::new(cos, 0.0, sin)))
        };
        let ring: Vec<Pos2> = (0..CORNERS).filter_map(corner).collect();
        let line: Vec<Pos2> = [&self.from, &self.to].into_iter().filter_map(at).collect();
        // Dark on bright: seen on every ground.
        for (width, colour) in [(3.5, BRIGHT), (1.5, DARK)] {
            painter.add(Shape::line(line.clone(), Stroke::new(width, colour)));
            painter.add(Shape::closed_line(ring.clone(), Stroke::new(width, colour)));
        }
        for foot in self.feet.iter().filter_map(at) {
            painter.circle(foot, DOT, DARK, Stroke::new(1.0, BRIGHT));
        }
    }
}
