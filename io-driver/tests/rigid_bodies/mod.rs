//! The same arm as loose bodies: where their centres are and how they are turned, from the drawing and
//! nothing else. Slow and obvious; the oracle of the closed forms.

use io_driver::kinematics::gravity::{Bodies, GRAVITY_M_PER_S2};
use io_driver::sim::dynamics::Inertias;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// A rigid body carried around by the linkage.
pub(crate) struct Body {
    mass_kg: f64,
    /// About its centre, in the pose where all angles of the linkage are zero (kg m^2).
    inertia_kg_m2: Vector3<f64>,
    /// Distances of its centre from the shoulder along the upper arm and along the forearm (m).
    out_m: [f64; 2],
    turns_with: Link,
}

#[derive(Clone, Copy)]
enum Link {
    Turret,
    UpperArm,
    Forearm,
}

/// The five bodies of an arm.
///
/// The paper gives the moments of `be` and `df` about the shoulder. About their centres, which are what a
/// moving body's energy wants, they are smaller by mass times lever squared (Steiner), but for the axis that
/// goes through the shoulder and the centre.
pub(crate) fn bodies([l1, l2]: [f64; 2], bodies: &Bodies, inertias: &Inertias) -> [Body; 5] {
    let Bodies { mass_a_kg, mass_c_kg, mass_be_kg, mass_df_kg, l3_m, l5_m, l6_m } = *bodies;
    let steiner_be = mass_be_kg * l5_m * l5_m * Vector3::new(1.0, 1.0, 0.0);
    let steiner_df = mass_df_kg * l6_m * l6_m * Vector3::new(1.0, 0.0, 1.0);
    let body = |mass_kg, inertia_kg_m2, out_m, turns_with| Body { mass_kg, inertia_kg_m2, out_m, turns_with };
    [
        body(mass_a_kg, inertias.a_kg_m2.into(), [l1, 0.5 * l2], Link::Forearm),
        body(mass_c_kg, inertias.c_kg_m2.into(), [0.5 * l1, l3_m], Link::UpperArm),
        body(mass_be_kg, Vector3::from(inertias.be_kg_m2) - steiner_be, [l5_m, 0.0], Link::UpperArm),
        body(mass_df_kg, Vector3::from(inertias.df_kg_m2) - steiner_df, [0.0, -l6_m], Link::Forearm),
        body(0.0, Vector3::y() * inertias.base_yy_kg_m2, [0.0, 0.0], Link::Turret),
    ]
}

/// Near the cube root of the unit roundoff, where the two errors of a central difference meet.
const STEP: f64 = 1e-5;

/// Energy of the motion (J) at linkage angles that change at these rates: half mass times speed squared, and
/// half moment times rate of turning squared, summed over the bodies; speeds by central differences.
pub(crate) fn kinetic_energy(bodies: &[Body; 5], angles: [f64; 3], rates: [f64; 3]) -> f64 {
    let at = |h: f64| std::array::from_fn(|j| angles[j] + h * rates[j]);
    bodies
        .iter()
        .map(|body| {
            let velocity = (body.centre(at(STEP)) - body.centre(at(-STEP))) / (2.0 * STEP);
            let turned = (body.orientation(at(STEP)) - body.orientation(at(-STEP))) / (2.0 * STEP);
            // R^T dR/dt is the rate of turning in the body's own axes, as a skew matrix.
            let spin = body.orientation(angles).transpose() * turned;
            let rate = Vector3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)]);
            let turning = body.inertia_kg_m2.dot(&rate.component_mul(&rate));
            0.5 * (body.mass_kg * velocity.norm_squared() + turning)
        })
        .sum()
}

/// Energy of the weight (J): each body's mass by its centre's height in the world above the shoulder.
pub(crate) fn potential_energy(bodies: &[Body; 5], angles: [f64; 3], base_in_world: &Rotation3<f64>) -> f64 {
    bodies.iter().map(|body| body.mass_kg * GRAVITY_M_PER_S2 * (base_in_world * body.centre(angles)).y).sum()
}

impl Body {
    fn centre(&self, angles: [f64; 3]) -> Vector3<f64> {
        let upper_arm = orientation(Link::UpperArm, angles) * Vector3::z();
        let forearm = orientation(Link::Forearm, angles) * -Vector3::y();
        self.out_m[0] * upper_arm + self.out_m[1] * forearm
    }

    fn orientation(&self, angles: [f64; 3]) -> Matrix3<f64> {
        orientation(self.turns_with, angles)
    }
}

/// The turret about the vertical, the links then about the horizontal through the shoulder, upwards.
fn orientation(link: Link, [turret, upper_arm, forearm]: [f64; 3]) -> Matrix3<f64> {
    let raised = match link {
        Link::Turret => 0.0,
        Link::UpperArm => upper_arm,
        Link::Forearm => forearm,
    };
    let turret = Rotation3::from_axis_angle(&Vector3::y_axis(), turret);
    (turret * Rotation3::from_axis_angle(&Vector3::x_axis(), -raised)).into_inner()
}
