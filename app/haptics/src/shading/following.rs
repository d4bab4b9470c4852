//! A shaded force that is continuous in the HIP: after a leap of the god-object it follows with the finger's way.
//!
//! Problem: over a convex edge the god-object leaps, since below it the HIP has long been under the next face; with it the
//! shaded normal and the force leap, by the more the deeper the finger is.
//!
//! Model: in the tick of a leap the force stays what it was, in direction and size; from there on it comes nearer to what
//! shading makes of the god-object as the finger goes, and is there after half of the leap's length. What an edge that stays
//! sharp does to the force is none of it: there the shaded normal turns as the faces do.
//!
//! Frames: object frame B.
//! Invariant: without a leap the force is that of [`Shading::turn`], to the bit.

use nalgebra::Vector3;

use super::{Shading, Turn};
use crate::algorithm::Touch;
use crate::shape::Shape;
use crate::surface::SurfacePoint;

/// Memory of a shaded contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Following {
    /// Place of the god-object in the last tick, and the size of the force there (N).
    last: Option<(SurfacePoint, f64)>,
    leap: Option<Leap>,
}

/// A leap that has not been made up for.
#[derive(Debug, Clone, Copy)]
struct Leap {
    /// From the shaded normal to what is felt.
    off_B: Vector3<f64>,
    /// Factor of the size of the force.
    size: f64,
    /// Of the god-object's way (m).
    left_m: f64,
}

impl Following {
    /// Turns the force of a contact with a point, in a tick in which the finger went so far (m).
    pub(crate) fn turn(&mut self, shading: &Shading, shape: &Shape, touch: &mut Touch, way_m: f64) {
        let (at, size_n) = (touch.god_object, touch.force_on_user_B.norm());
        let last = self.last.replace((at, size_n));
        let gone_m = last.map_or(0.0, |(last, _)| (at.point_B - last.point_B).norm());
        if self.leap.is_none() && gone_m <= LEAP * way_m + SLACK_M {
            return shading.turn(shape, touch);
        }
        let normal_B = shading.normal_at(shape, &at);
        if let Some((last, last_size_n)) = last.filter(|_| gone_m > LEAP * way_m + SLACK_M) {
            self.begin(shading, shape, (&last, last_size_n), (&at, size_n), normal_B);
        }
        let Some(leap) = &mut self.leap else { return shading.turn(shape, touch) };
        let left_m = leap.left_m - MADE_UP * way_m;
        if left_m <= 0.0 {
            self.leap = None;
            return shading.turn(shape, touch);
        }
        let share = left_m / leap.left_m;
        *leap = Leap { off_B: leap.off_B * share, size: 1.0 + (leap.size - 1.0) * share, left_m };
        let Leap { off_B, size, .. } = *leap;
        let turn = Turn { from_B: at.normal_B, to_B: normal_B + off_B };
        touch.force_on_user_B = shading.form().turned(&touch.force_on_user_B, &turn) * size;
        touch.normal_force_n *= size;
    }

    /// Nothing is known of the last tick.
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// The god-object leapt; what was felt is felt on.
    fn begin(
        &mut self,
        shading: &Shading,
        shape: &Shape,
        (last, last_size_n): (&SurfacePoint, f64),
        (at, size_n): (&SurfacePoint, f64),
        normal_B: Vector3<f64>,
    ) {
        let last_normal_B = shading.normal_at(shape, last);
        // As far as the faces, or farther: an edge that is not shaded, or a place that is quite another one.
        if (normal_B - last_normal_B).norm() >= SMOOTHED * (at.normal_B - last.normal_B).norm() {
            self.leap = None;
            return;
        }
        let before = self.leap.unwrap_or(Leap { off_B: Vector3::zeros(), size: 1.0, left_m: 0.0 });
        let size = before.size * last_size_n / size_n;
        let is_small = (1.0 / MOST_SIZE..=MOST_SIZE).contains(&size);
        self.leap = is_small.then(|| Leap {
            off_B: last_normal_B + before.off_B - normal_B,
            size,
            left_m: before.left_m + (at.point_B - last.point_B).norm(),
        });
    }
}

/// As often as the finger's way the god-object's is no leap: deep below a hill it is some times as far.
const LEAP: f64 = 4.0;
/// Roundings of places on a surface of a metre (m).
const SLACK_M: f64 = 1e-9;
/// Part of the leap that is made up for in a way of the same length.
const MADE_UP: f64 = 2.0;
/// A shaded edge turns the felt normal by less than this part of what it turns the faces' by.
const SMOOTHED: f64 = 0.5;
/// A leap that changes the force by more is no shaded edge's.
const MOST_SIZE: f64 = 1.25;
