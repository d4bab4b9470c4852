//! Every closed shape, felt through scene file, hand file and recording alone: turned and moved away from the origin, so
//! that nothing holds by accident.

// Names carry their frame.
#![allow(non_snake_case)]

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use system_tests::recording::Sample;
use system_tests::workplace::{Workplace, felt, hand};

type V = Vector3<f64>;

/// A shape and where it can be touched, in its own frame.
struct Kind {
    /// As the scene file says it.
    shape: &'static str,
    /// Places on its surface, with the feature that is to be named there.
    places: &'static [([f64; 3], &'static str)],
    /// Outward unit normal at a place on the surface.
    normal: fn(&V) -> V,
}

const KINDS: [Kind; 12] = [
    Kind {
        shape: "kind = \"plane\", normal = [0.0, 3.0, 4.0], offset_m = 0.1",
        places: &[([0.01, 0.012, 0.016], "surface"), ([-0.03, 0.0, 0.025], "surface")],
        normal: |_| V::new(0.0, 0.6, 0.8),
    },
    Kind {
        shape: "kind = \"box\", size_m = [0.06, 0.04, 0.1]",
        places: &[
            ([0.03, 0.004, -0.01], "face"),
            ([0.003, -0.02, 0.02], "face"),
            ([-0.01, 0.0, 0.05], "face"),
        ],
        normal: |p| largest(p, &[0.03, 0.02, 0.05]),
    },
    Kind {
        shape: "kind = \"cylinder\", radius_m = 0.03, length_m = 0.08",
        places: &[
            ([0.018, 0.01, -0.024], "surface"),
            ([0.007, 0.04, 0.01], "face"),
            ([0.0, -0.04, 0.01], "face"),
        ],
        normal: |p| if p.y.abs() >= 0.04 - NEAR_M { cap(p) } else { V::new(p.x, 0.0, p.z).normalize() },
    },
    // 3-4-5: it narrows by 0.03 over 0.04, so its side leans by exactly that.
    Kind {
        shape: "kind = \"cone\", radius_bottom_m = 0.05, radius_top_m = 0.02, length_m = 0.04",
        places: &[
            ([0.035, 0.0, 0.0], "surface"),
            ([0.0, 0.01, 0.0275], "surface"),
            ([0.01, 0.02, 0.0], "face"),
        ],
        normal: |p| if p.y.abs() >= 0.02 - NEAR_M { cap(p) } else { leaning(p) },
    },
    Kind {
        shape: "kind = \"cone\", radius_bottom_m = 0.06, radius_top_m = 0.0, length_m = 0.08",
        places: &[
            ([0.03, 0.0, 0.0], "surface"),
            ([0.0, 0.02, -0.015], "surface"),
            ([0.01, -0.04, 0.02], "face"),
        ],
        normal: |p| if p.y <= -0.04 + NEAR_M { cap(p) } else { leaning(p) },
    },
    Kind {
        shape: "kind = \"torus\", ring_radius_m = 0.05, tube_radius_m = 0.02",
        places: &[
            ([0.07, 0.0, 0.0], "surface"),
            ([0.03, 0.02, -0.04], "surface"),
            ([0.0, -0.012, 0.034], "surface"),
        ],
        normal: |p| (p - V::new(p.x, 0.0, p.z).normalize() * 0.05).normalize(),
    },
    Kind {
        shape: "kind = \"capsule\", radius_m = 0.025, length_m = 0.06",
        places: &[
            ([0.025, 0.01, 0.0], "surface"),
            ([0.0, 0.055, 0.0], "surface"),
            ([0.015, -0.05, 0.0], "surface"),
        ],
        normal: |p| (p - V::new(0.0, p.y.clamp(-0.03, 0.03), 0.0)).normalize(),
    },
    Kind {
        shape: "kind = \"ellipsoid\", radii_m = [0.06, 0.03, 0.04]",
        places: &[
            ([0.0, 0.03, 0.0], "surface"),
            ([0.036, 0.0, 0.032], "surface"),
            ([0.036, -0.024, 0.0], "surface"),
        ],
        normal: |p| oval(p, &[0.06, 0.03, 0.04]),
    },
    // A lozenge: a ball scaled along two of its axes (Melder ch. 7.4.7).
    Kind {
        shape: "kind = \"sphere\", radius_m = 0.03, scale = [2.0, 1.0, 1.25]",
        places: &[([0.0, 0.03, 0.0], "surface"), ([0.036, 0.0, 0.03], "surface")],
        normal: |p| oval(p, &[0.06, 0.03, 0.0375]),
    },
    Kind {
        shape: "kind = \"sphere\", radius_m = 30, scale = 0.001",
        places: &[([0.0, 0.03, 0.0], "surface"), ([0.018, 0.0, -0.024], "surface")],
        normal: |p| p.normalize(),
    },
    Kind {
        shape: "kind = \"box\", size_m = [1.0, 1.0, 1.0], scale = [0.06, 0.04, 0.1]",
        places: &[([0.03, 0.004, -0.01], "face"), ([-0.01, 0.0, 0.05], "face")],
        normal: |p| largest(p, &[0.03, 0.02, 0.05]),
    },
    // An oval column, which no other kind describes.
    Kind {
        shape: "kind = \"cylinder\", radius_m = 0.03, length_m = 0.08, scale = [2.0, 1.0, 1.0]",
        places: &[
            ([0.036, 0.01, 0.024], "surface"),
            ([0.0, 0.0, -0.03], "surface"),
            ([0.02, 0.04, 0.01], "face"),
        ],
        normal: |p| {
            if p.y.abs() >= 0.04 - NEAR_M { cap(p) } else { oval(&V::new(p.x, 0.0, p.z), &[0.06, 1.0, 0.03]) }
        },
    },
];

/// So near to a cap, a god-object lies on it.
const NEAR_M: f64 = 1e-9;

fn cap(p: &V) -> V {
    V::y() * p.y.signum()
}

/// The side of a cone that narrows by 3 over 4 of its length.
fn leaning(p: &V) -> V {
    V::new(p.x, 0.0, p.z).normalize() * 0.8 + V::y() * 0.6
}

fn oval(p: &V, radii: &[f64; 3]) -> V {
    p.component_div(&V::from(*radii)).component_div(&V::from(*radii)).normalize()
}

fn largest(p: &V, half: &[f64; 3]) -> V {
    let axis =
        (0..3).max_by(|a, b| (p[*a].abs() / half[*a]).total_cmp(&(p[*b].abs() / half[*b]))).unwrap_or(0);
    V::ith(axis, p[axis].signum())
}

const STIFFNESS: f64 = 800.0;
const DEPTH_M: f64 = 0.004;

/// Nothing about it is round, so that every sum rounds.
fn pose() -> Isometry3<f64> {
    let turn = UnitQuaternion::new_normalize(Quaternion::new(0.8, 0.36, -0.48, 0.0));
    Isometry3::from_parts(Translation3::new(-0.083, 0.061, 0.017), turn)
}

fn scene(shape: &str, rest: &str, finger: &str) -> String {
    let pose = pose();
    let q = pose.rotation;
    format!(
        "[[finger]]\nstart_m = [0.0, 0.5, 0.0]\n{finger}\n[[entity]]\nname = \"thing\"\nshape = {{ {shape} }}\n\
         position_m = {:?}\norientation_wxyz = [{:?}, {:?}, {:?}, {:?}]\nstiffness_n_per_m = {STIFFNESS:?}\n{rest}",
        pose.translation.vector.as_slice(),
        q.w,
        q.i,
        q.j,
        q.k
    )
}

fn in_world(p_B: V) -> [f64; 3] {
    (pose() * nalgebra::Point3::from(p_B)).coords.into()
}

fn in_body(s: &Sample) -> (V, V, V) {
    let back = pose().inverse();
    let point = |p: &V| (back * nalgebra::Point3::from(*p)).coords;
    (point(&s.hip), point(&s.god), back * s.force)
}

/// What a god-object's place is good for: slides on curved surfaces end within a fraction of a nanometre.
const PLACE_TOLERANCE_M: f64 = 1e-10;

#[test]
fn each_shape_pushes_along_its_normal_by_stiffness_times_depth_and_lets_go() {
    for Kind { shape, places, normal } in KINDS {
        for (place, feature) in places {
            let p = V::from(*place);
            let n = normal(&p);
            let at = |height: f64| in_world(p + n * height);
            let path = hand([(0.0, at(0.01)), (0.3, at(-DEPTH_M)), (0.6, at(-DEPTH_M)), (1.0, at(0.01))]);
            let samples = felt(&scene(shape, "", ""), &path, &[]);
            let touching = samples.iter().filter(|s| s.touches()).count();
            assert!(touching > 400, "{shape} at {place:?}: {touching} ticks in contact");
            for s in &samples {
                check_press(s, &p, &n, feature, shape);
            }
            assert!(!samples.last().is_some_and(Sample::touches), "{shape} at {place:?} lets go");
        }
    }
}

/// Below a place, inside, the place itself is the nearest point of the surface.
fn check_press(s: &Sample, p: &V, n: &V, feature: &str, shape: &str) {
    let (hip, god, force) = in_body(s);
    let depth_m = n.dot(&(p - hip));
    if depth_m.abs() > PLACE_TOLERANCE_M {
        assert_eq!(s.touches(), depth_m > 0.0, "{shape} at {p:?}: {s:?}");
    }
    let expected = n * (STIFFNESS * depth_m.max(0.0));
    assert!(
        (force - expected).norm() <= STIFFNESS * PLACE_TOLERANCE_M,
        "{shape}: {force:?} not {expected:?}: {s:?}"
    );
    if s.touches() {
        assert!((god - p).norm() <= PLACE_TOLERANCE_M, "{shape}: god-object {god:?}, not {p:?}");
        assert_eq!(s.feature, feature, "{shape} at {p:?}: {s:?}");
        assert_eq!(s.entity, "thing");
    }
}

/// Sliding ratios are promised to nine digits.
const RATIO_TOLERANCE: f64 = 1e-9;

#[test]
fn each_shape_slides_at_mu_d_wherever_the_stroke_leads() {
    let stiction = "friction = { model = \"stiction\", mu_s = 0.4, mu_d = 0.25 }\n";
    for Kind { shape, places, normal } in KINDS {
        for (place, _) in places {
            let p = V::from(*place);
            let n = normal(&p);
            let sideways = n.cross(&V::new(0.3, -0.5, 0.8)).normalize();
            let at = |height: f64, side: f64| in_world(p + n * height + sideways * side);
            let path = hand([
                (0.0, at(0.01, 0.0)),
                (0.1, at(-DEPTH_M, 0.0)),
                (0.2, at(-DEPTH_M, 0.0)),
                (1.2, at(-DEPTH_M, 0.0071)),
            ]);
            let samples = felt(&scene(shape, stiction, ""), &path, &[]);
            let slipping: Vec<&Sample> = samples.iter().filter(|s| s.friction == "slip").collect();
            assert!(slipping.len() > 300, "{shape} at {place:?}: {} ticks in slip", slipping.len());
            for s in slipping {
                let (_, god, force) = in_body(s);
                let n = normal(&god);
                let normal_n = force.dot(&n);
                let ratio = (force - n * normal_n).norm() / normal_n;
                assert!((ratio - 0.25).abs() <= RATIO_TOLERANCE, "{shape} at {place:?}: {ratio}: {s:?}");
            }
        }
    }
}

#[test]
fn a_spherical_finger_rolls_a_radius_above_each_shape_that_it_can_feel() {
    let radius_m = 0.005;
    for Kind { shape, places, normal } in KINDS {
        let is_felt = ["box", "cylinder", "cone", "torus", "capsule", "sphere", "plane"];
        let kind = shape.split('"').nth(1).unwrap_or_default();
        if !is_felt.contains(&kind) || shape.contains("scale = [") {
            continue;
        }
        for (place, _) in places {
            let p = V::from(*place);
            let n = normal(&p);
            let at = |height: f64| in_world(p + n * height);
            let path = hand([(0.0, at(0.02)), (0.5, at(radius_m - DEPTH_M)), (1.0, at(0.02))]);
            let scene = scene(shape, "", &format!("radius_m = {radius_m:?}"));
            let place = Workplace::new();
            place.write("scene.toml", &scene);
            place.write("hand.csv", &path);
            let said = place.run([
                "run",
                "scene.toml",
                "--hand",
                "hand.csv",
                "--clock",
                "virtual",
                "--record",
                "out.csv",
            ]);
            if said.status == Some(2) {
                // Whoever cannot feel it is told so; which shapes these are is not this test's matter.
                assert!(said.err.contains("cannot be felt by such a finger"), "{}", said.err);
                continue;
            }
            let samples = system_tests::recording::Table::read(&place.path("out.csv")).finger("f0");
            for s in &samples {
                let (hip, god, force) = in_body(s);
                let depth_m = radius_m + n.dot(&(p - hip));
                let expected = n * (STIFFNESS * depth_m.max(0.0));
                assert!(
                    (force - expected).norm() <= STIFFNESS * PLACE_TOLERANCE_M,
                    "{shape}: {force:?}, {expected:?}"
                );
                if s.touches() {
                    assert!((god - p - n * radius_m).norm() <= PLACE_TOLERANCE_M, "{shape}: {god:?}");
                }
            }
            assert!(samples.iter().any(Sample::touches), "{shape} at {p:?}");
        }
    }
}

#[test]
fn a_spherical_finger_says_whether_it_rests_on_a_face_an_edge_or_a_corner() {
    let half = 0.5 * 2f64.sqrt();
    let third = 1.0 / 3f64.sqrt();
    let cube = "kind = \"box\", size_m = [0.04, 0.04, 0.04]";
    let cone = "kind = \"cone\", radius_bottom_m = 0.02, radius_top_m = 0.0, length_m = 0.04";
    for (shape, place, normal, feature) in [
        (cube, [0.003, 0.02, 0.002], [0.0, 1.0, 0.0], "face"),
        (cube, [0.02, 0.02, 0.002], [half, half, 0.0], "edge"),
        (cube, [0.02, 0.02, -0.02], [third, third, -third], "vertex"),
        (cone, [0.0, 0.02, 0.0], [0.0, 1.0, 0.0], "vertex"),
        (cone, [0.02, -0.02, 0.0], [half, -half, 0.0], "edge"),
        (cone, [0.003, -0.02, 0.0], [0.0, -1.0, 0.0], "face"),
    ] {
        let (p, n) = (V::from(place), V::from(normal));
        let at = |height_m: f64| in_world(p + n * height_m);
        let path = hand([(0.0, at(0.02)), (0.5, at(0.005 - DEPTH_M)), (1.0, at(0.02))]);
        let scene = scene(shape, "", "radius_m = 0.005");
        let samples = Workplace::new().play(&scene, &path, &[]).finger("f0");
        let touching: Vec<&Sample> = samples.iter().filter(|s| s.touches()).collect();
        assert!(touching.len() > 30, "{shape}: {}", touching.len());
        for s in touching {
            assert_eq!(s.feature, feature, "{shape}: {s:?}");
        }
    }
}

#[test]
fn a_finger_that_is_too_large_for_the_hole_of_a_ring_rests_on_it() {
    // The ring's axis is y, where the centre of a ball of 31 mm stops 51 mm from the tube's middle.
    let shape = "kind = \"torus\", ring_radius_m = 0.05, tube_radius_m = 0.02";
    let height_m = (0.051_f64 * 0.051 - 0.05 * 0.05).sqrt();
    let at = |y: f64| in_world(V::new(0.0, y, 0.0));
    let path = hand([(0.0, at(0.03)), (0.5, at(0.0)), (1.0, at(-0.02)), (1.5, at(0.03))]);
    let samples = Workplace::new().play(&scene(shape, "", "radius_m = 0.031"), &path, &[]).finger("f0");
    let mut touched = 0;
    for s in samples.iter().filter(|s| s.touches()) {
        let (hip, god, _) = in_body(s);
        // Felt in triangles, whose chords are up to 1.4 um inside the tube: at a slope of 50 / 10, seven times that.
        assert!((god - V::new(0.0, height_m, 0.0)).norm() < 2e-5, "{s:?}");
        assert!(hip.y < height_m + 2e-5, "{s:?}");
        touched += 1;
    }
    assert!(touched > 500, "{touched}");
}

#[test]
fn a_face_is_felt_to_its_edge_and_no_further() {
    // Over the edge of a box, half a millimetre deep, frictionless: full force until the edge, none beyond.
    let shape = "kind = \"box\", size_m = [0.06, 0.04, 0.1]";
    let at = |x: f64, y: f64| in_world(V::new(x, y, 0.0));
    let path = hand([(0.0, at(0.0, 0.021)), (0.2, at(0.0, 0.0195)), (1.2, at(0.04, 0.0195))]);
    let mut felt_beyond = 0;
    for s in felt(&scene(shape, "", ""), &path, &[]) {
        let (hip, _, force) = in_body(&s);
        if hip.x > 0.03 + PLACE_TOLERANCE_M {
            felt_beyond += u32::from(s.touches());
        } else if hip.x < 0.03 - PLACE_TOLERANCE_M && hip.y < 0.02 - PLACE_TOLERANCE_M {
            let expected = STIFFNESS * (0.02 - hip.y);
            assert!((force - V::y() * expected).norm() <= STIFFNESS * PLACE_TOLERANCE_M, "{force:?}: {s:?}");
        }
    }
    assert_eq!(felt_beyond, 0, "beside the box it is free");
}

#[test]
fn a_thin_plate_is_not_pushed_through() {
    let shape = "kind = \"box\", size_m = [0.1, 0.001, 0.1]";
    let at = |y: f64| in_world(V::new(0.0, y, 0.0));
    let path = hand([(0.0, at(0.01)), (0.5, at(-0.015)), (1.0, at(0.01))]);
    for s in felt(&scene(shape, "", ""), &path, &[]) {
        let (hip, _, force) = in_body(&s);
        let expected = V::y() * (STIFFNESS * (0.0005 - hip.y).max(0.0));
        assert!(
            (force - expected).norm() <= STIFFNESS * PLACE_TOLERANCE_M,
            "{force:?} not {expected:?}: {s:?}"
        );
    }
}

#[test]
fn the_gallery_shows_every_shape_that_it_has() {
    let gallery = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/scenes/shapes.toml");
    let place = Workplace::new();
    let scene = gallery.to_str().expect("a path of text");
    let said = place.run(["run", scene, "--clock", "virtual", "--headless", "--record", "out.csv"]);
    assert_eq!(said.status, Some(0), "{}", said.err);
    let samples = system_tests::recording::Table::read(&place.path("out.csv")).finger("f0");
    let text = std::fs::read_to_string(&gallery).expect("the gallery");
    let entities = text.split("[[entity]]").skip(1).filter_map(|entity| entity.split('"').nth(1));
    for entity in entities.filter(|name| *name != "table") {
        let ticks = samples.iter().filter(|s| s.entity == entity).count();
        assert!(ticks > 500, "{entity}: {ticks} ticks");
    }
    // 3 mm deep at 800 N/m, and friction below 0.7.
    assert!(samples.iter().all(|s| s.force.norm() < 5.0));
}
