//! Viscous friction without chatter (Melder eq. 4.8, corrected).
//!
//! Sliding at constant speed v, the gap beyond the Coulomb circle follows x' = (x + v dt) q with
//! q = c / (1 + c), c = mu_v d / dt. From x = 0 this is x_n = mu_v d v (1 - q^n): a monotone rise to
//! the steady force k d (mu + mu_v v).

use crate::common::*;
use haptics::{ContactState, Friction, FrictionState};
use nalgebra::Vector3;

const SPEED: f64 = 0.1;
const MU: f64 = 0.3;

/// Tangential force over k at each tick of sliding at `SPEED`, which begins on the Coulomb rim.
fn slide(law: Friction, mu: f64, ticks: usize) -> Vec<f64> {
    let entity = table(law);
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    let start = mu * DEPTH;
    let mut gap = |n: usize| {
        let hip = Vector3::new(start + SPEED * DT * n as f64, -DEPTH, 0.0);
        let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
        assert_eq!(out.force_on_user_W.y, K * DEPTH);
        -out.force_on_user_W.x / K
    };
    (0..ticks).map(&mut gap).collect()
}

const COEFFICIENTS: [f64; 10] = [1e-3, 1e-2, 0.1, 0.11, 0.5, 1.0, 10.0, 1e2, 1e4, 1e6];

#[test]
//= melder#4.8 type=test
fn the_force_follows_the_closed_form_for_every_viscous_coefficient() {
    for mu_v in COEFFICIENTS {
        let q = {
            let c = mu_v * DEPTH / DT;
            c / (1.0 + c)
        };
        for (mu, law) in
            [(MU, Friction::coulomb_viscous(MU, mu_v).unwrap()), (0.0, Friction::viscous(mu_v).unwrap())]
        {
            for (n, gap) in slide(law, mu, 2000).iter().enumerate() {
                // -exp_m1(n ln q) is 1 - q^n without cancellation; ln q likewise.
                let log_q = -(DT / (mu_v * DEPTH)).ln_1p();
                let expected = mu * DEPTH + mu_v * DEPTH * SPEED * -(n as f64 * log_q).exp_m1();
                // Each tick rounds a position of up to 0.2 m (3e-17); the recurrence forgets a
                // rounding after 1 / (1 - q) ticks or never, and there are 2000.
                let tolerance = 6e-17 * (1.0 / (1.0 - q)).min(2000.0) + 1e-15 * expected;
                assert!((gap - expected).abs() <= tolerance, "mu_v {mu_v}, tick {n}: {gap}, {expected}");
            }
        }
    }
}

#[test]
fn the_force_rises_without_chatter_for_every_viscous_coefficient() {
    for mu_v in COEFFICIENTS {
        let gaps = slide(Friction::coulomb_viscous(MU, mu_v).unwrap(), MU, 2000);
        for pair in gaps.windows(2) {
            // Settled, it may move by the rounding of positions of 0.2 m.
            assert!(pair[1] >= pair[0] - 6e-17, "mu_v {mu_v}: {} after {}", pair[1], pair[0]);
        }
    }
}

#[test]
fn the_steady_force_is_that_of_the_speed_where_it_is_reached() {
    for mu_v in [1e-3, 1e-2, 0.1, 0.5, 1.0, 10.0] {
        // The time constant is c dt = mu_v d: 50 ms for the largest, 40 of them in 2 s.
        let gaps = slide(Friction::coulomb_viscous(MU, mu_v).unwrap(), MU, 2000);
        let ratio = gaps.last().unwrap() / DEPTH;
        assert!((ratio - (MU + mu_v * SPEED)).abs() < 1e-11, "mu_v {mu_v}: {ratio}");
    }
}

#[test]
fn the_explicit_form_as_printed_chatters_beyond_one_half() {
    // The circle of this tick from the speed of the last: an error in the gap comes back
    // multiplied by -mu_v d / dt, and the move is clipped at zero, which sustains it.
    let chatter = |mu_v: f64| {
        let (mut god, mut speed, mut last, mut reversals) = (0.0f64, 0.0f64, (0.0f64, 0.0f64), 0);
        for n in 1..2000 {
            let hip = MU * DEPTH + SPEED * DT * f64::from(n);
            let circle = (MU + mu_v * speed) * DEPTH;
            let step = (hip - god - circle).max(0.0);
            (god, speed) = (god + step, step / DT);
            let gap = hip - god;
            if n > 1000 && (gap - last.1) * (last.1 - last.0) < -1e-20 {
                reversals += 1;
            }
            last = (last.1, gap);
        }
        reversals
    };
    assert_eq!(chatter(0.09), 0, "mu_v d / dt = 0.45 settles");
    assert!(chatter(0.25) > 900, "mu_v d / dt = 1.25 reverses nearly every tick");
}

#[test]
fn stopping_it_relaxes_to_the_coulomb_circle_and_no_further() {
    let entity = table(Friction::coulomb_viscous(MU, 1.0).unwrap());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    let mut gap = 4e-3;
    let (c, rim) = (1.0 * DEPTH / DT, MU * DEPTH);
    for _ in 0..300 {
        let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(4e-3, -DEPTH, 0.0), DT);
        gap = rim + (gap - rim) * c / (1.0 + c);
        // Within 1e-12 of the depth it counts as resting and stops short of the recurrence.
        assert!((-out.force_on_user_W.x / K - gap).abs() < 1.01e-12 * DEPTH);
    }
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(4e-3, -DEPTH, 0.0), DT);
    assert_eq!(out.friction, ContactState::Stick, "within 1e-12 of the rim it rests");
}

#[test]
fn on_a_sphere_the_ratio_is_that_of_the_speed_of_the_god_object() {
    let (r, mu_v) = (0.1, 2.0);
    let entity = ball(r, Friction::coulomb_viscous(MU, mu_v).unwrap());
    let mut finger = point_finger();
    let mut before = None;
    for i in 0..5000 {
        let out = finger.step(std::slice::from_ref(&entity), &on_circle(r - DEPTH, f64::from(i) * 1e-3), DT);
        let moved =
            before.replace(out.god_object_W).map_or(0.0, |p: Vector3<f64>| (out.god_object_W - p).norm());
        if finger.contact(0).unwrap().friction == FrictionState::Slip {
            // Positions of 0.1 m are rounded to 1.4e-17, which mu_v / dt = 2000 magnifies; the
            // slide itself rests within 1e-12 of the depth, 5e-15 m, magnified likewise.
            let expected = MU + mu_v * moved / DT;
            assert!((ratio(&out, &(out.god_object_W / r)) - expected).abs() < 2e-11, "tick {i}");
        }
    }
}
