//! Forces of the end of the tick: what is found, how fast, and against a slow reference.
#![allow(non_snake_case)]

use crate::noise;
#[path = "solver/torsion.rs"]
mod torsion;

use nalgebra::{Matrix3, Vector3};
use noise::Noise;
use physics::{Held, MAX_SWEEPS, Motion, Rolling, Row, Solver, Torsion};

const DT: f64 = 1e-3;

/// A body of this mass and about this size, moving somehow.
fn motion(noise: &mut Noise, mass: f64, size: f64) -> Motion {
    let turn = noise.turn().to_rotation_matrix();
    let moments = Vector3::from_fn(|_, _| mass * size * size * noise.within(0.1, 0.2));
    let inverse = Matrix3::from_diagonal(&moments.map(f64::recip));
    Motion {
        velocity_W: noise.vector(0.5),
        angular_velocity_W: noise.vector(2.0),
        inverse_mass: 1.0 / mass,
        inverse_inertia_W: turn.matrix() * inverse * turn.matrix().transpose(),
    }
}

/// A contact point somewhere on a body, some way into its spring.
fn row(noise: &mut Noise, size: f64, stiffness: f64, mu: f64) -> Row {
    let normal_W = noise.direction();
    let depth = noise.within(-1e-4, 2e-3);
    let mu_slide = if noise.chance(0.5) { mu } else { mu * noise.within(0.3, 1.0) };
    Row {
        body: 0,
        other: None,
        arms_W: [
            (noise.direction() * 0.3 - normal_W).normalize() * size * noise.within(0.5, 1.0),
            Vector3::zeros(),
        ],
        normal_W,
        rest_W: (normal_W * depth + noise.vector(1e-3)) * stiffness,
        stiffness: [stiffness; 2],
        damping: [if noise.chance(0.5) { 1.0 } else { 0.0 }; 2],
        mu_hold: mu,
        mu_slide,
        held: if noise.chance(0.5) { Held::Stick } else { Held::Slip },
        force_W: normal_W * stiffness * noise.within(0.0, 1e-3),
        torsion: Torsion::default(),
        rolling: Rolling::default(),
        turning_m: [0.0; 2],
        tie_n: None,
    }
}

/// A scene: one body and its rows.
fn scene(seed: u64) -> (Motion, Vec<Row>) {
    let noise = &mut Noise::new(seed);
    let mass = noise.log_within(1e-3, 10.0);
    // As if of plastic or wood.
    let size = (mass / 1000.0).cbrt();
    let mu = if noise.chance(0.1) { 0.0 } else { noise.within(0.0, 2.0) };
    let count = 1 + noise.below(24);
    let body = motion(noise, mass, size);
    let rows = (0..count)
        .map(|_| {
            let stiffness = noise.log_within(10.0, 5000.0);
            row(noise, size, stiffness, mu)
        })
        .collect();
    (body, rows)
}

/// The velocity of a row's point.
fn at(row: &Row, motions: &[Motion]) -> Vector3<f64> {
    let own = motions[row.body].at(&row.arms_W[0]);
    row.other.map_or(own, |other| own - motions[other].at(&row.arms_W[1]))
}

fn given(motions: &mut [Motion], row: &Row, force_W: &Vector3<f64>) {
    let sides = [(Some(row.body), 1.0), (row.other, -1.0)];
    for ((body, sign), arm_W) in sides.into_iter().zip(&row.arms_W) {
        let Some(motion) = body.map(|body| &mut motions[body]) else { continue };
        motion.velocity_W += force_W * (sign * DT * motion.inverse_mass);
        motion.angular_velocity_W += motion.inverse_inertia_W * arm_W.cross(force_W) * (sign * DT);
    }
}

/// Velocity of a row's point per impulse on it, at most.
fn give(row: &Row, motions: &[Motion]) -> f64 {
    let of = |body: usize, arm: &Vector3<f64>| {
        motions[body].inverse_mass + arm.norm_squared() * motions[body].inverse_inertia_W.trace()
    };
    of(row.body, &row.arms_W[0]) + row.other.map_or(0.0, |other| of(other, &row.arms_W[1]))
}

fn falls(row: &Row) -> f64 {
    (0..2).map(|i| row.stiffness[i] * DT + row.damping[i]).fold(0.0, f64::max)
}

/// How far each row's force is from its own answer to what the others do, over the largest force.
fn residual(rows: &[Row], motions: &[Motion]) -> f64 {
    let most = rows.iter().map(|row| row.force_W.norm()).fold(1e-12, f64::max);
    let left = |row: &Row| {
        let u = at(row, motions);
        let off = (row.project(&row.trial_W(&(u * DT), &u)) - row.force_W).norm();
        off / (1.0 + falls(row) * give(row, motions) * DT)
    };
    rows.iter().map(left).fold(0.0, f64::max) / most
}

/// Slow and obvious: each row in turn goes a little way to what its velocity asks for, until nothing changes.
fn reference(rows: &[Row], motions: &[Motion]) -> Option<Vec<Motion>> {
    let (mut rows, mut motions) = (rows.to_vec(), motions.to_vec());
    rows.iter_mut().for_each(|row| row.force_W = Vector3::zeros());
    for _ in 0..200_000 {
        let mut change = 0.0_f64;
        let most = rows.iter().map(|row| row.force_W.norm()).fold(1e-12, f64::max);
        for row in &mut rows {
            let u = at(row, &motions);
            let wanted = row.project(&row.trial_W(&(u * DT), &u));
            let step = (wanted - row.force_W) / (1.0 + falls(row) * give(row, &motions) * DT);
            row.force_W += step;
            given(&mut motions, row, &step);
            change = change.max(step.norm() / most);
        }
        if change < 1e-14 {
            return Some(motions);
        }
    }
    None
}

/// What the bodies got is the sum of the rows' forces.
fn assert_belong_together(rows: &[Row], before: &[Motion], after: &[Motion]) {
    let mut summed = before.to_vec();
    rows.iter().for_each(|row| given(&mut summed, row, &row.force_W));
    for (index, (summed, after)) in summed.iter().zip(after).enumerate() {
        // Roundings of each summand.
        let of_row = |row: &&Row| row.body == index || row.other == Some(index);
        let sum: f64 = rows.iter().filter(of_row).map(|row| row.force_W.norm()).sum();
        let arm = rows.iter().map(|row| row.arms_W[0].norm()).fold(0.0, f64::max);
        let speed = summed.velocity_W.norm() + sum * DT * summed.inverse_mass;
        let spin = summed.angular_velocity_W.norm() + sum * DT * arm * summed.inverse_inertia_W.norm();
        assert!((summed.velocity_W - after.velocity_W).norm() <= 1e-13 * (speed + 1e-9));
        assert!((summed.angular_velocity_W - after.angular_velocity_W).norm() <= 1e-13 * (spin + 1e-9));
    }
}

fn assert_physical(rows: &[Row]) {
    for row in rows {
        let normal_n = row.normal_W.dot(&row.force_W);
        let across_n = (row.force_W - row.normal_W * normal_n).norm();
        // Roundings of the largest part.
        let rounding = 1e-12 * row.force_W.norm();
        assert!(normal_n >= -rounding, "no contact pulls: {row:?}");
        let mu = if row.held == Held::Slip { row.mu_slide } else { row.mu_hold };
        assert!(across_n <= mu * normal_n + rounding, "all of it lies in the cone: {row:?}");
    }
}

fn find_forces(scenes: u64) {
    let mut solver = Solver::with_capacity(64, 1);
    let (mut total, mut most) = (0, 0);
    for seed in 0..scenes {
        let (body, mut rows) = scene(seed);
        let mut motions = [body];
        let rounds = solver.solve(&mut rows, &mut motions, DT).sweeps;
        (total, most) = (total + rounds, most.max(rounds));
        // 1e-13 of the energy measure's root, of a force that may be one of many and far from the centre.
        let left = residual(&rows, &motions);
        assert!(left < 1e-9, "seed {seed}: {left} after {rounds} rounds");
        assert_belong_together(&rows, &[body], &motions);
        assert_physical(&rows);
    }
    let mean = total as f64 / scenes as f64;
    // Found 5.0 and 34; points pressed from all directions at once, as nothing is in a hand.
    assert!(mean < 6.0 && most < MAX_SWEEPS, "{mean} rounds on average, {most} at most");
}

#[test]
fn forces_of_a_single_body_are_found_in_few_rounds_whatever_presses_it() {
    find_forces(25_000);
}

/// `cargo test --release -p physics --test all solver:: -- --ignored`
#[test]
#[ignore = "a minute"]
fn forces_of_a_single_body_are_found_in_few_rounds_whatever_of_millions_presses_it() {
    find_forces(1_000_000);
}

#[test]
fn it_finds_what_a_slow_reference_finds() {
    let mut solver = Solver::with_capacity(64, 1);
    for seed in 1_000_000..1_003_000 {
        let (body, mut rows) = scene(seed);
        let mut motions = [body];
        solver.solve(&mut rows, &mut motions, DT);
        // Rows that broke loose count as loose: it is the same question.
        let Some(slow) = reference(&rows, &[body]) else {
            panic!("seed {seed}: the reference finds nothing")
        };
        let off = (slow[0].velocity_W - motions[0].velocity_W).norm() / motions[0].velocity_W.norm();
        // The reference ends at changes of 1e-14 a turn, of which thousands may be left.
        assert!(off < 1e-9, "seed {seed}: {off}");
    }
}

/// Two contact points that held it long: a gram between stiff fingers that move on.
#[test]
fn a_gram_between_stiff_fingers_that_move_takes_a_few_rounds() {
    let mut solver = Solver::with_capacity(2, 1);
    let mut most = 0;
    for seed in 0..2000 {
        let noise = &mut Noise::new(seed);
        let mut body = motion(noise, 1e-3, 0.01);
        body.velocity_W = noise.vector(0.5);
        let mut rows = [1.0, -1.0].map(|side| {
            let normal_W = Vector3::new(side, 0.0, 0.0);
            let arms_W = [-normal_W * 0.005, Vector3::zeros()];
            let rest_W = normal_W * 2.0 + noise.vector(0.5);
            let given = row(noise, 0.01, 5000.0, 0.5);
            Row { arms_W, normal_W, rest_W, held: Held::Stick, mu_hold: 0.5, mu_slide: 0.5, ..given }
        });
        let rounds = solver.solve(&mut rows, &mut [body], DT).sweeps;
        most = most.max(rounds);
    }
    // Turns of single points would take 91.
    assert!(most <= 15, "{most}");
}

#[test]
fn edge_cases_are_solved_like_all_others() {
    let mut solver = Solver::with_capacity(64, 1);
    let check = |name: &str, seed: u64, change: &dyn Fn(&mut Motion, &mut Vec<Row>), tolerance: f64| {
        let (mut body, mut rows) = scene(seed);
        change(&mut body, &mut rows);
        let mut motions = [body];
        let rounds = solver.solve(&mut rows, &mut motions, DT).sweeps;
        let left = residual(&rows, &motions);
        assert!(left < tolerance, "{name}, seed {seed}: {left} after {rounds} rounds");
        assert_belong_together(&rows, &[body], &motions);
        assert_physical(&rows);
    };
    let mut check = check;
    for seed in 0..2000 {
        check(
            "without stiffness",
            seed,
            &|_, rows| rows.iter_mut().for_each(|row| row.stiffness = [0.0; 2]),
            1e-9,
        );
        check(
            "without damping",
            seed,
            &|_, rows| rows.iter_mut().for_each(|row| row.damping = [0.0; 2]),
            1e-9,
        );
        let none = |_: &mut Motion, rows: &mut Vec<Row>| {
            rows.iter_mut().for_each(|row| (row.stiffness, row.damping) = ([0.0; 2], [0.0; 2]));
        };
        check("without either", seed, &none, 1e-9);
        let smooth = |_: &mut Motion, rows: &mut Vec<Row>| {
            rows.iter_mut().for_each(|row| (row.mu_hold, row.mu_slide) = (0.0, 0.0));
        };
        check("without friction", seed, &smooth, 1e-9);
        let parallel = |_: &mut Motion, rows: &mut Vec<Row>| {
            let n = rows[0].normal_W;
            rows.iter_mut().for_each(|row| row.normal_W = n);
        };
        check("all parallel", seed, &parallel, 1e-9);
        let same = |_: &mut Motion, rows: &mut Vec<Row>| {
            let first = rows[0];
            rows.iter_mut().for_each(|row| *row = first);
        };
        check("all the same", seed, &same, 1e-9);
        let locked = |body: &mut Motion, _: &mut Vec<Row>| {
            (body.inverse_inertia_W, body.angular_velocity_W) = (Matrix3::zeros(), Vector3::zeros());
        };
        check("never turning", seed, &locked, 1e-9);
    }
}

#[test]
fn rows_that_are_no_numbers_press_nothing_and_disturb_nobody() {
    let mut solver = Solver::with_capacity(64, 1);
    let broken: [&dyn Fn(&mut Row); 9] = [
        &|row| row.rest_W.x = f64::NAN,
        &|row| row.normal_W.y = f64::NAN,
        &|row| row.arms_W[0].z = f64::INFINITY,
        &|row| row.stiffness[0] = f64::NAN,
        &|row| row.damping[1] = -1.0,
        &|row| row.mu_hold = f64::NAN,
        &|row| row.torsion.rest_nm = f64::NAN,
        &|row| row.body = 7,
        &|row| row.other = Some(0),
    ];
    for seed in 0..200 {
        for change in broken {
            let (body, mut rows) = scene(seed);
            let (mut alone, mut motions) = (rows.clone(), [body]);
            solver.solve(&mut alone, &mut motions, DT);
            let mut bad = rows[0];
            change(&mut bad);
            rows.insert(rows.len() / 2, bad);
            let mut beside = [body];
            solver.solve(&mut rows, &mut beside, DT);
            assert_eq!(beside, motions);
            assert_eq!(rows[(rows.len() - 1) / 2].force_W, Vector3::zeros());
        }
    }
}

#[test]
fn bodies_that_are_no_numbers_are_not_pressed_and_press_nobody() {
    let broken: [&dyn Fn(&mut Motion); 4] = [
        &|body| body.velocity_W.x = f64::NAN,
        &|body| body.angular_velocity_W.y = f64::INFINITY,
        &|body| body.inverse_mass = f64::NAN,
        &|body| body.inverse_inertia_W[(2, 1)] = f64::NEG_INFINITY,
    ];
    for (seed, change) in broken.into_iter().enumerate() {
        let (body, rows) = scene(seed as u64);
        let mut alone = (rows.clone(), [body]);
        Solver::with_capacity(64, 1).solve(&mut alone.0, &mut alone.1, DT);
        let mut lost = body;
        change(&mut lost);
        let mut beside = rows.clone();
        beside.push(Row { other: Some(1), ..rows[0] });
        beside.extend(rows.iter().map(|row| Row { body: 1, ..*row }));
        let mut motions = [body, lost];
        Solver::with_capacity(64, 2).solve(&mut beside, &mut motions, DT);
        assert_eq!(motions[0], alone.1[0]);
        assert!(beside[rows.len()..].iter().all(|row| row.force_W == Vector3::zeros()), "{seed}");
    }
}

#[test]
fn rows_beyond_the_room_press_nothing() {
    let (body, mut rows) = scene(4);
    rows.resize(8, rows[0]);
    let mut motions = [body];
    Solver::with_capacity(5, 1).solve(&mut rows, &mut motions, DT);
    assert!(rows[5..].iter().all(|row| row.force_W == Vector3::zeros()));
    assert_belong_together(&rows, &[body], &motions);
}

/// Bodies in a row, each pressed against the next, and some rows against what is fixed.
fn chain(seed: u64) -> (Vec<Motion>, Vec<Row>) {
    let noise = &mut Noise::new(seed);
    let count = 2 + noise.below(3);
    let mass = noise.log_within(0.02, 10.0);
    let size = (mass / 1000.0).cbrt();
    let bodies: Vec<_> = (0..count)
        .map(|_| {
            let own = mass * noise.within(0.5, 2.0);
            motion(noise, own, size)
        })
        .collect();
    let mut rows = Vec::new();
    for body in 0..count {
        for point in 0..1 + noise.below(4) {
            let stiffness = noise.log_within(10.0, 2000.0);
            let mu = noise.within(0.0, 0.8);
            let other = (body + 1 < count && point > 0).then_some(body + 1);
            let arms_W = [noise.direction() * size, noise.direction() * size];
            rows.push(Row { body, other, arms_W, ..row(noise, size, stiffness, mu) });
        }
    }
    (bodies, rows)
}

#[test]
fn bodies_that_press_each_other_are_solved_together() {
    let mut solver = Solver::with_capacity(64, 8);
    for seed in 0..3000 {
        let (bodies, mut rows) = chain(seed);
        let mut motions = bodies.clone();
        let turns = solver.solve(&mut rows, &mut motions, DT).sweeps;
        let left = residual(&rows, &motions);
        // Changes of 1e-10 a turn, of which some tens may be left.
        assert!(left < 1e-8, "seed {seed}: {left} after {turns}, {} rows", rows.len());
        assert_belong_together(&rows, &bodies, &motions);
        assert_physical(&rows);
        let Some(slow) = reference(&rows, &bodies) else {
            panic!("seed {seed}: the reference finds nothing")
        };
        for (slow, fast) in slow.iter().zip(&motions) {
            let off = (slow.velocity_W - fast.velocity_W).norm();
            assert!(off < 1e-7 * (1.0 + fast.velocity_W.norm()), "seed {seed}: {off}");
        }
    }
}

#[test]
fn a_fixed_other_is_no_other() {
    for seed in 0..200 {
        let (body, rows) = scene(seed);
        let fixed = Motion {
            velocity_W: Vector3::zeros(),
            angular_velocity_W: Vector3::zeros(),
            inverse_mass: 0.0,
            inverse_inertia_W: Matrix3::zeros(),
        };
        let (mut alone, mut motions) = (rows.clone(), [body]);
        Solver::with_capacity(64, 1).solve(&mut alone, &mut motions, DT);
        let mut with: Vec<Row> = rows.iter().map(|row| Row { other: Some(1), ..*row }).collect();
        let mut both = [body, fixed];
        Solver::with_capacity(64, 2).solve(&mut with, &mut both, DT);
        assert_eq!(both, [motions[0], fixed]);
    }
}

/// How many of many scenes, changed so, are not solved; what is found is what contacts can do in all of them.
fn missed(change: impl Fn(&mut Motion, &mut Vec<Row>)) -> usize {
    let mut solver = Solver::with_capacity(64, 1);
    let mut missed = 0;
    for seed in 0..10_000 {
        let (mut body, mut rows) = scene(seed);
        change(&mut body, &mut rows);
        let mut motions = [body];
        solver.solve(&mut rows, &mut motions, DT);
        let left = residual(&rows, &motions);
        assert!(left < 2.0, "seed {seed}: {left} of the largest force");
        missed += usize::from(left > 1e-6);
        assert_belong_together(&rows, &[body], &motions);
        assert_physical(&rows);
    }
    missed
}

#[test]
fn what_is_not_found_is_still_what_contacts_can_do() {
    // Nothing in a hand is like this: friction pries at arms thirty times as long as the mass is wide.
    let far = missed(|_, rows| rows.iter_mut().for_each(|row| row.arms_W[0] *= 30.0));
    assert!(far < 25, "found 5: {far}");
    // Impulses, a million times harder than the body, at up to eight points of a floor and a wall, anywhere on the body.
    let hard = missed(|body, rows| {
        rows.truncate(8);
        for row in rows {
            row.normal_W = if row.normal_W.x > 0.5 { Vector3::x() } else { Vector3::y() };
            let stop = 1e6 / (body.inverse_mass * DT);
            row.rest_W = row.normal_W * stop * 0.1;
            (row.stiffness, row.damping) = ([0.0, 100.0], [stop, 0.0]);
            (row.mu_hold, row.mu_slide) = (row.mu_hold * 0.4, row.mu_slide * 0.4);
        }
    });
    assert!(hard < 25, "found 9: {hard}");
    println!("{far} {hard}");
}
