//! Steepness of heights over a whole surface.
//!
//! Model: a few thousand places of the surface, spread at random but the same each time: of a mesh over its faces by their
//! area, of a plane over one picture, of other forms the points nearest to places in and around the box about them.
//! Limits: what is steep in single places only may be missed. Own surfaces are not looked at.

use nalgebra::Vector3;

use super::{HeightMap, PictureScale};
use crate::mesh::{Mesh, area_vector};
use crate::shape::{Form, Shape};
use crate::surface::{Feature, Surface, SurfacePoint};

/// Heights over a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeightSurvey {
    /// The steepest slope that was found.
    pub steepest: f64,
    /// The part of the surface that is steeper than what is felt.
    pub too_steep: f64,
}

impl HeightMap {
    /// Looks at heights all over a shape; `None` if its surface cannot be gone over.
    pub fn survey(&self, shape: &Shape) -> Option<HeightSurvey> {
        let mut survey = HeightSurvey::default();
        let mut looked = 0_u32;
        let mut look = |at: SurfacePoint| {
            let slope = self.height(shape, &at).1.norm();
            survey.steepest = survey.steepest.max(slope);
            survey.too_steep += f64::from(u32::from(slope > Self::STEEPEST));
            looked += 1;
        };
        let mut random = Halton::default();
        match shape {
            Shape::Form(form) => {
                let half_m = self.half_m(form)?;
                let place = |random: &mut Halton| {
                    random.next_point().map(|x| AROUND * (2.0 * x - 1.0)).component_mul(&half_m)
                };
                (0..PLACES).for_each(|_| look(form.nearest(&place(&mut random))));
            }
            Shape::Mesh(mesh) => {
                let sums: Vec<f64> = (0..mesh.faces().len() as u32)
                    .scan(0.0, |sum, face| {
                        *sum += area_vector(&corners(mesh, face)).norm();
                        Some(*sum)
                    })
                    .collect();
                let whole = *sums.last()?;
                for _ in 0..PLACES {
                    let [which, a, b] = random.next_point().into();
                    let face = sums.partition_point(|&sum| sum < which * whole).min(sums.len() - 1);
                    look(on_face(mesh, face as u32, [a, b]));
                }
            }
            _ => return None,
        }
        survey.too_steep /= f64::from(looked);
        Some(survey)
    }

    /// Half the sides of the box around a form, or of one picture on a plane \[m\].
    fn half_m(&self, form: &Form) -> Option<Vector3<f64>> {
        if let (Form::Plane(_), PictureScale::Size([width_m, height_m])) = (form, self.scale) {
            return Some(Vector3::repeat(0.5 * width_m.max(height_m)));
        }
        // The farthest points along each axis.
        let half = Vector3::from_fn(|axis, _| {
            let mut way = Vector3::zeros();
            way[axis] = FAR_M;
            form.nearest(&way).point_B[axis].abs().max(form.nearest(&-way).point_B[axis].abs())
        });
        (half.amax() < FAR_M).then_some(half)
    }
}

fn corners(mesh: &Mesh, face: u32) -> [Vector3<f64>; 3] {
    mesh.faces()[face as usize].vertices.map(|vertex| mesh.vertices()[vertex as usize])
}

/// A point of a face, by two numbers from 0 to 1, evenly over its area.
fn on_face(mesh: &Mesh, face: u32, [a, b]: [f64; 2]) -> SurfacePoint {
    let (root, [p, q, r]) = (a.sqrt(), corners(mesh, face));
    let point_B = p * (1.0 - root) + q * (root * (1.0 - b)) + r * (root * b);
    SurfacePoint {
        point_B,
        normal_B: mesh.faces()[face as usize].normal_B,
        feature: Feature::Face,
        piece: face,
    }
}

/// Points spread evenly over a cube of side 1 (Halton 1960).
#[derive(Debug, Default)]
struct Halton(u32);

impl Halton {
    fn next_point(&mut self) -> Vector3<f64> {
        self.0 += 1;
        let number = self.0;
        Vector3::from([2, 3, 5].map(|base| {
            let (mut left, mut share, mut at) = (number, 1.0, 0.0);
            while left > 0 {
                share /= f64::from(base);
                at += share * f64::from(left % base);
                left /= base;
            }
            at
        }))
    }
}

/// Places that are looked at.
const PLACES: usize = 8192;
/// So many times the box around a form.
const AROUND: f64 = 1.1;
/// Nothing with an end reaches so far \[m\].
const FAR_M: f64 = 1e6;
