//! Torsional friction at its limit, against the closed form of a tick.
//!
//! One body turns about one axis: `I (w - w0) = dt T` with `T = rest - c w`, `c = k dt + b`, cut to `+-most`. Below the limit
//! that is linear in w; above it, the spin changes by `dt most / I`, against what drives the row.

use super::{DT, Noise};
use nalgebra::{Matrix3, Vector3};
use physics::{Motion, Row, Solver, Torsion};

/// Spin and torque at the end of the tick.
fn closed_form(inertia: f64, w0: f64, torsion: &Torsion) -> (f64, f64) {
    let c = torsion.stiffness_nm_per_rad * DT + torsion.damping_nm_s_per_rad;
    let w = (inertia * w0 + DT * torsion.rest_nm) / (inertia + DT * c);
    let torque_nm = torsion.rest_nm - c * w;
    if torque_nm.abs() <= torsion.most_nm {
        return (w, torque_nm);
    }
    let torque_nm = torsion.most_nm.copysign(torque_nm);
    (w0 + DT * torque_nm / inertia, torque_nm)
}

fn spinning(axis_W: Vector3<f64>, inertia: f64, w0: f64) -> Motion {
    Motion {
        velocity_W: Vector3::zeros(),
        angular_velocity_W: axis_W * w0,
        inverse_mass: 20.0,
        inverse_inertia_W: Matrix3::from_diagonal_element(1.0 / inertia),
    }
}

/// Spin, torque and rounds of a body with one such row about a slanted axis.
fn solved(inertia: f64, w0: f64, torsion: Torsion) -> (f64, f64, usize) {
    let axis_W = Vector3::new(2.0, -1.0, 2.0) / 3.0;
    let (mut rows, mut motions) = ([Row::turning(0, axis_W, torsion)], [spinning(axis_W, inertia, w0)]);
    let made = Solver::with_capacity(1, 1).solve(&mut rows, &mut motions, DT);
    assert_eq!(made.unsolved, 0);
    (axis_W.dot(&motions[0].angular_velocity_W), rows[0].torsion.torque_nm, made.sweeps)
}

/// A pad of 0.5 N m/rad on a cube of 50 g, which holds 8 mN m.
const PAD: Torsion = Torsion {
    rest_nm: 0.0,
    stiffness_nm_per_rad: 0.5,
    damping_nm_s_per_rad: 2e-4,
    most_nm: 8e-3,
    torque_nm: 0.0,
};
const INERTIA: f64 = 2e-5;

#[test]
fn a_row_holds_exactly_up_to_its_torque_and_slips_above_with_that_torque() {
    for sign in [1.0, -1.0] {
        // At rest, pushed by its own spring to just below and just above the limit at the end of the tick.
        let c = PAD.stiffness_nm_per_rad * DT + PAD.damping_nm_s_per_rad;
        let rest_at_limit_nm = PAD.most_nm * (1.0 + DT * c / INERTIA);
        for (share, slips) in [(1.0 - 1e-9, false), (1.0 + 1e-9, true), (3.0, true)] {
            let torsion = Torsion { rest_nm: sign * share * rest_at_limit_nm, ..PAD };
            let (spin, torque_nm, _) = solved(INERTIA, 0.0, torsion);
            let (expected_spin, expected_nm) = closed_form(INERTIA, 0.0, &torsion);
            assert!((spin - expected_spin).abs() <= 1e-13 * expected_spin.abs(), "{sign} {share}: {spin}");
            assert!((torque_nm - expected_nm).abs() <= 1e-13 * PAD.most_nm, "{sign} {share}: {torque_nm}");
            assert_eq!(torque_nm == sign * PAD.most_nm, slips, "{sign} {share}: {torque_nm}");
        }
    }
}

#[test]
fn a_row_that_slips_resists_with_all_its_torque_and_never_turns_the_body_back() {
    for w0 in [100.0, 40.0, 1.0, -1.0, -40.0, -100.0f64] {
        for rest_nm in [0.0, -4e-3, 4e-3, -0.3, 0.3] {
            let torsion = Torsion { rest_nm, damping_nm_s_per_rad: 0.01, ..PAD };
            let (spin, torque_nm, rounds) = solved(INERTIA, w0, torsion);
            let (expected_spin, expected_nm) = closed_form(INERTIA, w0, &torsion);
            let name = format!("{w0} rad/s, {rest_nm} N m");
            assert!((spin - expected_spin).abs() <= 1e-12 * w0.abs(), "{name}: {spin} {expected_spin}");
            assert!(
                (torque_nm - expected_nm).abs() <= 1e-12 * PAD.most_nm,
                "{name}: {torque_nm} {expected_nm}"
            );
            if rest_nm == 0.0 {
                assert!(torque_nm * w0 < 0.0 && spin * w0 >= 0.0, "{name}: a brake turns nothing back");
            }
            // One step to where the row holds or slips, one to the answer, and one that a chord saves.
            assert!(rounds <= 3, "{name}: {rounds} rounds");
        }
    }
}

/// Newton's whole step leads from one side of a row's limit to the other, where it is as far from the answer: by halving alone
/// it gets there slowly or not at all.
#[test]
fn rows_whose_torque_turns_over_within_the_tick_are_found_in_few_rounds() {
    let noise = &mut Noise::new(5);
    let (mut sum, count) = (0, 4000);
    for seed in 0..count {
        let inertia = noise.log_within(1e-8, 1e-3);
        let torsion = Torsion {
            rest_nm: noise.within(-1.0, 1.0) * noise.log_within(1e-4, 1.0),
            stiffness_nm_per_rad: noise.within(0.0, 2.0),
            damping_nm_s_per_rad: noise.log_within(1e-6, 1.0),
            most_nm: noise.log_within(1e-4, 0.1),
            torque_nm: if noise.chance(0.5) { 0.0 } else { noise.within(-0.1, 0.1) },
        };
        let w0 = noise.within(-1.0, 1.0) * noise.log_within(0.1, 1e3);
        let (spin, torque_nm, rounds) = solved(inertia, w0, torsion);
        let (expected_spin, expected_nm) = closed_form(inertia, w0, &torsion);
        // 1e-13 of the torque in force; the spin is what that leaves of w0.
        let scale = w0.abs() + DT * torsion.most_nm / inertia;
        assert!(
            (spin - expected_spin).abs() <= 1e-11 * scale,
            "seed {seed}: {spin} {expected_spin}, {torsion:?}"
        );
        let c = torsion.stiffness_nm_per_rad * DT + torsion.damping_nm_s_per_rad;
        let tolerance_nm = 1e-11 * (torsion.most_nm + c * scale.min(torsion.most_nm / c));
        assert!((torque_nm - expected_nm).abs() <= tolerance_nm, "seed {seed}: {torque_nm} {expected_nm}");
        sum += rounds;
    }
    // Found 1.6 in the mean.
    assert!(sum < 2 * count, "{sum} rounds for {count} bodies");
}

/// Several pads about axes of their own on one light body: whichever turn over, the answer is that of each row by itself.
#[test]
fn several_rows_that_turn_over_within_the_tick_agree_with_the_spin_that_they_leave() {
    let noise = &mut Noise::new(6);
    let (mut sum, mut at_limit, mut below, count) = (0, 0, 0, 4000);
    for seed in 0..count {
        let inertia = noise.log_within(1e-8, 1e-5);
        let mut rows: Vec<Row> = (0..2 + noise.below(5))
            .map(|_| {
                let torsion = Torsion {
                    rest_nm: noise.within(-1.0, 1.0) * noise.log_within(1e-3, 1.0),
                    stiffness_nm_per_rad: noise.within(0.0, 2.0),
                    damping_nm_s_per_rad: noise.log_within(1e-6, 1.0),
                    most_nm: noise.log_within(1e-4, 0.1),
                    torque_nm: 0.0,
                };
                Row::turning(0, noise.direction(), torsion)
            })
            .collect();
        let mut motions = [spinning(noise.direction(), inertia, noise.within(-100.0, 100.0))];
        let before = motions[0];
        let made = Solver::with_capacity(8, 1).solve(&mut rows, &mut motions, DT);
        sum += made.sweeps;
        assert_eq!(made.unsolved, 0, "seed {seed}");
        let spin_W = motions[0].angular_velocity_W;
        let torque_W: Vector3<f64> = rows.iter().map(|row| row.normal_W * row.torsion.torque_nm).sum();
        let left = (spin_W - before.angular_velocity_W) * inertia - torque_W * DT;
        let largest_nm = rows.iter().map(|row| row.torsion.most_nm).fold(0.0, f64::max);
        assert!(left.norm() <= 1e-12 * (largest_nm * DT + inertia * 100.0), "seed {seed}: {left}");
        for row in &rows {
            let t = &row.torsion;
            let c = t.stiffness_nm_per_rad * DT + t.damping_nm_s_per_rad;
            let asked_nm = (t.rest_nm - c * row.normal_W.dot(&spin_W)).clamp(-t.most_nm, t.most_nm);
            // What is left of the spin comes back by the row's damping.
            let stiff = 1.0 + c * DT / inertia;
            assert!(
                (asked_nm - t.torque_nm).abs() <= 1e-8 * largest_nm * stiff,
                "seed {seed}: {asked_nm}, {t:?}"
            );
            if t.torque_nm.abs() == t.most_nm { at_limit += 1 } else { below += 1 }
        }
    }
    assert!(at_limit > 5000 && below > 5000, "{at_limit} {below}");
    // Found 4.2 in the mean.
    assert!(sum < 5 * count, "{sum} rounds for {count} bodies");
}

/// A ball on one point without sliding friction: `m (u - u0) = dt N` with `N = rest - c u`, and the
/// spin changes by `dt s N / I` about the normal and across it. What does not press does not turn
/// either, whatever it did a tick ago.
#[test]
fn torques_that_grow_with_what_presses_are_those_of_the_same_tick() {
    let (n, mass, inertia) = (Vector3::new(2.0, 1.0, -2.0) / 3.0, 0.05, 2e-5);
    let across = Vector3::new(1.0, 0.0, 1.0) / 2.0_f64.sqrt();
    let [about_m, across_m] = [3e-4, 2e-4];
    for u0 in [-0.5, -0.01, 0.0, 0.003, 0.5] {
        let resists = |most_nm| Torsion { damping_nm_s_per_rad: 0.1, most_nm, torque_nm: 1e-3, ..PAD };
        let mut row = Row::turning(0, n, resists(0.0));
        row.rolling.damping_nm_s_per_rad = 0.1;
        row.rolling.torque_W = across * 1e-3;
        row.turning_m = [about_m, across_m];
        row.arms_W[0] = n * -0.01;
        (row.stiffness[0], row.damping[0], row.rest_W) = (2e5, 20.0, n * 0.5);
        let spin_W = n * 200.0 - across * 300.0;
        let mut motions = [Motion {
            velocity_W: n * u0,
            angular_velocity_W: spin_W,
            inverse_mass: 1.0 / mass,
            inverse_inertia_W: Matrix3::from_diagonal_element(1.0 / inertia),
        }];
        let mut rows = [row];
        let made = Solver::with_capacity(1, 1).solve(&mut rows, &mut motions, DT);
        assert_eq!(made.unsolved, 0);
        let c = 2e5 * DT + 20.0;
        let presses_n = ((0.5 - c * u0) / (1.0 + DT * c / mass)).max(0.0);
        let expected_W = (across * across_m - n * about_m) * presses_n;
        let found_W = n * rows[0].torsion.torque_nm + rows[0].rolling.torque_W;
        // Roundings of numbers of that size.
        assert!((found_W - expected_W).norm() <= 1e-12 * (presses_n + 1.0) * about_m, "{u0}: {found_W}");
        let turned_W = motions[0].angular_velocity_W - spin_W - expected_W * (DT / inertia);
        assert!(turned_W.norm() < 1e-9, "{u0}: {turned_W}");
        assert_eq!(presses_n == 0.0, rows[0].force_W == Vector3::zeros(), "{u0}");
    }
}
