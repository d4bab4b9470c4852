//! The faces around a vertex as a cone without end, and its point nearest to the HIP.

use nalgebra::Vector3;

use super::Mesh;
use super::fan::{Sector, for_each_around};
use super::place::{Side, next, previous};

/// What the HIP sees of a cone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    pub(crate) nearest: Nearest,
    /// From the tip to the HIP.
    to_hip_B: Vector3<f64>,
    /// Square of the distance from the tip to the nearest point: the larger, the nearer that point is to the HIP.
    reach_m2: f64,
    /// Depths of the HIP behind the faces' planes.
    least_depth_m: f64,
    most_depth_m: f64,
    is_closed: bool,
}

/// Where on a cone the point nearest to the HIP lies.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Nearest {
    /// Inside this face, behind which the HIP lies by so much \[m\].
    Face(Side, f64),
    /// On the edge of this number of a face.
    Edge(Side, usize),
    /// At the vertex itself.
    Tip,
}

impl Cone {
    /// The cone of all faces around a corner; `to_hip_B` leads from there to the HIP.
    pub(crate) fn around(mesh: &Mesh, side: Side, corner: usize, to_hip_B: &Vector3<f64>) -> Self {
        let mut cone = Self {
            nearest: Nearest::Tip,
            to_hip_B: *to_hip_B,
            reach_m2: 0.0,
            least_depth_m: f64::INFINITY,
            most_depth_m: f64::NEG_INFINITY,
            is_closed: false,
        };
        cone.is_closed = for_each_around(mesh, side, corner, |sector| cone.look_at(mesh, &sector));
        cone
    }

    /// Whether the HIP, nearest to the tip, is behind the surface: by the mean of the normals around, each weighted with
    /// its face's angle, which is what decides where no face or edge is nearer (Baerentzen and Aanaes 2005). A fan
    /// that is not closed has no behind.
    pub(crate) fn is_behind(&self, mesh: &Mesh, side: Side, corner: usize) -> bool {
        if !self.is_closed || self.most_depth_m < 0.0 {
            return false;
        }
        self.least_depth_m >= 0.0 || {
            let mut normal_B = Vector3::zeros();
            for_each_around(mesh, side, corner, |sector| {
                let [one_B, other_B] = sector.edges_B(mesh);
                normal_B += sector.facet.normal_B * one_B.angle(&other_B);
            });
            normal_B.dot(&self.to_hip_B) <= 0.0
        }
    }

    fn look_at(&mut self, mesh: &Mesh, sector: &Sector<'_>) {
        let Sector { facet, corner } = *sector;
        let depth_m = -facet.normal_B.dot(&self.to_hip_B);
        self.least_depth_m = self.least_depth_m.min(depth_m);
        self.most_depth_m = self.most_depth_m.max(depth_m);
        let [one_B, other_B] = sector.edges_B(mesh);
        for (edge, edge_B) in [(corner, one_B), (previous(corner), other_B)] {
            let along = edge_B.dot(&self.to_hip_B);
            if along > 0.0 {
                self.offer(
                    along * along / edge_B.norm_squared(),
                    facet.side,
                    Nearest::Edge(facet.side, edge),
                );
            }
        }
        let is_within = facet.inward_B(&one_B).dot(&self.to_hip_B) >= 0.0
            && facet.inward_B(&other_B).dot(&self.to_hip_B) <= 0.0;
        if is_within {
            let reach_m2 = self.to_hip_B.norm_squared() - depth_m * depth_m;
            self.offer(reach_m2, facet.side, Nearest::Face(facet.side, depth_m));
        }
    }

    /// The farther reach wins, the lower face among equals: where one started around the vertex must not matter.
    fn offer(&mut self, reach_m2: f64, side: Side, nearest: Nearest) {
        let best_face = match self.nearest {
            Nearest::Face(side, _) | Nearest::Edge(side, _) => side.face,
            Nearest::Tip => u32::MAX,
        };
        if reach_m2 > self.reach_m2 || (reach_m2 == self.reach_m2 && reach_m2 > 0.0 && side.face <= best_face)
        {
            (self.reach_m2, self.nearest) = (reach_m2, nearest);
        }
    }
}

impl Sector<'_> {
    /// From the corner along its two edges, in the face's winding.
    fn edges_B(&self, mesh: &Mesh) -> [Vector3<f64>; 2] {
        let at_B = self.facet.corner_B(mesh, self.corner);
        [next(self.corner), previous(self.corner)].map(|corner| self.facet.corner_B(mesh, corner) - at_B)
    }
}
