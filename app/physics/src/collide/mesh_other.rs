//! What a mesh asks of a solid that it touches, be that a closed form or another mesh.
//!
//! Frames: everything in the mesh's frame M, in which the other one is placed.

use haptics::mesh::{Linear, Mesh, Sides};
use haptics::{Form, Surface};
use nalgebra::{Isometry3, Point3, Vector3};

use super::Stands;
use super::convex::{Convex, Core};
use super::mesh_corner::Corner;
use super::mesh_cut::Edge;
use super::mesh_own::{Own, Owns, owns_of_form};
use super::mesh_patch::Patch;
use super::mesh_see::{Seen, Side, in_box, in_form, see, see_side};
use super::mesh_span::Standing;

/// The other one, placed in the mesh's frame.
#[derive(Clone, Copy)]
pub(super) struct Other<'s> {
    pub(super) solid: Solidity<'s>,
    pub(super) X_MO: Isometry3<f64>,
}

#[derive(Clone, Copy)]
pub(super) enum Solidity<'s> {
    Form(&'s Form),
    Mesh(&'s Mesh),
}

/// About where the two touch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    /// Unit, from the mesh to the other one.
    pub(super) normal_M: Vector3<f64>,
    /// On the mesh \[m\].
    pub(super) at_M: Vector3<f64>,
    /// How deep they are in each other there \[m\].
    pub(super) depth_m: f64,
    pub(super) reach_m: f64,
    pub(super) travel_m: f64,
}

impl Meeting {
    pub(super) fn of(patch: &Patch, reach_m: f64, travel_m: f64) -> Self {
        Self { normal_M: patch.normal_M, at_M: patch.at_M, depth_m: patch.depth_m, reach_m, travel_m }
    }

    /// What may be this deep was not there a tick ago, unless it was deep then.
    pub(super) fn deep_m(&self) -> f64 {
        if self.depth_m > 0.0 { 1.5 * self.depth_m + 2.0 * self.travel_m } else { 0.0 }
    }

    /// So deep in a sheet may be what has come through it here: all else is on its other side, and was.
    pub(super) fn deep_in_sheet_m(&self) -> f64 {
        1.5 * self.depth_m + 2.0 * self.travel_m + BEGUN_M
    }

    /// Sides of a box that stand about along the normal, so far out: what is outside of them cannot be touched.
    fn shadow(&self, covers: &Extent, beside_m: f64) -> [Linear; 4] {
        let mut sides = [0, 1, 2];
        let stands = |axis: &usize| covers.axes_M[*axis].dot(&self.normal_M).abs();
        sides.sort_unstable_by(|a, b| stands(a).total_cmp(&stands(b)));
        let [u, v] = [sides[0], sides[1]];
        [(u, 0), (u, 1), (v, 0), (v, 1)].map(|(axis, end)| {
            let sign = if end == 0 { -1.0 } else { 1.0 };
            Linear::new(
                covers.axes_M[axis] * -sign,
                sign * covers.ends_m[axis][end] + self.reach_m + beside_m,
            )
        })
    }

    /// With where a height begins that is no deeper than what may be pressed here, and not on another side \[m\].
    pub(super) fn limits(
        &self,
        covers: &Extent,
        beside_m: f64,
        height: &Linear,
        behind_m: f64,
    ) -> [Linear; 5] {
        let [a, b, c, d] = self.shadow(covers, beside_m);
        let deepest_m = self.deep_m() + 2.0 * self.travel_m + behind_m;
        [a, b, c, d, Linear::new(height.along_B, height.base + deepest_m)]
    }
}

/// The box along its own axes that something is in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    axes_M: [Vector3<f64>; 3],
    /// Of each, along it \[m\].
    ends_m: [[f64; 2]; 3],
}

impl Extent {
    /// Of a box in a frame that is placed in M.
    pub(super) fn of([low, high]: [Vector3<f64>; 2], X_MO: &Isometry3<f64>) -> Self {
        let axes_M = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| X_MO.rotation * axis);
        let ends_m = std::array::from_fn(|axis| {
            let at_m = axes_M[axis].dot(&X_MO.translation.vector);
            [low[axis] + at_m, high[axis] + at_m]
        });
        Self { axes_M, ends_m }
    }
}

impl Other<'_> {
    /// A ball around it.
    pub(super) fn ball(&self) -> (Vector3<f64>, f64) {
        let (centre, radius_m) = match self.solid {
            Solidity::Form(form) => super::bounding_ball(&(*form).into()),
            Solidity::Mesh(mesh) => super::mesh::bounding_ball(mesh),
        }
        .unwrap_or((Vector3::zeros(), 0.0));
        ((self.X_MO * Point3::from(centre)).coords, radius_m)
    }

    /// The box that it is in.
    pub(super) fn extent(&self) -> Extent {
        let own = match self.solid {
            Solidity::Mesh(mesh) => mesh.bounds_B(),
            Solidity::Form(form) => match Convex::of(form, &Isometry3::identity()) {
                Some(convex) => [-1.0, 1.0].map(|sign| {
                    let reaches_m = |axis: usize| {
                        let way = Vector3::ith(axis, sign);
                        sign * (way.dot(&convex.support(&way)) + convex.radius_m)
                    };
                    Vector3::new(reaches_m(0), reaches_m(1), reaches_m(2))
                }),
                None => {
                    let radius_m =
                        super::bounding_ball(&(*form).into()).map_or(0.0, |(_, radius_m)| radius_m);
                    [-1.0, 1.0].map(|sign| Vector3::repeat(sign * radius_m))
                }
            },
        };
        Extent::of(own, &self.X_MO)
    }

    /// Where a point is with regard to it; deep inside, `along_M` is the way out that it came in by.
    pub(super) fn see(&self, point_M: &Vector3<f64>, along_M: &Vector3<f64>, deep_m: f64) -> Seen {
        let point = self.X_MO.inverse_transform_point(&Point3::from(*point_M)).coords;
        let along = self.X_MO.inverse_transform_vector(along_M);
        let seen = match self.solid {
            Solidity::Form(Form::Cuboid(cuboid)) => in_box(cuboid, &point, &along, deep_m),
            Solidity::Form(form) => in_form(form, &point, &along, deep_m),
            Solidity::Mesh(mesh) => see(mesh, &point, &along, deep_m),
        };
        Seen { out: self.X_MO * seen.out, gap_m: seen.gap_m }
    }

    /// What [`Self::see`] says of the side that is entered against `along_M` alone, from clear of what presses elsewhere: at
    /// a floor's wall a point that is deeper in the floor. Of a mesh; forms see the side that is asked for.
    pub(super) fn see_side(&self, point_M: &Vector3<f64>, side: &Side) -> Option<Seen> {
        let Solidity::Mesh(mesh) = self.solid else { return None };
        let point = self.X_MO.inverse_transform_point(&Point3::from(*point_M)).coords;
        let turned = |v: &Vector3<f64>| self.X_MO.inverse_transform_vector(v);
        let side = Side { lift: turned(&side.lift), along: turned(&side.along), ..*side };
        see_side(mesh, &point, &side).map(|seen| Seen { out: self.X_MO * seen.out, gap_m: seen.gap_m })
    }

    /// It has no inside.
    pub(super) fn is_sheet(&self) -> bool {
        matches!(self.solid, Solidity::Mesh(mesh) if mesh.sides() == Sides::Sheet)
    }

    pub(super) fn is_convex(&self) -> bool {
        matches!(self.solid, Solidity::Form(form) if !matches!(form, Form::Torus(_)))
    }

    /// Whether its surface may be within a ball; if not, it surely is not.
    pub(super) fn may_be_near(&self, middle_M: &Vector3<f64>, radius_m: f64) -> bool {
        let middle = self.X_MO.inverse_transform_point(&Point3::from(*middle_M)).coords;
        match self.solid {
            Solidity::Form(form) => form.signed_distance(&middle).abs() <= radius_m,
            Solidity::Mesh(mesh) => {
                let [low, high] = mesh.bounds_B();
                let outside = (low - middle).sup(&(middle - high)).sup(&Vector3::zeros());
                outside.norm_squared() <= radius_m * radius_m && mesh.clearance(&middle, radius_m) < radius_m
            }
        }
    }

    /// Whether it ends in this direction at a vertex of its own; forms' points are chosen so.
    pub(super) fn looks(&self, own: &Own, way_M: &Vector3<f64>) -> bool {
        match (self.solid, own.corner) {
            (Solidity::Mesh(mesh), Some(corner)) => {
                corner.looks(mesh, &self.X_MO.inverse_transform_vector(way_M))
            }
            _ => true,
        }
    }

    /// Whether a vertex of its own [sticks out](Corner::sticks_out); forms' points do.
    pub(super) fn sticks_out(&self, own: &Own) -> bool {
        match (self.solid, own.corner) {
            (Solidity::Mesh(mesh), Some(corner)) => corner.sticks_out(mesh),
            _ => true,
        }
    }

    /// Whether a vertex of its own [is round](Corner::is_round) in this direction.
    pub(super) fn is_round(&self, own: &Own, way_M: &Vector3<f64>) -> bool {
        match (self.solid, own.corner) {
            (Solidity::Mesh(mesh), Some(corner)) => {
                corner.is_round(mesh, &self.X_MO.inverse_transform_vector(way_M))
            }
            _ => false,
        }
    }

    /// The point of an ellipsoid that lies farthest against a direction: the only one of its own.
    pub(super) fn lowest(&self, up_M: &Vector3<f64>) -> Option<Vector3<f64>> {
        let Solidity::Form(form) = self.solid else { return None };
        let convex = Convex::of(form, &self.X_MO)?;
        matches!(convex.core, Core::Ellipsoid { .. }).then(|| convex.support(&-up_M))
    }

    /// A point that no other one of it passes in this direction, as far about where they meet as is asked; of a mesh, only there.
    pub(super) fn front(&self, way_M: &Vector3<f64>, meeting: &Meeting, around_m: f64) -> Vector3<f64> {
        match self.solid {
            Solidity::Form(form @ Form::Torus(torus)) => {
                let (centre_M, _) = self.ball();
                let owns = owns_of_form(form, &self.X_MO, way_M);
                let first = owns[0].map_or(centre_M, |own| own.at_M);
                first + way_M * torus.tube_radius_m()
            }
            Solidity::Form(form) => {
                // The way is that of the last tick: a wide face seems to lean by what has turned since, and rises far away.
                let Seen { out, gap_m } = self.see(&meeting.at_M, way_M, meeting.deep_m());
                let near_M = meeting.at_M - out * gap_m;
                let passes_m = Convex::of(form, &self.X_MO)
                    .map_or(0.0, |convex| way_M.dot(&(convex.support(way_M) - near_M)) + convex.radius_m);
                let leans = (way_M - out * out.dot(way_M)).norm();
                near_M + way_M * passes_m.min(around_m * leans)
            }
            Solidity::Mesh(_) => meeting.at_M + way_M * meeting.depth_m,
        }
    }

    /// Points of its own that look towards the mesh.
    pub(super) fn owns(&self, meeting: &Meeting, of_mesh: &[Linear], memory: &mut Stands) -> Owns {
        let way_M = -meeting.normal_M;
        match self.solid {
            Solidity::Form(form) => owns_of_form(form, &self.X_MO, &way_M),
            Solidity::Mesh(mesh) => {
                let mut limits = [Linear::ONE; 5];
                let standing = self.standing(mesh, meeting, of_mesh, &mut limits);
                standing.choose(memory).map(|corner| corner.map(|corner| self.own_vertex(mesh, corner)))
            }
        }
    }

    /// The other mesh over the place, within limits that hold in M.
    pub(super) fn standing<'l>(
        &self,
        second: &'l Mesh,
        meeting: &Meeting,
        of_mesh: &[Linear],
        limits: &'l mut [Linear; 5],
    ) -> Standing<'l> {
        let height = Linear::from(&meeting.at_M, meeting.normal_M);
        for (limit, of_mesh) in limits.iter_mut().zip(of_mesh) {
            *limit = seen_from(of_mesh, &self.X_MO);
        }
        Standing {
            mesh: second,
            height: seen_from(&height, &self.X_MO),
            limits: &limits[..of_mesh.len()],
            reach_m: meeting.reach_m,
            travel_m: meeting.travel_m,
        }
    }

    /// Edges of its own around the face that looks this way, or the line that does; none where it has no straight ones.
    pub(super) fn edges(&self, way_M: &Vector3<f64>) -> [Option<Edge>; 4] {
        let way = self.X_MO.inverse_transform_vector(way_M);
        let placed = |point: Vector3<f64>| (self.X_MO * Point3::from(point)).coords;
        let line = |ends: [Vector3<f64>; 2]| [Some(Edge { ends: ends.map(placed) }), None, None, None];
        let Solidity::Form(form) = self.solid else { return [None; 4] };
        let across = Vector3::new(way.x, 0.0, way.z).try_normalize(UPRIGHT).unwrap_or_default();
        match form {
            Form::Cuboid(cuboid) => around_face(&(Vector3::from(cuboid.size_m()) * 0.5), &way)
                .map(|ends| Some(Edge { ends: ends.map(placed) })),
            _ if across == Vector3::zeros() => [None; 4],
            Form::Cylinder(c) => {
                line([0.5, -0.5].map(|end| across * c.radius_m() + Vector3::y() * (end * c.length_m())))
            }
            Form::Capsule(c) if c.length_m() > 0.0 => {
                line([0.5, -0.5].map(|end| across * c.radius_m() + Vector3::y() * (end * c.length_m())))
            }
            Form::Cone(c) => {
                let up = Vector3::y() * (0.5 * c.length_m());
                line([across * c.radius_top_m() + up, across * c.radius_bottom_m() - up])
            }
            _ => [None; 4],
        }
    }

    pub(super) fn own_vertex(&self, mesh: &Mesh, corner: Corner) -> Own {
        let at_M = (self.X_MO * Point3::from(*corner.point_M(mesh))).coords;
        Own { number: corner.vertex(mesh), at_M, radius_m: 0.0, corner: Some(corner) }
    }
}

/// Edges of the face of a box that looks this way.
fn around_face(half: &Vector3<f64>, way: &Vector3<f64>) -> [[Vector3<f64>; 2]; 4] {
    let axis = way.iamax();
    let corner = |(s, t): (f64, f64)| {
        let mut corner = *half;
        corner[axis] = half[axis].copysign(way[axis]);
        corner[(axis + 1) % 3] *= s;
        corner[(axis + 2) % 3] *= t;
        corner
    };
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner);
    [0, 1, 2, 3].map(|i| [corners[i], corners[(i + 1) % 4]])
}

/// A linear function of points of M, of points of O.
fn seen_from(of_M: &Linear, X_MO: &Isometry3<f64>) -> Linear {
    let along = X_MO.inverse_transform_vector(&of_M.along_B);
    Linear { along_B: along, base: of_M.base + of_M.along_B.dot(&X_MO.translation.vector), ..*of_M }
}

/// So deep in a sheet may lie what lies there from the beginning \[m\].
const BEGUN_M: f64 = 2e-3;
/// Sine of a way to the axis from which on it is the side that looks there.
const UPRIGHT: f64 = 0.7;
