//! Outliers, and data that determine nothing.

mod support;

use calibration::{CalibrationError, Gathering, Model, Pair, PairsError, Transform, calibrate, parse_pairs};
use nalgebra::{Matrix3, Vector3};
use support::{Random, WIDE, angle_between, pairs_of, rigid_truth};

#[track_caller]
fn refused(pairs: &[Pair], model: Model) -> CalibrationError {
    calibrate(pairs, model).expect_err("nothing that determines a transform")
}

#[test]
fn pairs_whose_points_had_come_apart_are_found_and_do_not_count() {
    let mut pairs = pairs_of(&rigid_truth(), 200, WIDE, 1e-4, 11);
    // A quarter less ten: all to the same side, which is what pulls a fit along.
    let bad: Vec<usize> = (0..40).map(|i| i * 5).collect();
    for index in &bad {
        pairs[*index].fiducial += Vector3::new(0.02, 0.01, 0.0);
    }
    let found = calibrate(&pairs, Model::Rigid).expect("enough are good");
    let lines: Vec<usize> = found.outliers.listed.iter().map(|outlier| outlier.line).collect();
    assert_eq!(lines, bad.iter().map(|index| index + 1).collect::<Vec<_>>());
    let without = found.without_outliers.as_ref().expect("there are outliers");
    let accuracy = without.accuracy.expect("160 pairs");
    let off = (without.transform.position - rigid_truth().position).amax();
    // Four standard errors, which one calibration in 16,000 exceeds; this one is always the same.
    assert!(off < 4.0 * accuracy.position_m[0], "{off} {accuracy:?}");
    assert!(angle_between(&without.transform.matrix, &rigid_truth().matrix) < 8.0 * accuracy.rotation_rad[0]);
    // The fit to all is off by a fifth of what the outliers are.
    assert!(
        (found.all.transform.apply(&without.spread_other.centre)
            - without.transform.apply(&without.spread_other.centre))
        .norm()
            > 0.15 * 0.0223
    );
}

#[test]
fn bad_pairs_at_one_end_that_pull_the_fit_to_themselves_are_found() {
    // Where the arms reach furthest the end points come apart: the leverage is theirs. A fit to all pairs leaves the
    // bad ones so little that many good ones lie further from it.
    let mut pairs = pairs_of(&rigid_truth(), 200, WIDE, 1e-4, 5);
    let mut by_x: Vec<usize> = (0..pairs.len()).collect();
    by_x.sort_by(|a, b| pairs[*b].other.x.total_cmp(&pairs[*a].other.x));
    let mut bad = by_x[..40].to_vec();
    bad.sort_unstable();
    for index in &bad {
        pairs[*index].other += Vector3::new(0.0, 0.03, 0.03);
    }
    let found = calibrate(&pairs, Model::Rigid).expect("enough are good");
    let lines: Vec<usize> = found.outliers.listed.iter().map(|outlier| outlier.line).collect();
    assert_eq!(lines, bad.iter().map(|index| index + 1).collect::<Vec<_>>());
}

#[test]
fn good_pairs_are_not_called_outliers() {
    // 2000 pairs of 20 seeds: 1 in 65,000 would be 0.6 in all; four is beyond 1 in 300.
    let listed = |seed: u64| {
        let pairs = pairs_of(&rigid_truth(), 2000, WIDE, 1e-4, 100 + seed);
        calibrate(&pairs, Model::Rigid).expect("good pairs").outliers.listed.len()
    };
    let all: usize = (0..20u64).map(listed).sum();
    assert!(all <= 4, "{all}");
}

#[test]
fn one_bad_pair_among_exact_ones_is_found_by_its_line() {
    let mut pairs = pairs_of(&rigid_truth(), 12, WIDE, 0.0, 1);
    pairs[4].other.z += 1e-3;
    for model in [Model::Rigid, Model::Affine] {
        let found = calibrate(&pairs, model).expect("eleven good pairs");
        assert_eq!(found.outliers.listed.len(), 1, "{:?}", found.outliers);
        assert_eq!(found.outliers.listed[0].line, 5);
    }
}

#[test]
fn too_few_pairs_are_refused() {
    let pairs = pairs_of(&rigid_truth(), 3, WIDE, 0.0, 1);
    assert_eq!(
        refused(&pairs[..2], Model::Rigid),
        CalibrationError::TooFew { found: 2, needed: 3, model: "rigid" }
    );
    assert_eq!(
        refused(&pairs, Model::Affine),
        CalibrationError::TooFew { found: 3, needed: 4, model: "affine" }
    );
    assert_eq!(refused(&[], Model::Rigid), CalibrationError::TooFew { found: 0, needed: 3, model: "rigid" });
}

#[test]
fn a_line_is_refused_for_both_with_noise_or_without() {
    for noise_m in [0.0, 1e-4] {
        for model in [Model::Rigid, Model::Affine] {
            let mut random = Random::new(9);
            let mut pairs = pairs_of(&rigid_truth(), 400, [0.3, 0.0, 0.0], noise_m, 9);
            for pair in &mut pairs {
                pair.other += random.normal3() * noise_m;
            }
            let error = refused(&pairs, model);
            assert!(matches!(error, CalibrationError::Collinear { .. }), "{noise_m} {model:?} {error}");
        }
    }
}

#[test]
fn a_plane_is_refused_for_an_affine_transform_only() {
    for noise_m in [0.0, 1e-4] {
        let mut random = Random::new(9);
        let mut pairs = pairs_of(&rigid_truth(), 400, [0.3, 0.2, 0.0], noise_m, 9);
        for pair in &mut pairs {
            pair.other += random.normal3() * noise_m;
        }
        assert!(calibrate(&pairs, Model::Rigid).is_ok());
        let error = refused(&pairs, Model::Affine);
        assert!(matches!(error, CalibrationError::Coplanar { .. }), "{error}");
        assert!(error.to_string().contains("rigid"), "{error}");
    }
}

#[test]
fn a_line_that_outliers_make_look_thick_is_still_a_line() {
    let mut pairs = pairs_of(&rigid_truth(), 100, [0.3, 0.0, 0.0], 1e-5, 3);
    for index in [3, 50, 77] {
        let aside = Vector3::new(0.0, 0.05, 0.04);
        pairs[index].other += aside;
        pairs[index].fiducial -= aside;
    }
    assert!(matches!(refused(&pairs, Model::Rigid), CalibrationError::Collinear { .. }));
}

#[test]
fn millimetres_are_recognised() {
    let scaled = |by_fiducial: f64, by_other: f64| -> Vec<Pair> {
        let pairs = pairs_of(&rigid_truth(), 20, WIDE, 0.0, 1);
        let scale = |p: Pair| Pair { fiducial: p.fiducial * by_fiducial, other: p.other * by_other, ..p };
        pairs.into_iter().map(scale).collect()
    };
    for (pairs, whose) in [(scaled(1e3, 1e3), "fiducial"), (scaled(1.0, 1e3), "other device")] {
        let error = refused(&pairs, Model::Rigid).to_string();
        assert!(error.contains(whose) && error.contains("millimetres"), "{error}");
    }
}

#[test]
fn a_device_that_stood_still_is_refused() {
    let mut pairs = pairs_of(&rigid_truth(), 20, WIDE, 0.0, 1);
    for pair in &mut pairs {
        pair.other = Vector3::new(0.1, 0.1, 0.1);
    }
    assert!(matches!(
        refused(&pairs, Model::Rigid),
        CalibrationError::HardlyMoved { whose: "other device", .. }
    ));
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_their_line() {
    let mut pairs = pairs_of(&rigid_truth(), 20, WIDE, 0.0, 1);
    pairs[6].fiducial.y = f64::NAN;
    assert_eq!(refused(&pairs, Model::Affine), CalibrationError::NotFinite { line: 7 });
}

#[test]
fn a_left_handed_device_is_refused() {
    let truth = rigid_truth();
    let mirrored =
        Transform { matrix: truth.matrix * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)), ..truth };
    for model in [Model::Rigid, Model::Affine] {
        let error = refused(&pairs_of(&mirrored, 100, WIDE, 1e-4, 1), model);
        assert!(matches!(error, CalibrationError::Mirrored { .. }), "{error}");
    }
}

#[test]
fn points_that_have_nothing_to_do_with_each_other_are_refused() {
    let mut random = Random::new(2);
    let mut pairs = pairs_of(&rigid_truth(), 100, WIDE, 0.0, 1);
    for pair in &mut pairs {
        pair.fiducial = random.in_box(WIDE);
    }
    for model in [Model::Rigid, Model::Affine] {
        let error = refused(&pairs, model);
        assert!(matches!(error, CalibrationError::Unrelated { .. }), "{error}");
    }
}

#[test]
fn files_of_matlab_spreadsheets_and_people_are_read_alike() {
    let rows = [
        "\u{feff}xf,yf,zf,xn,yn,zn\r\n1,2,3,4,5,6\r\n1e-1, 2 ,3,4,5,6.5\r\n\r\n",
        "% saved by hand\n   1.0000000e+00   2.0000000e+00 3 4 5 6\n\t0.1 2 3 4 5 6.5 % suspect\n",
        "1;2;3;4;5;6\n0.1;2;3;4;5;6.5\n",
    ];
    for text in rows {
        let pairs = parse_pairs(text).expect(text);
        assert_eq!(pairs.len(), 2, "{text}");
        assert_eq!(pairs[0].fiducial, Vector3::new(1.0, 2.0, 3.0));
        assert_eq!((pairs[1].fiducial.x, pairs[1].other.z), (0.1, 6.5));
    }
    let lines: Vec<usize> = parse_pairs(rows[0]).expect("good").iter().map(|pair| pair.line).collect();
    assert_eq!(lines, [2, 3]);
    assert_eq!(parse_pairs(""), Ok(vec![]));
}

#[test]
fn mistakes_in_a_file_name_line_and_column() {
    for (text, message) in [
        ("1 2 3\n", "line 1: found 3 cells; allowed: 6, x y z of the fiducial"),
        ("1,2,3,4,5,6\n1,2,,4,5,6\n", "line 2, fiducial z: found ``; allowed: a finite number"),
        ("a,b,c,d,e,f\n1,2,3,4,nan,6\n", "line 2, other y: found `nan`"),
        ("1,2,3,4,5,6\na,b,c,d,e,f\n", "line 2, fiducial x: found `a`"),
        ("x,2,3,4,5,6\n", "line 1, fiducial x: found `x`"),
        ("1,2,3,4,5,6,7\n", "line 1: found 7 cells"),
        ("1 2 3 4 5 1e999\n", "line 1, other z: found `1e999`"),
    ] {
        let error = parse_pairs(text).expect_err(text);
        assert!(error.to_string().starts_with(message), "{text}: {error}");
    }
    assert!(matches!(parse_pairs(&"1 2 3 4 5 6\n".repeat(1_000_001)), Err(PairsError::TooMany { .. })));
}

#[test]
fn gathering_keeps_a_pair_for_each_place_and_says_where_to_move() {
    let mut gathering = Gathering::new(0.002);
    assert_eq!(gathering.coverage().wanting_axis(), Some(0));
    // Along x, back and forth, at a tenth of a millimetre a tick.
    for i in 0..4000 {
        let x = 0.1 * (f64::from(i) * 1e-3).sin();
        gathering.offer(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, x, 0.0));
    }
    // From -0.0757 to 0.1 in steps of 2 mm to 2.1 mm; the way back brings nothing new.
    assert!((80..=89).contains(&gathering.pairs().len()), "{}", gathering.pairs().len());
    let axis = gathering.coverage().wanting_axis().expect("y or z");
    assert!(axis == 1 || axis == 2);
    assert!(!gathering.coverage().is_enough());
    let mut random = Random::new(1);
    for _ in 0..1000 {
        let p = random.in_box([0.2, 0.2, 0.02]);
        gathering.offer(p, p);
    }
    assert_eq!(gathering.coverage().wanting_axis(), Some(2));
    for _ in 0..1000 {
        let p = random.in_box([0.2, 0.2, 0.2]);
        gathering.offer(p, p);
    }
    assert_eq!(gathering.coverage().wanting_axis(), None);
    assert!(gathering.coverage().is_enough());
    assert!(!gathering.offer(Vector3::new(f64::NAN, 0.0, 0.0), Vector3::zeros()));
}

#[test]
fn one_wild_pair_spoils_a_fit_to_all_and_not_one_without_it() {
    let mut pairs = pairs_of(&rigid_truth(), 200, WIDE, 1e-4, 13);
    pairs[16].fiducial.x += 2.0;
    let found = calibrate(&pairs, Model::Rigid).expect("199 are good");
    assert_eq!(found.outliers.listed.iter().map(|outlier| outlier.line).collect::<Vec<_>>(), [17]);
    assert!(matches!(found.all_refused, Some(CalibrationError::Unrelated { .. })), "{:?}", found.all_refused);
    let without = found.without_outliers.expect("there is one");
    // 0.1 mm of noise in 199 pairs.
    assert!((without.transform.position - rigid_truth().position).amax() < 1e-4);
}

#[test]
fn decimal_commas_are_told_as_such() {
    let among_commas = "0,1,0,2,0,3,-0,4,0,5,0,6";
    for row in ["0,1;0,2;0,3;-0,4;0,5;0,6", "0,1 0,2 0,3 -0,4 0,5 0,6", among_commas, "0,0,1,0,2,0,3,0"] {
        let said = parse_pairs(row).expect_err("commas").to_string();
        assert!(said.ends_with("; a decimal number has a point, as in 0.1"), "{said}");
    }
    for row in ["1;2;3;4;5;6;7", "1,2,3,4,5,6,7", "0.1,2,3,4,5,6,7,8"] {
        let said = parse_pairs(row).expect_err("no six").to_string();
        assert!(said.ends_with("in metres"), "{said}");
    }
    assert_eq!(parse_pairs("\"1\",\"2\", 3,4,5,6").expect("quotes are none of it").len(), 1);
}
