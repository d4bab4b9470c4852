//! What is below a hand: pictures do not tell how far away something floats.

use super::middle;
use super::seen::Seen;
use crate::stage::{Stage, Thing};
use eframe::egui::{Color32, Painter, Pos2, Shape, Stroke};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Of the ring on what is below (m).
const RING_M: f64 = 0.01;
const CORNERS: u32 = 32;
/// Of the dot below each finger (points).
const DOT: f32 = 2.5;
const DARK: Color32 = Color32::from_rgba_premultiplied(15, 15, 15, 190);
const BRIGHT: Color32 = Color32::from_rgba_premultiplied(130, 130, 130, 130);

/// Looks straight down.
#[derive(Debug, Default)]
pub struct Below {
    /// The stage of which the balls are.
    stage: Option<Arc<Stage>>,
    /// Around each thing, in its own frame: centre and radius (m).
    balls: Vec<(Point3<f64>, f64)>,
}

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

impl Below {
    /// Of fingers that are here (m), while entities are there; without those that they hold. `None`: nothing is below them.
    pub fn cue(
        &mut self,
        stage: &Arc<Stage>,
        poses: &[Isometry3<f64>],
        fingers: &[Vector3<f64>],
        is_held: impl Fn(usize) -> bool,
    ) -> Option<Cue> {
        let from = middle(fingers);
        let to = self.first(stage, poses, &from, &is_held)?;
        let feet = fingers.iter().filter_map(|finger| self.first(stage, poses, finger, &is_held)).collect();
        Some(Cue { from, to, feet })
    }

    /// What is met first from here straight down (m).
    pub fn first(
        &mut self,
        stage: &Arc<Stage>,
        poses: &[Isometry3<f64>],
        from: &Vector3<f64>,
        is_held: impl Fn(usize) -> bool,
    ) -> Option<Vector3<f64>> {
        if !self.stage.as_ref().is_some_and(|known| Arc::ptr_eq(known, stage)) {
            self.balls = stage.things.iter().map(ball_around).collect();
            self.stage = Some(Arc::clone(stage));
        }
        let things = stage.things.iter().zip(&self.balls).filter(|(thing, _)| !is_held(thing.entity));
        let near = things.filter_map(|(thing, (centre, radius_m))| {
            let pose = poses.get(thing.entity)? * thing.pose;
            let away = (pose * centre).coords - from;
            (away.x.hypot(away.z) <= *radius_m && away.y <= *radius_m).then_some((thing, pose))
        });
        let ways = near.filter_map(|(thing, pose)| {
            let eye = pose.inverse_transform_point(&Point3::from(*from));
            let way = pose.inverse_transform_vector(&-Vector3::y());
            let corners = thing.triangles.corners.iter();
            let met = corners.filter_map(|corners| {
                let [a, b, c] = corners.map(|corner| thing.triangles.places[corner as usize]);
                meets(&eye, &way, [a, b, c])
            });
            met.min_by(f64::total_cmp)
        });
        ways.min_by(f64::total_cmp).map(|way_m| from - Vector3::y() * way_m)
    }
}

fn ball_around(thing: &Thing) -> (Point3<f64>, f64) {
    let places = &thing.triangles.places;
    let (least, most) = places.iter().fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(least, most), place| (least.inf(&place.coords), most.sup(&place.coords)),
    );
    let centre = Point3::from(0.5 * (least + most));
    (centre, places.iter().map(|place| (place - centre).norm()).fold(0.0, f64::max))
}

/// How far a ray goes until it meets a triangle, from either side (Moeller and Trumbore, 1997).
fn meets(eye: &Point3<f64>, way: &Vector3<f64>, [a, b, c]: [Point3<f64>; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = way.cross(&ac);
    let volume = ab.dot(&across);
    if volume == 0.0 {
        return None;
    }
    let from_a = eye - a;
    let u = from_a.dot(&across) / volume;
    let other = from_a.cross(&ab);
    let v = way.dot(&other) / volume;
    let along = ac.dot(&other) / volume;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && along >= 0.0).then_some(along)
}

impl Cue {
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
