//! A device's peak: no force beyond it, and none that is not a number.

use nalgebra::Vector3;

/// Cuts a force to a device's peak, keeping its direction. Returns whether it had to. A force that is not
/// finite is a defect of the caller's and becomes zero.
pub fn limit_force(force: Vector3<f64>, peak_n: f64) -> (Vector3<f64>, bool) {
    if !force.iter().all(|component| component.is_finite()) {
        return (Vector3::zeros(), true);
    }
    // The largest component is divided out first: the square of a large finite force is infinite.
    let largest = force.amax();
    if largest == 0.0 {
        return (force, false);
    }
    let direction = force / largest;
    let norm = direction.norm();
    if largest <= peak_n / norm { (force, false) } else { (direction * (peak_n / norm), true) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_limited_force_keeps_its_direction_and_respects_the_peak(
            x in proptest::num::f64::NORMAL, y in proptest::num::f64::NORMAL, z in proptest::num::f64::NORMAL,
            peak in 0.0..100.0f64,
        ) {
            let force = Vector3::new(x, y, z);
            let (limited, was_cut) = limit_force(force, peak);
            // Four roundings (two divisions, the norm, a product) of half an ulp each.
            prop_assert!(limited.norm() <= peak * (1.0 + 1e-15));
            if was_cut {
                let unit = force / force.amax();
                let turned = limited.cross(&unit).norm();
                prop_assert!(turned <= 1e-14 * peak * unit.norm());
            } else {
                prop_assert_eq!(limited, force);
            }
        }
    }

    #[test]
    fn the_peak_is_one_of_length_in_every_direction() {
        for direction in [[1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, -3.0, 4.0], [1.0, 2.0, -2.0]] {
            let unit = Vector3::from(direction).normalize();
            assert_eq!(limit_force(unit * 8.499, 8.5), (unit * 8.499, false), "{direction:?}");
            let (limited, was_cut) = limit_force(unit * 8.501, 8.5);
            assert!(was_cut && (limited - unit * 8.5).norm() < 1e-14, "{direction:?}: {limited}");
        }
    }

    #[test]
    fn a_force_that_is_not_finite_becomes_zero() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(limit_force(Vector3::new(1.0, bad, 0.0), 8.5), (Vector3::zeros(), true));
        }
        let huge = Vector3::repeat(f64::MAX);
        assert_eq!(
            limit_force(huge, f64::INFINITY),
            (huge, false),
            "no limit leaves everything finite alone"
        );
    }
}
