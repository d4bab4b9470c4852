//! A solid made of others, felt through scene file, hand file and recording alone.

use nalgebra::Vector3;
use system_tests::recording::Sample;
use system_tests::workplace::{Workplace, felt, hand};

type V = Vector3<f64>;

const STIFFNESS: f64 = 800.0;

/// A block of 0.1 x 0.04 x 0.08 with a bore of 0.04 along y, a ball in one of its corners, and a wall on it: nested, turned
/// and scaled. Only the finger's start and the rest of the entity are left open.
fn block(rest: &str) -> String {
    format!(
        r#"
        [[finger]]
        start_m = [0.0, 0.5, 0.0]
        [[entity]]
        name = "block"
        stiffness_n_per_m = {STIFFNESS:?}
        shape = {{ kind = "csg", op = "union", children = [
            {{ shape = {{ kind = "csg", op = "difference", children = [
                {{ shape = {{ kind = "box", size_m = [0.1, 0.04, 0.08] }} }},
                {{ shape = {{ kind = "cylinder", radius_m = 0.02, length_m = 0.2 }} }},
                {{ shape = {{ kind = "sphere", radius_m = 0.01 }}, position_m = [0.05, 0.02, 0.04] }},
            ] }} }},
            {{ shape = {{ kind = "box", size_m = [1, 1, 1], scale = [0.08, 0.01, 0.03] }}, position_m = [-0.045, 0.025, 0.0],
               orientation_wxyz = [0.7071067811865476, 0.0, 0.7071067811865476, 0.0] }},
        ] }}
        {rest}"#
    )
}

/// What a god-object's place is good for: slides on curved surfaces end within a fraction of a nanometre.
const PLACE_TOLERANCE_M: f64 = 1e-10;

#[test]
fn each_part_of_a_csg_is_felt_with_its_feature() {
    // Place, normal, feature: the top, the bore's wall (its normal turned by the difference), the ball's hollow, the
    // wall's top, the corner between wall and top.
    let hollow = V::new(-1.0, -1.0, -1.0).normalize();
    for (place, normal, feature) in [
        (V::new(0.03, 0.02, 0.02), V::y(), "face"),
        (V::new(0.02, 0.0, 0.0), -V::x(), "surface"),
        (V::new(0.05, 0.02, 0.04) + hollow * 0.01, -hollow, "surface"),
        (V::new(-0.04, 0.03, 0.01), V::y(), "face"),
        (V::new(-0.03, 0.02, 0.03), V::new(1.0, 1.0, 0.0).normalize(), "edge"),
    ] {
        let at = |height: f64| (place + normal * height).into();
        let path = hand([
            (0.0, [0.0, 0.5, 0.0]),
            (0.5, at(0.005)),
            (0.8, at(-0.003)),
            (1.1, at(-0.003)),
            (1.4, at(0.005)),
        ]);
        let samples = felt(&block(""), &path, &[]);
        let touching: Vec<&Sample> = samples.iter().filter(|s| s.touches()).collect();
        assert!(touching.len() > 300, "{place:?}: {} ticks", touching.len());
        for s in touching {
            assert!((s.god - place).norm() < PLACE_TOLERANCE_M, "{s:?}");
            let expected = normal * (STIFFNESS * normal.dot(&(place - s.hip)));
            assert!((s.force - expected).norm() < STIFFNESS * PLACE_TOLERANCE_M, "{s:?}");
            assert_eq!((s.entity.as_str(), s.feature.as_str()), ("block", feature), "{s:?}");
        }
        assert!(!samples.last().is_some_and(Sample::touches), "{place:?} lets go");
    }
}

#[test]
fn a_csg_slides_at_mu_d_over_its_plane_and_its_curved_parts() {
    let stiction = "friction = { model = \"stiction\", mu_s = 0.4, mu_d = 0.25 }";
    for (place, normal, along) in
        [(V::new(0.04, 0.02, -0.03), V::y(), V::z()), (V::new(0.02, -0.01, 0.0), -V::x(), V::y())]
    {
        let at = |side: f64, height: f64| (place + along * side + normal * height).into();
        let path = hand([
            (0.0, [0.0, 0.5, 0.0]),
            (0.5, at(0.0, 0.005)),
            (0.8, at(0.0, -0.003)),
            (1.8, at(0.02, -0.003)),
        ]);
        let samples = felt(&block(stiction), &path, &[]);
        let slipping: Vec<&Sample> = samples.iter().filter(|s| s.friction == "slip").collect();
        assert!(slipping.len() > 500, "{} ticks in slip", slipping.len());
        for s in slipping {
            let normal_n = s.force.dot(&normal);
            let ratio = (s.force - normal * normal_n).norm() / normal_n;
            // Sliding ratios are promised to nine digits.
            assert!((ratio - 0.25).abs() < 1e-9, "{ratio} {s:?}");
        }
    }
}

/// A block with a fingertip of this radius for it.
fn for_a_ball(radius_m: f64, rest: &str) -> String {
    block(rest).replace("start_m", &format!("radius_m = {radius_m:?}\nstart_m"))
}

#[test]
fn a_ball_on_a_csg_is_felt_by_each_of_its_parts() {
    // Where it comes from and where to, in the place where its centre is held on the way, and the feature: on the top,
    // through the bore along its wall, on the rim that it does not fit through, in the groove between wall and top, round the
    // block's lower edge.
    let cases = [
        (5e-3, [0.03, 0.05, 0.02], [0.03, 0.022, 0.02], V::new(0.03, 0.025, 0.02), "face"),
        (5e-3, [0.0, 0.0, 0.0], [0.017, 0.0, 0.0], V::new(0.015, 0.0, 0.0), "surface"),
        (0.025, [0.0, 0.08, 0.0], [0.0, 0.032, 0.0], V::new(0.0, 0.035, 0.0), "edge"),
        (5e-3, [-0.02, 0.05, 0.03], [-0.027, 0.023, 0.0], V::new(-0.025, 0.025, 0.0), "face"),
        (5e-3, [0.06, -0.03, 0.0], [0.0524, -0.0232, 0.0], V::new(0.053, -0.024, 0.0), "edge"),
    ];
    for (radius_m, from, to, centre, feature) in cases {
        // In the bore it comes in from above.
        let above = if feature == "surface" { [0.0, 0.06, 0.0] } else { from };
        let path = hand([(0.0, above), (0.4, from), (0.8, to), (1.2, to)]);
        let scene = for_a_ball(radius_m, "").replace("[0.0, 0.5, 0.0]", &format!("{above:?}"));
        let samples = felt(&scene, &path, &[]);
        let last = samples.last().expect("a recording");
        assert!(last.touches(), "{centre:?} {last:?}");
        // On a rim all around it the ball is held by points of it, found to a billionth of the radius.
        assert!((last.god - centre).norm() < 1e-9, "{centre:?} {last:?}");
        assert_eq!(last.feature, feature, "{centre:?}");
        assert!((last.force - (centre - V::from(to)) * STIFFNESS).norm() < 1e-6, "{centre:?} {last:?}");
    }
}

#[test]
fn what_no_csg_can_be_is_refused_with_the_reason() {
    let place = Workplace::new();
    let says = |scene: &str, parts: &[&str]| {
        place.write("scene.toml", scene);
        let said = place.run(["run", "scene.toml", "--clock", "virtual", "--record", "out.csv"]);
        let message = said.err;
        assert_ne!(said.status, Some(0), "{message}");
        for part in parts {
            assert!(message.contains(part), "{part} in {message}");
        }
    };
    says(&block("algorithm = \"classic\""), &["entity block is a csg", "classic", "allowed: friction-cone"]);
    let many = vec!["{ shape = { kind = \"sphere\", radius_m = 1 } }"; 257].join(",");
    let many =
        format!("[[finger]]\n[[entity]]\nshape = {{ kind = \"csg\", op = \"union\", children = [{many}] }}");
    says(&many, &["scene.toml:2: entity e0", "more than 256 leaves"]);
}
