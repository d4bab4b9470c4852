//! The energy that is seen is the energy that was fed, and never more is fed than was promised.
#![allow(non_snake_case)]

use crate::{common, sources};

use common::*;
use haptics::Finger;
use haptics::passivity::{Passivity, PassivitySpec, Port, Pressing};
use nalgebra::Vector3;
use sources::{Hand, Source};

const RATES_HZ: [f64; 3] = [500.0, 1000.0, 4000.0];

fn controller(dt: f64) -> Passivity {
    Passivity::new(PassivitySpec::usual(dt), dt).unwrap()
}

/// An observer that never interferes.
fn observer() -> Passivity {
    Passivity::new(PassivitySpec { bound_j: 1e9, ..PassivitySpec::usual(DT) }, DT).unwrap()
}

/// What a wall of stiffness `k` and damping `b` feeds while a finger is pressed in by `n` steps of `h` and drawn out.
fn press_and_release(k: f64, b: f64, h: f64, n: i32) -> f64 {
    let mut observer = observer();
    let mut last = 0.0;
    for step in (0..=n).chain((0..n).rev()) {
        let depth = f64::from(step) * h;
        let damping = b * (depth - std::mem::replace(&mut last, depth)) / DT;
        let force = if depth > 0.0 { k * depth + damping } else { 0.0 };
        observer.step(&Port::new(Vector3::y() * -depth, Vector3::y() * force, DT));
    }
    observer.energy_j()
}

#[test]
fn a_spring_that_is_held_between_ticks_leaks_its_closed_form() {
    // Forces lag by a step both ways: in, the sum of k i h for i below n, times h, is taken; out, for i from 1 to n, it is
    // given. The difference is k h^2 n = k v T d. All numbers are sums of few powers of two, so nothing is rounded.
    let (k, h, n) = (1024.0, 1.0 / 8192.0, 40);
    assert_eq!(press_and_release(k, 0.0, h, n), k * h * h * f64::from(n));
    assert_eq!(press_and_release(k, 0.0, 2.0 * h, n / 2), 2.0 * k * h * h * f64::from(n), "twice as fast");
}

#[test]
fn damping_of_half_stiffness_times_tick_pays_for_that() {
    let (k, h, n) = (1000.0, 1e-4, 50);
    let b = 0.5 * k * DT;
    // The damper takes b h^2 / T a tick, but in the first of 2 n intervals, which has no force yet, and gives it in the
    // one after the turn, which has still the force of pressing.
    let closed = k * h * h * f64::from(n) - b * h * h / DT * f64::from(2 * n - 3);
    let found = press_and_release(k, b, h, n);
    assert!((found - closed).abs() < 1e-15, "{found} {closed}");
    assert!((found - 1.5 * k * h * h).abs() < 1e-15, "what the turn costs is left: {found}");
}

#[test]
fn a_tick_of_the_spring_alone_feeds_half_its_stiffness_times_the_way_squared() {
    // dE + dS of a tick: -k x h + k ((x + h)^2 - x^2) / 2, the same in and out.
    let (k, h, x) = (2000.0, 1e-4, 3e-3);
    for sign in [1.0, -1.0] {
        let mut observer = observer();
        let mut at = |depth: f64| {
            observer.step(&Port::new(Vector3::y() * -depth, Vector3::y() * k * depth, DT)).energy_j
        };
        let fed = -at(x) + at(x + sign * h);
        let stored = 0.5 * k * ((x + sign * h).powi(2) - x * x);
        assert!((fed + stored - 0.5 * k * h * h).abs() < 1e-15);
    }
}

/// Apart from the code under test: positions and forces are collected first, then summed up.
#[test]
fn what_is_seen_is_the_sum_over_the_recording() {
    for (is_late, is_told) in [(false, false), (true, false), (false, true)] {
        let mut passivity = controller(DT);
        let (mut hand, mut noise) = (Hand::new(1), Noise(2));
        let (mut positions, mut chosen, mut applied, mut seen) = (vec![], vec![], vec![], vec![]);
        for _ in 0..5000 {
            hand.wander(100.0, DT);
            let force = noise.vector(2.0);
            let told = is_told.then(|| noise.vector(2.0));
            let port = Port {
                applied_on_user_W: told,
                is_late,
                ..Port::new(hand.read(3e-5), force, DT).storing(1.0)
            };
            let out = passivity.step(&port);
            positions.push(port.position_W);
            chosen.push(out.force_on_user_W);
            applied.push(told.unwrap_or_default());
            seen.push(out.energy_j);
        }
        let mut energy = 0.0;
        for k in 1..positions.len() {
            let way: Vector3<f64> = positions[k] - positions[k - 1];
            energy += match (is_told, is_late) {
                (true, _) => applied[k].dot(&way),
                (false, false) => chosen[k - 1].dot(&way),
                (false, true) if k > 1 => chosen[k - 2].dot(&way),
                (false, true) => 0.0,
            };
            assert!((energy - seen[k]).abs() < 1e-12, "{k}: {energy} {}", seen[k]);
        }
        assert!(energy.abs() > 1e-3, "something was fed or taken: {energy}");
    }
}

/// Checks the documented guarantee between any two ticks, as it is stated.
struct Guarantee {
    spec: PassivitySpec,
    /// Fed less what the specification lets be paid.
    unpaid_j: f64,
    /// The least of that, plus what was stored, over all ticks before.
    least_j: f64,
    last: Option<Vector3<f64>>,
    closest: f64,
}

impl Guarantee {
    fn new(spec: PassivitySpec) -> Self {
        Self { spec, unpaid_j: 0.0, least_j: 0.0, last: None, closest: f64::INFINITY }
    }

    /// A tick that found the finger at `position`, where `acting` (N) had acted, and whose contacts hold `stored` (J).
    fn check(
        &mut self,
        position: Vector3<f64>,
        acting: &Vector3<f64>,
        stored: f64,
        dt: f64,
    ) -> Result<(), f64> {
        let way = self.last.replace(position).map_or(Vector3::zeros(), |last| position - last);
        let paid = self.spec.recovery_w * dt + self.spec.device_friction_n * way.norm();
        self.unpaid_j += acting.dot(&way) - paid;
        let room = self.spec.bound_j - (self.unpaid_j - self.least_j);
        self.closest = self.closest.min(room);
        self.least_j = self.least_j.min(self.unpaid_j + stored);
        // Sums of 1e5 numbers of some millijoules.
        if room >= -1e-12 { Ok(()) } else { Err(room) }
    }
}

/// Plays a source to a hand; returns how near the bound it came (J), and how often the force was changed.
fn play(
    name: &str,
    source: &mut Source,
    (seed, is_worst, is_late): (u64, bool, bool),
    spec: PassivitySpec,
    dt: f64,
    ticks: usize,
) -> (f64, usize) {
    let mut passivity = Passivity::new(spec, dt).unwrap();
    let mut guarantee = Guarantee::new(spec);
    let mut hand = Hand::new(seed);
    let (mut acting, mut pending) = (Vector3::zeros(), Vector3::zeros());
    let (mut changed, mut stored_before) = (0, 0.0f64);
    for k in 0..ticks {
        let most = spec.acceleration_m_per_s2;
        if is_worst && k > 0 {
            hand.follow(&acting, most, dt);
        } else if k > 0 {
            hand.wander(most, dt);
        }
        let position = hand.read(spec.resolution_m);
        let (wanted, stored) = source(&position, k);
        let port = Port { is_late, ..Port::new(position, wanted, dt).storing(stored) };
        let out = passivity.step(&port);
        let before = std::mem::replace(&mut stored_before, stored);
        let may_come_back = if is_late { stored.max(before) } else { stored };
        if let Err(beyond) = guarantee.check(position, &acting, may_come_back, dt) {
            panic!("{name}, {} Hz, worst: {is_worst}, late: {is_late}, tick {k}: {beyond} J", 1.0 / dt);
        }
        let force = out.force_on_user_W;
        assert!(force.norm() <= wanted.norm() * (1.0 + 1e-12), "{name}: never larger");
        assert!(force.dot(&wanted) >= 0.0, "{name}: never against it");
        changed += usize::from(force != wanted);
        (acting, pending) = if is_late { (pending, force) } else { (force, force) };
    }
    (guarantee.closest, changed)
}

#[test]
fn no_source_feeds_more_than_the_bound_into_any_hand_between_any_two_ticks() {
    for (index, rate) in RATES_HZ.into_iter().enumerate() {
        let (dt, seed) = (1.0 / rate, 10 + index as u64);
        let usual = PassivitySpec::usual(dt);
        let strict = PassivitySpec { recovery_w: 0.0, device_friction_n: 0.0, ..usual };
        for (is_late, is_worst, spec) in [
            (false, false, usual),
            (false, true, usual),
            (false, true, strict),
            (true, false, strict),
            (true, true, usual),
            (true, true, strict),
        ] {
            for (name, mut source) in sources::active(seed) {
                let how = (seed, is_worst, is_late);
                let (closest, changed) = play(name, &mut source, how, spec, dt, 100_000);
                assert!(!is_worst || changed > 0, "{name} at {rate} Hz is no test: {closest}");
            }
        }
    }
}

#[test]
fn a_bound_of_any_size_is_kept_and_used() {
    for bound_j in [1e-9, 1e-5, 1e-3, 0.1] {
        let unpaid = PassivitySpec { recovery_w: 0.0, device_friction_n: 0.0, ..PassivitySpec::usual(DT) };
        let spec = PassivitySpec { bound_j, ..unpaid };
        let (closest, changed) =
            play("negative friction", &mut sources::chase(4.0), (3, true, false), spec, DT, 100_000);
        // Strict: with nothing paid, all that was ever fed is below it; and what was allowed was given.
        assert!(changed > 1000 && closest < 0.01 * bound_j, "{bound_j}: {closest} {changed}");
    }
}

/// A finger that feels `entities` while it goes along `path`; returns (changed ticks, largest change, ticks in contact).
fn touch(
    entities: &[haptics::Entity],
    dt: f64,
    seconds: f64,
    path: impl Fn(f64) -> Vector3<f64>,
) -> (usize, f64, usize) {
    let mut finger = Finger::new(0.0, entities.len()).unwrap();
    let mut passivity = controller(dt);
    let (mut changed, mut largest, mut touching) = (0, 0.0f64, 0);
    for k in 0..(seconds / dt) as usize {
        let hip = path(k as f64 * dt).map(|x| (x / 3e-5).round() * 3e-5);
        let felt = finger.step(entities, &hip, dt);
        let stored: f64 = finger
            .contacts()
            .map(|c| 0.5 * c.force_on_user_W.norm_squared() / entities[c.entity].stiffness_n_per_m)
            .sum();
        let out = passivity.step(&Port::new(hip, felt.force_on_user_W, dt).storing(stored));
        let is_same = out.force_on_user_W.map(f64::to_bits) == felt.force_on_user_W.map(f64::to_bits);
        changed += usize::from(!is_same);
        largest = largest.max(out.changed_n);
        touching += usize::from(felt.entity.is_some());
    }
    (changed, largest, touching)
}

#[test]
fn passive_material_is_untouched_to_the_bit() {
    for rate in RATES_HZ {
        let dt = 1.0 / rate;
        for k in [500.0, 1000.0, 2000.0] {
            for friction in [haptics::Friction::None, stiction()] {
                let material = |entity: haptics::Entity| {
                    let stiff = haptics::Entity { stiffness_n_per_m: k, ..entity };
                    // Twice what pays for sampling.
                    stiff.with_damping(k * dt).unwrap()
                };
                let entities = [material(table(friction.clone()))];
                // Pressed 5 mm deep twice a second, with a peak of 31 mm/s, and drawn to and fro over it meanwhile.
                let path = |t: f64| {
                    let y = 0.003 - 0.008 * (0.5 - 0.5 * (4.0 * std::f64::consts::PI * t).cos());
                    Vector3::new(0.02 * (3.0 * t).sin(), y, 0.0)
                };
                let (changed, _, touching) = touch(&entities, dt, 10.0, path);
                assert_eq!(changed, 0, "{rate} Hz, {k} N/m, {friction:?}");
                assert!(touching as f64 > 0.5 * 10.0 / dt, "{touching}");
            }
        }
    }
}

#[test]
fn a_finger_that_rests_without_credit_gets_its_whole_force() {
    for rate in RATES_HZ {
        let mut passivity = controller(1.0 / rate);
        let wanted = Vector3::new(3.0, -7.9, 0.5);
        let out = passivity.step(&Port::new(Vector3::zeros(), wanted, 1.0 / rate));
        // A Premium's 8.5 N.
        assert_eq!(out.force_on_user_W, wanted);
    }
}

/// All that may be fed is gone, and the finger stands still with its wall.
fn exhausted() -> (Passivity, Vector3<f64>) {
    let mut passivity = controller(DT);
    let mut source = sources::chase(4.0);
    let mut hand = Hand::new(5);
    for k in 0..20_000 {
        let position = hand.read(3e-5);
        let out = passivity.step(&Port::new(position, source(&position, k).0, DT));
        hand.follow(&out.force_on_user_W, 150.0, DT);
    }
    // Whichever way it went, it stops.
    for k in 0..200 {
        hand.way *= 0.9;
        hand.position += hand.way;
        let position = hand.read(3e-5);
        passivity.step(&Port::new(position, source(&position, k).0, DT));
    }
    assert!(passivity.balance_j() > 0.5 * passivity.spec().bound_j, "{}", passivity.balance_j());
    (passivity, hand.read(3e-5))
}

#[test]
fn at_rest_nothing_chatters_and_the_force_comes_back_evenly() {
    let (mut passivity, at) = exhausted();
    let wanted = Vector3::new(1.0, 6.0, 0.0);
    let step_n = passivity.spec().recovery_w * DT / passivity.spec().bound_j * 8.5;
    let first = passivity.step(&Port::new(at, wanted, DT));
    let mut last = passivity.step(&Port::new(at, wanted, DT)).force_on_user_W.norm();
    assert!(first.changed_n > 1.0, "it is held back: {first:?}");
    for _ in 0..12_000 {
        let out = passivity.step(&Port::new(at, wanted, DT));
        let force = out.force_on_user_W.norm();
        // The budget grows by the recovery of a tick, and the force with it, as the bound lets 8.5 N pass; and the
        // projection's halving ends at a rounding.
        assert!((-1e-12..=step_n + 1e-12).contains(&(force - last)), "{last} {force}");
        assert!(force > 0.0 && out.force_on_user_W.cross(&wanted).norm() < 1e-9, "of the same direction");
        last = force;
    }
    assert_eq!(last, wanted.norm(), "ten seconds pay all of it");
}

#[test]
fn a_counter_that_flickers_changes_the_force_by_its_share_of_what_is_not_known_only() {
    let (mut passivity, at) = exhausted();
    let wanted = Vector3::new(0.0, 6.0, 0.0);
    for _ in 0..100 {
        passivity.step(&Port::new(at, wanted, DT));
    }
    let q = passivity.spec().resolution_m;
    let r = 150.0 * DT * DT + 2.0 * f64::sqrt(3.0) * q;
    let mut last = None;
    for k in 0..2000u32 {
        let flicker = Vector3::y() * if k % 3 == 0 { q } else { 0.0 };
        let force = passivity.step(&Port::new(at + flicker, wanted, DT)).force_on_user_W.y;
        if let Some(last) = last.replace(force) {
            // F = A / (r + p), with p between -q and q, and A changed by at most F q: (r + q)^2 / r (r - q).
            let most = (r + q) / (r - q) * (1.0 + q / (r - q));
            assert!(force <= last * most && last <= force * most, "{last} {force} {most}");
        }
    }
}

#[test]
fn a_wall_that_was_spent_comes_back_where_it_is_pressed() {
    let (mut passivity, at) = exhausted();
    // Pressed slowly, a wall of 2000 N/m: what is let through grows by e over every r of the way.
    let wanted = Vector3::y() * 5.0;
    let mut depth = 0.0;
    let mut force = 0.0;
    while force < wanted.y && depth < 5e-3 {
        depth += 1e-5;
        force =
            passivity.step(&Port::new(at - Vector3::y() * depth, wanted, DT).storing(6e-3)).force_on_user_W.y;
    }
    // From a hundredth of a newton it takes six times r = 0.25 mm.
    assert!(depth < 2e-3, "{depth} {force}");
}

#[test]
fn what_friction_took_buys_nothing_later() {
    let mut passivity = controller(DT);
    let way = 1e-4;
    let mut at = Vector3::zeros();
    // A metre of drag of 2 N: 2 J.
    for _ in 0..10_000 {
        at.x += way;
        passivity.step(&Port::new(at, Vector3::x() * -2.0, DT).storing(2e-3));
    }
    assert!(passivity.energy_j() < -1.99 && passivity.balance_j() == -2e-3, "{passivity:?}");
    // Then a push along the way.
    let before = passivity.energy_j();
    for _ in 0..10_000 {
        at.x += way;
        passivity.step(&Port::new(at, Vector3::x() * 2.0, DT));
    }
    let (fed, spec) = (passivity.energy_j() - before, *passivity.spec());
    // Beside the bound ten seconds of recovery, and a metre of the device's own friction.
    let paid = 10.0 * spec.recovery_w + 1.0 * spec.device_friction_n;
    assert!(fed <= spec.bound_j + paid, "{fed} {paid}");
}

#[test]
fn a_reset_keeps_debts_and_forgets_credit() {
    let (mut spent, at) = exhausted();
    let owed = spent.balance_j();
    spent.reset();
    assert_eq!(spent.balance_j(), owed);
    // From elsewhere: nobody moved it there.
    let energy = spent.energy_j();
    spent.step(&Port::new(at + Vector3::x(), Vector3::x(), DT));
    assert_eq!(spent.energy_j(), energy);
    let mut pressed = controller(DT);
    for k in 0..50 {
        let depth = f64::from(k) * 1e-4;
        pressed.step(&Port::new(Vector3::y() * -depth, Vector3::y() * 1000.0 * depth, DT).storing(1.0));
    }
    assert!(pressed.balance_j() < -5e-3);
    pressed.reset();
    assert_eq!(pressed.balance_j(), 0.0);
}

#[test]
fn a_finger_that_is_carried_takes_no_energy() {
    let mut passivity = controller(DT);
    passivity.step(&Port::new(Vector3::zeros(), Vector3::x(), DT));
    passivity.carry(Vector3::x() * 0.01);
    passivity.step(&Port::new(Vector3::x() * 0.011, Vector3::x(), DT));
    // A newton over the millimetre that the hand itself went; positions are rounded at 1e-18.
    assert!((passivity.energy_j() - 1e-3).abs() < 1e-15, "{}", passivity.energy_j());
}

#[test]
fn missed_ticks_count_with_the_force_that_was_held() {
    let mut passivity = controller(DT);
    passivity.step(&Port::new(Vector3::zeros(), Vector3::x() * 2.0, DT));
    passivity.step(&Port::new(Vector3::x() * 1e-3, Vector3::zeros(), 7.0 * DT));
    assert_eq!(passivity.energy_j(), 2e-3);
}

#[test]
fn a_sensor_that_jumps_is_no_hand_that_moves() {
    let mut passivity = controller(DT);
    passivity.step(&Port::new(Vector3::zeros(), Vector3::x() * 2.0, DT));
    passivity.step(&Port::new(Vector3::x() * 0.5, Vector3::x() * 2.0, DT));
    assert_eq!(passivity.energy_j(), 0.0, "500 m/s");
    let jolt = passivity.step(&Port::new(Vector3::x() * 0.51, Vector3::x() * 2.0, DT));
    assert!((jolt.energy_j - 0.02).abs() < 1e-15, "10 m/s is a jolt");
    assert_eq!(
        passivity.balance_j(),
        passivity.spec().bound_j,
        "it is forgiven what it fed beyond the bound"
    );
}

#[test]
fn no_input_makes_a_force_that_is_not_finite_or_larger_than_wanted() {
    let numbers =
        [0.0, -1e-3, 1e-300, 1e-4, 1.0, 1e200, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
    let mut noise = Noise(11);
    for seed in 0..20 {
        let mut passivity = controller(DT);
        for _ in 0..5000 {
            let mut pick = || numbers[(noise.uniform() * numbers.len() as f64) as usize % numbers.len()];
            let mut vector = || Vector3::new(pick(), pick(), pick());
            let (position_W, force_on_user_W, applied) = (vector(), vector(), vector());
            let (pressing_W, normal_W) = (vector(), vector());
            let port = Port {
                position_W,
                force_on_user_W,
                applied_on_user_W: (seed % 2 == 0).then_some(applied),
                stored_j: pick(),
                is_late: seed % 3 == 0,
                dt_s: pick(),
                pressing: Pressing {
                    force_on_user_W: pressing_W,
                    normal_on_user_W: normal_W,
                    stored_j: pick(),
                    followed_j: pick(),
                },
            };
            let out = passivity.step(&port);
            let force = out.force_on_user_W;
            assert!(force.iter().all(|n| n.is_finite()), "{port:?} {out:?}");
            assert!(out.energy_j.is_finite() && out.changed_n.is_finite(), "{port:?} {out:?}");
            // In shares of the largest component: squares of the largest numbers are none.
            let largest = force_on_user_W.amax();
            let [is, wanted] = [force, force_on_user_W].map(|force| (force / largest).norm());
            assert!(
                is <= wanted * (1.0 + 1e-12) || force.amax() == 0.0 || largest.is_nan(),
                "{port:?} {out:?}"
            );
            assert!(passivity.balance_j() <= passivity.spec().bound_j, "{passivity:?}");
        }
        // And afterwards all is well again, once its debts are paid.
        passivity.reset();
        for _ in 0..11_000 {
            passivity.step(&Port::new(Vector3::zeros(), Vector3::zeros(), DT));
        }
        let wanted = Vector3::y();
        assert_eq!(passivity.step(&Port::new(Vector3::zeros(), wanted, DT)).force_on_user_W, wanted);
    }
}

#[test]
fn numbers_out_of_range_are_refused_with_their_name() {
    let usual = PassivitySpec::usual(DT);
    let cases = [
        (PassivitySpec { bound_j: 0.0, ..usual }, "bound_j"),
        (PassivitySpec { recovery_w: -1.0, ..usual }, "recovery_w"),
        (PassivitySpec { device_friction_n: f64::NAN, ..usual }, "device_friction_n"),
        (PassivitySpec { acceleration_m_per_s2: f64::INFINITY, ..usual }, "acceleration_m_per_s2"),
        (PassivitySpec { resolution_m: -1e-6, ..usual }, "resolution_m"),
    ];
    for (spec, name) in cases {
        assert!(Passivity::new(spec, DT).unwrap_err().to_string().starts_with(name));
    }
    assert!(Passivity::new(usual, 0.0).unwrap_err().to_string().starts_with("period_s"));
}
