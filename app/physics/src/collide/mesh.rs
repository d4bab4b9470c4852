//! Where a mesh touches something else.
//!
//! Model: against a plane, the vertices that it stands on ([`mesh_plane`](super::mesh_plane)); against a ball, the locally
//! nearest features ([`mesh_ball`](super::mesh_ball)); against all else, points of either in the other and edges that cross
//! ([`mesh_solid`](super::mesh_solid)). What is found is told in the mesh's frame, with normals that leave
//! the mesh or point to it as is handy; [`Told`] turns it into contact points of A and B.
//!
//! Identity: what a contact point is about is told by a number below 2^27, a kind of two bits and three of the place among several: a face, an edge (three
//! times its face plus its number there; where edges cross, eight times that, whose it is and which of its places), a vertex, or a
//! point of the other one. No two of a pair clash as long as a mesh has less than 5,500,000 faces.

use haptics::mesh::{Mesh, Sides};
use haptics::{Form, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

use super::mesh_ball::{self, Ball};
use super::mesh_other::{Other, Solidity};
use super::{ContactPoint, ContactPoints, PairMemory, Solid};
use super::{mesh_plane, mesh_ring, mesh_solid};

/// Where A and B touch, at least one of them being a mesh.
pub(super) fn contact_points(
    a: Solid<'_>,
    b: Solid<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    found: &mut ContactPoints,
) {
    match (a.shape, b.shape) {
        (Shape::Mesh(_), Shape::Mesh(mesh)) if is_coarse_sheet(mesh, a.shape) => {
            let told = Told { X_WM: b.X_W, mesh_is_a: false, part: 1.0, found };
            against(mesh, a.shape, a.X_W, reach_m, memory, told);
        }
        (Shape::Mesh(mesh), other) => {
            let told = Told { X_WM: a.X_W, mesh_is_a: true, part: 1.0, found };
            against(mesh, other, b.X_W, reach_m, memory, told);
        }
        (other, Shape::Mesh(mesh)) => {
            let told = Told { X_WM: b.X_W, mesh_is_a: false, part: 1.0, found };
            against(mesh, other, a.X_W, reach_m, memory, told);
        }
        _ => {}
    }
}

/// True for a sheet of fewer faces than another mesh: places are sought on the faces of the first one, and those of a room are
/// looked at in time where those of a thing within it are not.
fn is_coarse_sheet(mesh: &Mesh, other: &Shape) -> bool {
    let Shape::Mesh(other) = other else { return false };
    mesh.sides() == Sides::Sheet && mesh.faces().len() < other.faces().len()
}

/// Whether contact points of such a mesh as A can be found.
pub(super) fn can_move(_mesh: &Mesh) -> bool {
    true
}

/// Whether those of these two can, of which one is a mesh.
pub(super) fn is_collidable(a: &Shape, b: &Shape) -> bool {
    let other = if matches!(a, Shape::Mesh(_)) { b } else { a };
    matches!(other, Shape::Form(_) | Shape::Mesh(_))
}

/// A ball around a mesh: that around its box.
pub(super) fn bounding_ball(mesh: &Mesh) -> Option<(Vector3<f64>, f64)> {
    let [low_B, high_B] = mesh.bounds_B();
    // The mesh is in the box to rounding.
    Some(((low_B + high_B) * 0.5, 0.5 * (high_B - low_B).norm() * (1.0 + 1e-12)))
}

fn against(
    mesh: &Mesh,
    other: &Shape,
    X_WO: &Isometry3<f64>,
    reach_m: f64,
    memory: &mut PairMemory,
    mut told: Told<'_>,
) {
    let X_MO = told.X_WM.inv_mul(X_WO);
    if let Some((normal_O, offset_m)) = mesh_plane::plane_below(mesh, other, &X_MO, memory.is_soft) {
        let normal_M = X_MO * normal_O;
        let offset_m = offset_m + normal_M.dot(&X_MO.translation.vector);
        mesh_plane::contact_points(mesh, &normal_M, offset_m, reach_m, memory, &mut told);
        return;
    }
    match other {
        Shape::Form(Form::Sphere(sphere)) => {
            let ball = Ball { centre_M: X_MO.translation.vector, radius_m: sphere.radius_m() };
            mesh_ball::contact_points(mesh, &ball, reach_m, memory, &mut told);
        }
        Shape::Form(form @ Form::Torus(torus)) => {
            let other = Other { solid: Solidity::Form(form), X_MO };
            mesh_ring::contact_points(mesh, torus, &other, reach_m, memory, &mut told);
        }
        Shape::Form(form) => {
            let other = Other { solid: Solidity::Form(form), X_MO };
            mesh_solid::contact_points(mesh, &other, reach_m, memory, &mut told);
        }
        Shape::Mesh(second) => {
            let other = Other { solid: Solidity::Mesh(second), X_MO };
            mesh_solid::contact_points(mesh, &other, reach_m, memory, &mut told);
        }
        Shape::Csg(_) | Shape::Nurbs(_) | Shape::Own(_) => {}
    }
}

/// Contact points as the mesh sees them, told to the pair.
pub(super) struct Told<'t> {
    /// Pose of the mesh.
    pub(super) X_WM: &'t Isometry3<f64>,
    /// Or B.
    pub(super) mesh_is_a: bool,
    /// Of their depths so much counts.
    pub(super) part: f64,
    pub(super) found: &'t mut ContactPoints,
}

/// A contact point in the mesh's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Contact {
    pub(super) id: u32,
    /// On the mesh \[m\].
    pub(super) on_mesh_M: Vector3<f64>,
    /// On the other one \[m\].
    pub(super) on_other_M: Vector3<f64>,
    /// Unit, from the mesh to the other one.
    pub(super) normal_M: Vector3<f64>,
    /// Negative where they overlap \[m\].
    pub(super) gap_m: f64,
    /// Which part of its depth that is.
    pub(super) share: f64,
    /// Which part of it bears where the surface is round.
    pub(super) rolls: f64,
    /// It was one of its place's in the last tick.
    pub(super) carried: bool,
}

impl Contact {
    /// Whose gap is that between its points.
    pub(super) fn new(about: About, on_mesh_M: Vector3<f64>, normal_M: Vector3<f64>, gap_m: f64) -> Self {
        Self {
            id: about.id(),
            on_mesh_M,
            on_other_M: on_mesh_M + normal_M * gap_m,
            normal_M,
            gap_m,
            share: 1.0,
            rolls: 0.0,
            carried: false,
        }
    }

    /// The same; where it presses, what it stands on may be round there.
    pub(super) fn rolling(self, is_round: impl FnOnce() -> bool) -> Self {
        Self { rolls: if self.gap_m < 0.0 && is_round() { 1.0 } else { 0.0 }, ..self }
    }
}

impl Told<'_> {
    pub(super) fn tell(&mut self, contact: &Contact) {
        let Contact { id, on_mesh_M, on_other_M, normal_M, gap_m, share, rolls, .. } = *contact;
        let (point_M, sign) = if self.mesh_is_a { (on_mesh_M, -1.0) } else { (on_other_M, 1.0) };
        let point_W = (self.X_WM * Point3::from(point_M)).coords;
        let (gap_m, share) =
            if gap_m < 0.0 { (gap_m * self.part, share * self.part) } else { (gap_m, share) };
        let normal_W = self.X_WM * normal_M * sign;
        self.found.push(ContactPoint { id, point_W, normal_W, gap_m, share, rolls });
    }
}

/// What a contact point is about.
#[derive(Debug, Clone, Copy)]
pub(super) enum About {
    /// A face of the mesh.
    Face(u32),
    /// An edge, by a face of the mesh and its number there.
    Edge(u32, usize),
    /// A vertex of the mesh.
    Vertex(u32),
    /// A point of the other one.
    Other(u32),
    /// An edge of the mesh, or of the other one, that is cut off; which of its places that is.
    Cut { edge: u32, of_mesh: bool, place: u32 },
    /// Both, where two convex ones touch.
    Both,
    /// A part of the space that is in both, by a face of a coarse mesh.
    Region(u32),
}

impl About {
    pub(super) fn id(&self) -> u32 {
        match *self {
            Self::Face(face) => face << 2,
            Self::Edge(face, edge) => (face * 3 + edge as u32) << 2 | 1,
            Self::Vertex(vertex) => vertex << 2 | 2,
            Self::Other(point) => point << 2 | 3,
            Self::Both => (MOST_NUMBERS - 1) << 2 | 3,
            Self::Region(face) => (MOST_NUMBERS - 2 - face) << 2 | 3,
            // No ball has any.
            Self::Cut { edge, of_mesh, place } => (edge << 3 | u32::from(of_mesh) << 2 | place) << 2 | 1,
        }
    }

    /// The vertex of the mesh or the point of the other one that has this name.
    pub(super) fn point(id: u32) -> Option<Self> {
        let number = id >> 2;
        match id & 3 {
            2 => Some(Self::Vertex(number)),
            3 => Some(Self::Other(number)),
            _ => None,
        }
    }

    pub(super) fn at_place(self, place: u32) -> Self {
        match self {
            Self::Cut { edge, of_mesh, .. } => Self::Cut { edge, of_mesh, place },
            other => other,
        }
    }
}

/// Numbers have 27 bits.
const MOST_NUMBERS: u32 = 1 << 27;
