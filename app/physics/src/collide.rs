//! Where two entities touch: contact points that keep their identity.
//!
//! Model (Melder ch. 6.2.1, 7.4): a contact that fills an edge gives its two ends, one that fills a face its corners. A
//! point is reported from a given reach on before it touches, so that its spring is there when it does.
//! Who finds them, by the kinds of the two:
//! - convex forms with each other: `convex_pair`, along the direction in which they touch (`axis`, `follow`, `gjk`), what
//!   flat pieces (`overlay`) and lines (`lines`) share; on planes the same with the plane's normal;
//! - balls on anything that tells its nearest point: `ball`; rings, as a ball that is swept along a circle: `ring`, and where
//!   they are deep, all along it: `ring_deep`;
//! - meshes with anything: `mesh`; convex ones with convex ones along the direction in which they touch, too.
//!
//! Who cannot meet says [`is_collidable`]: trees of shapes with nothing, NURBS and surfaces of one's own with balls only, a
//! torus that is scaled by different factors with balls only, a torus not with other scaled forms.
//!
//! Frames and signs: W; normals leave B and point to A; gaps are negative where they overlap. Of points nearer to each other
//! than a millimetre the later ones count with a part of their depth.
//! Invariants: no allocation; at most [`MAX_POINTS`] points, of two forms eight, unless one is a ring; an id stands for the same features from tick to tick; finite for
//! every pose; along a continuous way the forces of springs on the points are continuous, save where the way out that a
//! body came by ends (a rim that is deeper in a tip than that is round).
//! Cost: mostly below 1 us a pair while the direction of the last tick can be followed, a few where a ring has edges beside
//! it; bounded searches of up to some tens where it cannot, or where a ring is deep. `cargo bench -p physics --bench collide -- table`.

use haptics::{Form, Shape};
use nalgebra::{Isometry3, Vector3};

mod axis;
mod ball;
mod bounds;
mod convex;
mod convex_pair;
mod facet;
mod follow;
mod gjk;
mod lines;
pub(crate) mod mesh;
mod mesh_ball;
mod mesh_carry;
mod mesh_convex;
mod mesh_corner;
mod mesh_cut;
mod mesh_found;
mod mesh_other;
mod mesh_overlap;
mod mesh_own;
mod mesh_patch;
mod mesh_plane;
mod mesh_ridge;
mod mesh_ring;
mod mesh_role;
mod mesh_search;
mod mesh_see;
mod mesh_share;
mod mesh_solid;
mod mesh_span;
mod mesh_spread;
mod mesh_springs;
mod overlay;
mod places;
mod rim;
mod ring;
mod ring_deep;
mod spots;

pub use bounds::bounding_ball;
pub(crate) use mesh_patch::Searched;
pub use mesh_patch::{Patch, Patches};
pub(crate) use mesh_spread::Spread;
pub use places::Places;
use spots::{Spot, Spots};

/// The most contact points of two entities.
pub const MAX_POINTS: usize = 24;
/// Of two forms, or of one of the places where a mesh touches.
const PATCH_POINTS: usize = 8;

/// A contact point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactPoint {
    /// Which features of A and B touch; different for each point of a pair.
    pub id: u32,
    /// On the surface of A \[m\].
    pub point_W: Vector3<f64>,
    /// Unit, from B to A.
    pub normal_W: Vector3<f64>,
    /// From B's surface to that of A along the normal \[m\]; negative: what counts of the depth.
    pub gap_m: f64,
    /// Which part of its depth counts: less than 1 where it is next to other points.
    pub share: f64,
    /// Which part of it bears where a mesh is round, so that others bear it when it rolls on.
    pub rolls: f64,
}

impl ContactPoint {
    /// How deep it is, all of it \[m\].
    pub fn depth_m(&self) -> f64 {
        if self.gap_m < 0.0 && self.share > 0.0 { -self.gap_m / self.share } else { 0.0 }
    }
}

/// All contact points of two entities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactPoints {
    points: [ContactPoint; MAX_POINTS],
    count: usize,
}

impl ContactPoints {
    /// Adds one; beyond the room, it takes the place of the one that is least deep, if it is deeper.
    pub fn push(&mut self, point: ContactPoint) {
        if let Some(place) = self.points.get_mut(self.count) {
            *place = point;
            self.count += 1;
            return;
        }
        let least = self.points.iter_mut().max_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        if let Some(least) = least.filter(|least| point.gap_m < least.gap_m) {
            *least = point;
        }
    }

    /// Without those that are farther apart than this \[m\].
    pub(crate) fn forget_beyond(&mut self, gap_m: f64) {
        let mut kept = 0;
        for at in 0..self.count {
            if self.points[at].gap_m <= gap_m {
                self.points.swap(kept, at);
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// All of them.
    pub fn as_slice(&self) -> &[ContactPoint] {
        &self.points[..self.count]
    }
}

/// An entity as collision sees it.
#[derive(Debug, Clone, Copy)]
pub struct Solid<'s> {
    /// In its own frame.
    pub shape: &'s Shape,
    /// Where that is.
    pub X_W: &'s Isometry3<f64>,
}

/// What finding the contact points of a pair remembers from tick to tick.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PairMemory {
    /// Whatever the pair's algorithm makes of them.
    pub words: [f64; 8],
    /// Of a mesh, where it touches.
    pub patches: Places,
    /// Points are so soft that energy in them can be felt: of a mesh all vertices count.
    pub is_soft: bool,
    /// B never moves: vertices of a fixed mesh do not count where a closed form touches it.
    pub is_b_fixed: bool,
}

/// The vertices that a mesh stands on, and how it stood when they were chosen.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stands {
    /// As corners of faces, plus one; 0: none.
    corners: [u32; PATCH_POINTS],
    /// Heights were `along . x + base`, and the lowest this one.
    along: Vector3<f64>,
    base: f64,
    lowest_m: f64,
    /// How often they were sought.
    ticks: u32,
}

/// Whether contact points of such an entity as `A` can be found: a solid that ends somewhere.
pub fn can_move(shape: &Shape) -> bool {
    match shape {
        Shape::Form(Form::Plane(_)) => false,
        Shape::Form(form) => !is_scaled_torus(form),
        Shape::Mesh(mesh) => mesh::can_move(mesh),
        _ => false,
    }
}

/// Whether contact points of these two can be found if A moves. What cannot passes through the other.
pub fn is_collidable(a: &Shape, b: &Shape) -> bool {
    if !can_move(a) {
        return false;
    }
    match (a, b) {
        (Shape::Mesh(_), _) | (_, Shape::Mesh(_)) => mesh::is_collidable(a, b),
        (Shape::Form(a), Shape::Form(b)) => forms_are_collidable(a, b),
        (Shape::Form(Form::Sphere(_)), Shape::Own(_) | Shape::Nurbs(_)) => true,
        _ => false,
    }
}

/// What a shape is called.
pub fn name(shape: &Shape) -> &'static str {
    match shape {
        Shape::Form(Form::Plane(_)) => "plane",
        Shape::Form(Form::Sphere(_)) => "sphere",
        Shape::Form(Form::Cuboid(_)) => "box",
        Shape::Form(Form::Cylinder(_)) => "cylinder",
        Shape::Form(Form::Cone(_)) => "cone",
        Shape::Form(Form::Capsule(_)) => "capsule",
        Shape::Form(Form::Torus(_)) => "torus",
        Shape::Form(Form::Ellipsoid(_)) => "ellipsoid",
        Shape::Form(form @ Form::Scaled(_)) if is_scaled_torus(form) => "torus scaled by different factors",
        Shape::Form(Form::Scaled(_)) => "form scaled by different factors",
        Shape::Mesh(_) => "mesh",
        Shape::Csg(_) => "tree of shapes (CSG)",
        Shape::Nurbs(_) => "NURBS surface",
        Shape::Own(_) => "surface of one's own",
    }
}

/// Where A and B touch, or come nearer than `reach_m`; nothing where they are not [collidable](is_collidable).
pub fn contact_points(
    a: Solid<'_>,
    b: Solid<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    found: &mut ContactPoints,
) {
    match (a.shape, b.shape) {
        (Shape::Mesh(_), _) | (_, Shape::Mesh(_)) => mesh::contact_points(a, b, reach_m, memory, found),
        (Shape::Form(form_a), Shape::Form(form_b)) if forms_are_collidable(form_a, form_b) => {
            let is_swapped = rank(form_b) < rank(form_a);
            let (X_WA, X_WB) = if is_swapped { (b.X_W, a.X_W) } else { (a.X_W, b.X_W) };
            let (form_a, form_b) = if is_swapped { (form_b, form_a) } else { (form_a, form_b) };
            let spots = of_forms(form_a, &X_WB.inv_mul(X_WA), form_b, reach_m, memory);
            spots.report(X_WB, is_swapped, found);
        }
        (Shape::Form(Form::Sphere(sphere)), surface) => {
            let centre = b.X_W.inv_mul(a.X_W).translation.vector;
            if let Some(touch) = ball::on_surface(surface, &centre, sphere.radius_m()) {
                single(&touch, &centre, sphere.radius_m(), reach_m).report(b.X_W, false, found);
            }
        }
        _ => {}
    }
}

/// In the frame of B, which does not rank before A.
fn of_forms(a: &Form, X_BA: &Isometry3<f64>, b: &Form, reach_m: f64, memory: &mut PairMemory) -> Spots {
    match (a, b) {
        (Form::Torus(torus), _) => ring::contact(torus, X_BA, b, reach_m, memory),
        // Of a convex one the nearest point is better found by what suits all convex ones.
        (Form::Sphere(sphere), _) if !matches!(b, Form::Scaled(_)) || is_scaled_torus(b) => {
            let (centre, radius_m) = (X_BA.translation.vector, sphere.radius_m());
            single(&ball::on_form(b, &centre, radius_m), &centre, radius_m, reach_m)
        }
        (_, Form::Plane(plane)) => convex_pair::on_plane(a, X_BA, plane, reach_m, memory),
        _ => convex_pair::contact(a, X_BA, b, reach_m, memory),
    }
}

/// Which of two forms is looked at as A: rings on anything (a ball may lie in the hole), balls on anything else.
fn rank(form: &Form) -> u32 {
    match form {
        Form::Torus(_) => 0,
        Form::Sphere(_) => 1,
        Form::Plane(_) => 3,
        _ => 2,
    }
}

/// The one contact point of a ball.
fn single(touch: &ball::Touch, centre: &Vector3<f64>, radius_m: f64, reach_m: f64) -> Spots {
    let mut spots = Spots::within(reach_m, radius_m);
    let on_a = centre - touch.normal * radius_m;
    spots.push(Spot { id: 0, on_a, normal: touch.normal, gap_m: touch.gap_m });
    spots
}

fn forms_are_collidable(a: &Form, b: &Form) -> bool {
    let (is_ball, is_ring) = (matches!(a, Form::Sphere(_)), matches!(a, Form::Torus(_)));
    match b {
        Form::Scaled(_) if is_scaled_torus(b) => is_ball,
        Form::Scaled(_) => !is_ring,
        Form::Torus(_) => !matches!(a, Form::Scaled(_)),
        _ => true,
    }
}

fn is_scaled_torus(form: &Form) -> bool {
    matches!(form, Form::Scaled(scaled) if matches!(scaled.unscaled(), Form::Torus(_)))
}
