//! Pictures that no surface has: cliffs and noise of centimetres. The force follows the way of the hand all the same.

use crate::common::pictures::*;
use crate::common::*;
use haptics::{Cuboid, Friction, HeightForm, Shape, Sphere};
use nalgebra::Vector3;

const WAY_M: f64 = 2e-5;
/// 5000 a metre.
const LEAN: f64 = 0.1;
const AMPLITUDE_M: f64 = 0.02;
/// Deeper and the hand of these tests hardly touches.
const CARVED_M: f64 = 0.002;
/// sqrt(1 + 2^2): what the steepest slope that is felt makes of a load.
const STEEP: f64 = 2.236_067_977_499_79;

/// Strokes to and fro at 20 mm/s, 1 mm below the surface, in directions at random.
fn stroke(
    name: &str,
    shape: &Shape,
    form: HeightForm,
    picture: &std::sync::Arc<haptics::HeightGrid>,
    radius_m: f64,
) {
    // Carved and raised.
    for amplitude_m in [AMPLITUDE_M, -CARVED_M] {
        let map = sized(picture, amplitude_m, 0.01).with_form(form);
        let entity = with(entity(shape.clone(), Friction::None), map);
        let mut finger = finger(radius_m);
        let mut noise = Noise(11);
        let (mut at, mut goes_to) =
            (Vector3::new(0.001, 0.08, 0.0), Vector3::new(0.0, 0.049 + radius_m, 0.0));
        let (mut last, mut has_touched) = (Vector3::zeros(), 0);
        for tick_number in 0..12_000 {
            let left = goes_to - at;
            if left.norm() < WAY_M {
                goes_to =
                    Vector3::new(noise.between(-0.02, 0.02), 0.049 + radius_m, noise.between(-0.02, 0.02));
            }
            at += left.cap_magnitude(WAY_M);
            let was_touching = finger.contact(0).is_some();
            let force = tick(&mut finger, &entity, &at).force_on_user_W;
            if let (Some(contact), true) = (finger.contact(0), was_touching) {
                let change_n = (force - last).norm();
                let told =
                    format!("{name}, {form:?}, {amplitude_m}, {radius_m}, tick {tick_number}: {change_n} N");
                // The finger's own way and twice that of the picture, and the lean by the way.
                let lean_n = LEAN * contact.normal_force_n.max(last.norm());
                let most_n = 3.0 * STEEP * K * WAY_M + lean_n;
                assert!(change_n <= most_n + 1e-9, "{told}, at most {most_n}");
                assert!(
                    contact.explained_n <= 5.0 * STEEP * K * WAY_M + LEAN * force.norm() + 1e-9,
                    "{told}: {contact:?}"
                );
                has_touched += 1;
            }
            last = force;
        }
        assert!(has_touched > 100, "{name}, {form:?}, {amplitude_m}, {radius_m}: {has_touched}");
    }
}

#[test]
fn over_cliffs_and_noise_the_force_follows_the_way_of_the_hand() {
    let cliff = picture(SIDE, |u, _| f64::from(u > 0.5));
    let noise = rough(SIDE, 5);
    let shapes: [(&str, Shape); 2] =
        [("box", Cuboid::new([0.1; 3]).unwrap().into()), ("ball", Sphere::new(0.05).unwrap().into())];
    for (name, shape) in &shapes {
        for (of, picture) in [("cliffs", &cliff), ("noise", &noise)] {
            for form in [HeightForm::Gradient, HeightForm::AlongForce] {
                for radius_m in [0.0, 0.004] {
                    stroke(&format!("{of} on a {name}"), shape, form, picture, radius_m);
                }
            }
        }
    }
}

/// The whole height of a cliff is felt once the finger has gone half of that beyond it.
#[test]
fn behind_a_cliff_its_whole_height_is_felt() {
    let cliff = picture(SIDE, |u, _| f64::from(u > 0.5));
    let map = sized(&cliff, 4e-3, 0.04).with_form(HeightForm::AlongForce);
    let entity = with(table(Friction::None), map);
    let mut finger = point_finger();
    for tick_number in 0..750 {
        let x_m = -5e-3 + WAY_M * f64::from(tick_number);
        let force_n = tick(&mut finger, &entity, &Vector3::new(x_m, -1e-3, 0.0)).force_on_user_W.y;
        let [low_n, high_n] = [K * 1e-3, K * 5e-3];
        // The spline is even from a texel and a half off; the finger comes with its first tick.
        if x_m < -1e-3 {
            assert!((force_n - low_n).abs() < 1e-9, "{x_m}: {force_n}");
        } else if x_m > 1e-3 + 2e-3 {
            assert!((force_n - high_n).abs() < 1e-9, "{x_m}: {force_n}");
        } else {
            assert!((low_n - 1e-9..=high_n + 1e-9).contains(&force_n), "{x_m}: {force_n}");
        }
    }
}
