//! Layouts with a master, a camera and affine devices.

#![allow(non_snake_case)] // Frames are capital letters: X_WD takes D to W.

use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use world::{Layout, Placement};

fn parse(text: &str) -> Layout {
    Layout::parse(text, Path::new("l.toml")).expect("nothing is wrong")
}

fn pose(position: [f64; 3], axis: [f64; 3]) -> Isometry3<f64> {
    Isometry3::new(position.into(), axis.into())
}

const DEVICES: &str = "[[device]]\nposition_m = [0.0, 0.0, -0.4]\norientation_wxyz = [0.8, 0.0, 0.6, 0.0]\n\
    [[device]]\nposition_m = [0.3, 0.0, 0.0]\norientation_wxyz = [0.6, 0.0, 0.0, 0.8]\n";

/// A few products of numbers below 1, each rounded to 1.1e-16.
const ROUNDING: f64 = 2e-15;

#[test]
fn without_a_master_every_entry_is_in_the_world_bit_for_bit() {
    let (plain, mastered) = (parse(DEVICES), parse(&format!("master = 0\n{DEVICES}")));
    assert_eq!(plain.placement(0), mastered.placement(0));
    assert_eq!(plain.pose(0).translation.vector, Vector3::new(0.0, 0.0, -0.4));
    assert_eq!(plain.pose(1).translation.vector, Vector3::new(0.3, 0.0, 0.0));
    assert_eq!(plain.pose(5), Isometry3::identity());
    // Beside the master, not at the origin.
    assert_eq!(mastered.pose(5), mastered.pose(0));
}

#[test]
fn the_others_are_relative_to_the_master_and_the_master_to_the_camera() {
    let text = format!(
        "master = 0\nattached_to = \"camera\"\n[camera]\nposition_m = [0.1, 0.5, 1.0]\n\
         orientation_wxyz = [0.6, 0.8, 0.0, 0.0]\n{DEVICES}"
    );
    let layout = parse(&text);
    let X_WC = Isometry3::from_parts(
        Translation3::new(0.1, 0.5, 1.0),
        UnitQuaternion::new_normalize(nalgebra::Quaternion::new(0.6, 0.8, 0.0, 0.0)),
    );
    let (X_CM, X_MD) = (parse(DEVICES).pose(0), parse(DEVICES).pose(1));
    let p_D = Point3::new(0.01, 0.02, 0.03);
    assert!((layout.pose(0) * p_D - X_WC * X_CM * p_D).norm() < ROUNDING);
    assert!((layout.pose(1) * p_D - X_WC * X_CM * X_MD * p_D).norm() < ROUNDING);
    assert_eq!(layout.camera(), Some(X_WC));

    let elsewhere = pose([1.0, 2.0, 3.0], [0.0, 1.0, 0.0]);
    let moved = layout.with_camera(elsewhere);
    assert!((moved.pose(1) * p_D - elsewhere * X_CM * X_MD * p_D).norm() < 4.0 * ROUNDING);
    // The devices' places relative to each other are the calibration, which no camera changes.
    let between = |layout: &Layout| layout.pose(0).inverse() * layout.pose(1);
    assert!((between(&moved) * p_D - X_MD * p_D).norm() < 4.0 * ROUNDING);
}

#[test]
fn a_camera_without_devices_attached_moves_nothing() {
    let layout = parse(&format!("master = 1\nattached_to = \"world\"\n{DEVICES}"));
    assert_eq!(layout.clone().with_camera(pose([1.0, 0.0, 0.0], [0.0; 3])), layout);
    assert_eq!((layout.master(), layout.camera()), (Some(1), None));
}

#[test]
fn a_matrix_is_read_by_rows() {
    let layout =
        parse("[[device]]\nposition_m = [1, 2, 3]\nmatrix = [[1, 0.1, 0], [0, 1, 0], [0, 0, 0.9]]\n");
    let placed = layout.placement(0);
    assert_eq!(placed.rigid(), None);
    assert_eq!(placed.apply(&Vector3::new(0.0, 1.0, 1.0)), Vector3::new(1.1, 3.0, 3.9));
}

fn any_placement() -> impl Strategy<Value = Placement> {
    let numbers = (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform3(-3.0..3.0f64));
    (numbers, prop::option::of(prop::array::uniform9(-0.1..0.1f64))).prop_map(|((position, axis), shape)| {
        let rigid = pose(position, axis);
        match shape {
            None => Placement::Rigid(rigid),
            Some(shape) => {
                let turn = rigid.rotation.to_rotation_matrix().into_inner();
                let matrix = turn * (Matrix3::identity() + Matrix3::from_row_slice(&shape));
                Placement::affine(matrix, position.into()).expect("stretches of 0.7 to 1.3")
            }
        }
    })
}

proptest! {
    #[test]
    fn an_inverse_undoes_and_a_product_is_one_after_the_other(
        a in any_placement(), b in any_placement(), p in prop::array::uniform3(-1.0..1.0f64),
    ) {
        let p = Vector3::from(p);
        // Numbers up to 5, twice a condition up to 2.
        prop_assert!((a.inverse().apply(&a.apply(&p)) - p).norm() < 20.0 * ROUNDING);
        prop_assert!((a.then(&b).apply(&p) - a.apply(&b.apply(&p))).norm() < 20.0 * ROUNDING);
    }

    #[test]
    fn what_is_written_for_a_device_places_it_there(wanted in any_placement(), device in 0usize..4, master in 0usize..4) {
        for text in ["".to_owned(), format!("master = {master}\n"),
            format!("master = {master}\nattached_to = \"camera\"\n[camera]\nposition_m = [1, 2, 3]\n")] {
            let layout = parse(&format!("{text}{DEVICES}"));
            let entry = layout.entry_of(device, &wanted);
            // The device's placement is linear in its entry, so an entry put into the place of the old one shows it.
            let outer = match layout.master() {
                Some(m) if m == device => layout.camera().map_or_else(Placement::identity, Placement::Rigid),
                Some(m) => layout.placement(m),
                None => Placement::identity(),
            };
            let p = Vector3::new(0.1, 0.2, 0.3);
            prop_assert!((outer.then(&entry).apply(&p) - wanted.apply(&p)).norm() < 50.0 * ROUNDING);
        }
    }
}
