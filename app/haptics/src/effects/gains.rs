//! Linear gains of effects at a place: stiffness, damping and mass against small motions, by direction.
//!
//! Model: of a finger that rests at a place and is held there for as long as it takes, `dF = -K dx - B dv - m da`. Gains of
//! several effects add up at a place as their forces do; whether a loop stands the sum is for [`super::Limits`] to say.
//! Of a guide K is that of its spring's pull: along the pull its stiffness, up to its force limit; across it
//! the pull over the distance, as a pendulum's. Of a field that fades and of a magnet's pull that falls the slopes are told
//! only where they draw back.
//! Frames: world.

use nalgebra::{Matrix3, Vector3};

use super::{Field, FieldKind, Guide, Region};
use crate::entity::Entity;
use crate::frame::{point_into_body, point_into_world};
use crate::surface::Surface;

/// Stiffness, damping and mass at a place, in the world's axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gains {
    /// \[N/m\]
    pub stiffness_n_per_m: Matrix3<f64>,
    /// \[N s/m\]
    pub damping_n_s_per_m: Matrix3<f64>,
    /// In all directions \[kg\].
    pub mass_kg: f64,
}

impl Field {
    /// At this place.
    pub fn gains_at(&self, p_W: &Vector3<f64>) -> Gains {
        let weight = self.region().weight(p_W);
        match self.kind() {
            FieldKind::Viscous { damping_n_s_per_m } => {
                let along =
                    |axis_W: Vector3<f64>| self.region().multiplied(&axis_W, damping_n_s_per_m) * weight;
                let damping_n_s_per_m = by_axes(along);
                Gains { damping_n_s_per_m, ..Gains::default() }
            }
            FieldKind::Inertial { mass_kg, .. } => Gains { mass_kg: mass_kg * weight, ..Gains::default() },
            FieldKind::Constant { .. } => Gains::default(),
        }
    }
}

impl Region {
    /// Nearest place, or about it, at which a field is felt in full; in what is thinner than two rims, at which it is felt most.
    pub fn felt_near(&self, p_W: &Vector3<f64>) -> Vector3<f64> {
        let Some((form, X_WB, rim_m)) = self.parts() else { return *p_W };
        let p_B = point_into_body(X_WB, p_W);
        if -form.signed_distance(&p_B) >= rim_m {
            return *p_W;
        }
        let at = form.nearest(&p_B);
        let within_m = |below_m: f64| -form.signed_distance(&(at.point_B - at.normal_B * below_m));
        let below_m = if within_m(rim_m) < rim_m * FULL { deepest(within_m, rim_m) } else { rim_m };
        point_into_world(X_WB, &(at.point_B - at.normal_B * below_m))
    }
}

/// Way below a surface, up to this one, at whose end it is farthest; on the way it is farther first, and then nearer.
fn deepest(within_m: impl Fn(f64) -> f64, most_m: f64) -> f64 {
    let (mut least, mut most) = (0.0, most_m);
    for _ in 0..THIRDS {
        let [near, far] = [least + (most - least) / 3.0, most - (most - least) / 3.0];
        if within_m(near) < within_m(far) { least = near } else { most = far }
    }
    0.5 * (least + most)
}

/// Of a rim: nearer to its end a field is felt in full, but for rounding.
const FULL: f64 = 1.0 - 1e-9;
/// Each leaves two thirds of a way.
const THIRDS: usize = 60;

impl Guide {
    /// At this place, if it has the finger on the branch of its track that is nearest; nothing where it lets go.
    pub fn gains_at(&self, p_W: &Vector3<f64>) -> Gains {
        let foot = self.track().foot(p_W);
        let off_W = p_W - foot.point_W;
        let (stretch_m, damping) = self.strengths(off_W.norm());
        if self.lets_go_at(stretch_m) {
            return Gains::default();
        }
        let across = by_axes(|axis_W| foot.across(&axis_W, &off_W));
        let most_m = self.force_limit_n() / self.stiffness_n_per_m();
        let stiffness_n_per_m = match off_W.try_normalize(0.0) {
            Some(pull_W) => {
                let along = pull_W * pull_W.transpose();
                let slope =
                    if stretch_m > 0.0 && stretch_m < most_m { self.stiffness_n_per_m() } else { 0.0 };
                let sideways = self.stiffness_n_per_m() * stretch_m.min(most_m) / off_W.norm();
                along * slope + (across - along) * sideways
            }
            None if self.strengths(f64::MIN_POSITIVE).0 > 0.0 => across * self.stiffness_n_per_m(),
            None => Matrix3::zeros(),
        };
        Gains { stiffness_n_per_m, damping_n_s_per_m: across * damping, mass_kg: 0.0 }
    }

    /// On a finger that rests at this place, if it has the finger on the branch of its track that is nearest \[N\]; nothing
    /// where it lets go.
    pub fn force_at(&self, p_W: &Vector3<f64>) -> Vector3<f64> {
        let off_W = p_W - self.track().foot(p_W).point_W;
        let (stretch_m, _) = self.strengths(off_W.norm());
        let pull_n = (self.stiffness_n_per_m() * stretch_m).min(self.force_limit_n());
        match off_W.try_normalize(0.0) {
            Some(away_W) if !self.lets_go_at(stretch_m) => away_W * -pull_n,
            _ => Vector3::zeros(),
        }
    }

    /// Distance from its track at which it pulls most, or nearly \[m\].
    pub fn strained_m(&self) -> f64 {
        self.felt_between().1
    }

    /// Nearest place, or about it, at which it is felt in full.
    pub fn felt_near(&self, p_W: &Vector3<f64>) -> Vector3<f64> {
        let foot = self.track().foot(p_W);
        let off_W = p_W - foot.point_W;
        let (near_m, far_m) = self.felt_between();
        let distance_m = off_W.norm();
        // On the track itself any way off it will do.
        let away_W = off_W.try_normalize(0.0).unwrap_or_else(|| {
            let across = by_axes(|axis_W| foot.across(&axis_W, &Vector3::zeros()));
            let column = (0..3).max_by(|a, b| across.column(*a).norm().total_cmp(&across.column(*b).norm()));
            across.column(column.unwrap_or(0)).normalize()
        });
        foot.point_W + away_W * distance_m.clamp(near_m, far_m)
    }
}

impl Entity {
    /// Pull of its magnetism on a finger of this radius at this place, that does not touch it \[N\].
    pub fn magnet_force_at(&self, p_W: &Vector3<f64>, finger_radius_m: f64) -> Vector3<f64> {
        let pulled =
            self.magnetism.and_then(|magnetism| magnetism.pull((0, self), p_W, p_W, finger_radius_m));
        pulled.map_or(Vector3::zeros(), |(pull, _)| pull.force_on_user_W)
    }

    /// Of its magnetism on a finger of this radius at this place, that does not touch it.
    pub fn magnet_gains_at(&self, p_W: &Vector3<f64>, finger_radius_m: f64) -> Gains {
        let pulled =
            self.magnetism.and_then(|magnetism| magnetism.pull((0, self), p_W, p_W, finger_radius_m));
        let Some((pull, reaction)) = pulled else { return Gains::default() };
        let along_W = pull.force_on_user_W.normalize();
        Gains {
            stiffness_n_per_m: along_W * along_W.transpose() * reaction.stiffness_n_per_m,
            ..Gains::default()
        }
    }
}

impl std::ops::AddAssign for Gains {
    fn add_assign(&mut self, other: Self) {
        self.stiffness_n_per_m += other.stiffness_n_per_m;
        self.damping_n_s_per_m += other.damping_n_s_per_m;
        self.mass_kg += other.mass_kg;
    }
}

fn by_axes(of: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_columns(&[of(Vector3::x()), of(Vector3::y()), of(Vector3::z())])
}
