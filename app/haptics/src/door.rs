//! Doors: how a finger goes from one space into another (Melder 8.3.3, the TARDIS).
//!
//! Problem: a hull that is smaller than the room inside of it. Where the finger is in the world does not say what it
//! feels; that depends on the way it came.
//!
//! Model: every entity is in one space and so is every finger, which feels the entities of its space. A door is a rectangle
//! across z of a frame D in an entity's, its hull; z leads out. What goes through it is the god-object, or the HIP where
//! nothing is touched: a finger that something in front of the door holds back is in front of it, however far its HIP went.
//! Of several contacts the one that is furthest behind counts. Who slides over the rim of an opening comes around it: its way
//! is along the door first and then through it.
//! The hull, and the walls of the space behind, are open where the rectangle lies on them (to [`SLAB_M`]): a solid hull
//! needs no opening, a room no hole. Where they have one, its rim and its jambs are felt. Of a ball the centre goes through,
//! and the space that the centre is in is felt.
//!
//! On the other side contacts begin on the way from the god-objects to the HIP, so a floor that goes on holds on; what
//! does not go on is left with its force, which fades within [`FADE_S`]. So does that of a wall that was pressed beside the
//! opening when the finger comes into it.
//!
//! Frames: W world, B the hull's, D the door's. Invariants: a finger crosses a door once in a tick; whoever is not through
//! is in front, to [`ON_M`]. Cost: nothing without doors; of each door of the finger's space some comparisons.

use nalgebra::{Isometry3, Vector3};

use crate::entity::Entity;
use crate::error::{ParameterError, above_zero};
use crate::finger::{Finger, FingerOutput};
use crate::frame::{is_finite, point_into_body, point_into_world};
use crate::touch_points::TouchPoint;

/// A space that is no other one's: the world.
pub const WORLD: u32 = 0;
/// A surface so near to a door's rectangle is open in it \[m\].
pub const SLAB_M: f64 = 1e-3;
/// Walls of doors that are felt at once: a corner has three.
const MOST_OPEN: usize = 8;
/// What is left behind at a door fades within this time \[s\].
pub const FADE_S: f64 = 0.02;
/// Surfaces with less of their normal than this along the door's z are its jambs, its floor and its lintel.
const LEAST_ACROSS: f64 = 0.7;
/// As near to a door's plane a finger is on it, on the side that it came from (m): above the roundings of poses, below what
/// any device resolves.
const ON_M: f64 = 1e-6;

/// A rectangle that leads from one space to another.
#[derive(Debug, Clone, PartialEq)]
pub struct Door {
    hull: usize,
    X_BD: Isometry3<f64>,
    half_m: [f64; 2],
    spaces: [u32; 2],
    opens: Box<[u32]>,
}

impl Door {
    /// In the frame of the entity `hull`, around the origin of D, of this width along x and height along y; from the space in
    /// front of it, where z leads, to that behind. Walls of the other space are open in it as the hull is.
    ///
    /// Errors: a size not finite or not positive.
    pub fn new(
        hull: usize,
        X_BD: Isometry3<f64>,
        [width_m, height_m]: [f64; 2],
        [front, behind]: [u32; 2],
        walls: impl IntoIterator<Item = u32>,
    ) -> Result<Self, ParameterError> {
        let half_m = [0.5 * above_zero("width_m", width_m)?, 0.5 * above_zero("height_m", height_m)?];
        let mut opens: Vec<u32> = walls.into_iter().chain([hull as u32]).collect();
        opens.sort_unstable();
        Ok(Self { hull, X_BD, half_m, spaces: [front, behind], opens: opens.into() })
    }

    /// The entity that has it.
    pub fn hull(&self) -> usize {
        self.hull
    }

    /// The spaces in front of it and behind.
    pub fn spaces(&self) -> [u32; 2] {
        self.spaces
    }

    /// So far in front of its middle \[m\].
    pub fn before_W(&self, entities: &[Entity], height_m: f64) -> Vector3<f64> {
        self.in_world(entities, &Vector3::new(0.0, 0.0, height_m))
    }

    /// A point as it is seen from the door.
    fn seen(&self, entities: &[Entity], p_W: &Vector3<f64>) -> Vector3<f64> {
        let in_hull = entities.get(self.hull).map_or(*p_W, |hull| point_into_body(&hull.X_WB, p_W));
        point_into_body(&self.X_BD, &in_hull)
    }

    fn in_world(&self, entities: &[Entity], p_D: &Vector3<f64>) -> Vector3<f64> {
        let in_hull = point_into_world(&self.X_BD, p_D);
        entities.get(self.hull).map_or(in_hull, |hull| point_into_world(&hull.X_WB, &in_hull))
    }

    /// Whether the foot of a point lies in the rectangle, larger by a margin (m).
    fn frames(&self, p_D: &Vector3<f64>, margin_m: f64) -> bool {
        let [x, y] = self.half_m;
        p_D.x.abs() <= x + margin_m && p_D.y.abs() <= y + margin_m
    }

    /// 1 for who is in front of it, -1 for who is in the space behind; `None`: it is in neither.
    fn side(&self, space: u32) -> Option<f64> {
        let at = self.spaces.iter().position(|own| *own == space)?;
        Some([1.0, -1.0][at])
    }
}

/// Where a finger went from one space into another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Which of the doors.
    pub door: usize,
    /// Into which space.
    pub to: u32,
    /// Where on the other side it begins \[m\].
    pub begins_W: Vector3<f64>,
    /// Whether it was drawn through along what it touches.
    pub drags: bool,
}

/// What a finger remembers of doors.
#[derive(Debug, Clone)]
pub struct Passage {
    /// Of each door, where the finger was seen from it in the last tick; `None`: it was not there, or somewhere else.
    seen: Box<[Option<Seen>]>,
    /// What it left behind, and for how long it has been fading (s).
    left_W: Vector3<f64>,
    fading_s: f64,
    /// Part of it that was left in the last tick (N).
    begun_n: f64,
    /// Forces of the last tick (N) of contacts with what is open in doors.
    felt: [Option<(usize, Vector3<f64>)>; MOST_OPEN],
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    place_D: Vector3<f64>,
    touches: bool,
}

impl Passage {
    /// Of a finger that was not seen yet.
    pub fn new(doors: &[Door]) -> Self {
        let seen = vec![None; doors.len()].into();
        Self { seen, left_W: Vector3::zeros(), fading_s: FADE_S, begun_n: 0.0, felt: [None; MOST_OPEN] }
    }

    /// The finger is somewhere else: nobody saw how it came there.
    pub fn reset(&mut self) {
        self.seen.fill(None);
        self.fading_s = FADE_S;
        self.begun_n = 0.0;
        self.felt.fill(None);
    }

    /// Force that contacts pressed with and that is felt without them since the last tick (N).
    pub fn begun_n(&self) -> f64 {
        self.begun_n
    }

    /// A tick of a finger, which `step` does: once, or, in the tick in which it goes through a door, once on either side.
    /// What it feels, and where it went through. `moves`: whether what happens to a finger at an entity happens to that, too;
    /// of such forces nothing is left behind.
    pub fn step(
        &mut self,
        finger: &mut Finger,
        (entities, doors): (&[Entity], &[Door]),
        dt_s: f64,
        moves: impl Fn(usize) -> bool,
        mut step: impl FnMut(&mut Finger) -> FingerOutput,
    ) -> (FingerOutput, Option<Crossing>) {
        let mut output = step(finger);
        self.begun_n = 0.0;
        if doors.is_empty() {
            return (output, None);
        }
        let passed = self.look(finger, entities, doors);
        let mut left_W = Vector3::zeros();
        if passed.is_open {
            output = finger.output(entities);
            left_W = self.left_open_W(finger, &moves);
        }
        if let Some(crossing) = &passed.crossing {
            let stays_W = |finger: &Finger| -> Vector3<f64> {
                let fixed = finger.contacts().filter(|contact| !moves(contact.entity));
                fixed.map(|contact| contact.force_on_user_W).sum()
            };
            // What it meets in this tick alone it would have met behind the door, on this side.
            let dragged_W = if crossing.drags { stays_W(finger) } else { Vector3::zeros() };
            finger.go_through(crossing);
            output = step(finger);
            self.crossed(crossing, doors, entities);
            // What lies in the opening is open from this side, too.
            if self.look(finger, entities, doors).is_open {
                output = finger.output(entities);
            }
            if dragged_W != Vector3::zeros() {
                left_W += dragged_W - stays_W(finger);
            }
        }
        self.begun_n = left_W.norm();
        if left_W != Vector3::zeros() {
            (self.left_W, self.fading_s) = (self.left_W * self.share() + left_W, 0.0);
        }
        self.note(finger, doors);
        output.force_on_user_W += self.fade(dt_s);
        (output, passed.crossing)
    }

    /// After a tick of the finger: what of it is open, and whether it went through one of the doors.
    fn look(&mut self, finger: &mut Finger, entities: &[Entity], doors: &[Door]) -> Passed {
        let mut passed = Passed::default();
        let Some(hip_W) = finger.last_hip_W() else {
            self.reset();
            return passed;
        };
        for (at, (door, seen)) in doors.iter().zip(&mut self.seen).enumerate() {
            let Some(side) = door.side(finger.space()) else {
                *seen = None;
                continue;
            };
            let eye = Eye { door, side, entities, hip_D: door.seen(entities, &hip_W) };
            let before = *seen;
            let opened_D = eye.open(finger, before);
            passed.is_open |= opened_D.is_some();
            let now = eye.see(finger);
            let foot_D = before.and_then(|before| eye.foot(finger, &before, &now, opened_D));
            let goes = foot_D.is_some_and(|foot_D| door.frames(&foot_D, ON_M));
            // Who would go through and must not yet is where it was.
            *seen = if goes { before } else { Some(now) };
            if let (true, Some(foot_D), Some(before)) = (goes, foot_D, before) {
                let [front, behind] = door.spaces;
                let to = if side > 0.0 { behind } else { front };
                let drags = before.touches && now.touches;
                let begins_W = eye.begin_W(finger, &foot_D, drags);
                passed.crossing.get_or_insert(Crossing { door: at, to, begins_W, drags });
            }
        }
        passed
    }

    /// On the other side it is known where it was: on the door.
    fn crossed(&mut self, crossing: &Crossing, doors: &[Door], entities: &[Entity]) {
        self.seen.fill(None);
        if let (Some(door), Some(seen)) = (doors.get(crossing.door), self.seen.get_mut(crossing.door)) {
            *seen = Some(Seen { place_D: door.seen(entities, &crossing.begins_W), touches: false });
        }
    }

    /// Forces of the last tick (N) of what a door has opened in this one.
    fn left_open_W(&self, finger: &Finger, moves: impl Fn(usize) -> bool) -> Vector3<f64> {
        let left = self
            .felt
            .iter()
            .flatten()
            .filter(|(entity, _)| !moves(*entity) && finger.contact(*entity).is_none());
        left.map(|(_, force_W)| force_W).sum()
    }

    fn note(&mut self, finger: &Finger, doors: &[Door]) {
        self.felt.fill(None);
        let is_opened =
            |entity: usize| doors.iter().any(|door| door.opens.binary_search(&(entity as u32)).is_ok());
        let felt = finger.contacts().filter(|contact| is_opened(contact.entity));
        for (place, contact) in self.felt.iter_mut().zip(felt) {
            *place = Some((contact.entity, contact.force_on_user_W));
        }
    }

    /// Share that is left of a force which fades.
    fn share(&self) -> f64 {
        (1.0 - self.fading_s / FADE_S).max(0.0)
    }

    /// What of the force that was left behind is still felt in this tick (N); the tick of the crossing has all of it.
    fn fade(&mut self, dt_s: f64) -> Vector3<f64> {
        if self.fading_s >= FADE_S || !is_finite(&self.left_W) {
            return Vector3::zeros();
        }
        let share = self.share();
        // Where time is unknown nothing lasts.
        self.fading_s = if dt_s > 0.0 { self.fading_s + dt_s } else { FADE_S };
        self.left_W * share
    }
}

/// What became of a finger at the doors in a tick.
#[derive(Debug, Clone, Copy, Default)]
struct Passed {
    /// Contacts ended because what was touched is open there: the finger's force is [another](Finger::output).
    is_open: bool,
    /// It is to go on elsewhere.
    crossing: Option<Crossing>,
}

/// A door as a finger sees it.
struct Eye<'a> {
    door: &'a Door,
    side: f64,
    entities: &'a [Entity],
    hip_D: Vector3<f64>,
}

impl Eye<'_> {
    fn height_m(&self, p_D: &Vector3<f64>) -> f64 {
        self.side * p_D.z
    }

    /// Ends contacts that stand on nothing but the opening, and says where. Who is beyond it without having been in front did
    /// not come by it.
    fn open(&self, finger: &mut Finger, before: Option<Seen>) -> Option<Vector3<f64>> {
        let was_in_front = before.is_some_and(|before| self.height_m(&before.place_D) >= -ON_M);
        if !was_in_front && self.height_m(&self.hip_D) < -ON_M {
            return None;
        }
        let mut opened_D = None;
        let aimed_D = before.and_then(|before| self.aimed_D(&before));
        while let Some((entity, point_D)) = self.stands_open(finger, aimed_D) {
            finger.forget(entity);
            opened_D = Some(point_D);
        }
        opened_D
    }

    /// Where the HIP's way from free space met the opening: a god-object that began there may be beside it since.
    fn aimed_D(&self, before: &Seen) -> Option<Vector3<f64>> {
        let is_through = !before.touches && self.height_m(&self.hip_D) < 0.0;
        let met_D = is_through.then(|| self.met_D(before, &self.hip_D))?;
        self.door.frames(&met_D, -ON_M).then_some(met_D)
    }

    /// Where the straight way from there to here goes through the door's plane.
    fn met_D(&self, before: &Seen, to_D: &Vector3<f64>) -> Vector3<f64> {
        let (from_m, to_m) = (self.height_m(&before.place_D), self.height_m(to_D));
        let share = (from_m / (from_m - to_m)).clamp(0.0, 1.0);
        before.place_D + (to_D - before.place_D) * share
    }

    /// An entity that the finger touches in nothing but the opening, there where other contacts let it be; and where.
    fn stands_open(&self, finger: &Finger, aimed_D: Option<Vector3<f64>>) -> Option<(usize, Vector3<f64>)> {
        let mut contacts = finger.contacts();
        contacts.find_map(|contact| {
            self.door.opens.binary_search(&(contact.entity as u32)).ok()?;
            let aside_D = self.held_D(finger, Some(contact.entity)) - self.hip_D;
            let margin_m = if aside_D == Vector3::zeros() { -ON_M } else { ON_M };
            let open_D = |point: &TouchPoint| {
                let ends_W = [point.point_W, point.point_W + point.normal_W];
                let [foot_D, tip_D] = ends_W.map(|end_W| self.door.seen(self.entities, &end_W));
                let is_across = (tip_D.z - foot_D.z).abs() > LEAST_ACROSS;
                let open_D = aimed_D.unwrap_or(foot_D + aside_D);
                let is_framed = self.door.frames(&open_D, margin_m);
                (is_across && is_framed && foot_D.z.abs() <= SLAB_M).then_some(open_D)
            };
            let points = finger.touch_points(self.entities, contact.entity);
            let first_D = open_D(points.as_slice().first()?)?;
            let all_are = points.as_slice().iter().all(|point| open_D(point).is_some());
            all_are.then_some((contact.entity, first_D))
        })
    }

    /// Where all contacts together, but for one, hold the HIP.
    fn held_D(&self, finger: &Finger, without: Option<usize>) -> Vector3<f64> {
        let others = finger.contacts().filter(|contact| Some(contact.entity) != without);
        let aside_D = others.map(|contact| self.door.seen(self.entities, &contact.god_object_W) - self.hip_D);
        self.hip_D + aside_D.sum::<Vector3<f64>>()
    }

    /// Where the finger is: that of its god-objects that is furthest behind on its way, or its HIP.
    fn see(&self, finger: &Finger) -> Seen {
        let places = finger.contacts().map(|contact| self.door.seen(self.entities, &contact.god_object_W));
        let last = places.max_by(|a, b| self.height_m(a).total_cmp(&self.height_m(b)));
        Seen { place_D: last.unwrap_or(self.hip_D), touches: last.is_some() }
    }

    /// Where the way from one tick to the next goes through the door's plane.
    fn foot(
        &self,
        finger: &Finger,
        before: &Seen,
        now: &Seen,
        opened_D: Option<Vector3<f64>>,
    ) -> Option<Vector3<f64>> {
        let (from_m, to_m) = (self.height_m(&before.place_D), self.height_m(&now.place_D));
        if from_m < -ON_M || to_m >= -ON_M {
            return None;
        }
        if opened_D.is_some() {
            return opened_D;
        }
        if before.touches {
            // It came along the surface, and around its rim.
            return Some(self.held_D(finger, None));
        }
        Some(self.met_D(before, &now.place_D))
    }

    /// Beyond the plane. Who drags begins outside of what it touches, so that what goes on there is come to from outside.
    fn begin_W(&self, finger: &Finger, foot_D: &Vector3<f64>, drags: bool) -> Vector3<f64> {
        let mut begins_D = *foot_D;
        if drags {
            let out_W = finger.contacts().map(|contact| contact.normal_W * ON_M).sum::<Vector3<f64>>();
            let held_W = self.door.in_world(self.entities, &self.held_D(finger, None));
            begins_D = self.door.seen(self.entities, &(held_W + out_W));
        }
        if !drags || self.height_m(&begins_D) > -ON_M {
            begins_D.z = -self.side * ON_M;
        }
        self.door.in_world(self.entities, &begins_D)
    }
}
