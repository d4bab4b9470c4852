//! What a mesh asks of a solid that it touches, be that a closed form or another mesh.
//!
//! Frames: everything in the mesh's frame M, in which the other one is placed. Numbers of a form's own points: corners of a
//! box 0 to 7; four of each rim; ends of an axis; else 0. Those of a mesh are its vertices.

use haptics::mesh::{Linear, Mesh, Sides};
use haptics::{Cuboid, Feature, Form, Surface};
use nalgebra::{Isometry3, Point3, Vector3};

use super::convex::{Convex, Core};
use super::mesh_corner::Corner;
use super::mesh_cut::Edge;
use super::mesh_span::Standing;
use super::{MAX_POINTS, Stands};

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

/// Where a point is with regard to a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Unit, out of the surface.
    pub(super) out: Vector3<f64>,
    /// Negative inside \[m\].
    pub(super) gap_m: f64,
}

/// A point of the other one that may touch the mesh: the middle of a ball.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Own {
    pub(super) number: u32,
    pub(super) at_M: Vector3<f64>,
    pub(super) radius_m: f64,
    /// Of a mesh, which one.
    pub(super) corner: Option<Corner>,
}

/// Points of its own that look at the mesh.
pub(super) type Owns = [Option<Own>; MAX_POINTS];

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
    /// What may be this deep was not there a tick ago, unless it was deep then.
    pub(super) fn deep_m(&self) -> f64 {
        if self.depth_m > 0.0 { 1.5 * self.depth_m + 2.0 * self.travel_m } else { 0.0 }
    }

    /// The square across the normal that a ball covers: what is outside of it cannot be touched.
    pub(super) fn shadow(&self, (centre_M, radius_m): (Vector3<f64>, f64)) -> [Linear; 4] {
        let u = super::mesh_span::across(&self.normal_M);
        let v = self.normal_M.cross(&u);
        let room_m = radius_m + self.reach_m;
        [u, -u, v, -v].map(|way| Linear::new(-way, way.dot(&centre_M) + room_m))
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

    /// Where a point is with regard to it; deep inside, `along_M` is the way out that it came in by.
    pub(super) fn see(&self, point_M: &Vector3<f64>, along_M: &Vector3<f64>, deep_m: f64) -> Seen {
        let point = self.X_MO.inverse_transform_point(&Point3::from(*point_M)).coords;
        let along = self.X_MO.inverse_transform_vector(along_M);
        let seen = match self.solid {
            Solidity::Form(Form::Cuboid(cuboid)) => in_box(cuboid, &point, &along),
            Solidity::Form(form) => at_form(*form, &point),
            Solidity::Mesh(mesh) => see(mesh, &point, &along, deep_m),
        };
        Seen { out: self.X_MO * seen.out, gap_m: seen.gap_m }
    }

    /// A point that no other one of it passes in this direction; of a mesh, about where they meet.
    pub(super) fn front(&self, way_M: &Vector3<f64>, meeting: &Meeting) -> Vector3<f64> {
        match self.solid {
            Solidity::Form(form @ Form::Torus(torus)) => {
                let (centre_M, _) = self.ball();
                let owns = self.owns_of_form(form, way_M);
                let first = owns[0].map_or(centre_M, |own| own.at_M);
                first + way_M * torus.tube_radius_m()
            }
            Solidity::Form(form) => Convex::of(form, &self.X_MO)
                .map_or(meeting.at_M, |convex| convex.support(way_M) + way_M * convex.radius_m),
            Solidity::Mesh(_) => meeting.at_M + way_M * meeting.depth_m,
        }
    }

    /// Points of its own that look towards the mesh.
    pub(super) fn owns(&self, meeting: &Meeting, of_mesh: &[Linear; 4], memory: &mut Stands) -> Owns {
        let way_M = -meeting.normal_M;
        match self.solid {
            Solidity::Form(form) => self.owns_of_form(form, &way_M),
            Solidity::Mesh(mesh) => {
                let height = Linear::from(&meeting.at_M, meeting.normal_M);
                let limits = of_mesh.map(|limit| seen_from(&limit, &self.X_MO));
                let standing = Standing {
                    mesh,
                    height: seen_from(&height, &self.X_MO),
                    limits: &limits,
                    reach_m: meeting.reach_m,
                    travel_m: meeting.travel_m,
                };
                standing.choose(memory).map(|corner| corner.map(|corner| self.own_vertex(mesh, corner)))
            }
        }
    }

    /// Edges of its own around the face that looks this way; none where it has no straight ones.
    pub(super) fn edges(&self, way_M: &Vector3<f64>) -> [Option<Edge>; 4] {
        let Solidity::Form(Form::Cuboid(cuboid)) = self.solid else { return [None; 4] };
        let half = Vector3::from(cuboid.size_m()) * 0.5;
        let way = self.X_MO.inverse_transform_vector(way_M);
        let axis = way.iamax();
        let corner = |(s, t): (f64, f64)| {
            let mut corner = half;
            corner[axis] = half[axis].copysign(way[axis]);
            corner[(axis + 1) % 3] *= s;
            corner[(axis + 2) % 3] *= t;
            (self.X_MO * Point3::from(corner)).coords
        };
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(corner);
        [0, 1, 2, 3].map(|i| Some(Edge { ends: [corners[i], corners[(i + 1) % 4]] }))
    }

    fn own_vertex(&self, mesh: &Mesh, corner: Corner) -> Own {
        let at_M = (self.X_MO * Point3::from(*corner.point_M(mesh))).coords;
        Own { number: corner.vertex(mesh), at_M, radius_m: 0.0, corner: Some(corner) }
    }

    fn owns_of_form(&self, form: &Form, way_M: &Vector3<f64>) -> Owns {
        let way = self.X_MO.inverse_transform_vector(way_M);
        let mut owns = Points { owns: [None; MAX_POINTS], count: 0, X_MO: &self.X_MO };
        match form {
            Form::Sphere(sphere) => owns.push(0, Vector3::zeros(), sphere.radius_m()),
            Form::Cuboid(cuboid) => {
                let half = Vector3::from(cuboid.size_m()) * 0.5;
                for corner in 0..8_u32 {
                    let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    owns.push(corner, half.component_mul(&Vector3::new(sign(0), sign(1), sign(2))), 0.0);
                }
            }
            Form::Capsule(capsule) => {
                for (end, sign) in [(0, 0.5), (1, -0.5)] {
                    owns.push(end, Vector3::y() * (sign * capsule.length_m()), capsule.radius_m());
                }
            }
            Form::Cylinder(c) => {
                owns.rim(0, 0.5 * c.length_m(), c.radius_m(), 0.0, &way);
                owns.rim(4, -0.5 * c.length_m(), c.radius_m(), 0.0, &way);
            }
            Form::Cone(c) => {
                owns.rim(0, 0.5 * c.length_m(), c.radius_top_m(), 0.0, &way);
                owns.rim(4, -0.5 * c.length_m(), c.radius_bottom_m(), 0.0, &way);
            }
            Form::Torus(t) => owns.rim(0, 0.0, t.ring_radius_m(), t.tube_radius_m(), &way),
            _ => {
                if let Some(convex) = Convex::of(form, &Isometry3::identity()) {
                    match convex.core {
                        Core::Segment { .. } | Core::Ellipsoid { .. } => {
                            owns.push(0, convex.support(&way), 0.0);
                        }
                        _ => (0..8_u32).for_each(|number| {
                            let part = |bit: u32| if number >> bit & 1 == 1 { 0.3 } else { -0.3 };
                            let aside = Vector3::new(part(0), part(1), part(2));
                            owns.push(number, convex.support(&(way + aside)), 0.0);
                        }),
                    }
                }
            }
        }
        owns.owns
    }
}

struct Points<'p> {
    owns: Owns,
    count: usize,
    X_MO: &'p Isometry3<f64>,
}

impl Points<'_> {
    fn push(&mut self, number: u32, at: Vector3<f64>, radius_m: f64) {
        if let Some(place) = self.owns.get_mut(self.count) {
            *place =
                Some(Own { number, at_M: (self.X_MO * Point3::from(at)).coords, radius_m, corner: None });
            self.count += 1;
        }
    }

    /// Four of a rim around the y axis, of which one looks there most.
    fn rim(&mut self, first: u32, y: f64, ring_m: f64, tube_m: f64, way: &Vector3<f64>) {
        if ring_m == 0.0 {
            self.push(first, Vector3::y() * y, tube_m);
            return;
        }
        let across = Vector3::new(way.x, 0.0, way.z);
        // Lying flat, none does: then the same as ever.
        let toward = if across.norm() > FLAT { across.normalize() } else { Vector3::x() };
        let beside = Vector3::y().cross(&toward);
        for (quarter, out) in [toward, beside, -toward, -beside].into_iter().enumerate() {
            self.push(first + quarter as u32, Vector3::y() * y + out * ring_m, tube_m);
        }
    }
}

/// Tilted by less, a rim lies flat \[rad\].
const FLAT: f64 = 1e-4;

/// Of a box: inside, the way out is through the face that was come in by, unless another one is very much nearer.
fn in_box(cuboid: &Cuboid, point: &Vector3<f64>, along: &Vector3<f64>) -> Seen {
    let gap_m = cuboid.signed_distance(point);
    let axis = along.iamax();
    let depth_m = 0.5 * cuboid.size_m()[axis] - point[axis] * along[axis].signum();
    if gap_m <= 0.0 && depth_m < MUCH * -gap_m + LITTLE_M {
        let mut out = Vector3::zeros();
        out[axis] = 1.0_f64.copysign(along[axis]);
        return Seen { out, gap_m: -depth_m };
    }
    at_form((*cuboid).into(), point)
}

fn at_form(form: Form, point: &Vector3<f64>) -> Seen {
    let (nearest, gap_m) = (form.nearest(point), form.signed_distance(point));
    let away = point - nearest.point_B;
    // At an edge the way from the nearest point is none of the faces' normals.
    match away.try_normalize(NOTHING_M).filter(|_| gap_m > 0.0) {
        Some(out) => Seen { out, gap_m: away.norm() },
        None => Seen { out: nearest.normal_B, gap_m },
    }
}

/// Nearer to a surface, the way from there is rounding \[m\].
const NOTHING_M: f64 = 1e-9;

/// Where a point is with regard to a mesh; inside, `along` is the way out that it came in by. A sheet is seen from there, and
/// so is a wall that it cannot have come through otherwise than by going so deep (m).
pub(super) fn see(mesh: &Mesh, point: &Vector3<f64>, along: &Vector3<f64>, deep_m: f64) -> Seen {
    let (nearest, is_inside) = mesh.nearest_and_side(point);
    let face = &mesh.faces()[nearest.face as usize];
    if mesh.sides() == Sides::Sheet {
        let side = if face.normal_B.dot(along) < 0.0 { -1.0 } else { 1.0 };
        let height_m = (face.normal_B.dot(point) - face.offset_m) * side;
        let is_beside = nearest.feature != Feature::Face && nearest.distance_m > height_m.abs() * 1.01;
        if is_beside {
            let out = (point - nearest.point_B) / nearest.distance_m;
            return Seen { out, gap_m: nearest.distance_m };
        }
        return Seen { out: face.normal_B * side, gap_m: height_m };
    }
    if !is_inside {
        let through = if deep_m > 0.0 { mesh.first_hit(&(point + along * deep_m), point) } else { None };
        let through = through.map(|hit| &mesh.faces()[hit.face as usize]);
        if let Some(face) = through.filter(|face| face.normal_B.dot(along) > AGREES) {
            return Seen { out: face.normal_B, gap_m: face.normal_B.dot(point) - face.offset_m };
        }
        let away = point - nearest.point_B;
        let is_flat = nearest.feature == Feature::Face || nearest.distance_m < 1e-9 * mesh.extent_m();
        let out = if is_flat { face.normal_B } else { away / nearest.distance_m };
        return Seen { out, gap_m: nearest.distance_m };
    }
    if face.normal_B.dot(along) < AGREES {
        // From far enough outside back to the point.
        let most_m = MUCH * nearest.distance_m + LITTLE_M;
        if let Some(hit) = mesh.first_hit(&(point + along * most_m), point) {
            let through = &mesh.faces()[hit.face as usize];
            if through.normal_B.dot(along) > AGREES {
                return Seen { out: through.normal_B, gap_m: through.normal_B.dot(point) - through.offset_m };
            }
        }
    }
    Seen { out: face.normal_B, gap_m: -nearest.distance_m }
}

/// Another way out must be so many times as short, and a little more \[m\].
const MUCH: f64 = 5.0;
const LITTLE_M: f64 = 2e-3;
/// Cosine between directions that are about the same.
const AGREES: f64 = 0.7;

/// A linear function of points of M, of points of O.
fn seen_from(of_M: &Linear, X_MO: &Isometry3<f64>) -> Linear {
    let along = X_MO.inverse_transform_vector(&of_M.along_B);
    Linear { along_B: along, base: of_M.base + of_M.along_B.dot(&X_MO.translation.vector), ..*of_M }
}
