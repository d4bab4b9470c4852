//! Rims of cylinders and cones over a plane.
//!
//! Model: four points of each rim, equally spaced, of which one is the deepest. While all of them are pressed that is the
//! whole rim, pressed evenly, whichever four they are: with heights `a + b cos(angle)` neither the sum of their squares nor
//! that of their moments depends on it. On its edge the rim presses with its lowest point. In between the energy of four
//! springs is a function of `a` and `b` alone, and their forces are its slope, since those beside the deepest, which alone
//! gain height along the rim, do so by as much as they lose: a rim that rolls is neither driven nor braked.
//! A cylinder that lies stands on both of its rims. While it stands upright no point is the deepest, and those of before stay.

use std::f64::consts::FRAC_PI_2;

use haptics::Plane;
use nalgebra::Vector3;

use super::convex::{Convex, Core};
use super::facet::RIM_IDS;
use super::overlay::FLAT;
use super::spots::{Spot, Spots};

/// Contact points of both rims with a half-space, whose frame is B; `begins`: the angle at which the points begin.
pub(super) fn on_plane(form: &Convex<'_>, plane: &Plane, begins: &mut f64, spots: &mut Spots) {
    let Core::Frustum { half_m, radii_m: [bottom_m, top_m] } = form.core else { return };
    let normal = plane.normal_B();
    let [u, v] = [Vector3::x(), Vector3::z()].map(|axis| form.placed_vector(&axis));
    let (along_u, along_v) = (normal.dot(&u), normal.dot(&v));
    if along_u.hypot(along_v) > FLAT * u.norm().max(v.norm()) {
        *begins = (-along_v).atan2(-along_u);
    }
    let top = (0, half_m, top_m);
    let bottom = (1, -half_m, bottom_m);
    let is_top_down = normal.dot(&form.placed_vector(&Vector3::y())) < 0.0;
    // Of two that are close the lower one counts.
    for (cap, y, radius_m) in if is_top_down { [top, bottom] } else { [bottom, top] } {
        let points = if radius_m > 0.0 { 4 } else { 1 };
        for quarter in 0..points {
            let (sine, cosine) = (*begins + f64::from(quarter) * FRAC_PI_2).sin_cos();
            let own = Vector3::new(cosine * radius_m, y, sine * radius_m);
            let on_a = form.placed_point(&own) - normal * form.radius_m;
            let gap_m = normal.dot(&on_a) - plane.offset_m();
            spots.push(Spot { id: RIM_IDS + 4 * cap + quarter, on_a, normal, gap_m });
        }
    }
}
