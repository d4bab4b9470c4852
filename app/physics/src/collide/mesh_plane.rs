//! A mesh over a plane: the vertices that it stands on, or, where contacts are soft, all that touch.
//!
//! Cost: that of [`mesh_span`](super::mesh_span) and [`mesh_spread`].

use haptics::mesh::{Linear, Mesh};
use haptics::{Form, Shape};
use nalgebra::{Isometry3, Vector3};

use super::mesh::{About, Contact, Told, bounding_ball};
use super::mesh_corner::Corner;
use super::mesh_span::Standing;
use super::mesh_spread::Lows;
use super::{MAX_POINTS, PairMemory, mesh_spread};

/// The plane that such a mesh can only stand on, in the other one's frame: that of a plane, or, where contacts are soft, of a box's
/// face that it is over with all that it has.
pub(super) fn plane_below(
    mesh: &Mesh,
    other: &Shape,
    X_MO: &Isometry3<f64>,
    is_soft: bool,
) -> Option<(Vector3<f64>, f64)> {
    match other {
        Shape::Form(Form::Plane(plane)) => Some((plane.normal_B(), plane.offset_m())),
        Shape::Form(Form::Cuboid(cuboid)) if is_soft => {
            let (centre_M, radius_m) = bounding_ball(mesh)?;
            let centre = X_MO.inverse_transform_point(&centre_M.into()).coords;
            let beyond_m = centre.abs() - Vector3::from(cuboid.size_m()) * 0.5;
            let axis = beyond_m.imax();
            let is_over = (0..3).all(|side| side == axis || beyond_m[side] < -radius_m);
            let mut normal = Vector3::zeros();
            normal[axis] = 1_f64.copysign(centre[axis]);
            (is_over && beyond_m[axis] > 0.0).then_some((normal, 0.5 * cuboid.size_m()[axis]))
        }
        _ => None,
    }
}

/// The plane is `normal . x = offset` in the mesh's frame, and what is above it is free.
pub(super) fn contact_points(
    mesh: &Mesh,
    normal_M: &Vector3<f64>,
    offset_m: f64,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    let standing = Standing {
        mesh,
        height: Linear::new(*normal_M, -offset_m),
        limits: &[],
        reach_m,
        travel_m: (reach_m - crate::pair::REACH_M).max(0.0),
    };
    let spread = &mut memory.patches.spread;
    let find = |lows: &mut Lows| {
        let see = |corner: Corner| {
            let about = About::Vertex(corner.vertex(mesh));
            let contact = Contact::new(about, *corner.point_M(mesh), -normal_M, standing.height_m(corner));
            Some(contact.rolling(|| corner.is_round(mesh, &-normal_M)))
        };
        lows.find(&standing, |_| true, see)
    };
    if memory.is_soft && mesh_spread::tell(spread, MAX_POINTS, find, |contact| told.tell(contact)) {
        return;
    }
    for corner in standing.choose(&mut memory.patches.all[0].stands[0]).into_iter().flatten() {
        let gap_m = standing.height_m(corner);
        if gap_m <= reach_m {
            let about = About::Vertex(corner.vertex(mesh));
            told.tell(&Contact::new(about, *corner.point_M(mesh), -normal_M, gap_m));
        }
    }
}
