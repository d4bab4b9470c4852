//! Bodies that nothing presses: what turning without torque is, against closed forms and a slow reference.
#![allow(non_snake_case)]

use std::f64::consts::PI;

use haptics::{Entity, Sphere};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use physics::{Body, Integrator, Manipulation, MassProperties, Settings};

const DT: f64 = 1e-3;

/// A brick of 3 : 2 : 1.
const MOMENTS: [f64; 3] = [5e-5, 1e-4, 1.3e-4];

fn spinning(moments: [f64; 3], omega_B: Vector3<f64>, turned: UnitQuaternion<f64>) -> Body {
    let sphere = Sphere::new(0.02).unwrap();
    let mass = MassProperties::of_shape(&sphere.into(), 0.1).unwrap().with_inertia(moments).unwrap();
    let pose = Isometry3::from_parts(Vector3::zeros().into(), turned);
    Body::at_rest(mass, &pose).moving(Vector3::zeros(), turned * omega_B)
}

/// Bodies in empty space.
struct Space {
    entities: Vec<Entity>,
    manipulation: Manipulation,
}

impl Space {
    fn new(body: Body, integrator: Integrator) -> Self {
        Self::up_to(1e9, body, integrator)
    }

    /// However fast it turns.
    fn without_limit(body: Body, integrator: Integrator) -> Self {
        Self::up_to(f64::INFINITY, body, integrator)
    }

    fn up_to(most_spin_rad_s: f64, body: Body, integrator: Integrator) -> Self {
        let sphere = Sphere::new(0.02).unwrap();
        let entities = vec![Entity::new(sphere, body.pose(), 1000.0).unwrap()];
        let settings =
            Settings { gravity_W: Vector3::zeros(), integrator, most_spin_rad_s, ..Settings::default() };
        let manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
        Self { entities, manipulation }
    }

    fn step(&mut self, dt_s: f64) -> &Body {
        self.manipulation.step(&mut self.entities, &mut [], dt_s);
        self.body()
    }

    fn body(&self) -> &Body {
        &self.manipulation.bodies()[0]
    }
}

fn omega_B(body: &Body) -> Vector3<f64> {
    body.orientation.inverse() * body.angular_velocity_W()
}

/// Jacobi's sn, cn, dn by the arithmetic-geometric mean (Abramowitz and Stegun 16.4), m the parameter.
fn jacobi(u: f64, m: f64) -> [f64; 3] {
    let (mut a, mut b, mut c) = (vec![1.0_f64], (1.0 - m).sqrt(), vec![m.sqrt()]);
    while c.last().unwrap().abs() > 1e-16 {
        let last = *a.last().unwrap();
        c.push(0.5 * (last - b));
        a.push(0.5 * (last + b));
        b = (last * b).sqrt();
    }
    let n = a.len() - 1;
    let mut phi = 2.0_f64.powi(n as i32) * a[n] * u;
    for i in (1..=n).rev() {
        phi = 0.5 * (phi + (c[i] / a[i] * phi.sin()).asin());
    }
    let sn = phi.sin();
    [sn, phi.cos(), (1.0 - m * sn * sn).sqrt()]
}

/// Landau and Lifshitz, Mechanics, section 37: a body with moments I1 < I2 < I3 that passes omega_2 = 0 at t = 0, and whose
/// L^2 is more than 2 E I2.
fn exact_omega_B(t: f64, [I1, I2, I3]: [f64; 3], omega_1: f64, omega_3: f64) -> Vector3<f64> {
    let E2 = I1 * omega_1 * omega_1 + I3 * omega_3 * omega_3;
    let L2 = (I1 * omega_1).powi(2) + (I3 * omega_3).powi(2);
    assert!(L2 > E2 * I2);
    let rate = ((I3 - I2) * (L2 - E2 * I1) / (I1 * I2 * I3)).sqrt();
    let m = (I2 - I1) * (E2 * I3 - L2) / ((I3 - I2) * (L2 - E2 * I1));
    let [sn, cn, dn] = jacobi(rate * t, m);
    let two = ((E2 * I3 - L2) / (I2 * (I3 - I2))).sqrt();
    Vector3::new(omega_1 * cn, two * sn, omega_3 * dn)
}

/// Euler's equations and the quaternion in steps so short that nothing is left of their error.
fn tiny_steps(start: &Body, seconds: f64) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let J = start.mass.principal_kg_m2;
    let rate = |w: &Vector3<f64>| -w.cross(&J.component_mul(w)).component_div(&J);
    let (mut w, mut q) = (omega_B(start), start.orientation);
    let h = 1e-5;
    for _ in 0..(seconds / h).round() as usize {
        let k1 = rate(&w);
        let k2 = rate(&(w + k1 * (h / 2.0)));
        let k3 = rate(&(w + k2 * (h / 2.0)));
        let k4 = rate(&(w + k3 * h));
        let middle = w + (k1 * 5.0 + k2 * 4.0 + k3 * 4.0 - k4) * (h / 24.0);
        w += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        q *= UnitQuaternion::from_scaled_axis(middle * h);
    }
    (w, q)
}

#[test]
fn the_asymmetric_top_turns_as_jacobis_elliptic_functions_say() {
    //= melder#5.8 type=test
    //= melder#5.15 type=test
    let (omega_1, omega_3) = (3.0, 8.0);
    // Ticks, and the largest error as a share of the angular velocity.
    let cases = [
        // The middle of a step of h rad is off by h^2 / 12 and less: 2e-5 of the rate at 16 rad/s (I1 is what the largest
        // rate is reckoned with), in phase over 10 s and some 60 rad, at most.
        (Integrator::Implicit, 10_000, 1e-3),
        // h^4 / 120 of the rate.
        (Integrator::Rk4, 10_000, 1e-8),
        // h / 2 of what the rate changes by, again and again: some percent after 8 rad.
        (Integrator::ThesisEulerGyroscopic, 1000, 0.1),
    ];
    for (integrator, ticks, tolerance) in cases {
        let start = spinning(MOMENTS, Vector3::new(omega_1, 0.0, omega_3), UnitQuaternion::identity());
        let mut space = Space::new(start, integrator);
        let mut worst = 0.0_f64;
        for tick in 1..=ticks {
            let exact = exact_omega_B(f64::from(tick) * DT, MOMENTS, omega_1, omega_3);
            worst = worst.max((omega_B(space.step(DT)) - exact).norm() / exact.norm());
        }
        assert!(worst < tolerance, "{integrator:?}: {worst}");
    }
    // And the closed form is what tiny steps make.
    let start = spinning(MOMENTS, Vector3::new(omega_1, 0.0, omega_3), UnitQuaternion::identity());
    let slow = tiny_steps(&start, 1.0).0;
    assert!((slow - exact_omega_B(1.0, MOMENTS, omega_1, omega_3)).norm() < 1e-11);
}

#[test]
fn orientation_goes_where_tiny_steps_go() {
    let turned = UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1);
    let start = spinning(MOMENTS, Vector3::new(3.0, 1.0, 8.0), turned);
    let (_, reference) = tiny_steps(&start, 2.0);
    // Angles after 2 s (rad): the rates' errors above, times the angle turned (17 rad).
    for (integrator, tolerance) in [(Integrator::Implicit, 5e-4), (Integrator::Rk4, 1e-8)] {
        let mut space = Space::new(start, integrator);
        for _ in 0..2000 {
            space.step(DT);
        }
        let off = space.body().orientation.angle_to(&reference);
        assert!(off < tolerance, "{integrator:?}: {off}");
    }
}

#[test]
fn momentum_is_kept_to_rounding_and_energy_within_a_percent_at_any_spin_rate() {
    for (spin, ticks) in [(1.0, 20_000), (100.0, 5000), (2000.0, 5000), (1e4, 5000), (1e5, 500), (1e7, 500)] {
        for moments in [MOMENTS, [1e-6, 1e-4, 1.005e-4], [1e-4, 1e-4, 1.9e-4], [1e-4; 3]] {
            let start = spinning(moments, Vector3::new(0.3, 0.5, 0.8) * spin, UnitQuaternion::identity());
            let mut space = Space::new(start, Integrator::Implicit);
            let energy_j = start.kinetic_energy_j();
            let (L_W, mut worst) = (start.angular_momentum_W, 0.0_f64);
            for _ in 0..ticks {
                let body = space.step(DT);
                worst = worst.max((body.kinetic_energy_j() / energy_j - 1.0).abs());
                assert_eq!(body.angular_momentum_W, L_W);
            }
            // Steps of a quarter of a radian swing by h^2 / 24 = 0.3 % of what differs between the axes. Beyond 16,000
            // rad/s steps are longer: there the energy only stays between those about the longest and the shortest axis.
            if spin <= 1e4 {
                assert!(worst < 0.01, "{spin} rad/s, {moments:?}: {worst}");
            }
            let most = 0.5 * L_W.norm_squared() / moments.iter().fold(f64::MAX, |a, b| a.min(*b));
            let least = 0.5 * L_W.norm_squared() / moments.iter().fold(0.0, |a, b| f64::max(a, *b));
            let is = space.body().kinetic_energy_j();
            assert!((least * (1.0 - 1e-12)..=most * (1.0 + 1e-12)).contains(&is));
        }
    }
}

#[test]
fn about_the_middle_axis_it_tumbles_and_about_the_others_it_does_not() {
    let tumbles = |axis: usize| {
        let mut omega = Vector3::repeat(0.01);
        omega[axis] = 10.0;
        let mut space =
            Space::new(spinning(MOMENTS, omega, UnitQuaternion::identity()), Integrator::Implicit);
        (0..5000).any(|_| omega_B(space.step(DT))[axis] < -5.0)
    };
    assert_eq!([0, 1, 2].map(tumbles), [false, true, false]);
}

#[test]
fn the_middle_axis_turns_over_when_the_elliptic_functions_say() {
    // Just off the middle axis: half a period of sn takes K(m) twice.
    let (omega_1, omega_3) = (5.0, 6.2);
    let start = spinning(MOMENTS, Vector3::new(omega_1, 0.0, omega_3), UnitQuaternion::identity());
    let mut space = Space::new(start, Integrator::Implicit);
    let (mut turns, mut exact_turns) = (Vec::new(), Vec::new());
    let (mut was, mut exact_was) = (0.0, 0.0);
    for tick in 1..=20_000 {
        let is = omega_B(space.step(DT)).y;
        let exact = exact_omega_B(f64::from(tick) * DT, MOMENTS, omega_1, omega_3).y;
        if is * was < 0.0 {
            turns.push(f64::from(tick));
        }
        if exact * exact_was < 0.0 {
            exact_turns.push(f64::from(tick));
        }
        (was, exact_was) = (is, exact);
    }
    assert!(exact_turns.len() > 10 && turns.len() == exact_turns.len(), "{turns:?} {exact_turns:?}");
    for (is, exact) in turns.iter().zip(&exact_turns) {
        // 2e-5 of the time gone, and a tick of looking.
        assert!((is - exact).abs() <= 1.0 + 2e-4 * exact, "{is} {exact}");
    }
}

#[test]
fn a_symmetric_top_precesses_with_its_angular_momentum_over_its_transverse_moment() {
    // Axis of symmetry z, 30 degrees off L: it goes round L at L / I1.
    let (transverse, axial) = (1e-4, 1.7e-4);
    let lean = 30.0_f64.to_radians();
    let L = 2e-3;
    let omega_B = Vector3::new(L * lean.sin() / transverse, 0.0, L * lean.cos() / axial);
    for integrator in [Integrator::Implicit, Integrator::Rk4] {
        let start = spinning([transverse, transverse, axial], omega_B, UnitQuaternion::identity());
        let L_W = start.angular_momentum_W;
        let axis_W = |body: &Body| body.orientation * Vector3::z();
        let mut space = Space::new(start, integrator);
        let seconds = 5.0;
        for _ in 0..5000 {
            space.step(DT);
        }
        let expected = UnitQuaternion::from_scaled_axis(L_W / transverse * seconds) * axis_W(&start);
        let off = (axis_W(space.body()) - expected).norm();
        // 20 rad/s for 5 s, 100 rad, of which the middle of a step of 0.02 rad is off by 0.02^2 / 12 at most.
        assert!(off < 3.5e-3, "{integrator:?}: {off}");
    }
}

#[test]
fn the_thesis_integrator_keeps_the_angular_velocity_instead() {
    //= melder#5.9 type=test
    //= melder#5.12 type=test
    let omega = Vector3::new(0.3, 5.0, 0.8);
    let start = spinning(MOMENTS, omega, UnitQuaternion::from_euler_angles(0.3, -0.7, 1.1));
    let omega_W = start.angular_velocity_W();
    let mut space = Space::new(start, Integrator::ThesisEuler);
    for _ in 0..1000 {
        space.step(DT);
    }
    let body = space.body();
    // A rounding for each tick.
    assert!((body.angular_velocity_W() - omega_W).norm() < 1e-12 * omega_W.norm() * 1e3);
    assert!(
        (body.angular_momentum_W - start.angular_momentum_W).norm() > 1e-2 * start.angular_momentum_W.norm()
    );
}

#[test]
fn the_thesis_gyroscopic_term_drains_angular_momentum_until_the_body_spins_about_its_longest_axis() {
    let start = spinning(MOMENTS, Vector3::new(0.3, 0.5, 0.8) * 30.0, UnitQuaternion::identity());
    let mut space = Space::new(start, Integrator::ThesisEulerGyroscopic);
    for _ in 0..10_000 {
        assert!(space.step(DT).is_finite());
    }
    let body = space.body();
    let kept = body.angular_momentum_W.norm() / start.angular_momentum_W.norm();
    let omega_B = omega_B(body);
    // Found 0.54: that of the energy it began with, or a little more, all about the axis of the smallest moment.
    assert!(kept < 0.6, "{kept}");
    assert!(omega_B.x.abs() > 0.99 * omega_B.norm(), "{omega_B}");
}

/// A disc that spins at `spin` (rad/s) about its axis and leans by a billionth of that: by what each tick stretches the lean.
fn growth_of_a_lean(integrator: Integrator, spin: f64) -> f64 {
    let [across, along] = DISC;
    let start =
        spinning([across, across, along], Vector3::new(1e-9 * spin, 0.0, spin), UnitQuaternion::identity());
    let lean = |body: &Body| {
        let (omega_W, axis_W) = (body.angular_velocity_W(), body.orientation * Vector3::z());
        (omega_W - axis_W * omega_W.dot(&axis_W)).norm() / spin
    };
    let mut space = Space::new(start, integrator);
    let (mut is, mut ticks) = (lean(&start), 0);
    // Beyond a thousandth the axis follows, and the closed form no longer is one.
    while ticks < 1000 && is < 1e-3 {
        is = lean(space.step(DT));
        ticks += 1;
    }
    (is / lean(&start)).powf(f64::from(ticks).recip())
}

/// Across its axis, and along (kg m^2).
const DISC: [f64; 2] = [1e-4, 1.7e-4];

#[test]
fn a_spinning_disc_that_leans_is_thrown_over_by_the_printed_term_as_its_closed_form_says() {
    //= melder#5.8 type=test
    //= melder#5.15 type=test
    //= melder#8.1 type=test
    let [across, along] = DISC;
    for spin in [0.1, 1.0, 10.0, 100.0] {
        let rate = spin * (along - across) / across;
        // Euler's method turns what is across by a tick of `rate`, and stretches it; the matrix of a small angle does the
        // same to the axis.
        let stretched = |rate: f64| (1.0 + (rate * DT).powi(2)).sqrt();
        let cases = [
            (Integrator::Implicit, 1.0),
            (Integrator::ThesisEuler, stretched(spin)),
            (Integrator::ThesisEulerGyroscopic, stretched(spin) * stretched(rate)),
            // Without its J the rate is so many times as large.
            (Integrator::ThesisEulerPrinted, stretched(spin) * stretched(rate / along)),
        ];
        for (integrator, expected) in cases {
            let found = growth_of_a_lean(integrator, spin);
            // A lean of a billionth has seven digits, and grows to a thousandth, whose square counts.
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{integrator:?}, {spin} rad/s: {found} {expected}"
            );
        }
    }
}

#[test]
fn with_the_printed_term_a_turning_brick_ends_as_no_number_and_by_default_it_never_does() {
    let fastest = |integrator, ticks| {
        let start = spinning(MOMENTS, Vector3::new(0.3, 0.5, 0.8), UnitQuaternion::identity());
        let mut space = Space::without_limit(start, integrator);
        let mut most = 0.0_f64;
        let lasted = (0..ticks).position(|_| {
            let parked = space.manipulation.step(&mut space.entities, &mut [], DT).parked;
            most = most.max(space.body().angular_velocity_W().norm());
            parked > 0
        });
        (lasted, most / start.angular_velocity_W().norm())
    };
    // Half the difference of 1/J times the rate and the tick is some 6: it squares itself, and 2^10 digits are too many.
    let (lasted, _) = fastest(Integrator::ThesisEulerPrinted, 100);
    assert!(lasted.is_some_and(|ticks| ticks < 20), "{lasted:?}");
    for integrator in [Integrator::Implicit, Integrator::ThesisEulerGyroscopic] {
        let (lasted, most) = fastest(integrator, 10_000);
        // Nothing turns faster than its angular momentum about the axis of its smallest moment.
        assert!(lasted.is_none() && most < MOMENTS[2] / MOMENTS[0], "{integrator:?}: {lasted:?}, {most}");
    }
}

#[test]
fn the_thesis_matrix_turns_a_sphere_by_its_small_angles() {
    //= melder#5.13 type=test
    //= melder#5.14 type=test
    // About the third column nothing but the tangent of the small angle is wrong: atan(omega dt) for omega dt.
    let omega = Vector3::new(0.0, 0.0, 20.0);
    let mut space =
        Space::new(spinning([1e-4; 3], omega, UnitQuaternion::identity()), Integrator::ThesisEuler);
    for _ in 0..100 {
        space.step(DT);
    }
    let angle = 100.0 * (20.0 * DT).atan();
    let turned = Matrix3::new(angle.cos(), -angle.sin(), 0.0, angle.sin(), angle.cos(), 0.0, 0.0, 0.0, 1.0);
    let R = space.body().orientation.to_rotation_matrix();
    assert!((R.matrix() - turned).norm() < 1e-13, "{}", R.matrix());
    assert!(angle < PI);
}

#[test]
fn a_thrown_body_goes_as_galilei_says_with_every_integrator() {
    //= melder#5.7 type=test
    //= melder#5.10 type=test
    //= melder#5.11 type=test
    for (name, integrator) in Integrator::NAMES {
        let sphere = Sphere::new(0.02).unwrap();
        let body = spinning([1e-4; 3], Vector3::zeros(), UnitQuaternion::identity())
            .moving(Vector3::new(1.0, 2.0, 0.0), Vector3::zeros());
        let mut entities = vec![Entity::new(sphere, body.pose(), 1000.0).unwrap()];
        let settings = Settings { integrator, ..Settings::default() };
        let mut manipulation = Manipulation::new(&entities, &[(0, body)], settings).unwrap();
        for _ in 0..500 {
            manipulation.step(&mut entities, &mut [], DT);
        }
        let body = &manipulation.bodies()[0];
        let exact = Vector3::new(0.5, 1.0 - 0.5 * 9.81 * 0.25, 0.0);
        // Euler goes with the velocity of the tick's end, half a tick ahead: g dt t / 2 too low. The others are exact.
        let low = match integrator {
            Integrator::Implicit | Integrator::Rk4 => 0.0,
            _ => 0.5 * 9.81 * DT * 0.5,
        };
        let off = body.centre_W - exact + Vector3::y() * low;
        assert!(off.norm() < 1e-12, "{name}: {off}");
        assert!((body.velocity_W - Vector3::new(1.0, 2.0 - 9.81 * 0.5, 0.0)).norm() < 1e-12, "{name}");
    }
}
