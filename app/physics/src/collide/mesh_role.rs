//! Which vertex of a mesh takes which role in what it stands on: see [`mesh_span`](super::mesh_span).

use haptics::mesh::Linear;
use nalgebra::Vector3;

use super::mesh_corner::Corner;
use super::mesh_span::{Chosen, Standing};

/// The choice of all roles.
pub(super) struct Seek<'s> {
    pub(super) standing: &'s Standing<'s>,
    /// Below the level, as far as it counts \[m\].
    pub(super) depth: Linear,
    /// D.
    pub(super) deepest: Corner,
    pub(super) kept: &'s Chosen,
    pub(super) how: &'s How,
    /// The role for which much is looked at; `None`: each.
    pub(super) searched: Option<usize>,
}

/// What makes one chosen that was not.
pub(super) struct How {
    /// So many times as good as all that were chosen.
    pub(super) better: f64,
    /// It sticks out of a side by this share of it.
    bulge: f64,
    /// Deeper than this share of D's depth is no better: what comes in loaded brakes what rolls, or drives it.
    pub(super) full: f64,
}

/// Where nothing was chosen yet.
pub(super) const FIRST: How = How { better: 1.001, bulge: 0.02, full: 1.0 };
/// From then on.
pub(super) const LATER: How = How { better: BETTER, bulge: BULGE, full: 0.25 };
pub(super) const CROWDED: How = How { better: 3.0, bulge: 0.5, full: 0.25 };

impl Seek<'_> {
    pub(super) fn choose(&self, chosen: &mut Chosen) {
        let up_B = self.standing.height.along_B;
        chosen[0] = Some(self.deepest);
        let d_B = self.deepest.point_M(self.standing.mesh);
        let Some(far) = self.far_from(d_B) else { return };
        chosen[1] = Some(far);
        let along_B = flat(&(far.point_M(self.standing.mesh) - d_B), &up_B);
        let length_m = along_B.norm();
        let beside_B = up_B.cross(&along_B) / length_m;
        for (role, side_B) in [(2, beside_B), (3, -beside_B)] {
            let found = self.best(role, &Linear::from(d_B, side_B), self.how.bulge * length_m);
            chosen[role] = found.filter(|found| self.is_new(found, chosen));
        }
        self.sides(chosen);
    }

    /// One far away in any direction: at first along the line to that of the last tick.
    fn far_from(&self, d_B: &Vector3<f64>) -> Option<Corner> {
        let up_B = self.standing.height.along_B;
        let mesh = self.standing.mesh;
        let was_B = self.kept[1].map(|corner| flat(&(corner.point_M(mesh) - d_B), &up_B));
        let least_m = FAR * mesh.extent_m();
        let along_B = match was_B.and_then(|was_B| was_B.try_normalize(least_m)) {
            Some(along_B) => along_B,
            None => across(&up_B),
        };
        let beside_B = up_B.cross(&along_B);
        [along_B, -along_B, beside_B, -beside_B]
            .iter()
            .find_map(|way_B| self.best(1, &Linear::from(d_B, *way_B), least_m))
    }

    /// What sticks out of the sides of the quadrilateral.
    fn sides(&self, chosen: &mut Chosen) {
        let (up_B, mesh) = (self.standing.height.along_B, self.standing.mesh);
        let corners = [chosen[0], chosen[2], chosen[1], chosen[3]];
        for (role, (from, to)) in [(0, 1), (1, 2), (2, 3), (3, 0)].into_iter().enumerate() {
            let (Some(from), Some(to)) = (corners[from], corners[to]) else { continue };
            let from_B = from.point_M(mesh);
            let along_B = flat(&(to.point_M(mesh) - from_B), &up_B);
            let length_m = along_B.norm();
            if length_m > 0.0 {
                // F is to the left of D E seen from above, so the outside is to the left of D F.
                let outward_B = up_B.cross(&along_B) / length_m;
                let found = self.best(4 + role, &Linear::from(from_B, outward_B), self.how.bulge * length_m);
                chosen[4 + role] = found.filter(|found| self.is_new(found, chosen));
            }
        }
    }

    fn is_new(&self, found: &Corner, chosen: &Chosen) -> bool {
        let mesh = self.standing.mesh;
        !chosen.iter().flatten().any(|one| one.vertex(mesh) == found.vertex(mesh))
    }

    /// The best by distance and depth; if it was not chosen before, it is at least this far away (m).
    fn best(&self, role: usize, distance: &Linear, at_least_m: f64) -> Option<Corner> {
        let mesh = self.standing.mesh;
        let score = |point_B: &Vector3<f64>| {
            let (far, deep) = (distance.at(point_B), self.depth.at(point_B));
            if far > 0.0 && deep > 0.0 { far * deep } else { 0.0 }
        };
        let of = |corner: Corner| {
            if self.standing.is_over(corner) { score(corner.point_M(mesh)) } else { 0.0 }
        };
        let least = at_least_m * self.depth.at_most;
        let kept = self
            .kept
            .iter()
            .flatten()
            .fold((self.deepest, 0.0), |best, &one| if of(one) > best.1 { (one, of(one)) } else { best });
        let (mut best, mut most) = (kept.0, kept.1);
        let (near, near_score) = kept.0.climb(mesh, of);
        if near_score > least.max(self.how.better * kept.1) {
            (best, most) = (near, near_score);
        }
        let needed = least.max(self.how.better * most);
        let visits =
            if self.searched.is_none_or(|searched| searched == role) { MANY_VISITS } else { FEW_VISITS };
        if let Some((corner, score)) =
            mesh.outlying([distance, &self.depth], self.standing.limits, needed, visits)
        {
            (best, most) = (Corner::new(corner), score);
        }
        (most > 0.0).then_some(best)
    }
}

/// The part of a vector along the face.
fn flat(v_B: &Vector3<f64>, up_B: &Vector3<f64>) -> Vector3<f64> {
    v_B - up_B * up_B.dot(v_B)
}

/// Any direction along the face.
pub(super) fn across(up_B: &Vector3<f64>) -> Vector3<f64> {
    let axis_B = match up_B.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    up_B.cross(&axis_B).try_normalize(0.0).unwrap_or_else(Vector3::x)
}

/// So many times as good as all that were chosen must be what takes a role.
const BETTER: f64 = 1.5;
/// What sticks out of a side by less than this share of it is left out.
const BULGE: f64 = 0.05;
/// E is at least this share of the mesh's extent away from D.
const FAR: f64 = 1e-5;
/// Nodes of the hierarchy that are looked at for a role: in each tick many for one of them.
pub(super) const MANY_VISITS: usize = 256;
const FEW_VISITS: usize = 32;
