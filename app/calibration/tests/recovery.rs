//! What is found from pairs without noise, and that it is the thesis' own answer.

#![allow(non_snake_case)] // P_F and P_N, as in the equation.

mod support;

use calibration::{Model, Pair, Transform, calibrate};
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use support::{Random, WIDE, affine_truth, angle_between, pairs_of, rigid_truth};

/// Centres, cross-covariance and SVD round some hundred numbers below 1 for every pair, each to 1.1e-16, and rounding
/// adds as a random walk: sqrt(1e5) * 1.1e-16 = 4e-14. The condition of the boxes (at most 100) multiplies that.
const ROUNDING: f64 = 4e-12;

#[track_caller]
fn assert_near(found: &Transform, truth: &Transform, tolerance: f64) {
    assert!((found.matrix - truth.matrix).amax() < tolerance, "{found:?}\n{truth:?}");
    assert!((found.position - truth.position).amax() < tolerance, "{found:?}\n{truth:?}");
}

#[test]
fn a_rigid_transform_is_recovered_to_rounding() {
    for (count, edges) in [(3, WIDE), (4, WIDE), (500, WIDE), (500, [0.3, 0.02, 0.01])] {
        let found =
            calibrate(&pairs_of(&rigid_truth(), count, edges, 0.0, 7), Model::Rigid).expect("good pairs");
        assert_near(&found.all.transform, &rigid_truth(), ROUNDING);
        assert!(found.all.residuals.max_m < ROUNDING && found.outliers.listed.is_empty(), "{found:?}");
    }
}

#[test]
fn an_affine_transform_is_recovered_to_rounding_and_its_shape_is_told() {
    for count in [4, 500] {
        let found =
            calibrate(&pairs_of(&affine_truth(), count, WIDE, 0.0, 7), Model::Affine).expect("good pairs");
        assert_near(&found.all.transform, &affine_truth(), ROUNDING);
        let shape = found.all.transform.shape();
        // The columns of the shape matrix that `affine_truth` multiplies by; turning keeps lengths and angles.
        assert!((shape.scale[0] - 1.02f64.hypot(0.02)).abs() < ROUNDING, "{shape:?}");
        assert!((shape.scale[1] - 0.01f64.hypot(0.97).hypot(0.03)).abs() < ROUNDING, "{shape:?}");
        let closed = (1.02 * 0.01 - 0.02 * 0.97) / (shape.scale[0] * shape.scale[1]);
        assert!((shape.shear_rad[0] - closed.asin()).abs() < ROUNDING, "{shape:?}");
        assert!((shape.volume - affine_truth().matrix.determinant()).abs() < ROUNDING, "{shape:?}");
    }
}

#[test]
fn a_plane_is_enough_for_a_rigid_transform() {
    let found =
        calibrate(&pairs_of(&rigid_truth(), 50, [0.3, 0.2, 0.0], 0.0, 3), Model::Rigid).expect("a plane");
    assert_near(&found.all.transform, &rigid_truth(), ROUNDING);
}

/// `P_F P_N^T (P_N P_N^T)^-1` of homogeneous columns, to the letter.
//= melder#5.4 type=test
fn thesis(pairs: &[Pair]) -> Transform {
    let homogeneous = |point: fn(&Pair) -> Vector3<f64>| {
        DMatrix::from_fn(4, pairs.len(), |i, j| if i < 3 { point(&pairs[j])[i] } else { 1.0 })
    };
    let (P_F, P_N) = (homogeneous(|pair| pair.fiducial), homogeneous(|pair| pair.other));
    let inverse = (&P_N * P_N.transpose()).try_inverse().expect("not degenerate");
    let T = P_F * P_N.transpose() * inverse;
    let position = T.fixed_view::<3, 1>(0, 3).into_owned();
    Transform { matrix: T.fixed_view::<3, 3>(0, 0).into_owned(), position }
}

#[test]
fn the_affine_fit_is_the_formula_of_the_thesis() {
    for seed in 0..20 {
        // With noise, so that the formula chooses among imperfect transforms.
        let pairs = pairs_of(&affine_truth(), 100, WIDE, 1e-3, seed);
        let found = calibrate(&pairs, Model::Affine).expect("good pairs");
        // The formula inverts the product, whose condition is the square: (1 / 0.04)^2 = 600, and 100 columns add.
        assert_near(&found.all.transform, &thesis(&pairs), 1e-11);
    }
}

#[test]
fn a_rigid_fit_takes_no_noise_for_scale_and_the_affine_one_does() {
    let pairs = pairs_of(&rigid_truth(), 30, WIDE, 1e-3, 5);
    let shape = |model| calibrate(&pairs, model).expect("good pairs").all.transform.shape();
    assert!((shape(Model::Rigid).volume - 1.0).abs() < ROUNDING);
    // 1 mm in 43 mm RMS over sqrt(30) pairs: 4e-3 per direction. A tenth of it would be luck.
    assert!((shape(Model::Affine).volume - 1.0).abs() > 4e-4);
}

fn any_turn() -> impl Strategy<Value = Matrix3<f64>> {
    prop::array::uniform3(-3.0..3.0f64).prop_map(|axis| Rotation3::new(Vector3::from(axis)).into_inner())
}

fn any_place() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-0.9..0.9f64).prop_map(Vector3::from)
}

proptest! {
    #[test]
    fn no_rotation_is_ever_a_reflection(seed: u64, thickness in 0.0..0.05f64, noise in 0.0..0.02f64, turn in any_turn()) {
        let truth = Transform { matrix: turn, position: Vector3::new(0.1, 0.2, 0.3) };
        // Thin and noisy slabs are where the unconstrained answer flips over.
        let pairs = pairs_of(&truth, 6, [0.3, 0.2, thickness], noise, seed);
        if let Ok(found) = calibrate(&pairs, Model::Rigid) {
            for fit in [Some(&found.all), found.without_outliers.as_ref()].into_iter().flatten() {
                let matrix = fit.transform.matrix;
                prop_assert!((matrix.determinant() - 1.0).abs() < ROUNDING);
                prop_assert!((matrix * matrix.transpose() - Matrix3::identity()).amax() < ROUNDING);
            }
        }
    }

    #[test]
    fn moving_the_fiducials_base_moves_the_answer_and_nothing_else(
        seed in 0u64..1000, turn in any_turn(), place in any_place(),
    ) {
        for model in [Model::Rigid, Model::Affine] {
            let pairs = pairs_of(&rigid_truth(), 40, WIDE, 1e-4, seed);
            let moved: Vec<Pair> =
                pairs.iter().map(|pair| Pair { fiducial: turn * pair.fiducial + place, ..*pair }).collect();
            let (before, after) = (calibrate(&pairs, model).unwrap(), calibrate(&moved, model).unwrap());
            let truth = Transform {
                matrix: turn * before.all.transform.matrix,
                position: turn * before.all.transform.position + place,
            };
            prop_assert!((after.all.transform.matrix - truth.matrix).amax() < ROUNDING);
            prop_assert!((after.all.transform.position - truth.position).amax() < ROUNDING);
            prop_assert!((after.all.residuals.rms_m - before.all.residuals.rms_m).abs() < ROUNDING);
        }
    }

    #[test]
    fn the_order_of_the_pairs_does_not_matter(seed in 0u64..1000, shift in 1usize..39) {
        let pairs = pairs_of(&rigid_truth(), 40, WIDE, 1e-4, seed);
        let mut turned = pairs.clone();
        turned.rotate_left(shift);
        let (a, b) = (calibrate(&pairs, Model::Rigid).unwrap(), calibrate(&turned, Model::Rigid).unwrap());
        prop_assert!((a.all.transform.matrix - b.all.transform.matrix).amax() < ROUNDING);
        prop_assert_eq!(a.outliers.listed.len(), b.outliers.listed.len());
    }

    #[test]
    fn exchanging_the_devices_inverts_a_rigid_transform(seed in 0u64..1000) {
        let pairs = pairs_of(&rigid_truth(), 40, WIDE, 1e-4, seed);
        let exchanged: Vec<Pair> =
            pairs.iter().map(|pair| Pair { fiducial: pair.other, other: pair.fiducial, ..*pair }).collect();
        let forth = calibrate(&pairs, Model::Rigid).unwrap().all.transform;
        let back = calibrate(&exchanged, Model::Rigid).unwrap().all.transform;
        prop_assert!(angle_between(&forth.matrix, &back.matrix.transpose()) < ROUNDING);
        prop_assert!((forth.matrix * back.position + forth.position).amax() < ROUNDING);
    }
}

#[test]
fn the_noise_of_the_tests_is_what_it_says() {
    let mut random = Random::new(1);
    let sum: f64 = (0..100_000).map(|_| random.normal().powi(2)).sum();
    // The variance of 100,000 squares: sqrt(2 / 1e5) = 0.0045; four times that.
    assert!((sum / 1e5 - 1.0).abs() < 0.018, "{sum}");
}
