//! Height maps: small features over a surface from a picture (Melder ch. 4.2.7).
//!
//! Problem: dimples, engraved letters or cloth are far too fine to be modelled. A picture of heights over a plain surface is
//! enough for a finger that moves along it.
//!
//! Model: the picture lies on the surface by the coordinates of [`Chart`] and is smooth between its texels
//! ([`HeightGrid`]). A value `w` from 0 (black) to 1 (white) stands for the height `h = amplitude (w - zero level)`. Two
//! forms, of which k is the stiffness, n the surface's outward normal and d the finger's depth below it:
//! - [`HeightForm::AlongForce`], the thesis' own: `k h` is added along the force that the contact algorithm found. Nothing
//!   pushes sideways on a slope, and a loop over a hill can give or take energy; in return it holds on any surface. Since
//!   it is added in contact only, and to a force that has no direction before, a raised surface is met with a step of
//!   `k h`.
//! - [`HeightForm::Gradient`]: the surface itself is raised. Depth grows by h, and the normal leans to
//!   `n' = normalise(n - grad h)`. The part of the force along n is `k (d + h)`, that along the surface
//!   `-k (d + h) grad h`: without friction this is the gradient of `k/2 (d + h)^2`, and no path gains energy. Friction
//!   keeps its share of the normal force and turns with the normal. On curved surfaces this holds to first order in
//!   (d + h) over the radius of curvature, since the slope is taken at the surface and not where the finger is.
//!
//! Where touch begins: with the gradient form a raised surface is met at its own height, because the contact is that with
//! the shape grown by the map's largest height, less what is missing below that ([`HeightMap::lift_m`]): the force begins at
//! zero. That takes a shape that can grow, see [`crate::Surface::grown`]. On meshes and on scaled shapes, which cannot, and
//! with the other form, touch begins at the base surface, and with a step of `k h` where the surface is raised; a zero
//! level of 1 (all of the picture carved) has no such step anywhere.
//! Above a dent the finger is free: while the raised surface is below it there is no force, the contact is not reported, and
//! the god-object follows without friction, so that nothing has been strained when the finger comes down again.
//!
//! Edges: each face of a box, each cap has a picture of its own; heights jump from one to the next. Over a round edge the
//! picture of the face that it looks most like goes on.
//!
//! Frames: B. Invariants: a contact never pulls; nothing that is finite becomes infinite but by its own size, and no slope
//! makes more of a force than its `sqrt(5)`-fold: what is steeper than 2 (63 degrees) is felt as that ([`felt`]), cliffs too,
//! and a path may gain energy there.
//! Cost: nine texels and the chart, in contact only.

mod error;
mod felt;
mod grid;
mod survey;

pub use error::HeightMapError;
pub(crate) use felt::FeltHeight;
pub use grid::{Border, HeightGrid, MAX_GRID_SIDE};
pub use survey::HeightSurvey;

use nalgebra::Vector3;
use std::sync::Arc;

use crate::algorithm::Touch;
use crate::chart::{Chart, Coordinate, along_surface};
use crate::shape::Shape;
use crate::surface::{Surface, SurfacePoint};

/// Heights over a surface.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    picture: Arc<HeightGrid>,
    scale: PictureScale,
    form: HeightForm,
    border: Border,
    amplitude_m: f64,
    zero_level: f64,
    is_inverted: bool,
}

/// How large a picture is on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PictureScale {
    /// So many pictures from one end of the surface to the other, across and up; on meshes, so many for each of the file's.
    Repeat([f64; 2]),
    /// The size of one picture \[m\], which lies in the middle; where the surface closes, as near to it as a whole number
    /// of pictures comes.
    Size([f64; 2]),
}

/// What heights do to a force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HeightForm {
    /// They lengthen it.
    AlongForce,
    /// They raise the surface.
    #[default]
    Gradient,
}

/// What is known of a contact beside the touch itself.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Over<'e> {
    pub(crate) shape: &'e Shape,
    pub(crate) stiffness_n_per_m: f64,
    pub(crate) finger_radius_m: f64,
    pub(crate) hip_B: Vector3<f64>,
    /// Way of the finger in this tick \[m\].
    pub(crate) way_m: f64,
}

/// Height and slope at a place of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Height {
    h_m: f64,
    slope_B: Vector3<f64>,
}

impl HeightMap {
    /// The highest and the deepest that anything may be \[m\].
    pub const LARGEST_AMPLITUDE_M: f64 = 1.0;
    /// Slopes that are steeper are felt as this one: on a mesh whose texture coordinates shrink to a point they have no end, and
    /// the force grows with them.
    pub const STEEPEST: f64 = 2.0;

    /// A picture on a surface, black at the surface and white `amplitude_m` above it, or below if that is negative.
    ///
    /// # Errors
    /// An amplitude that is not finite or too large, a scale that is not finite or not positive.
    pub fn new(
        picture: Arc<HeightGrid>,
        amplitude_m: f64,
        scale: PictureScale,
    ) -> Result<Self, HeightMapError> {
        let is_usable = amplitude_m.abs() <= Self::LARGEST_AMPLITUDE_M;
        check(is_usable, "amplitude_m", amplitude_m, "a number from -1 to 1")?;
        let (parameter, along) = match scale {
            PictureScale::Repeat(times) => ("repeat", times),
            PictureScale::Size(size_m) => ("size_m", size_m),
        };
        for number in along {
            check(number.is_finite() && number > 0.0, parameter, number, "a finite number > 0")?;
        }
        let (form, border) = Default::default();
        Ok(Self { picture, scale, form, border, amplitude_m, zero_level: 0.0, is_inverted: false })
    }

    /// In this form.
    pub fn with_form(self, form: HeightForm) -> Self {
        Self { form, ..self }
    }

    /// With this beyond the picture's borders.
    pub fn with_border(self, border: Border) -> Self {
        Self { border, ..self }
    }

    /// With this value, from 0 (black) to 1 (white), at the surface. Errors: any other.
    pub fn with_zero_level(self, zero_level: f64) -> Result<Self, HeightMapError> {
        check((0.0..=1.0).contains(&zero_level), "zero_level", zero_level, "a number from 0 to 1")?;
        Ok(Self { zero_level, ..self })
    }

    /// With black for white.
    pub fn inverted(self) -> Self {
        Self { is_inverted: !self.is_inverted, ..self }
    }

    /// Whether the picture can lie on this shape.
    ///
    /// # Errors
    /// The shape has no coordinates, or none that this scale is for.
    pub fn check_fit(&self, shape: &Shape) -> Result<(), HeightMapError> {
        let chart = shape.chart(&some_point(shape)).ok_or(HeightMapError::NoCoordinates)?;
        for (axis, along) in [chart.u, chart.v].iter().enumerate() {
            match self.scale {
                PictureScale::Size(_) if matches!(shape, Shape::Mesh(_)) => {
                    return Err(HeightMapError::NoMetres);
                }
                PictureScale::Repeat(_) if along.length_m.is_infinite() => {
                    return Err(HeightMapError::Endless);
                }
                PictureScale::Repeat(times) if along.closes && times[axis].fract() != 0.0 => {
                    return Err(HeightMapError::Seam { found: times[axis] });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Heights of the picture's darkest and brightest place \[m\], the lower one first.
    pub fn range_m(&self) -> [f64; 2] {
        let [a, b] = self.picture.range().map(|value| self.height_of(value));
        [a.min(b), a.max(b)]
    }

    /// How far above a shape a finger of this radius begins to be in touch with it \[m\]: the largest height, if the
    /// surface itself is raised and can grow; 0 otherwise.
    pub fn lift_m(&self, shape: &Shape, finger_radius_m: f64) -> f64 {
        let highest_m = self.range_m()[1];
        if self.form != HeightForm::Gradient || highest_m <= 0.0 {
            return 0.0;
        }
        let radius_m = finger_radius_m + highest_m;
        let can_grow = match shape {
            Shape::Form(form) => form.grown(radius_m).is_some(),
            Shape::Own(surface) => surface.show_grown(radius_m, &mut |_| {}),
            // A mesh is met by rolling a ball over it, which would round off its concave edges; and costs ten times as much.
            _ => false,
        };
        if can_grow { highest_m } else { 0.0 }
    }

    /// Height \[m\] and its gradient along the surface at one of the shape's points; zero where it has no coordinates.
    pub fn height(&self, shape: &Shape, at: &SurfacePoint) -> (f64, Vector3<f64>) {
        let height = shape.chart(at).map(|chart| self.on_chart(&chart, at)).unwrap_or_default();
        (height.h_m, height.slope_B)
    }

    /// Makes of a contact's force what it is on the raised surface, and tells by how much that explains a change of it (N).
    /// `None` if the finger is above it.
    #[inline(never)]
    pub(crate) fn raise(&self, over: &Over<'_>, felt: &mut FeltHeight, touch: &mut Touch) -> Option<f64> {
        let lift_m = self.lift_m(over.shape, over.finger_radius_m);
        let held = touch.god_object;
        let on_base_B = held.point_B - held.normal_B * (over.finger_radius_m + lift_m);
        let (h_m, slope_B) = self.height(over.shape, &SurfacePoint { point_B: on_base_B, ..held });
        let step = felt.follow(Height { h_m, slope_B }, over.way_m);
        let Height { h_m, slope_B } = step.height;
        let is_below = match self.form {
            HeightForm::AlongForce => lengthen(over.stiffness_n_per_m * h_m, touch),
            HeightForm::Gradient => {
                let depth_m = held.normal_B.dot(&(held.point_B - over.hip_B));
                lean(over.stiffness_n_per_m * (h_m - lift_m), &slope_B, touch);
                touch.god_object.point_B += held.normal_B * (h_m - lift_m);
                depth_m + (h_m - lift_m) >= 0.0
            }
        };
        let steepness = (1.0 + slope_B.norm_squared()).sqrt();
        let moved_n = over.stiffness_n_per_m * (over.way_m + step.change_m) * steepness;
        is_below.then_some(moved_n + step.lean * touch.normal_force_n)
    }

    fn height_of(&self, value: f64) -> f64 {
        let value = if self.is_inverted { 1.0 - value } else { value };
        self.amplitude_m * (value - self.zero_level)
    }

    fn on_chart(&self, chart: &Chart, at: &SurfacePoint) -> Height {
        let [u, v] = [(0, &chart.u), (1, &chart.v)].map(|(axis, along)| self.in_pictures(axis, along));
        let sample = self.picture.at([u.0, v.0], self.border);
        let gain_m = if self.is_inverted { -self.amplitude_m } else { self.amplitude_m };
        let full_m = self.height_of(sample.value);
        let slope_B =
            chart.u.gradient_B * (sample.slopes[0] * u.1) + chart.v.gradient_B * (sample.slopes[1] * v.1);
        let slope_B = slope_B * (gain_m * chart.weight) + chart.weight_gradient_B * full_m;
        let height = Height { h_m: full_m * chart.weight, slope_B: along_surface(&slope_B, &at.normal_B) };
        // A place without coordinates, such as the tip of a cone: nothing stands there.
        let is_known = height.h_m.is_finite() && height.slope_B.iter().all(|x| x.is_finite());
        if is_known { height } else { Height::default() }
    }

    /// A coordinate in pictures, and pictures per metre of it.
    fn in_pictures(&self, axis: usize, along: &Coordinate) -> (f64, f64) {
        let times = match self.scale {
            PictureScale::Repeat(times) => times[axis],
            PictureScale::Size(size_m) if along.closes => (along.length_m / size_m[axis]).round().max(1.0),
            PictureScale::Size(size_m) => return (along.at_m / size_m[axis] + 0.5, 1.0 / size_m[axis]),
        };
        let per_m = times / along.length_m;
        (along.at_m * per_m + 0.5 * times, per_m)
    }
}

/// Adds a force (N) along the one that is there, as far as that keeps its direction. `false` if nothing is left of it.
fn lengthen(by_n: f64, touch: &mut Touch) -> bool {
    let size_n = touch.force_on_user_B.norm();
    if size_n == 0.0 {
        // Without a direction it stays without force.
        return by_n >= 0.0;
    }
    let factor = 1.0 + by_n / size_n;
    touch.force_on_user_B *= factor;
    touch.normal_force_n *= factor;
    // What is not a number is not above anything, and ends the contact by itself.
    factor.is_nan() || factor > 0.0
}

/// Adds to the load along the normal (N), and leans the normal, and the force with it, back from a slope.
fn lean(by_n: f64, slope_B: &Vector3<f64>, touch: &mut Touch) {
    let normal_B = touch.god_object.normal_B;
    let leaning_B = normal_B - slope_B;
    let steepness = leaning_B.norm();
    let leaning_B = leaning_B / steepness;
    let before_n = touch.normal_force_n;
    let after_n = (before_n + by_n).max(0.0) * steepness;
    touch.force_on_user_B = if before_n > LEAST_N {
        turned(&normal_B, &leaning_B, &(touch.force_on_user_B / before_n)) * after_n
    } else {
        leaning_B * after_n
    };
    touch.normal_force_n = after_n;
    touch.god_object.normal_B = leaning_B;
}

/// A load so small that it tells no direction.
const LEAST_N: f64 = 1e-200;

/// `v` turned by the smallest rotation from one unit vector to another less than a right angle away.
fn turned(from: &Vector3<f64>, to: &Vector3<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let axis = from.cross(to);
    let across = axis.cross(v);
    v + across + axis.cross(&across) / (1.0 + from.dot(to))
}

/// Where a shape that closes around an axis closes.
fn some_point(shape: &Shape) -> SurfacePoint {
    let far_B = Vector3::x() * 1e6;
    match shape {
        Shape::Form(form) => form.nearest(&far_B),
        Shape::Own(surface) => surface.nearest(&far_B),
        _ => SurfacePoint {
            point_B: Vector3::zeros(),
            normal_B: Vector3::y(),
            feature: crate::surface::Feature::Face,
            piece: 0,
        },
    }
}

fn check(
    is_usable: bool,
    parameter: &'static str,
    found: f64,
    allowed: &'static str,
) -> Result<(), HeightMapError> {
    if is_usable { Ok(()) } else { Err(HeightMapError::OutOfRange { parameter, found, allowed }) }
}
