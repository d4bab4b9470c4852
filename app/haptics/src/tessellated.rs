//! Closed forms as triangles, for balls that cannot feel them otherwise.
//!
//! Problem: a ball that does not fit through the hole of a torus rests on both sides of it, and a scaled cone grown by
//! a ball has no equation. On a mesh a ball feels all of that already.
//!
//! Model: turned around the y axis in [`AROUND`] segments, their corners on the form. No triangle is farther from it
//! than 1 - cos(pi / 384) = 3.4e-5 of the radius around the axis, for a tube 1.4e-4 of its own: a few micrometres, the
//! steps of a real device's encoders being 30.

use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::mesh::{TriangleSoup, make};
use crate::shape::Form;

/// Segments around the axis.
const AROUND: usize = 384;
/// Segments around a tube, or of a half ball twice.
const ALONG: usize = 192;

/// The form in triangles; `None` for forms that feel every ball as they are.
pub(crate) fn tessellated(form: &Form) -> Option<TriangleSoup> {
    match form {
        Form::Torus(ring) => Some(make::torus(AROUND, ALONG, ring.ring_radius_m(), ring.tube_radius_m())),
        Form::Scaled(scaled) => {
            let mut soup = of_unscaled(&scaled.unscaled())?;
            let factors = Vector3::from(scaled.factors());
            soup.vertices.iter_mut().for_each(|vertex| vertex.component_mul_assign(&factors));
            Some(soup)
        }
        _ => None,
    }
}

fn of_unscaled(form: &Form) -> Option<TriangleSoup> {
    match form {
        Form::Cylinder(it) => Some(frustum(it.radius_m(), it.radius_m(), it.length_m())),
        Form::Cone(it) => Some(frustum(it.radius_bottom_m(), it.radius_top_m(), it.length_m())),
        Form::Capsule(it) => {
            let quarter = ALONG / 4;
            let arc = |i: usize| {
                let angle = FRAC_PI_2 * i as f64 / quarter as f64;
                [it.radius_m() * angle.sin(), 0.5 * it.length_m() + it.radius_m() * angle.cos()]
            };
            let top: Vec<_> = (1..=quarter).map(arc).collect();
            let bottom = top.iter().rev().map(|[rho, y]| [*rho, -y]);
            // Without a straight part both arcs end in the same ring.
            let skipped = usize::from(it.length_m() == 0.0);
            let profile: Vec<_> = top.iter().copied().chain(bottom.skip(skipped)).collect();
            Some(turned(0.5 * it.length_m() + it.radius_m(), &profile))
        }
        form => tessellated(form),
    }
}

fn frustum(bottom_m: f64, top_m: f64, length_m: f64) -> TriangleSoup {
    let rings = [[top_m, 0.5 * length_m], [bottom_m, -0.5 * length_m]];
    let profile: Vec<_> = rings.into_iter().filter(|[rho, _]| *rho > 0.0).collect();
    turned(0.5 * length_m, &profile)
}

/// A profile of rings (radius, height) from top to bottom, turned around the y axis and closed at `-+pole_m`.
fn turned(pole_m: f64, profile: &[[f64; 2]]) -> TriangleSoup {
    let mut vertices = vec![Vector3::new(0.0, pole_m, 0.0), Vector3::new(0.0, -pole_m, 0.0)];
    for [rho, y] in profile {
        vertices.extend((0..AROUND).map(|i| {
            let (sin, cos) = (TAU * i as f64 / AROUND as f64).sin_cos();
            Vector3::new(rho * cos, *y, rho * sin)
        }));
    }
    let index = |i: usize, ring: usize| (2 + ring * AROUND + i % AROUND) as u32;
    let last = profile.len().saturating_sub(1);
    let mut faces = Vec::new();
    for i in 0..AROUND {
        faces.push([0, index(i + 1, 0), index(i, 0)]);
        for ring in 0..last {
            let [a, b] = [index(i, ring), index(i + 1, ring)];
            let [c, d] = [index(i + 1, ring + 1), index(i, ring + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
        faces.push([1, index(i, last), index(i + 1, last)]);
    }
    TriangleSoup { vertices, faces }
}

const _: () = assert!(PI * PI / 2.0 / ((AROUND * AROUND) as f64) < 3.5e-5);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Sides};
    use crate::surface::Surface;
    use crate::{Capsule, Cone, Cylinder, Scaled, Torus};

    #[test]
    fn the_triangles_close_and_lie_as_near_to_the_form_as_promised() {
        let scaled = |form: Form| Scaled::new(form, [1.0, 0.8, 2.0]).unwrap();
        for form in [
            Torus::new(0.05, 0.02).unwrap().into(),
            scaled(Torus::new(0.05, 0.02).unwrap().into()),
            scaled(Cylinder::new(0.05, 0.04).unwrap().into()),
            scaled(Cone::new(0.05, 0.02, 0.04).unwrap().into()),
            scaled(Cone::new(0.05, 0.0, 0.04).unwrap().into()),
            scaled(Cone::new(0.0, 0.05, 0.04).unwrap().into()),
            scaled(Capsule::new(0.03, 0.04).unwrap().into()),
            scaled(Capsule::new(0.03, 0.0).unwrap().into()),
        ] {
            let (mesh, report) = Mesh::build(tessellated(&form).unwrap()).unwrap();
            assert_eq!(mesh.sides(), Sides::Solid, "{form:?}");
            assert_eq!(report.flipped.count, 0, "{form:?}: {report}");
            for face in mesh.faces() {
                let corners = face.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
                // The form's own distance is exact, or for a scaled one below the true one by factors of up to 2.5.
                let middle = form.signed_distance(&(corners.iter().sum::<Vector3<f64>>() / 3.0));
                assert!((-1.4e-4 * 0.1..1e-12).contains(&middle), "{form:?}: {middle:e}");
                for corner in corners {
                    assert!(form.signed_distance(&corner).abs() < 1e-15, "{form:?}");
                }
            }
        }
    }

    #[test]
    fn forms_that_grow_need_no_triangles() {
        assert!(tessellated(&Cylinder::new(0.05, 0.04).unwrap().into()).is_none());
    }
}
