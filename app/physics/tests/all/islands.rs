//! Bodies that press each other: which they are, and that their forces are found together.
#![allow(non_snake_case)]

use crate::noise;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use noise::Noise;
use physics::{Held, Islands, Motion, Rolling, Row, Solver, Torsion};

const DT: f64 = 1e-3;
const G: f64 = 9.81;

fn motion(noise: &mut Noise, mass: f64) -> Motion {
    let size = (mass / 1000.0).cbrt();
    let turn = noise.turn().to_rotation_matrix();
    let moments = Vector3::from_fn(|_, _| mass * size * size * noise.within(0.1, 0.2));
    Motion {
        velocity_W: noise.vector(0.5),
        angular_velocity_W: noise.vector(2.0),
        inverse_mass: 1.0 / mass,
        inverse_inertia_W: turn.matrix()
            * Matrix3::from_diagonal(&moments.map(f64::recip))
            * turn.matrix().transpose(),
    }
}

fn row(body: usize, other: Option<usize>) -> Row {
    Row {
        body,
        other,
        arms_W: [Vector3::zeros(); 2],
        normal_W: Vector3::y(),
        rest_W: Vector3::zeros(),
        stiffness: [0.0; 2],
        damping: [0.0; 2],
        mu_hold: 0.0,
        mu_slide: 0.0,
        held: Held::Stick,
        force_W: Vector3::zeros(),
        torsion: Torsion::default(),
        rolling: Rolling::default(),
        turning_m: [0.0; 2],
        tie_n: None,
    }
}

/// Bodies that are pressed here and there, by each other and by what is fixed; some points resist turning.
fn heap(seed: u64) -> (Vec<Motion>, Vec<Row>) {
    let noise = &mut Noise::new(seed);
    let count = 2 + noise.below(5);
    let mass = noise.log_within(1e-3, 10.0);
    let masses: Vec<f64> = (0..count).map(|_| mass * noise.log_within(0.3, 3.0)).collect();
    let bodies: Vec<_> = masses.iter().map(|&mass| motion(noise, mass)).collect();
    let mut rows = Vec::new();
    for body in 0..count {
        for _ in 0..1 + noise.below(4) {
            // Everybody is joined to the next one, and some to others.
            let other = if noise.chance(0.6) { (body + 1) % count } else { noise.below(count) };
            let other = (other != body && noise.chance(0.8)).then_some(other);
            let stiffness = noise.log_within(10.0, 5000.0);
            let normal_W = noise.direction();
            let size = |body: usize| (masses[body] / 1000.0).cbrt();
            let mu = noise.within(0.0, 0.8);
            let most_nm = if noise.chance(0.3) { noise.log_within(1e-5, 1e-2) } else { 0.0 };
            let arms_W = [noise.direction() * size(body), noise.direction() * size(other.unwrap_or(body))];
            rows.push(Row {
                arms_W,
                normal_W,
                rest_W: (normal_W * noise.within(-1e-4, 2e-3) + noise.vector(1e-3)) * stiffness,
                stiffness: [stiffness; 2],
                damping: [if noise.chance(0.5) { 1.0 } else { 0.0 }; 2],
                mu_hold: mu,
                mu_slide: if noise.chance(0.5) { mu } else { mu * noise.within(0.3, 1.0) },
                held: if noise.chance(0.5) { Held::Stick } else { Held::Slip },
                force_W: normal_W * stiffness * noise.within(0.0, 1e-3),
                torsion: Torsion {
                    rest_nm: most_nm * noise.within(-2.0, 2.0),
                    stiffness_nm_per_rad: most_nm * 10.0,
                    damping_nm_s_per_rad: most_nm * 0.01,
                    most_nm,
                    torque_nm: 0.0,
                },
                ..row(body, other)
            });
        }
    }
    (bodies, rows)
}

/// Slow and obvious: Newton's method for all velocities with one dense matrix, whose derivatives of single forces are
/// differences.
mod dense {
    use super::*;

    fn velocity(row: &Row, u: &DVector<f64>) -> (Vector3<f64>, f64) {
        let of = |body: usize, arm_W: &Vector3<f64>| {
            let along = Vector3::new(u[6 * body], u[6 * body + 1], u[6 * body + 2]);
            let spin = Vector3::new(u[6 * body + 3], u[6 * body + 4], u[6 * body + 5]);
            (along + spin.cross(arm_W), spin)
        };
        let (mut v, mut spin) = of(row.body, &row.arms_W[0]);
        if let Some(other) = row.other {
            let (w, turns) = of(other, &row.arms_W[1]);
            (v, spin) = (v - w, spin - turns);
        }
        (v, row.normal_W.dot(&spin))
    }

    fn force(row: &Row, v: &Vector3<f64>, spin: f64) -> (Vector3<f64>, f64) {
        let torsion = &row.torsion;
        let falls = torsion.stiffness_nm_per_rad * DT + torsion.damping_nm_s_per_rad;
        let torque = (torsion.rest_nm - falls * spin).clamp(-torsion.most_nm, torsion.most_nm);
        (row.project(&row.trial_W(&(v * DT), v)), torque)
    }

    /// Velocities and spins of the sides by those of all bodies: a 4 x 6n matrix.
    fn sides(row: &Row, n: usize) -> DMatrix<f64> {
        let mut J = DMatrix::zeros(4, n);
        for (body, arm_W, sign) in [(Some(row.body), row.arms_W[0], 1.0), (row.other, row.arms_W[1], -1.0)] {
            let Some(body) = body else { continue };
            J.view_mut((0, 6 * body), (3, 3)).copy_from(&(Matrix3::identity() * sign));
            J.view_mut((0, 6 * body + 3), (3, 3)).copy_from(&(arm_W.cross_matrix() * -sign));
            J.view_mut((3, 6 * body + 3), (1, 3)).copy_from(&(row.normal_W.transpose() * sign));
        }
        J
    }

    fn left(rows: &[Row], M: &DMatrix<f64>, start: &DVector<f64>, u: &DVector<f64>) -> DVector<f64> {
        let mut left = M * (u - start);
        for row in rows {
            let (v, spin) = velocity(row, u);
            let (f, torque) = force(row, &v, spin);
            let all = DVector::from_row_slice(&[f.x, f.y, f.z, torque]);
            left -= sides(row, u.len()).transpose() * all * DT;
        }
        left
    }

    fn derivative(rows: &[Row], M: &DMatrix<f64>, u: &DVector<f64>) -> DMatrix<f64> {
        let mut derivative = M.clone();
        for row in rows {
            let (v, spin) = velocity(row, u);
            let mut D = DMatrix::zeros(4, 4);
            let h = 1e-7;
            for at in 0..4 {
                let step = Vector3::from_fn(|i, _| if i == at { h } else { 0.0 });
                let turn = if at == 3 { h } else { 0.0 };
                let (more, less) =
                    (force(row, &(v + step), spin + turn), force(row, &(v - step), spin - turn));
                let slope = (more.0 - less.0) / (2.0 * h);
                D.view_mut((0, at), (3, 1)).copy_from(&slope);
                D[(3, at)] = (more.1 - less.1) / (2.0 * h);
            }
            let J = sides(row, u.len());
            derivative -= J.transpose() * D * J * DT;
        }
        derivative
    }

    /// The velocities after the tick; `None` where it finds none.
    pub(crate) fn solve(rows: &[Row], bodies: &[Motion]) -> Option<DVector<f64>> {
        let n = 6 * bodies.len();
        let mut M = DMatrix::zeros(n, n);
        let mut start = DVector::zeros(n);
        for (body, motion) in bodies.iter().enumerate() {
            let at = 6 * body;
            M.view_mut((at, at), (3, 3)).copy_from(&(Matrix3::identity() / motion.inverse_mass));
            let J = motion.inverse_inertia_W.try_inverse().unwrap();
            M.view_mut((at + 3, at + 3), (3, 3)).copy_from(&J);
            start.rows_mut(at, 3).copy_from(&motion.velocity_W);
            start.rows_mut(at + 3, 3).copy_from(&motion.angular_velocity_W);
        }
        let inverse = M.clone().try_inverse().unwrap();
        let measure = |left: &DVector<f64>| (left.transpose() * &inverse * left)[0].sqrt();
        let mut u = start.clone();
        let mut now = left(rows, &M, &start, &u);
        for _ in 0..200 {
            let step = derivative(rows, &M, &u).lu().solve(&now)?;
            let found = (0..30).find_map(|halvings| {
                let next = &u - &step * 0.5_f64.powi(halvings);
                let after = left(rows, &M, &start, &next);
                (measure(&after) < measure(&now)).then_some((next, after))
            });
            // Roundings are all that is left, or it is stuck.
            let Some((next, after)) = found else { break };
            (u, now) = (next, after);
        }
        let forces: f64 = rows.iter().map(|row| measure_of(row, bodies, &velocity(row, &u).0)).sum();
        (measure(&now) < 1e-12 * (forces + measure(&(M * &u)))).then_some(u)
    }

    fn measure_of(row: &Row, bodies: &[Motion], v: &Vector3<f64>) -> f64 {
        force(row, v, 0.0).0.norm() * DT * bodies[row.body].inverse_mass.sqrt()
    }
}

fn compare_with_dense(scenes: u64) {
    let mut solver = Solver::with_capacity(64, 8);
    let (mut compared, mut most_rounds) = (0, 0);
    for seed in 0..scenes {
        let (bodies, mut rows) = heap(seed);
        let mut motions = bodies.clone();
        let solved = solver.solve(&mut rows, &mut motions, DT);
        most_rounds = most_rounds.max(solved.sweeps);
        assert_eq!(solved.unsolved, 0, "seed {seed}: {solved:?}");
        assert!(solved.residual < 1e-9, "seed {seed}: {solved:?}");
        // Rows that broke loose count as loose: it is the same question.
        let Some(u) = dense::solve(&rows, &bodies) else { continue };
        compared += 1;
        let speed = motions.iter().map(|motion| motion.velocity_W.norm()).fold(1e-3, f64::max);
        let spin = motions.iter().map(|motion| motion.angular_velocity_W.norm()).fold(1e-3, f64::max);
        for (body, motion) in motions.iter().enumerate() {
            let off = (motion.velocity_W - u.fixed_rows::<3>(6 * body)).norm() / speed;
            let turned = (motion.angular_velocity_W - u.fixed_rows::<3>(6 * body + 3)).norm() / spin;
            assert!(off < 1e-10 && turned < 1e-10, "seed {seed}, body {body}: {off} {turned} {solved:?}");
        }
    }
    // The dense one has no way around where it is stuck.
    println!("{compared} of {scenes} compared, {most_rounds} rounds at most");
    assert!(compared > scenes * 9 / 10, "{compared}");
}

#[test]
fn the_forces_of_an_island_are_those_that_one_dense_matrix_finds() {
    compare_with_dense(1500);
}

/// `cargo test --release -p physics --test all islands:: -- --ignored`
#[test]
#[ignore = "half a minute"]
fn the_forces_of_fifty_thousand_islands_are_those_that_one_dense_matrix_finds() {
    compare_with_dense(50_000);
}

#[test]
fn islands_are_what_rows_join_and_what_nothing_moves_joins_nobody() {
    for seed in 0..500 {
        let noise = &mut Noise::new(seed);
        let count = 1 + noise.below(30);
        let still = Motion {
            velocity_W: Vector3::zeros(),
            angular_velocity_W: Vector3::zeros(),
            inverse_mass: 0.0,
            inverse_inertia_W: Matrix3::zeros(),
        };
        let motions: Vec<_> = (0..count)
            .map(|_| {
                let is_still = noise.chance(0.2);
                let motion = motion(noise, 0.1);
                if is_still { still } else { motion }
            })
            .collect();
        let rows: Vec<_> = (0..noise.below(30))
            .map(|_| {
                let other = noise.chance(0.8).then(|| noise.below(count + 2));
                row(noise.below(count), other)
            })
            .collect();
        // The lowest body that each can be reached from, told on until nothing changes.
        let mut first: Vec<usize> = (0..count).collect();
        for _ in 0..count {
            for row in &rows {
                let Some(other) = row.other.filter(|&other| other < count) else { continue };
                if motions[row.body].inverse_mass > 0.0 && motions[other].inverse_mass > 0.0 {
                    let least = first[row.body].min(first[other]);
                    (first[row.body], first[other]) = (least, least);
                }
            }
        }
        let mut expected: Vec<Vec<usize>> = Vec::new();
        for root in 0..count {
            let of: Vec<_> = (0..count).filter(|&body| first[body] == root).collect();
            if !of.is_empty() {
                expected.push(of);
            }
        }
        let mut islands = Islands::with_capacity(count);
        let found: Vec<_> = islands.of(&rows, &motions).map(<[usize]>::to_vec).collect();
        assert_eq!(found, expected, "seed {seed}");
        for (number, bodies) in expected.iter().enumerate() {
            assert!(bodies.iter().all(|&body| islands.island_of(body) == Some(number)));
        }
    }
}

/// Cubes of a gram on each other, four points each, on what lifts the lowest at this speed (m/s).
fn stack(count: usize, rises_m_s: f64) -> (Vec<Motion>, Vec<Row>) {
    let (mass, edge, k) = (1e-3, 0.01, 5000.0);
    let cube = Motion {
        velocity_W: Vector3::y() * (-G * DT),
        angular_velocity_W: Vector3::zeros(),
        inverse_mass: 1.0 / mass,
        inverse_inertia_W: Matrix3::from_diagonal_element(6.0 / (mass * edge * edge)),
    };
    let corners = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let rows = (0..count)
        .flat_map(|body| corners.map(|corner| (body, corner)))
        .map(|(body, [x, z])| {
            let arm = |y: f64| Vector3::new(x, y, z) * (0.5 * edge);
            let other = body.checked_sub(1);
            let presses = mass * G * (count - body) as f64 / 4.0;
            let moved = if body == 0 { rises_m_s * (k * DT + 0.5) } else { 0.0 };
            Row {
                arms_W: [arm(-1.0), if other.is_some() { arm(1.0) } else { Vector3::zeros() }],
                rest_W: Vector3::y() * (presses + moved),
                stiffness: [k; 2],
                damping: [0.5; 2],
                mu_hold: 0.5,
                mu_slide: 0.5,
                ..row(body, other)
            }
        })
        .collect();
    (vec![cube; count], rows)
}

#[test]
fn a_stack_that_rests_on_something_weighs_on_it_with_all_its_cubes_within_a_tick() {
    let (mut motions, mut rows) = stack(10, 0.0);
    let solved = Solver::with_capacity(64, 10).solve(&mut rows, &mut motions, DT);
    // Nobody told it what the forces were: they were zero.
    let weighs: f64 = rows[..4].iter().map(|row| row.force_W.y).sum();
    let weight = 10.0 * 1e-3 * G;
    // Roundings, of ten cubes in a row.
    assert!((weighs - weight).abs() < 1e-13 * weight, "{weighs} for {weight}, {solved:?}");
    assert!(solved.unsolved == 0 && solved.residual < 1e-13 && solved.sweeps <= 2, "{solved:?}");
    assert!(motions.iter().all(|motion| motion.velocity_W.norm() < 1e-14));
}

#[test]
fn a_stack_that_is_lifted_moves_as_what_lifts_it_gives() {
    let (start, mut rows) = stack(10, 0.05);
    let mut motions = start.clone();
    let solved = Solver::with_capacity(64, 10).solve(&mut rows, &mut motions, DT);
    let lifts: f64 = rows[..4].iter().map(|row| row.force_W.y).sum();
    let gains: f64 =
        motions.iter().zip(&start).map(|(now, was)| 1e-3 * (now.velocity_W.y - was.velocity_W.y)).sum();
    assert!((lifts * DT - gains).abs() < 1e-13 * gains, "{lifts} {gains}");
    assert!(lifts > 10.0 * 1e-3 * G && solved.residual < 1e-13, "{lifts} {solved:?}");
    // It passes on what is left of it, to the highest within the same tick.
    let speeds: Vec<f64> = motions.iter().map(|motion| motion.velocity_W.y).collect();
    assert!(speeds.windows(2).all(|pair| pair[0] > pair[1] && pair[1] > 0.0), "{speeds:?}");
}

#[test]
fn islands_that_are_too_large_are_found_body_by_body_and_it_is_told_when_they_are_not() {
    let (mut motions, mut rows) = stack(160, 0.0);
    let solved = Solver::with_capacity(1024, 160).solve(&mut rows, &mut motions, DT);
    assert!(solved.unsolved == 1 && solved.residual > 1e-9, "{solved:?}");
    assert!(rows.iter().all(|row| row.force_W.y >= 0.0 && row.force_W.y.is_finite()));
    // One that starts with the right forces is found at once.
    let (mut motions, mut rows) = stack(160, 0.0);
    rows.iter_mut().for_each(|row| row.force_W = row.rest_W);
    let solved = Solver::with_capacity(1024, 160).solve(&mut rows, &mut motions, DT);
    assert!(solved.unsolved == 0, "{solved:?}");
    let weighs: f64 = rows[..4].iter().map(|row| row.force_W.y).sum();
    // What counts as found: a change of 1e-9 of a force.
    assert!((weighs - 160.0 * 1e-3 * G).abs() < 1e-8, "{weighs}");
}

/// 140 cubes whose springs and dampers are a hundred times softer: in turns, forces go from one to the next without much of an echo.
#[test]
fn turns_over_the_bodies_of_a_large_island_end_at_what_all_of_its_equations_ask_for() {
    let (start, mut rows) = stack(140, 0.0);
    for row in &mut rows {
        // From the lowest on, all is pressed unevenly at first.
        (row.stiffness, row.damping) = ([50.0; 2], [0.01; 2]);
        row.rest_W += Vector3::new(1e-4, 2e-3 * (row.body % 3) as f64, 0.0);
    }
    let mut motions = start.clone();
    let solved = Solver::with_capacity(1024, 140).solve(&mut rows, &mut motions, DT);
    assert!(solved.unsolved == 0 && solved.sweeps > 3, "{solved:?}");
    for row in &rows {
        let own = motions[row.body].at(&row.arms_W[0]);
        let moves = row.other.map_or(own, |other| own - motions[other].at(&row.arms_W[1]));
        let asked = row.project(&row.trial_W(&(moves * DT), &moves));
        // Forces that change by less than 1e-9 of the largest, over some turns.
        assert!((row.force_W - asked).norm() < 1e-7, "{} {asked}", row.force_W);
    }
}

#[test]
fn an_island_comes_out_the_same_whatever_else_there_is() {
    for seed in 0..300 {
        let (bodies, rows) = heap(seed);
        let (more_bodies, more_rows) = heap(seed + 10_000);
        let (mut alone, mut beside) = (bodies.clone(), [bodies.clone(), more_bodies].concat());
        let mut all = rows.clone();
        let shifted = more_rows.iter().map(|row| Row {
            body: row.body + bodies.len(),
            other: row.other.map(|other| other + bodies.len()),
            ..*row
        });
        // In between, as pairs come.
        shifted.enumerate().for_each(|(at, row)| all.insert((2 * at).min(all.len()), row));
        let mut own = rows.clone();
        Solver::with_capacity(128, 16).solve(&mut own, &mut alone, DT);
        Solver::with_capacity(128, 16).solve(&mut all, &mut beside, DT);
        assert_eq!(alone, beside[..bodies.len()], "seed {seed}");
    }
}
