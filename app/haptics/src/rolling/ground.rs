//! What a rolling ball asks of a shape: where its feet are.
//!
//! Model: a foot is the point of a feature (a face, an edge, a vertex, a bent patch) that is nearest to the ball's
//! centre. A feature that is known is followed as the ball moves; what else is near, a query tells.
//!
//! Frames and signs: the shape's own, B; normals lead from the shape to the ball's centre.

use nalgebra::Vector3;

use super::press::Plane;
use crate::mesh::TooMany;
use crate::surface::Feature;

/// A shape on which balls roll.
pub(crate) trait Ground {
    type Foot: Foot;
    /// What is kept from one tick to the next, so that not every tick has to look at everything.
    type Vicinity: Copy + Default + std::fmt::Debug;

    /// Whether its pieces are bent: how far a slide goes then is another matter than on a plane.
    const IS_BENT: bool;

    /// Of all shapes of its kind, which.
    fn identity(&self) -> u64;

    /// Largest coordinate, without its sign \[m\].
    fn extent_m(&self) -> f64;

    /// A lower bound of the distance from its surface, on either side; what is farther than `at_most_m` need not be
    /// told \[m\].
    fn clearance_m(&self, point_B: &Vector3<f64>, at_most_m: f64) -> f64;

    /// Where nothing was found within `radius_m`, how much of that is known to be clear of both sides of the surface \[m\].
    fn seen_m(&self, radius_m: f64) -> f64;

    /// Whether the material is there.
    fn is_inside(&self, point_B: &Vector3<f64>) -> bool;

    /// A near foot of a point that is inside.
    fn way_out(&self, point_B: &Vector3<f64>) -> Option<Self::Foot>;

    /// The normal at a foot, of which the way to the centre says nothing.
    fn normal_B(&self, foot: &Self::Foot) -> Vector3<f64>;

    /// The foot of `centre_B` that one comes to from another foot; where the ball has others on the same piece, it is not
    /// alone: on a rim around the ball they must not come together.
    fn walked(&self, foot: &Self::Foot, centre_B: &Vector3<f64>, radius_m: f64, is_alone: bool)
    -> Self::Foot;

    /// How far `centre_B` is from a foot's feature alone, or where that is not alone from the foot \[m\].
    fn distance_m(&self, foot: &Self::Foot, centre_B: &Vector3<f64>, is_alone: bool) -> f64;

    /// Where one comes to from a foot, also beyond the end of its feature.
    fn followed(&self, foot: &Self::Foot, centre_B: &Vector3<f64>) -> Self::Foot;

    /// Which way the centre lies from its foot, and `normal . x` of where it then is when it touches.
    fn plane(&self, foot: &Self::Foot, centre_B: &Vector3<f64>, radius_m: f64) -> Plane;

    /// The nearest foot that is nearer than `at_most_m`, and how far it is.
    fn nearest_within(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
    ) -> Result<Option<(Self::Foot, f64)>, TooMany>;

    /// As [`Self::nearest_within`], in front of a plane `normal . x = offset`. What is behind it may be told, too.
    fn nearest_above(
        &self,
        centre_B: &Vector3<f64>,
        at_most_m: f64,
        plane: (&Vector3<f64>, f64),
    ) -> Result<Option<Self::Foot>, TooMany>;

    /// Whether it is certain that nothing in front of the plane that touches the ball of radius `near_m`, with this
    /// normal, is nearer than that; `moved_m` is how far the ball came in this tick.
    fn is_clear(
        &self,
        vicinity: &mut Self::Vicinity,
        centre_B: &Vector3<f64>,
        normal_B: &Vector3<f64>,
        near_m: f64,
        moved_m: f64,
    ) -> bool;

    /// Share of the way after which it first goes through the surface, from either side; `None`: nowhere on it, if the ground can tell
    /// that at all.
    fn crossed_at(&self, way_B: [&Vector3<f64>; 2]) -> Option<f64>;

    /// How far a free ball can go whichever way, as far as `ahead_m` matters; negative where it is too near \[m\].
    fn room_m(&self, centre_B: &Vector3<f64>, radius_m: f64, ahead_m: f64) -> Option<f64>;

    /// Where a ball that rests on this foot, with this normal, comes to rest without friction, if this is known without
    /// searching: its foot there, and the plane of that.
    fn seat(
        &self,
        foot: &Self::Foot,
        normal_B: &Vector3<f64>,
        hip_B: &Vector3<f64>,
        radius_m: f64,
    ) -> Option<(Self::Foot, Plane)>;
}

/// A point of a shape, on one of its features.
pub(crate) trait Foot: Copy + std::fmt::Debug {
    /// No foot; it holds a place that nobody looks at.
    const NOWHERE: Self;

    fn point_B(&self) -> Vector3<f64>;

    /// What kind of feature it is on.
    fn feature(&self) -> Feature;

    /// The number of a piece of the shape that the feature belongs to.
    fn piece(&self) -> u32;

    /// Whether both are on one smooth piece.
    fn is_on_same_piece(&self, other: &Self) -> bool;

    /// Whether no fold is between them: both are on one smooth piece, or on it and on its edge.
    fn is_beside(&self, other: &Self) -> bool;
}
