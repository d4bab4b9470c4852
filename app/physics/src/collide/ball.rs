//! A ball on any form.
//!
//! Model: the surface point nearest to its centre is where it touches, and the way from there to the centre the normal;
//! once the centre is inside, the way out.

use haptics::{Form, Shape, Surface, SurfacePoint};
use nalgebra::Vector3;

use super::axis::unit;

/// How a ball touches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Unit, to the ball.
    pub(super) normal: Vector3<f64>,
    /// Negative: the depth \[m\].
    pub(super) gap_m: f64,
}

/// How a ball of this radius touches a form, in whose frame it is.
pub(super) fn on_form(form: &Form, centre: &Vector3<f64>, radius_m: f64) -> Touch {
    match form {
        Form::Plane(plane) => {
            Touch { normal: plane.normal_B(), gap_m: gap_m(form, centre, radius_m) }
        }
        Form::Sphere(_) | Form::Capsule(_) | Form::Torus(_) => {
            Touch { normal: form.nearest(centre).normal_B, gap_m: gap_m(form, centre, radius_m) }
        }
        // Sharp forms know their distance where they are round.
        Form::Cuboid(_) | Form::Cylinder(_) | Form::Cone(_) => {
            let round = form.grown(radius_m).unwrap_or(*form);
            Touch { normal: round.nearest(centre).normal_B, gap_m: round.signed_distance(centre) }
        }
        Form::Ellipsoid(_) | Form::Scaled(_) => {
            from_nearest(&form.nearest(centre), form.signed_distance(centre), centre, radius_m)
        }
    }
}

/// The gap alone \[m\].
pub(super) fn gap_m(form: &Form, centre: &Vector3<f64>, radius_m: f64) -> f64 {
    match form {
        Form::Ellipsoid(_) | Form::Scaled(_) => on_form(form, centre, radius_m).gap_m,
        Form::Cuboid(_) | Form::Cylinder(_) | Form::Cone(_) => {
            form.grown(radius_m).unwrap_or(*form).signed_distance(centre)
        }
        _ => form.signed_distance(centre) - radius_m,
    }
}

/// How it touches a shape that is no form and knows its nearest point; `None` where it does not.
pub(super) fn on_surface(shape: &Shape, centre: &Vector3<f64>, radius_m: f64) -> Option<Touch> {
    let touch = |surface: &dyn Surface| {
        from_nearest(&surface.nearest(centre), surface.signed_distance(centre), centre, radius_m)
    };
    match shape {
        Shape::Own(own) => Some(from_nearest(
            &own.nearest(centre),
            own.signed_distance(centre),
            centre,
            radius_m,
        )),
        Shape::Nurbs(nurbs) => Some(touch(&nurbs.surface(0.0))),
        _ => None,
    }
}

/// Of the distance only the sign counts.
fn from_nearest(at: &SurfacePoint, distance_m: f64, centre: &Vector3<f64>, radius_m: f64) -> Touch {
    let away = centre - at.point_B;
    let sign = if distance_m < 0.0 { -1.0 } else { 1.0 };
    // Beside the surface's normal stands whoever is nearest to an edge; on the surface there is only the normal.
    let normal = if away.norm() > NEAR_M { unit(&(away * sign)) } else { None };
    Touch { normal: normal.unwrap_or(at.normal_B), gap_m: sign * away.norm() - radius_m }
}

/// A centre nearer to the surface than this leads nowhere \[m\].
const NEAR_M: f64 = 1e-9;
