//! Every friction model, felt through scene file, hand file and recording alone.

use nalgebra::Vector3;
use system_tests::recording::Sample;
use system_tests::workplace::{felt, hand};

const STIFFNESS: f64 = 500.0;
const DEPTH_M: f64 = 0.005;
/// Sliding ratios are promised to nine digits.
const RATIO_TOLERANCE: f64 = 1e-9;

fn table(friction: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.1, 0.0]\n[[entity]]\nname = \"table\"\nstiffness_n_per_m = {STIFFNESS:?}\n\
         shape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}\nfriction = {{ {friction} }}\n"
    )
}

/// Onto the table, 5 mm into it, and then along it at this speed for 3 s, in a direction that is no axis.
fn stroke(speed_m_s: f64) -> String {
    let at = |s: f64, y: f64| [0.8 * s, y, 0.6 * s];
    hand([
        (0.0, at(0.0, 0.01)),
        (0.1, at(0.0, -DEPTH_M)),
        (0.2, at(0.0, -DEPTH_M)),
        (3.2, at(3.0 * speed_m_s, -DEPTH_M)),
    ])
}

/// Tangential over normal force against the motion, in every row that presses.
fn ratios(friction: &str, speed_m_s: f64) -> Vec<(Sample, f64)> {
    let along = Vector3::new(0.8, 0.0, 0.6);
    let samples = felt(&table(friction), &stroke(speed_m_s), &[]);
    let pressed = samples.into_iter().filter(|s| s.hip.y < -1e-4);
    pressed
        .map(|s| {
            let (normal_n, tangential) = s.split(&Vector3::y());
            // k times a depth with one rounding.
            assert_eq!(normal_n, STIFFNESS * -s.hip.y, "{friction}: {s:?}");
            let across = tangential - along * tangential.dot(&along);
            assert!(across.norm() <= RATIO_TOLERANCE * normal_n, "{friction}: it pulls aside: {s:?}");
            let ratio = -tangential.dot(&along) / normal_n;
            (s, ratio)
        })
        .collect()
}

/// Ratio in the last second of the stroke.
fn steady(friction: &str, speed_m_s: f64) -> Vec<f64> {
    let rows = ratios(friction, speed_m_s);
    rows.into_iter().filter(|(s, _)| s.t > 2.2 && s.t < 3.19).map(|(_, ratio)| ratio).collect()
}

const SPEEDS_M_S: [f64; 3] = [0.011, 0.053, 0.29];

/// The Stribeck curve of the documentation.
fn stribeck(speed_m_s: f64) -> f64 {
    0.3 + (0.7 - 0.3) * (-(speed_m_s / 0.02).powi(2)).exp() + 0.5 * speed_m_s
}

/// A model, and its ratio of tangential to normal force in steady sliding at a speed.
type Case = (&'static str, fn(f64) -> f64);

#[test]
fn each_model_slides_steadily_at_the_ratio_that_it_documents() {
    let cases: [Case; 13] = [
        ("model = \"none\"", |_| 0.0),
        ("model = \"coulomb\", mu = 0.5", |_| 0.5),
        ("model = \"stiction\", mu_s = 0.7, mu_d = 0.3", |_| 0.3),
        ("model = \"viscous\", mu_v_s_per_m = 1.5", |v| 1.5 * v),
        ("model = \"coulomb-viscous\", mu = 0.2, mu_v_s_per_m = 1.5", |v| 0.2 + 1.5 * v),
        ("model = \"karnopp\", mu_s = 0.7, mu_d = 0.3, mu_v_s_per_m = 0.5", |v| 0.3 + 0.5 * v),
        ("model = \"dahl\", mu = 0.5", |_| 0.5),
        ("model = \"hayward\", mu = 0.5", |_| 0.5),
        ("model = \"lugre\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 0.02, mu_v_s_per_m = 0.5", stribeck),
        ("model = \"reset-integrator\", mu_s = 0.7, mu_d = 0.3", |_| 0.3),
        ("model = \"fixed-cone\", friction_n = 1.0", |_| 1.0 / (STIFFNESS * DEPTH_M)),
        // Rises by 0.2 over 0.1 m/s, then by 0.3 over 0.3 m/s.
        ("model = \"curve\", speed_m_s = [0.0, 0.1, 0.4], mu = [0.3, 0.5, 0.8], mu_s = 0.7", |v| {
            if v < 0.1 { 0.3 + 2.0 * v } else { 0.5 + (v - 0.1) }
        }),
        // One that begins above rest and ends below the stroke's speed.
        ("model = \"curve\", speed_m_s = [0.02, 0.2], mu = [0.4, 0.8]", |v| {
            0.4 + (v.clamp(0.02, 0.2) - 0.02) / 0.18 * 0.4
        }),
    ];
    for (friction, expected) in cases {
        for speed_m_s in SPEEDS_M_S {
            let expected = expected(speed_m_s);
            for ratio in steady(friction, speed_m_s) {
                // Models with a strain approach their limit exponentially over millimetres of path; viscous parts
                // relax in a tick or two; speeds are differences of positions over a millisecond.
                let is_strain = ["dahl", "hayward", "lugre"].iter().any(|model| friction.contains(model));
                let tolerance = if is_strain && speed_m_s < 0.02 { 1e-3 } else { 1e-8 };
                assert!(
                    (ratio - expected).abs() <= tolerance,
                    "{friction} at {speed_m_s} m/s: {ratio}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn a_falling_curve_is_followed_where_sliding_is_steady() {
    // Down to 0.3 at 0.1 m/s, up again beyond.
    let friction = "model = \"curve\", speed_m_s = [0.0, 0.1, 0.4], mu = [0.5, 0.3, 0.6], mu_s = 0.7";
    for ratio in steady(friction, 0.29) {
        assert!((ratio - 0.49).abs() <= 1e-8, "{ratio}");
    }
    // On the falling part nothing slides steadily: it sticks and slips, within the curve's limits.
    let ratios = steady(friction, 0.011);
    assert!(ratios.iter().all(|ratio| (0.0..=0.7 + RATIO_TOLERANCE).contains(ratio)));
    assert!(ratios.iter().any(|ratio| *ratio > 0.6) && ratios.iter().any(|ratio| *ratio < 0.4));
}

#[test]
fn stribeck_friction_is_on_its_curve_where_sliding_is_steady() {
    let friction = "model = \"stribeck\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 0.02, mu_v_s_per_m = 0.5";
    for speed_m_s in [0.06, 0.29] {
        for ratio in steady(friction, speed_m_s) {
            assert!((ratio - stribeck(speed_m_s)).abs() <= 1e-8, "{ratio} at {speed_m_s} m/s");
        }
    }
    // On the steep part of the curve nothing slides steadily: it sticks and slips, within the curve's limits.
    for ratio in steady(friction, 0.005) {
        assert!((0.0..=0.7 + 0.5 * 0.3).contains(&ratio), "{ratio}");
    }
}

#[test]
fn bristles_rasp_around_their_mean() {
    for bonds in ["", ", bonds = 20, seed = 7"] {
        let ratios = steady(&format!("model = \"bristle\", mu = 0.5{bonds}"), 0.053);
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        // The documentation promises a deviation of mu / sqrt(8 bonds), 8 % of mu; the rows of a second are correlated
        // over one bond's life, some 70 ms, which leaves about 14 independent values: 2 % of mu, three times that.
        assert!((mean - 0.5).abs() <= 0.06 * 0.5, "{bonds}: {mean}");
        assert!(ratios.iter().any(|ratio| (ratio - 0.5).abs() > 0.01), "it rasps");
        assert!(ratios.iter().all(|ratio| (0.0..=0.75 + 1e-12).contains(ratio)), "3/2 mu at most");
    }
    let run = |seed: u32| steady(&format!("model = \"bristle\", mu = 0.5, seed = {seed}"), 0.053);
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2), "another seed, other bristles");
}

#[test]
fn what_holds_breaks_away_at_its_static_coefficient() {
    let cases = [
        ("model = \"coulomb\", mu = 0.5", 0.5),
        ("model = \"stiction\", mu_s = 0.7, mu_d = 0.3", 0.7),
        ("model = \"stribeck\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 0.02", 0.7),
        ("model = \"karnopp\", mu_s = 0.7, mu_d = 0.3", 0.7),
        ("model = \"reset-integrator\", mu_s = 0.7, mu_d = 0.3", 0.7),
        ("model = \"curve\", speed_m_s = [0.0, 0.1], mu = [0.5, 0.3], mu_s = 0.7", 0.7),
        ("model = \"fixed-cone\", friction_n = 1.0, static_n = 1.75", 0.7),
    ];
    let speed_m_s = 0.053;
    for (friction, mu_s) in cases {
        let rows = ratios(friction, speed_m_s);
        let moving = rows.iter().filter(|(s, _)| s.t > 0.2);
        let peak = moving.clone().map(|(_, ratio)| *ratio).fold(0.0, f64::max);
        // It is held until the tick that would go beyond; in a tick the ratio grows by v dt over the depth.
        let step = speed_m_s * 1e-3 / DEPTH_M;
        assert!(peak <= mu_s + RATIO_TOLERANCE && peak > mu_s - step, "{friction}: {peak}");
        let before: Vec<_> = moving.take_while(|(_, ratio)| *ratio < mu_s - step).collect();
        assert!(
            before.len() > 30 && before.iter().all(|(s, _)| s.friction == "stick"),
            "{friction}: held until then"
        );
        assert!(before.iter().all(|(s, _)| (s.god.x, s.god.z) == (0.0, 0.0)), "{friction}: to the last bit");
    }
}

#[test]
fn a_hand_at_rest_is_held_and_not_pushed() {
    // Pressed, dragged, and then held still: the force rests as well, inside the model's limit.
    let at = |x: f64| [x, -DEPTH_M, 0.0];
    let path = hand([(0.0, [0.0, 0.01, 0.0]), (0.1, at(0.0)), (0.6, at(0.02)), (1.6, at(0.02))]);
    for friction in [
        "model = \"stribeck\", mu_s = 0.7, mu_d = 0.3, v_s_m_s = 0.02",
        "model = \"karnopp\", mu_s = 0.7, mu_d = 0.3",
        "model = \"dahl\", mu = 0.5",
        "model = \"lugre\", mu_s = 0.7, mu_d = 0.3",
        "model = \"hayward\", mu = 0.5",
        "model = \"bristle\", mu = 0.5",
        "model = \"reset-integrator\", mu_s = 0.7, mu_d = 0.3",
        "model = \"fixed-cone\", friction_n = 1.0",
        "model = \"curve\", speed_m_s = [0.0, 0.1], mu = [0.5, 0.3]",
    ] {
        let samples = felt(&table(friction), &path, &[]);
        let still: Vec<&Sample> = samples.iter().filter(|s| s.t > 0.7).collect();
        let first = still.first().expect("rows").force;
        assert!(
            still.iter().all(|s| s.force == first),
            "{friction}: a hand that rests feels a force that rests"
        );
        assert!(first.x < -0.1 && first.x > -0.75 * first.y, "{friction}: {first:?}");
    }
}
