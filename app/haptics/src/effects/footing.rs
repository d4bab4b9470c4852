//! The foot of a finger on a path, as a god-object: it is remembered and moves along the path.
//!
//! Problem: the nearest place of a path jumps where two of its parts are equally near: inside of a corner, between the
//! legs of a U. A force that goes by it has a step there, of any size.
//! Model: in each tick the foot goes down along the path, as [`Path::descend`], from where it was. Where its branch ends
//! (the finger leaves a corner's inner side), the next minimum may be far off: it slides over, so that spring and way
//! differ by [`Guide::SLIDE_M_PER_S`] at most. Where another part of the path is nearer by more than
//! [`Guide::CHANGE_M`], the finger changes over: it has two feet for a while, and the weight goes from the farther one to the
//! nearer one, so slowly that the force changes by what a slide of that speed would change it.
//! Invariants: what the springs hold, `sum w U(|p - foot|)`, is never raised by a foot's way or by a change of weights,
//! but by the finger's own motion only. So on a closed way the user gets back no more than he has put in, and beyond
//! that, as of every spring that is held from tick to tick, `k/2 |motion|^2` a tick. In a tick the spring's force
//! changes by `k (|motion| + 2 SLIDE_M_PER_S dt)` at most, and by `k |motion|` where the foot neither slides nor changes.
//! Cost: linear in the pieces of the path.

use nalgebra::Vector3;

use super::Motion;
use super::guide::{Draw, Guide};
use super::path::{Ball, Path, Spot};
use super::track::Foot;

/// Memory of a finger on a path.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Footing(Option<Known>);

#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    hip_W: Vector3<f64>,
    at: Spot,
    /// It is changing to `at` from here.
    from: Option<Spot>,
    /// Weight of `at`, 0 to 1.
    weight: f64,
}

impl Footing {
    /// The next step takes the nearest place.
    pub(super) fn forget(&mut self) {
        self.0 = None;
    }

    /// One tick; `draw` tells what a spring of this stiffness (N/m) to a foot does.
    pub(super) fn step(
        &mut self,
        path: &Path,
        motion: &Motion,
        stiffness_n_per_m: f64,
        draw: impl Fn(&Foot) -> Draw,
    ) -> Draw {
        let hip_W = motion.position_W;
        let draw = |spot: &Spot| draw(&path.foot(spot));
        // A time of no meaning is none.
        let slide_m = Guide::SLIDE_M_PER_S * if motion.dt_s > 0.0 { motion.dt_s.min(LONGEST_S) } else { 0.0 };
        let Some(mut known) = self.0 else {
            let at = path.nearest(&hip_W);
            self.0 = Some(Known { hip_W, at, from: None, weight: 1.0 });
            return draw(&at);
        };
        known.go_down(path, &hip_W, slide_m);
        let mut near = draw(&known.at);
        if known.from.is_none() {
            let nearest = path.nearest(&hip_W);
            let nearer = draw(&nearest);
            if near.stretch_m - nearer.stretch_m > Guide::CHANGE_M {
                (known.from, known.at, known.weight) = (Some(known.at), nearest, 0.0);
                near = nearer;
            }
        }
        if let Some(from) = known.from {
            let far = draw(&from);
            known.change(&far, &near, stiffness_n_per_m * slide_m);
            near = far.mixed(&near, known.weight);
            known.settle(from);
        }
        self.0 = Some(known);
        near
    }
}

impl Known {
    /// The feet go along the path.
    fn go_down(&mut self, path: &Path, hip_W: &Vector3<f64>, slide_m: f64) {
        let way_W = hip_W - std::mem::replace(&mut self.hip_W, *hip_W);
        // In it the stretch changes by no more than the motion and the slide.
        let within =
            |spot: &Spot| Ball { centre_W: path.point(spot) + way_W, radius_m: way_W.norm() + slide_m };
        let down = |spot: Spot| path.descend(spot, hip_W, &within(&spot));
        (self.at, self.from) = (down(self.at), self.from.map(down));
    }

    /// The weight goes to the nearer one, by a change of this force (N) at most.
    fn change(&mut self, from: &Draw, at: &Draw, most_n: f64) {
        let gap_n = (from.force_W - at.force_W).norm();
        let nearer_m = from.stretch_m - at.stretch_m;
        let change = if gap_n <= most_n {
            nearer_m.signum()
        } else {
            most_n / gap_n * (nearer_m / Guide::CHANGE_M).clamp(-1.0, 1.0)
        };
        let change = if change.is_nan() { 0.0 } else { change };
        self.weight = (self.weight + change).clamp(0.0, 1.0);
    }

    /// The foot that remains.
    fn settle(&mut self, from: Spot) {
        if self.weight == 0.0 {
            self.at = from;
        }
        if self.weight == 0.0 || self.weight == 1.0 {
            (self.from, self.weight) = (None, 1.0);
        }
    }
}

/// A longer tick is none of a loop.
const LONGEST_S: f64 = 0.05;
