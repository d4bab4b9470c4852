//! Everything that makes one hand differ from another.

use nalgebra::{UnitQuaternion, Vector3};

use super::grip::GripSpec;
use super::impedance::{ImpedanceSpec, SpringDamper};
use super::intention::IntentionSpec;
use super::tremor::TremorSpec;

/// A hand.
#[derive(Debug, Clone, PartialEq)]
pub struct HandModel {
    /// For people.
    pub name: String,
    /// What the tip feels of it.
    pub impedance: ImpedanceSpec,
    /// What it can do on purpose.
    pub intention: IntentionSpec,
    /// What it does against its will; zero amplitude: nothing.
    pub tremor: TremorSpec,
    /// How it holds, if it minds.
    pub grip: GripSpec,
    /// Whether it presses harder when what it holds slips.
    pub minds_slip: bool,
}

impl HandModel {
    /// The same hand told in the axes of a base that stands turned before the user: `R_WD` is the base's orientation.
    ///
    /// The numbers of a model are along the user's axes, which are W's: x right, y up, z to the user, and those of a
    /// Premium that stands straight before the user, as in the experiments that they are from. A device that is
    /// turned does not turn the hand. What is kept is the diagonal of R^T K R: exact for quarter turns and where the
    /// three axes are alike, else without the coupling between axes, so that each axis still is a hand of its own.
    #[must_use]
    #[allow(non_snake_case)]
    pub fn in_base(&self, R_WD: &UnitQuaternion<f64>) -> Self {
        // Column i of R_WD is D's axis i in W.
        let share = R_WD.to_rotation_matrix().matrix().map(|cell| cell * cell).transpose();
        let turn = |along_w: Vector3<f64>| share * along_w;
        let both = |pair: &SpringDamper| SpringDamper {
            stiffness_n_per_m: turn(pair.stiffness_n_per_m),
            damping_n_s_per_m: turn(pair.damping_n_s_per_m),
        };
        let impedance = ImpedanceSpec {
            mass_kg: turn(self.impedance.mass_kg),
            grasp: both(&self.impedance.grasp),
            arm: both(&self.impedance.arm),
        };
        let squares = self.tremor.rms_m.component_mul(&self.tremor.rms_m);
        let tremor = TremorSpec { rms_m: turn(squares).map(f64::sqrt), ..self.tremor };
        Self { impedance, tremor, ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::model_file::{Firmness, builtin, parse};
    use super::*;
    use nalgebra::Rotation3;
    use std::f64::consts::FRAC_PI_2;
    use std::path::Path;

    fn pen() -> HandModel {
        parse(builtin("pen-grip").unwrap(), Path::new("pen-grip"), Firmness::Usual).unwrap()
    }

    #[test]
    fn a_straight_base_changes_nothing_and_a_quarter_turn_exchanges_axes() {
        assert_eq!(pen().in_base(&UnitQuaternion::identity()), pen());
        // D's x axis is the user's -z, D's z axis the user's x.
        let quarter = UnitQuaternion::from_scaled_axis(Vector3::y() * FRAC_PI_2);
        let (straight, turned) = (pen().impedance, pen().in_base(&quarter).impedance);
        let exchanged = |v: Vector3<f64>| Vector3::new(v.z, v.y, v.x);
        // cos(90 degrees) is 6e-17, its square nothing.
        assert!((turned.mass_kg - exchanged(straight.mass_kg)).norm() < 1e-15);
        let (of, to) = (straight.grasp.stiffness_n_per_m, turned.grasp.stiffness_n_per_m);
        assert!((to - exchanged(of)).norm() < 1e-12);
    }

    #[test]
    fn any_turn_keeps_the_diagonal_of_the_turned_matrix() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.8, 0.5));
        let rotation: Rotation3<f64> = turn.to_rotation_matrix();
        let stiffness = pen().impedance.arm.stiffness_n_per_m;
        let turned = rotation.inverse() * nalgebra::Matrix3::from_diagonal(&stiffness) * rotation;
        let kept = pen().in_base(&turn).impedance.arm.stiffness_n_per_m;
        // Some products of numbers of 300.
        assert!((kept - turned.diagonal()).norm() < 1e-11);
    }
}
