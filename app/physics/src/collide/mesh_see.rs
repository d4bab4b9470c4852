//! Where a point is with regard to a solid: the way out, and how far that is.

use haptics::mesh::{Mesh, Sides};
use haptics::{Cuboid, Feature, Form, Surface};
use nalgebra::{Isometry3, Vector3};

use super::convex::Convex;

/// Where a point is with regard to a surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Unit, out of the surface.
    pub(super) out: Vector3<f64>,
    /// Negative inside \[m\].
    pub(super) gap_m: f64,
}

/// Of a box: inside, the way out is through the face that was come in by, unless another one is very much nearer; and so it is
/// behind a thin one, for what may have come through by going so deep (m).
pub(super) fn in_box(cuboid: &Cuboid, point: &Vector3<f64>, along: &Vector3<f64>, deep_m: f64) -> Seen {
    let gap_m = cuboid.signed_distance(point);
    let axis = along.iamax();
    let half_m = Vector3::from(cuboid.size_m()) * 0.5;
    let depth_m = half_m[axis] - point[axis] * along[axis].signum();
    let is_through = if gap_m <= 0.0 {
        depth_m < MUCH * -gap_m + LITTLE_M
    } else {
        let is_beside = (0..3).any(|other| other != axis && point[other].abs() > half_m[other]);
        (0.0..=deep_m).contains(&depth_m) && !is_beside
    };
    if is_through {
        let mut out = Vector3::zeros();
        out[axis] = 1.0_f64.copysign(along[axis]);
        return Seen { out, gap_m: -depth_m };
    }
    at_form((*cuboid).into(), point)
}

pub(super) fn at_form(form: Form, point: &Vector3<f64>) -> Seen {
    let (nearest, gap_m) = (form.nearest(point), form.signed_distance(point));
    let away = point - nearest.point_B;
    // At an edge the way from the nearest point is none of the faces' normals.
    match away.try_normalize(NOTHING_M).filter(|_| gap_m > 0.0) {
        Some(out) => Seen { out, gap_m: away.norm() },
        None => Seen { out: nearest.normal_B, gap_m },
    }
}

/// Of another closed form: the same, by the way along which it was come in by.
pub(super) fn in_form(form: &Form, point: &Vector3<f64>, along: &Vector3<f64>, deep_m: f64) -> Seen {
    let seen = at_form(*form, point);
    let most_m = if seen.gap_m <= 0.0 { deep_m.max(MUCH * -seen.gap_m + LITTLE_M) } else { deep_m };
    let is_known = seen.gap_m <= 0.0 && seen.out.dot(along) > AGREES;
    if is_known || seen.gap_m >= most_m || Convex::of(form, &Isometry3::identity()).is_none() {
        return seen;
    }
    exit(form, point, &(along * most_m)).filter(|through| through.out.dot(along) > AGREES).unwrap_or(seen)
}

/// Out of a convex form, where a way from inside of it or from behind it ends outside: as seen through the surface there.
fn exit(form: &Form, from: &Vector3<f64>, way: &Vector3<f64>) -> Option<Seen> {
    let at = |share: f64| from + way * share;
    let height_m = |share: f64| form.signed_distance(&at(share));
    if height_m(1.0) <= 0.0 {
        return None;
    }
    // The distance is convex along the way: inside, if anything is, is where it is least.
    let (mut low, mut high) = (0.0, 1.0);
    if height_m(low) > 0.0 {
        let (mut first, mut last) = (0.0, 1.0);
        for _ in 0..NARROWINGS {
            let third = (last - first) / 3.0;
            let [a, b] = [first + third, last - third];
            (first, last) = if height_m(a) < height_m(b) { (first, b) } else { (a, last) };
        }
        low = 0.5 * (first + last);
        if height_m(low) > 0.0 {
            return None;
        }
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        (low, high) = if height_m(middle) > 0.0 { (low, middle) } else { (middle, high) };
    }
    let on_surface = at(high);
    let out = form.nearest(&on_surface).normal_B;
    Some(Seen { out, gap_m: out.dot(&(from - on_surface)) })
}

/// Thirds of a way that are left out until what of it is inside is found: to a thousandth of it.
const NARROWINGS: usize = 17;
/// Halves of a way until its end is known: to a part in 1e12.
const HALVINGS: usize = 40;
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
        let most_m = deep_m.max(MUCH * nearest.distance_m + LITTLE_M);
        if let Some(hit) = mesh.first_hit(&(point + along * most_m), point) {
            let through = &mesh.faces()[hit.face as usize];
            if through.normal_B.dot(along) > AGREES {
                return Seen { out: through.normal_B, gap_m: through.normal_B.dot(point) - through.offset_m };
            }
        }
    }
    // Behind an inner corner the nearest point is on the corner, and the face's plane is nearer.
    let depth_m = (face.offset_m - face.normal_B.dot(point)).clamp(0.0, nearest.distance_m);
    Seen { out: face.normal_B, gap_m: -depth_m }
}

/// One side of a mesh among several that press.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// Unit, out of it.
    pub(super) along: Vector3<f64>,
    /// From a point to where nothing else presses \[m\].
    pub(super) lift: Vector3<f64>,
    /// How far above and below a point it is looked for \[m\].
    pub(super) above_m: f64,
    pub(super) below_m: f64,
}

/// Where a point is with regard to a side, if the way through it meets that.
pub(super) fn see_side(mesh: &Mesh, point: &Vector3<f64>, side: &Side) -> Option<Seen> {
    let (along, lifted) = (side.along, point + side.lift);
    let hit = mesh.first_hit(&(lifted + along * side.above_m), &(lifted - along * side.below_m))?;
    let face = &mesh.faces()[hit.face as usize];
    let sign = if hit.is_front { 1.0 } else { -1.0 };
    let (out, gap_m) = (face.normal_B * sign, sign * (face.normal_B.dot(point) - face.offset_m));
    (out.dot(&along) > AGREES).then_some(Seen { out, gap_m })
}

/// Another way out must be so many times as short, and a little more \[m\].
const MUCH: f64 = 5.0;
const LITTLE_M: f64 = 2e-3;
/// Cosine between directions that are about the same.
const AGREES: f64 = 0.7;

#[cfg(test)]
mod tests {
    use haptics::mesh::TriangleSoup;

    use super::*;

    /// An angle: over x and y a square of 2 m without its upper right quarter, from z = -1 to 1.
    fn angle() -> Mesh {
        let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let end = |z: f64| outline.iter().map(move |[x, y]| Vector3::new(*x, *y, z));
        let vertices = end(1.0).chain(end(-1.0)).collect();
        let front = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]];
        let mut faces = front.to_vec();
        faces.extend(front.map(|[a, b, c]| [a + 6, c + 6, b + 6]));
        (0..6).for_each(|a| faces.extend([[a, a + 6, (a + 1) % 6 + 6], [a, (a + 1) % 6 + 6, (a + 1) % 6]]));
        Mesh::build(TriangleSoup { vertices, faces }).unwrap().0
    }

    #[test]
    fn behind_an_inner_corner_a_point_is_as_deep_as_in_the_side_that_is_looked_at() {
        let mesh = angle();
        for (x, y) in [(0.03, 0.01), (0.01, 0.03), (0.02, 0.02)] {
            let point = Vector3::new(1.0 - x, 1.0 - y, 0.1);
            for (along, depth_m) in [(Vector3::x(), x), (Vector3::y(), y)] {
                let seen = see(&mesh, &point, &along, 0.0);
                // Roundings of metres. Of both sides the one that is looked at, or the one that is nearest.
                let of_side = if seen.out.dot(&along) > 0.5 { depth_m } else { x + y - depth_m };
                assert!((seen.gap_m + of_side).abs() < 1e-14, "{x} {y} {along:?}: {seen:?}");
            }
        }
    }
}
