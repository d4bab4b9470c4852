//! Somebody's own shape, friction law and contact algorithm, those of `examples/own_parts.rs`, through a finger.
#![allow(non_snake_case)]

use crate::{common, example};

use common::meshes::*;
use common::*;
use example::{Ageing, EggCarton, Honey, drag};
use haptics::mesh::make;
use haptics::{
    Algorithm, ConeInput, ContactAlgorithm, ContactMemory, ContactState, Friction, FrictionLaw,
    FrictionMemory, FrictionQuery, Shape, Sphere, Surface, SurfacePoint, Touch, TouchInput,
};
use nalgebra::Vector3;

#[test]
fn the_example_runs() {
    example::main().unwrap();
}

#[test]
fn on_an_own_shape_the_frictionless_god_object_is_the_nearest_point_nearby() {
    let (height_m, period_m) = (2e-3, 0.03);
    let carton = entity(Shape::own(EggCarton { height_m, period_m }), Friction::None);
    let height = |x: f64, z: f64| {
        let per_m = std::f64::consts::TAU / period_m;
        height_m * (x * per_m).sin() * (z * per_m).cos()
    };
    for (tick, hip, out) in drag(&carton).unwrap() {
        assert_eq!(out.entity.is_some(), hip.y <= height(hip.x, hip.z), "tick {tick}");
        if out.entity.is_none() {
            continue;
        }
        let god = out.god_object_W;
        assert!((god.y - height(god.x, god.z)).abs() < 1e-15, "on the surface");
        let distance = |x: f64, z: f64| (Vector3::new(x, height(x, z), z) - hip).norm();
        let here = distance(god.x, god.z);
        // Steps of 10 um; the gap at rest is below 1e-12 of the depth.
        for (dx, dz) in [(1e-5, 0.0), (-1e-5, 0.0), (0.0, 1e-5), (0.0, -1e-5)] {
            assert!(distance(god.x + dx, god.z + dz) > here - 1e-12, "tick {tick}: {hip:?}, {out:?}");
        }
    }
}

#[test]
fn an_own_law_remembers_how_long_it_has_been_touched() {
    let (mu_fresh, mu_aged) = (0.2, 0.8);
    let law = Friction::own(Ageing { mu_fresh, mu_aged, ageing_s: 0.05 });
    let felt = drag(&table(law)).unwrap();
    let ratio_of = |out: &haptics::FingerOutput| out.force_on_user_W.x.abs() / out.force_on_user_W.y;
    let (most, rest) = felt
        .iter()
        .filter(|(_, _, out)| out.entity.is_some())
        .fold((0.0_f64, 0.0), |(most, _), tick| (most.max(ratio_of(&tick.2)), ratio_of(&tick.2)));
    // 0.17 s of rest and more until it breaks away: all but e^-3.4 of the way from fresh to aged.
    assert!(most > 0.75 && most < mu_aged, "{most}");
    // Sliding, it is fresh in every tick: the ratio is asked for to 12 digits.
    assert!((rest - mu_fresh).abs() < 1e-11, "{rest}");
    assert_eq!(felt.last().unwrap().2.friction, ContactState::Slip);
}

#[test]
fn an_own_laws_limit_knows_its_memory_so_that_the_damper_stays_within_a_fresh_contacts_cone() {
    let law = Friction::own(Ageing { mu_fresh: 0.2, mu_aged: 0.8, ageing_s: 0.5 });
    let (table, mut finger) = (table(law).with_damping(20.0).unwrap(), point_finger());
    let mut most = 0.0f64;
    for i in 0..20 {
        // 1 mm below the table and back and forth: 0.1 mm in a tick are 2 N of damping, ten times what is borne.
        let out = step(&mut finger, &table, &Vector3::new(1e-4 * f64::from(i % 2), -1e-3, 0.0));
        if out.friction == ContactState::Stick {
            most = most.max(ratio(&out, &Vector3::y()));
        }
    }
    // After 20 ms of 500 it bears 0.2 + 0.6 * 0.04 at most.
    assert!((0.2..0.225).contains(&most), "{most}");
}

#[test]
fn an_own_algorithm_renders_every_kind_of_shape_and_begins_anew_with_each_contact() {
    let honey = || Algorithm::own(Honey { time_constant_s: 0.02 });
    let ball = entity(Sphere::new(0.1).unwrap(), Friction::None).with_algorithm(honey());
    let mesh = touchable(&uv_sphere(316), Friction::None).with_algorithm(honey());
    for (name, entity) in [("closed form", ball), ("mesh", mesh)] {
        let mut finger = point_finger();
        let mut at = |x: f64, y: f64| step(&mut finger, &entity, &Vector3::new(x, y, 0.003));
        at(0.0, 0.12);
        // Straight down on the first touch: nothing lags yet. A fine mesh's facets are tilted by a hundredth.
        let first = at(0.0, 0.095);
        assert!(first.force_on_user_W.x.abs() < 0.02 * first.force_on_user_W.y, "{name}: {first:?}");
        // Sideways at 0.1 m/s the nearest point leads the HIP by 0.5 mm after 10 mm, and the god-object lags 2.1 mm
        // behind that point, which is its speed times the time constant: -0.8 N, on facets tilted by a hundredth.
        let lagging = (0..200).map(|i| at(1e-4 * f64::from(i), 0.095)).nth(99).unwrap();
        assert!((lagging.force_on_user_W.x + 0.8).abs() < 0.1, "{name}: {lagging:?}");
        // Away and back somewhere else: the old place is forgotten.
        at(0.0, 0.12);
        let again = at(-0.01, 0.095);
        assert!(again.god_object_W.x < -0.009, "{name}: {again:?}");
    }
}

/// A ball by another name, which the crate knows nothing of.
#[derive(Debug)]
struct OwnBall(Sphere);

impl Surface for OwnBall {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.0.signed_distance(point_B)
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.0.nearest(point_B)
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        self.0.entry(from_B, to_B)
    }

    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        self.0.settle(from, on_tangent_plane_B)
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        self.0.tangent_offset(at)
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        self.0.grown(radius_m).map(Self)
    }
}

#[test]
fn an_own_shape_that_can_grow_is_felt_by_fingers_with_a_radius_as_a_closed_form_is() {
    let ball = Sphere::new(0.1).unwrap();
    assert!(Shape::own(OwnBall(ball)).is_felt_by(0.01));
    assert!(!Shape::own(EggCarton { height_m: 2e-3, period_m: 0.03 }).is_felt_by(0.01));
    for algorithm in [Algorithm::FrictionCone, Algorithm::VectorField, Algorithm::ClassicGodObject] {
        let law = Friction::stiction(MU_S, MU_D).unwrap();
        let own = entity(Shape::own(OwnBall(ball)), law.clone()).with_algorithm(algorithm.clone());
        let form = entity(ball, law).with_algorithm(algorithm);
        let (mut one, mut other) = (finger(0.01), finger(0.01));
        for i in 0..300 {
            let hip = on_circle(0.106 + 0.01 * (1.0 - f64::from(i.min(50)) / 50.0), 2e-3 * f64::from(i));
            let felt = step(&mut one, &own, &hip);
            assert_eq!(felt, step(&mut other, &form, &hip));
            assert_eq!(felt.entity.is_some(), hip.norm() <= 0.11);
        }
    }
}

/// The vector field, which says of its contact what the entity's friction says.
#[derive(Debug)]
struct AsksTheLaw;

impl ContactAlgorithm for AsksTheLaw {
    fn touch(&self, input: &TouchInput<'_>, memory: &mut ContactMemory) -> Option<Touch> {
        let ConeInput { hip_B, dt_s, .. } = input.cone;
        let at = input.is_inside().then(|| input.nearest())??;
        let load_m = at.normal_B.dot(&(at.point_B - hip_B));
        let query = FrictionQuery { load_m, dt_s, ..Default::default() };
        let friction = if input.friction.holds(&query, &mut memory.friction) {
            haptics::FrictionState::Stick
        } else {
            haptics::FrictionState::Slip
        };
        Some(Touch { friction, ..Touch::frictionless(at, load_m, &input.cone) })
    }
}

#[test]
fn an_own_algorithm_keeps_the_memory_of_the_entitys_friction_for_one_contact() {
    // It holds from the 11th tick of a contact on, which only the memory tells.
    #[derive(Debug)]
    struct Dries;
    impl FrictionLaw for Dries {
        fn holds(&self, query: &FrictionQuery, memory: &mut FrictionMemory) -> bool {
            memory.words[23] += query.dt_s;
            memory.words[23] > 10.5 * DT
        }

        fn slide(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
            query.gap_m
        }

        fn held_limit_m(&self, query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
            query.load_m
        }
    }
    let entity = table(Friction::own(Dries)).with_algorithm(Algorithm::own(AsksTheLaw));
    let mut finger = point_finger();
    for _ in 0..2 {
        let held = (0..20).map(|_| step(&mut finger, &entity, &Vector3::new(0.0, -DEPTH, 0.0)).friction);
        assert_eq!(held.filter(|state| *state == ContactState::Stick).count(), 10);
        step(&mut finger, &entity, &Vector3::y());
    }
}

/// Holds whatever it touches, with any force, and resists every motion with the same force.
#[derive(Debug)]
struct Glue {
    /// Of spring \[m\].
    drag_m: f64,
}

impl FrictionLaw for Glue {
    fn holds(&self, _query: &FrictionQuery, _memory: &mut FrictionMemory) -> bool {
        true
    }

    fn slide(&self, _query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        -1.0
    }

    fn held_limit_m(&self, _query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        1.0
    }

    fn drag_m(&self, _query: &FrictionQuery, _memory: &FrictionMemory) -> f64 {
        self.drag_m
    }
}

/// Flat at y = 0 around the origin, with this law: a shape of a closed form and a mesh.
fn flat_grounds(law: impl Fn() -> Glue) -> [haptics::Entity; 2] {
    let mut cube = make::cuboid([0.1; 3]);
    cube.vertices.iter_mut().for_each(|v| v.y -= 0.05);
    [table(Friction::own(law())), touchable(&built(cube), Friction::own(law()))]
}

#[test]
fn touching_without_pressing_is_without_force_whatever_a_law_makes_of_it() {
    for mut ground in flat_grounds(|| Glue { drag_m: 0.0 }) {
        let felt = |ground: &haptics::Entity, hips: [[f64; 2]; 3]| {
            let mut finger = point_finger();
            let hips = hips.map(|[x, y]| step(&mut finger, ground, &Vector3::new(x, y, 0.0)));
            hips[2]
        };
        let held = felt(&ground, [[0.0, 0.01], [0.0, -0.005], [0.003, -0.004]]);
        assert!((held.force_on_user_W - Vector3::new(-K * 0.003, K * 0.004, 0.0)).norm() < 1e-14, "{held:?}");
        // Right on the surface, and 3 mm from where it is held.
        let resting = felt(&ground, [[0.0, 0.01], [0.0, -0.005], [0.003, 0.0]]);
        assert_eq!((resting.entity, resting.force_on_user_W), (Some(0), Vector3::zeros()));
        // Below it, and drawn back so fast that the damper takes all of the spring: at 2 m/s, where 0.8 were enough.
        ground.damping_n_s_per_m = 2.5;
        let lifted = felt(&ground, [[0.0, 0.01], [0.0, -0.006], [0.003, -0.004]]);
        assert_eq!((lifted.entity, lifted.force_on_user_W), (Some(0), Vector3::zeros()));
    }
}

#[test]
fn what_an_own_law_renders_beside_the_spring_is_felt_against_the_motion() {
    for ground in flat_grounds(|| Glue { drag_m: 1e-3 }) {
        let mut finger = point_finger();
        let places = [[0.0, 0.01], [0.0, -0.005], [0.002, -0.005], [0.001, -0.005], [0.001, -0.005]];
        let felt = places.map(|[x, y]| step(&mut finger, &ground, &Vector3::new(x, y, 0.0)).force_on_user_W);
        // 1 mm of spring beside those of the lag, forwards and backwards; none at rest.
        for (force, x_m) in felt[2..].iter().zip([-0.003, -0.001 + 0.001, -0.001]) {
            assert!((force - Vector3::new(K * x_m, K * 0.005, 0.0)).norm() < 1e-14, "{felt:?}");
        }
    }
}
