//! A row as the bodies that are solved for see it.

use nalgebra::{Matrix3, Vector3};

use super::Motion;
use super::blocks::Blocks;
use super::six::add;
use crate::row::Row;

/// The sign with which a row's force acts on either side.
pub(super) const SIGNS: [f64; 2] = [1.0, -1.0];

/// Which row joins which of the bodies that are solved for together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    /// Number of the row.
    pub(super) row: usize,
    /// Of the body that is pressed and of that which presses, the place among those that are solved for.
    pub(super) sides: [Option<usize>; 2],
    /// How the sides that are not move: the body's less the other's, at the contact point (m/s).
    given_W: Vector3<f64>,
    /// The like of how they turn (rad/s).
    given_spin_W: Vector3<f64>,
    /// The most velocity that an impulse gives to the point, in whatever direction (1/kg).
    pub(super) most_give: f64,
    /// The most spin that an angular impulse gives, in whatever direction (1/(kg m^2)).
    pub(super) most_turn: f64,
    /// Lengths of the arms (m).
    arms_m: [f64; 2],
}

impl Link {
    /// Between one body and what stands still.
    pub(super) fn alone(at: usize, row: &Row, motion: &Motion) -> Self {
        let mut link = Self::between(at, row, [None; 2], &[]);
        link.sides[0] = Some(0);
        link.add(0, row, motion);
        link
    }

    /// Between bodies whose places these are; the others go on as they do.
    pub(super) fn between(at: usize, row: &Row, sides: [Option<usize>; 2], motions: &[Motion]) -> Self {
        let still = Vector3::zeros();
        let (most_give, most_turn, arms_m) = (0.0, 0.0, [0.0; 2]);
        let mut link =
            Self { row: at, sides, given_W: still, given_spin_W: still, most_give, most_turn, arms_m };
        for (side, body) in [Some(row.body), row.other].into_iter().enumerate() {
            match (sides[side], body.and_then(|body| motions.get(body))) {
                (Some(_), Some(motion)) => link.add(side, row, motion),
                (None, Some(motion)) => {
                    link.given_W += motion.at(&row.arms_W[side]) * SIGNS[side];
                    link.given_spin_W += motion.angular_velocity_W * SIGNS[side];
                }
                _ => {}
            }
        }
        link
    }

    fn add(&mut self, side: usize, row: &Row, motion: &Motion) {
        let arm_m2 = row.arms_W[side].norm_squared();
        let turns = motion.inverse_inertia_W.trace();
        self.arms_m[side] = arm_m2.sqrt();
        self.most_give += motion.inverse_mass + arm_m2 * turns;
        self.most_turn += turns;
    }

    /// The places of the sides that are solved for, with which side each is.
    #[inline]
    pub(super) fn inside(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        self.sides.into_iter().enumerate().filter_map(|(side, place)| Some((side, place?)))
    }

    /// Velocity of the body's point relative to the other's (m/s).
    #[inline]
    pub(super) fn velocity_W(&self, row: &Row, moving: &[Motion]) -> Vector3<f64> {
        self.inside()
            .fold(self.given_W, |v, (side, place)| v + moving[place].at(&row.arms_W[side]) * SIGNS[side])
    }

    /// Angular velocity of the body relative to the other (rad/s).
    #[inline]
    pub(super) fn spin_W(&self, moving: &[Motion]) -> Vector3<f64> {
        self.inside().fold(self.given_spin_W, |spin_W, (side, place)| {
            spin_W + moving[place].angular_velocity_W * SIGNS[side]
        })
    }

    /// The most speed of the point, all sides' roundings counted (m/s); `speeds` are those of bodies (m/s) and their spins
    /// (rad/s).
    #[inline]
    pub(super) fn speed_m_s(&self, speeds: &[[f64; 2]]) -> f64 {
        let of_side = |(side, place): (usize, usize)| speeds[place][0] + speeds[place][1] * self.arms_m[side];
        self.inside().map(of_side).sum()
    }

    /// Gives an angular impulse to both sides (N m s).
    #[inline]
    pub(super) fn turn(&self, impulse_W: &Vector3<f64>, moving: &mut [Motion]) {
        for (side, place) in self.inside() {
            moving[place].turn(&(impulse_W * SIGNS[side]));
        }
    }

    /// Sum of the sides' spins, which bounds their roundings (rad/s).
    #[inline]
    pub(super) fn most_spin_rad_s(&self, speeds: &[[f64; 2]]) -> f64 {
        self.inside().map(|(_, place)| speeds[place][1]).sum()
    }

    /// What spin about the normal an angular impulse about it gives (1/(kg m^2)).
    #[inline]
    pub(super) fn turn_about(&self, row: &Row, moving: &[Motion]) -> f64 {
        let n = &row.normal_W;
        self.inside().map(|(_, place)| n.dot(&(moving[place].inverse_inertia_W * n))).sum()
    }

    /// Gives an impulse at the contact point to both sides (N s).
    #[inline]
    pub(super) fn push(&self, row: &Row, impulse_W: &Vector3<f64>, moving: &mut [Motion]) {
        for (side, place) in self.inside() {
            moving[place].push(&(impulse_W * SIGNS[side]), &row.arms_W[side]);
        }
    }

    /// Adds, for each two sides, by how much the first one's force and torque fall with the second one's velocity and spin:
    /// the point's force by `falls` (N s/m), its torque by `turns`, if there is any: by the first with
    /// the point's velocity (N s), by the second with the spin (N m s).
    #[inline]
    pub(super) fn add_falls(
        &self,
        row: &Row,
        falls: &Matrix3<f64>,
        turns: Option<&[Matrix3<f64>; 2]>,
        blocks: &mut Blocks,
    ) {
        for (by_side, by_place) in self.inside() {
            // Of the force, by velocity and spin: `D` and `-D [s]`.
            let s = &row.arms_W[by_side];
            let by_both = |falls: &Matrix3<f64>, at: usize| {
                let d = Vector3::new(falls[(at, 0)], falls[(at, 1)], falls[(at, 2)]);
                let turned = s.cross(&d);
                [d.x, d.y, d.z, turned.x, turned.y, turned.z]
            };
            let of_force = [0, 1, 2].map(|at| by_both(falls, at));
            for (side, place) in self.inside() {
                let r = &row.arms_W[side];
                let sign = SIGNS[side] * SIGNS[by_side];
                let block = blocks.at(place, by_place);
                for at in 0..3 {
                    add(&mut block[at], &of_force[at], sign);
                    // Of the torque: `[r]` times that of the force.
                    let (next, last) = ((at + 1) % 3, (at + 2) % 3);
                    add(&mut block[3 + at], &of_force[last], sign * r[next]);
                    add(&mut block[3 + at], &of_force[next], -sign * r[last]);
                }
                if let Some([by_velocity, by_spin]) = turns {
                    for at in 0..3 {
                        add(&mut block[3 + at], &by_both(by_velocity, at), sign);
                        (0..3).for_each(|by| block[3 + at][3 + by] += sign * by_spin[(at, by)]);
                    }
                }
            }
        }
    }
}
