//! One finger in contact with a set of patches, or near it (Melder ch. 4.2.2).
//!
//! Model: free, the HIP's path is tried against the surface each tick, unless it is known that nothing is near. In
//! contact the god-object holds or slides, as on every [`crate::Surface`]. Beside it goes its shadow, the frictionless
//! god-object: while that is held back, so is the finger, however thin the part is that it was pressed through; when
//! it is free, the finger is round the corner or over the rim, and friction must not hold it.
//!
//! Frames: the patches' own, B.
//! Cost: free and far, one comparison; free and near, one query of the tree; held, one descent from where the shadow was;
//! sliding, one more for each round.

use nalgebra::Vector3;

use super::Nurbs;
use super::descend::Crossing;
use super::foot::Foot;
use super::walker::{Stand, Walker};
use crate::algorithm::{Touch, TouchInput};
use crate::friction::Friction;
use crate::friction_cone::{ConeForce, ConeInput, FrictionCone, answer};
use crate::friction_law::FrictionState;
use crate::mesh::{Beginning, Sides};
use crate::surface::SurfacePoint;
use crate::tangent_view::TangentView;

/// State of one finger towards one set of patches.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct NurbsCone {
    /// Which set the rest is about: feet of another one would lead nowhere.
    nurbs: Option<u64>,
    touching: Option<Touching>,
    /// Where the HIP was in the last tick.
    last_hip_B: Option<Vector3<f64>>,
    /// A ball that the surface does not reach into, for this finger's centre.
    clear: Option<(Vector3<f64>, f64)>,
    /// The side of a sheet that it left last: where it is on it to the last digit, rounding must not decide.
    left: Option<f64>,
}

/// A contact.
#[derive(Debug, Clone, Copy)]
struct Touching {
    cone: FrictionCone,
    /// Under the god-object.
    god_foot: Foot,
    shadow: Foot,
    state: FrictionState,
    at: SurfacePoint,
}

impl NurbsCone {
    /// One tick; `None` while the finger is free.
    pub(crate) fn update(&mut self, nurbs: &Nurbs, input: &TouchInput<'_>) -> Option<(Touch, Beginning)> {
        let here = Some(nurbs.identity);
        if self.nurbs != here {
            *self = Self { nurbs: here, ..Self::default() };
        }
        let hip_B = input.cone.hip_B;
        let walker = Walker::new(nurbs, hip_B, input.finger_radius_m);
        let last_hip_B = self.last_hip_B.replace(hip_B);
        let mut beginning = Beginning::Came;
        if self.touching.is_none() {
            let (stand, how) = self.meet(nurbs, &walker, input, last_hip_B)?;
            beginning = how;
            self.touching = Some(Touching::new(&stand));
        }
        let touching = self.touching.as_mut()?;
        if let Some(touch) = touching.update(nurbs, &walker, input.friction, &input.cone) {
            return Some((touch, beginning));
        }
        self.left = Some(touching.shadow.side);
        let let_go_m = (touching.shadow.point_B() - hip_B).norm();
        self.touching = None;
        self.clear = None;
        self.pass_on(nurbs, &walker, input, let_go_m)
    }

    /// Let go by one of two parts that overlap, it may be inside the other, whose surface it never came through.
    #[cold]
    fn pass_on(
        &mut self,
        nurbs: &Nurbs,
        walker: &Walker<'_>,
        input: &TouchInput<'_>,
        let_go_m: f64,
    ) -> Option<(Touch, Beginning)> {
        if nurbs.sides == Sides::Sheet || !nurbs.has_near(&input.cone.hip_B, 0.0) {
            return None;
        }
        // What lies farther off than where it was let go is not what it is in.
        let stand = walker.find_within(&input.cone.hip_B, let_go_m).filter(|stand| {
            // Where it was let go, rounding does not find it again.
            stand.height_m < -1e-12 * nurbs.extent_m
        })?;
        let mut touching = Touching::new(&stand);
        let touch = touching.update(nurbs, walker, input.friction, &input.cone)?;
        self.touching = Some(touching);
        Some((touch, Beginning::WasInside))
    }

    /// Ends a contact whose force nobody can use: the next tick is as a first one.
    pub(crate) fn let_go(&mut self) {
        if self.touching.is_some() {
            *self = Self::default();
        }
    }

    fn meet(
        &mut self,
        nurbs: &Nurbs,
        walker: &Walker<'_>,
        input: &TouchInput<'_>,
        last_hip_B: Option<Vector3<f64>>,
    ) -> Option<(Stand, Beginning)> {
        let (hip_B, radius_m) = (&input.cone.hip_B, input.finger_radius_m);
        // Patches that were placed elsewhere were not met on the way there.
        let is_here = |from_B: &Vector3<f64>| {
            last_hip_B.is_some_and(|last_B| (from_B - last_B).amax() <= SAME_PLACE * nurbs.extent_m)
        };
        let Some(from_B) = input.previous_hip_B.filter(is_here) else {
            (self.clear, self.left) = (None, None);
            return nurbs.found_inside(walker, hip_B, radius_m).map(|stand| (stand, Beginning::WasInside));
        };
        if self.is_clear(&from_B) && self.is_clear(hip_B) {
            return None;
        }
        if let Some(stand) = nurbs.meet(walker, &from_B, hip_B, self.left) {
            // A ball that one place lets go may overlap another by more than it has come.
            let came_m = (hip_B - from_B).norm() + nurbs.slack_m;
            let how = if stand.height_m < -came_m { Beginning::WasInside } else { Beginning::Came };
            return Some((stand, how));
        }
        let clearance_m = nurbs.clearance(hip_B) - radius_m;
        self.clear = (clearance_m > 0.0).then_some((*hip_B, clearance_m));
        if clearance_m > nurbs.slack_m {
            self.left = None;
        }
        None
    }

    fn is_clear(&self, p_B: &Vector3<f64>) -> bool {
        self.clear.is_some_and(|(centre_B, radius_m)| (p_B - centre_B).norm_squared() < radius_m * radius_m)
    }
}

impl Touching {
    fn new(stand: &Stand) -> Self {
        Self {
            cone: FrictionCone::new(stand.at),
            god_foot: stand.foot,
            shadow: stand.foot,
            state: FrictionState::Stick,
            at: stand.at,
        }
    }

    fn update(
        &mut self,
        nurbs: &Nurbs,
        walker: &Walker<'_>,
        friction: &Friction,
        input: &ConeInput,
    ) -> Option<Touch> {
        let rest = nurbs.descend(&input.hip_B, &mut self.shadow, Crossing::All);
        let stand = walker.stand(self.shadow, rest, &input.hip_B);
        self.shadow = stand.foot;
        if stand.is_free || stand.height_m.is_nan() {
            return None;
        }
        if matches!(friction, Friction::None) {
            let at = stand.at;
            let view = TangentView::new(&at.point_B, at.normal_B, at.normal_B.dot(&at.point_B), input);
            let force = answer(&view, &Vector3::zeros(), 0, input);
            (self.cone, self.god_foot) = (FrictionCone::new(at), stand.foot);
            (self.at, self.state) = (at, FrictionState::Slip);
            return Some(self.touch(&force));
        }
        let mut god_object = *self.cone.god_object();
        // Held in a groove by a side that the HIP has left, it would be held by what is not in its way.
        if walker.is_of_a_point()
            && let Some((turned, foot)) = walker.turned(&self.god_foot)
        {
            self.cone.stand_at(turned);
            (god_object, self.god_foot) = (turned, foot);
        }
        walker.know(&god_object, &self.god_foot);
        let mut force = self.slide(walker, friction, input);
        if force.depth_m < -nurbs.slack_m && walker.is_of_a_point() {
            *self = Self::new(&self.fly(nurbs, walker, &input.hip_B)?);
            walker.know(&self.at, &self.god_foot);
            force = self.slide(walker, friction, input);
        }
        Some(self.touch(&force))
    }

    /// Nothing where it stands holds a god-object whose HIP is in front: it goes straight there, until it meets the surface.
    #[cold]
    fn fly(&self, nurbs: &Nurbs, walker: &Walker<'_>, hip_B: &Vector3<f64>) -> Option<Stand> {
        let from_B = self.at.point_B + self.at.normal_B * nurbs.slack_m;
        nurbs.meet(walker, &from_B, hip_B, None)
    }

    fn slide(&mut self, walker: &Walker<'_>, friction: &Friction, input: &ConeInput) -> ConeForce {
        let force = self.cone.update(walker, friction, input);
        self.at = *self.cone.god_object();
        self.state = self.cone.state();
        self.god_foot = walker.foot_of(&self.at).unwrap_or(self.god_foot);
        force
    }

    fn touch(&self, force: &ConeForce) -> Touch {
        Touch {
            god_object: self.at,
            force_on_user_B: force.force_on_user_B,
            normal_force_n: force.normal_force_n,
            friction: self.state,
        }
    }
}

impl Nurbs {
    /// Where a finger whose centre goes from `from_B` to `to_B` first touches; `left` is the side of a sheet it is on.
    pub(super) fn meet(
        &self,
        walker: &Walker<'_>,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
        left: Option<f64>,
    ) -> Option<Stand> {
        if !walker.is_of_a_point() {
            return self.meet_ball(walker, from_B, to_B);
        }
        let is_solid = self.sides == Sides::Solid;
        let crossed = self.first_crossing(from_B, to_B, |crossed| {
            let starts_on_it = crossed.along_m <= self.slack_m;
            match left {
                _ if is_solid => crossed.foot.side > 0.0,
                Some(side) if starts_on_it => crossed.foot.side == side,
                // A sheet is left as it was come to, so that leaving it is no coming from its other side.
                _ => crossed.along_m >= 0.0,
            }
        })?;
        Some(walker.at_foot(crossed.foot))
    }

    /// In steps as long as the way is clear, so that nothing is passed by; the last ones are Newton's.
    fn meet_ball(&self, walker: &Walker<'_>, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<Stand> {
        let path_B = to_B - from_B;
        let length_m = path_B.norm();
        let at =
            |along_m: f64| if along_m < length_m { from_B + path_B * (along_m / length_m) } else { *to_B };
        let mut along_m = 0.0;
        for _ in 0..MAX_STRIDES {
            let clear_m = self.clearance(&at(along_m)) - walker.layer_m();
            let stride_m = if clear_m > 0.0 {
                clear_m
            } else {
                let stand = walker.find(&at(along_m))?;
                let sinks = -stand.at.normal_B.dot(&path_B) / length_m;
                if stand.height_m <= 1e-15 * self.extent_m {
                    return (sinks > 0.0 || !stand.is_free).then_some(stand);
                }
                let is_close = stand.height_m <= CLOSE * self.extent_m && sinks > 1e-3;
                stand.height_m / if is_close { sinks } else { 1.0 }
            };
            if along_m >= length_m {
                return None;
            }
            along_m += stride_m;
        }
        // Along a surface that is all but touched: the end decides.
        walker.find(to_B).filter(|stand| !stand.is_free)
    }

    /// Whether a finger with its centre there would be pressed on, and from where.
    fn found_inside(&self, walker: &Walker<'_>, p_B: &Vector3<f64>, radius_m: f64) -> Option<Stand> {
        if !self.has_near(p_B, radius_m) || (self.sides == Sides::Sheet && radius_m == 0.0) {
            return None;
        }
        walker.find(p_B).filter(|stand| !stand.is_free)
    }

    /// Whether it is within the box of all, or nearer to it than `radius_m`.
    fn has_near(&self, p_B: &Vector3<f64>, radius_m: f64) -> bool {
        self.nodes[0].bounds.distance_squared(p_B) <= radius_m * radius_m
    }
}

/// Positions that differ by less than this share of the extent are the same, seen through two equal poses.
const SAME_PLACE: f64 = 1e-9;
/// Share of the extent within which a surface is flat enough that a ball sinks to it evenly.
const CLOSE: f64 = 1e-4;
/// Bound on the looks of a ball along its way.
const MAX_STRIDES: u32 = 32;
