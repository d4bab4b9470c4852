//! A ball and what it touches.
//!
//! Model: its centre C stays where nothing is nearer than the radius r. It knows the features that it touches, at most
//! [`MOST`], with the foot of C on each; the HIP presses on some of them ([`press`]).
//!
//! Cost: one plane, a few products.

use nalgebra::Vector3;

use super::ground::{Foot, Ground};
use super::press::{MOST, Plane, Pressed, press};
use crate::friction_cone::ConeInput;
use crate::surface::direction_or_up;
use crate::tangent_view::{TangentView, tangential};

/// A ball and what it touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball<F> {
    pub(super) centre_B: Vector3<f64>,
    pub(super) radius_m: f64,
    pub(super) rests: [Rest<F>; MOST],
    pub(super) count: usize,
    /// The move came to a feature that stands in its way: the centre is where it was to go, nearer than it may be.
    pub(super) is_blocked: bool,
}

/// A feature that it touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rest<F> {
    pub(super) foot: F,
    pub(super) normal_B: Vector3<f64>,
    /// `normal . x` of the centre when it touches \[m\].
    pub(super) offset_m: f64,
    /// What presses on it, as a spring \[m\].
    pub(super) load_m: f64,
}

/// What it sees of the HIP.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub(super) view: TangentView,
    /// The sum of all loads along their normals \[m\].
    pub(super) normal_spring_B: Vector3<f64>,
    /// The HIP is clear of all that it touches.
    pub(super) is_free: bool,
}

impl<F: Foot> Ball<F> {
    pub(super) fn in_free_space(centre_B: Vector3<f64>, radius_m: f64) -> Self {
        let rest = Rest { foot: F::NOWHERE, normal_B: Vector3::y(), offset_m: 0.0, load_m: 0.0 };
        Self { centre_B, radius_m, rests: [rest; MOST], count: 0, is_blocked: false }
    }

    pub(super) fn rests(&self) -> &[Rest<F>] {
        self.rests.get(..self.count).unwrap_or_default()
    }

    pub(super) fn rests_mut(&mut self) -> &mut [Rest<F>] {
        self.rests.get_mut(..self.count).unwrap_or_default()
    }

    /// What is pressed most.
    pub(super) fn primary(&self) -> Option<&Rest<F>> {
        let mut best = self.rests().first()?;
        for rest in self.rests() {
            if rest.load_m > best.load_m {
                best = rest;
            }
        }
        Some(best)
    }

    /// Finds out what the HIP presses on, and how the rest of the spring lies to it.
    #[inline(always)]
    pub(super) fn look(&mut self, ground: &impl Ground<Foot = F>, input: &ConeInput) -> Look {
        let centre_B = self.centre_B;
        if let [rest] = self.rests_mut() {
            let view = TangentView::new(&centre_B, rest.normal_B, rest.offset_m, input);
            rest.load_m = view.load_m;
            let is_free = view.depth_m < -tolerance_m(ground, self.radius_m);
            return Look { normal_spring_B: view.normal_B * view.load_m, view, is_free };
        }
        self.look_at_many(ground, input)
    }

    #[inline(never)]
    fn look_at_many(&mut self, ground: &impl Ground<Foot = F>, input: &ConeInput) -> Look {
        let (planes, count) = self.planes();
        let planes = &planes[..count];
        let pressed = self.press_on_what_is_touched(ground, planes, &input.hip_B);
        let nearest = planes.iter().map(|plane| distance(plane, &input.hip_B)).enumerate();
        let deepest = nearest.min_by(|(_, a), (_, b)| a.total_cmp(b));
        let set = self.held();
        if set.count_ones() <= 1 {
            // Zero counts as contact.
            let (index, height_m) = deepest.unwrap_or((0, f64::INFINITY));
            let index = if set == 0 { index } else { set.trailing_zeros() as usize };
            let (normal_B, offset_m) =
                planes.get(index).copied().unwrap_or((Vector3::y(), f64::NEG_INFINITY));
            let view = TangentView::new(&self.centre_B, normal_B, offset_m, input);
            if let Some(rest) = self.rests_mut().get_mut(index) {
                rest.load_m = view.load_m;
            }
            let is_near = height_m <= tolerance_m(ground, self.radius_m);
            let is_free = set == 0 && !is_near;
            return Look { normal_spring_B: normal_B * view.load_m, view, is_free };
        }
        let out_B = pressed.point_B - input.hip_B;
        let normal_B = direction_or_up(&out_B);
        let mut view =
            TangentView::new(&self.centre_B, normal_B, normal_B.dot(&input.hip_B) + out_B.norm(), input);
        view.lag_B = self.free_part(&(self.centre_B - pressed.point_B));
        view.gap_m = view.lag_B.norm();
        let mut normal_spring_B = Vector3::zeros();
        view.load_m = 0.0;
        for rest in self.rests_mut() {
            if rest.load_m > 0.0 {
                let approach_m_s = -rest.normal_B.dot(&input.hip_velocity_B);
                rest.load_m = (rest.load_m + input.damping_s() * approach_m_s).max(0.0);
                normal_spring_B += rest.normal_B * rest.load_m;
                // Each contact has its own friction cone: in a groove their loads add, not their forces.
                view.load_m += rest.load_m;
            } else {
                rest.load_m = 0.0;
            }
        }
        Look { view, normal_spring_B, is_free: false }
    }

    /// What the centre is not at, however near, carries nothing: with a wall nearly parallel to another one it would be far
    /// from where these meet, and what friction does to it on the way there would be lost.
    ///
    /// On flat faces the spring is no longer than to the centre, which is in front of all that it touches. Where it is
    /// that but for what walking feet leave, between walls that nearly face each other, the next place in front of both
    /// may be decimetres away: the walls are taken to be at the centre.
    fn press_on_what_is_touched<G: Ground<Foot = F>>(
        &mut self,
        ground: &G,
        planes: &[Plane],
        hip_B: &Vector3<f64>,
    ) -> Pressed {
        let near_m = tolerance_m(ground, self.radius_m);
        let centre_B = self.centre_B;
        let is_touched = |plane: &Plane| distance(plane, &centre_B) <= near_m;
        let (mut touched, mut count) = ([(Vector3::zeros(), 0.0); MOST], 0);
        for plane in planes.iter().filter(|plane| is_touched(plane)) {
            touched[count] = *plane;
            count += 1;
        }
        let mut pressed = press(&touched[..count], hip_B);
        if !G::IS_BENT && (pressed.point_B - hip_B).norm() > (centre_B - hip_B).norm() + near_m {
            for plane in &mut touched[..count] {
                plane.1 = plane.1.min(plane.0.dot(&centre_B));
            }
            pressed = press(&touched[..count], hip_B);
        }
        let mut loads_m = pressed.loads_m.into_iter();
        for (rest, plane) in self.rests_mut().iter_mut().zip(planes) {
            rest.load_m = if is_touched(plane) { loads_m.next().unwrap_or_default() } else { 0.0 };
        }
        pressed
    }

    /// True if the spring is longer than to the centre, which is in front of all that it touches but for what steps on bent
    /// ground leave: between walls that nearly face each other the next place in front of both may be decimetres away.
    pub(super) fn is_pressed_beyond_its_place(&self, look: &Look, input: &ConeInput) -> bool {
        let approach_m_s = |rest: &Rest<F>| (-rest.normal_B.dot(&input.hip_velocity_B)).max(0.0);
        let damped_m = input.damping_s() * self.rests().iter().map(approach_m_s).sum::<f64>();
        let longest_m = (1.0 + OF_STEPS) * (self.centre_B - input.hip_B).norm() + damped_m;
        look.normal_spring_B.norm_squared() > longest_m * longest_m
    }

    /// Takes all that it touches to be at the centre.
    pub(super) fn touch_exactly(&mut self, ground: &impl Ground<Foot = F>) {
        let (near_m, centre_B) = (tolerance_m(ground, self.radius_m), self.centre_B);
        for rest in self.rests_mut() {
            let at_centre_m = rest.normal_B.dot(&centre_B);
            if at_centre_m - rest.offset_m <= near_m {
                rest.offset_m = at_centre_m;
            }
        }
    }

    /// The part of a vector along which it can move and stay on all that it presses on.
    pub(super) fn free_part(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let mut held = self.rests().iter().filter(|rest| rest.load_m > 0.0).map(|rest| rest.normal_B);
        match (held.next(), held.next(), held.next()) {
            (Some(a), None, _) => tangential(v, &a),
            (Some(a), Some(b), None) => {
                let along = direction_or_up(&a.cross(&b));
                along * along.dot(v)
            }
            (Some(_), Some(_), Some(_)) => Vector3::zeros(),
            (None, ..) => *v,
        }
    }

    pub(super) fn held(&self) -> u8 {
        self.rests().iter().enumerate().fold(0, |set, (i, rest)| set | u8::from(rest.load_m > 0.0) << i)
    }

    pub(super) fn planes(&self) -> ([Plane; MOST], usize) {
        (self.rests.map(|rest| (rest.normal_B, rest.offset_m)), self.count)
    }

    /// Whether it went so far that it might have passed something.
    #[inline(always)]
    pub(super) fn strayed(&self, start: &Self) -> bool {
        !self.is_within_half_a_radius_of(start)
    }

    #[inline(always)]
    pub(super) fn is_within_half_a_radius_of(&self, other: &Self) -> bool {
        (self.centre_B - other.centre_B).norm_squared() <= 0.25 * self.radius_m * self.radius_m
    }

    /// Whether no foot, or none but this one, is on its piece.
    #[inline]
    pub(super) fn is_alone_with(&self, foot: &F) -> bool {
        let is_other = |other: &F| other.is_on_same_piece(foot) && other.point_B() != foot.point_B();
        !self.rests().iter().any(|rest| is_other(&rest.foot))
    }

    /// Whether it rests on this foot.
    pub(super) fn is_at(&self, foot: &F) -> bool {
        let near_m = SAME_FOOT * self.radius_m;
        self.rests().iter().any(|rest| (rest.foot.point_B() - foot.point_B()).amax() <= near_m)
    }

    /// Takes note of a feature that it touches.
    pub(super) fn add(&mut self, ground: &impl Ground<Foot = F>, foot: &F) {
        let mut rest = Self::in_free_space(self.centre_B, self.radius_m).rests[0];
        rest.foot = *foot;
        let is_alone = self.is_alone_with(&rest.foot);
        rest.walk(ground, &self.centre_B, self.radius_m, is_alone);
        if self.is_at(&rest.foot) {
            return;
        }
        // No more than three hold it: of four, one is not pressed.
        let idle = self.rests().iter().position(|rest| rest.load_m <= 0.0).unwrap_or(MOST - 1);
        let place = if self.count < MOST { self.count } else { idle };
        self.rests[place] = rest;
        self.count = (place + 1).max(self.count);
    }
}

impl<F: Foot> Rest<F> {
    #[inline(always)]
    pub(super) fn walk(
        &mut self,
        ground: &impl Ground<Foot = F>,
        centre_B: &Vector3<f64>,
        radius_m: f64,
        is_alone: bool,
    ) {
        self.foot = ground.walked(&self.foot, centre_B, radius_m, is_alone);
        (self.normal_B, self.offset_m) = ground.plane(&self.foot, centre_B, radius_m);
    }
}

pub(super) fn distance((normal_B, offset_m): &Plane, p_B: &Vector3<f64>) -> f64 {
    normal_B.dot(p_B) - offset_m
}

/// Nearer than the radius by less than this is touching \[m\].
#[inline(always)]
pub(super) fn tolerance_m(ground: &impl Ground, radius_m: f64) -> f64 {
    1e-9 * radius_m + 1e-12 * ground.extent_m()
}

/// Of a spring, what steps on bent ground may leave too much.
const OF_STEPS: f64 = 1e-3;

/// Feet that are as near to each other as this share of the radius are one.
pub(super) const SAME_FOOT: f64 = 1e-9;
