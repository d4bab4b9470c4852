//! A torus on any form: a ball that is swept along a ring.
//!
//! Model: it touches wherever the ball's gap is smallest along the ring, at up to [`SLOTS`] places. Lying flat on a plate it
//! does so all around: on each plate the ring is laid as a rim, four points of it and where it crosses the plate's edges.
//! Where it has a single deepest place on something round (a ball in its hole, another ring), three more points a quarter
//! apart stand for the rest of the ring. From [`DEEP`] on all of it presses that is in there ([`ring_deep`](super::ring_deep)).
//! Frames: that of the other form, B, which the ring meets as A.
//! Memory: word 0 the angle at which the ring's points begin, 1 to 4 the angles of the places found last.

use std::f64::consts::{FRAC_PI_2, TAU};

use haptics::{Form, Torus};
use nalgebra::{Isometry3, Vector3};

use super::PairMemory;
use super::ball::{self, Touch};
use super::convex::Convex;
use super::facet::{Facet, Outline, Plate};
use super::ring_deep::DeepRing;
use super::spots::{Spot, Spots};

/// Places that are told apart on something that is not flat.
const SLOTS: usize = 4;
/// Into how many pieces the ring is cut.
const PIECES: usize = 24;
/// Bound on the search for a place.
const ROUNDS: usize = 24;
/// Rising by less per turn (shares of the ring's radius), the ring lies flat.
const FLAT: f64 = 1e-4;
const QUARTER_IDS: u32 = 8;
const CROSSING_IDS: u32 = 64;
const NODE_IDS: u32 = 128;
/// From and to which shares of the tube's radius all of the ring takes over from its deepest places.
const DEEP: [f64; 2] = [0.2, 0.4];
/// Halvings until a crossing is found.
const HALVINGS: usize = 40;
/// A ball's normal along that of a plate is told from one across an edge by this cosine.
const ON_PLATE: f64 = 1.0 - 1e-9;

struct Ring<'r> {
    X_BA: &'r Isometry3<f64>,
    torus: &'r Torus,
    other: &'r Form,
}

/// Contact points of a torus with any form.
pub(super) fn contact(
    torus: &Torus,
    X_BA: &Isometry3<f64>,
    other: &Form,
    reach_m: f64,
    memory: &mut PairMemory,
) -> Spots {
    let ring = Ring { X_BA, torus, other };
    let plates = Plates::of(other);
    let places = if matches!(other, Form::Plane(_)) { Places::default() } else { ring.places(&plates) };
    let mut spots = Spots::within(reach_m, torus.tube_radius_m());
    let all = DeepRing::new(X_BA, torus, DEEP);
    let part = all.part(places.depth_m);
    if part < 1.0 {
        for (number, plate) in plates.as_slice().iter().enumerate() {
            ring.lie_on(plate, number as u32, &mut memory.words[0], reach_m, &mut spots);
        }
        ring.touch_at(places, plates.count > 0, &mut memory.words, &mut spots);
        spots.fade(1.0 - part);
    }
    if part > 0.0 {
        let tube_m = torus.tube_radius_m();
        let nodes = all.press(part, |at| ball::gap_m(other, at, tube_m) + tube_m);
        for (node, part) in nodes.into_iter().flatten() {
            spots.push_part(Spot { id: NODE_IDS + node.id, ..node }, part);
        }
    }
    spots
}

/// Where the gap is smallest along the ring.
#[derive(Default)]
struct Places {
    /// Gaps and angles of those that are on nothing flat.
    all: [Option<(f64, f64)>; SLOTS],
    count: usize,
    /// All of the ring is about as deep.
    is_flat: bool,
    /// How deep the deepest is, on anything \[m\].
    depth_m: f64,
}

impl Places {
    /// Adds one; without room, in the place of the least deep one.
    fn add(&mut self, gap_m: f64, angle: f64) {
        self.count += 1;
        let gap_at = |place: &Option<(f64, f64)>| place.map_or(f64::INFINITY, |place| place.0);
        let least = self.all.iter_mut().max_by(|a, b| gap_at(a).total_cmp(&gap_at(b)));
        if let Some(least) = least.filter(|least| gap_m < gap_at(least)) {
            *least = Some((gap_m, angle));
        }
    }

    fn deepest(&self) -> Option<(f64, f64)> {
        self.all.iter().flatten().copied().min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The angle of the one that is nearest to where one was known.
    fn take_nearest(&mut self, known: f64) -> Option<f64> {
        let apart = |place: &Option<(f64, f64)>| {
            place.map_or(f64::INFINITY, |(_, angle)| {
                let turn = (angle - known).rem_euclid(TAU);
                turn.min(TAU - turn)
            })
        };
        let nearest = self.all.iter_mut().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
        nearest.take().map(|(_, angle)| angle)
    }
}

/// The flat pieces of a form.
struct Plates {
    all: [Option<Plate>; 6],
    count: usize,
}

impl Plates {
    fn of(form: &Form) -> Self {
        let mut plates = Self { all: [None; 6], count: 0 };
        if let Form::Plane(plane) = form {
            let normal = plane.normal_B();
            plates.push(Plate::endless(normal * plane.offset_m(), normal));
        }
        let axes: &[usize] = match form {
            Form::Cuboid(_) => &[0, 1, 2],
            Form::Cylinder(_) | Form::Cone(_) => &[1],
            _ => &[],
        };
        let placed = Convex::of(form, &Isometry3::identity());
        for (convex, axis) in placed.iter().flat_map(|convex| axes.iter().map(move |axis| (convex, *axis))) {
            for sign in [1.0, -1.0] {
                if let Facet::Plate(plate) = Facet::of(convex, &(Vector3::ith(axis, sign))) {
                    plates.push(plate);
                }
            }
        }
        plates
    }

    fn push(&mut self, plate: Plate) {
        self.all[self.count] = Some(plate);
        self.count += 1;
    }

    fn as_slice(&self) -> &[Option<Plate>] {
        &self.all[..self.count]
    }

    /// Whether a ball that touches with this normal touches one of them.
    fn hold(&self, normal: &Vector3<f64>) -> bool {
        self.as_slice().iter().flatten().any(|plate| plate.normal.dot(normal) > ON_PLATE)
    }
}

impl Ring<'_> {
    fn middle(&self, angle: f64) -> Vector3<f64> {
        let (sine, cosine) = angle.sin_cos();
        let own = Vector3::new(cosine, 0.0, sine) * self.torus.ring_radius_m();
        self.X_BA.rotation * own + self.X_BA.translation.vector
    }

    fn touch(&self, angle: f64) -> Touch {
        ball::on_form(self.other, &self.middle(angle), self.torus.tube_radius_m())
    }

    /// How the gap changes along the ring, per turn.
    fn slope(&self, angle: f64) -> f64 {
        let (sine, cosine) = angle.sin_cos();
        let along = self.X_BA.rotation * Vector3::new(-sine, 0.0, cosine);
        self.touch(angle).normal.dot(&along)
    }

    fn push(&self, id: u32, angle: f64, spots: &mut Spots) {
        let touch = self.touch(angle);
        let on_a = self.middle(angle) - touch.normal * self.torus.tube_radius_m();
        spots.push(Spot { id, on_a, normal: touch.normal, gap_m: touch.gap_m });
    }

    /// Laid on a plate: four points of it, and where it crosses the plate's outline.
    fn lie_on(&self, plate: &Option<Plate>, number: u32, first: &mut f64, reach_m: f64, spots: &mut Spots) {
        let Some(plate) = plate else { return };
        let n = plate.normal;
        let (ring_m, tube_m) = (self.torus.ring_radius_m(), self.torus.tube_radius_m());
        let own = self.X_BA.inverse_transform_vector(&n);
        let height_m = n.dot(&(self.X_BA.translation.vector - plate.centre));
        let tilt = own.x.hypot(own.z);
        // Rings behind a plate touch another one.
        if height_m <= 0.0 && !matches!(plate.outline, Outline::Endless)
            || height_m - ring_m * tilt - tube_m > reach_m
        {
            return;
        }
        let begins = if tilt > FLAT { (-own.z).atan2(-own.x) } else { *first };
        let Some(view) = plate.seen_along(&n) else { return };
        let bottom = |angle: f64| self.middle(angle) - n * tube_m;
        let mut push = |id: u32, angle: f64| {
            let on_a = bottom(angle);
            spots.push(Spot { id, on_a, normal: n, gap_m: n.dot(&(on_a - plate.centre)) });
        };
        for quarter in 0..4_u32 {
            let angle = begins + f64::from(quarter) * FRAC_PI_2;
            if view.covers(&bottom(angle)) && self.touch(angle).normal.dot(&n) > ON_PLATE {
                *first = begins;
                push(QUARTER_IDS + 4 * number + quarter, angle);
            }
        }
        if matches!(plate.outline, Outline::Endless) {
            return;
        }
        let step = TAU / PIECES as f64;
        let is_over = |angle: f64| view.covers(&bottom(angle));
        let (mut was_over, mut crossings) = (is_over(0.0), 0);
        for piece in 0..PIECES {
            let (mut low, mut high) = (step * piece as f64, step * (piece + 1) as f64);
            let began_over = was_over;
            was_over = is_over(high);
            if began_over == was_over {
                continue;
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if is_over(middle) == began_over { low = middle } else { high = middle }
            }
            let inside = if began_over { low } else { high };
            if self.touch(inside).normal.dot(&n) > ON_PLATE {
                push(CROSSING_IDS + 8 * number + crossings, inside);
            }
            crossings += 1;
        }
    }

    /// Places where the gap is smallest.
    fn places(&self, plates: &Plates) -> Places {
        let step = TAU / PIECES as f64;
        let mut gaps_m = [0.0; PIECES];
        for (piece, gap_m) in gaps_m.iter_mut().enumerate() {
            *gap_m = ball::gap_m(self.other, &self.middle(step * piece as f64), self.torus.tube_radius_m());
        }
        let [least_m, most_m] =
            gaps_m.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], &gap_m| {
                [gap_m.min(least), gap_m.max(most)]
            });
        let is_flat = most_m - least_m < FLAT * self.torus.ring_radius_m();
        let mut places = Places { is_flat, depth_m: -least_m, ..Places::default() };
        for piece in 0..PIECES {
            let (before, after) = (gaps_m[(piece + PIECES - 1) % PIECES], gaps_m[(piece + 1) % PIECES]);
            if gaps_m[piece] >= before || gaps_m[piece] > after {
                continue;
            }
            let angle = self.bottom(step * (piece as f64 - 1.0), step * (piece as f64 + 1.0));
            let touch = self.touch(angle);
            places.depth_m = places.depth_m.max(-touch.gap_m);
            if !plates.hold(&touch.normal) {
                places.add(touch.gap_m, angle);
            }
        }
        places
    }

    /// Touches at places, and at the quarters.
    fn touch_at(&self, mut places: Places, has_plates: bool, words: &mut [f64; 8], spots: &mut Spots) {
        if !has_plates && (places.is_flat || places.count == 1) {
            if let (false, Some((_, angle))) = (places.is_flat, places.deepest()) {
                words[0] = angle;
            }
            for quarter in 0..4_u32 {
                self.push(QUARTER_IDS + quarter, words[0] + f64::from(quarter) * FRAC_PI_2, spots);
            }
            return;
        }
        for slot in 0..SLOTS {
            let Some(angle) = places.take_nearest(words[1 + slot]) else { break };
            words[1 + slot] = angle;
            self.push(slot as u32, angle, spots);
        }
    }

    /// Where the slope changes its sign between two angles: false position, halving the value of an end that stays
    /// (Illinois).
    fn bottom(&self, mut low: f64, mut high: f64) -> f64 {
        let (mut falls, mut rises) = (self.slope(low), self.slope(high));
        let mut stays = 0;
        for _ in 0..ROUNDS {
            let secant = low - falls * (high - low) / (rises - falls);
            let angle = if secant > low && secant < high { secant } else { 0.5 * (low + high) };
            let slope = self.slope(angle);
            if slope.abs() < STEEP || high - low < 1e-12 {
                return angle;
            }
            if slope < 0.0 {
                (low, falls) = (angle, slope);
                rises *= if stays == 1 { 0.5 } else { 1.0 };
                stays = 1;
            } else {
                (high, rises) = (angle, slope);
                falls *= if stays == -1 { 0.5 } else { 1.0 };
                stays = -1;
            }
        }
        0.5 * (low + high)
    }
}

/// A slope of less is none.
const STEEP: f64 = 1e-11;
