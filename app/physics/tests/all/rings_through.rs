//! Rings that go into other solids as deep as they like, and through them: they are pressed in every pose, by forces that
//! change as little as the poses do, and gain nothing.
//!
//! Hundreds of paths, and more poses and throws: `cargo test --release -p physics --test all rings_through:: -- --ignored`
//! (some minutes).
#![allow(non_snake_case)]

use crate::{common, meshes, noise};

use std::f64::consts::TAU;

use common::*;
use haptics::mesh::make;
use haptics::{Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Entity, Friction, Shape, Sphere, Torus};
use meshes::{build, cut_in_four};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use noise::Noise;
use physics::Settings;
use physics::collide::{ContactPoint, ContactPoints, PairMemory, Solid, contact_points};

const REACH: f64 = 1e-3;
/// Radii of rings and their tubes, from a third of the ring to a twelfth.
const RINGS: [[f64; 2]; 3] = [[0.025, 0.01], [0.03, 0.005], [0.03, 0.0025]];
/// From this share of the tube's radius on no form's place, and no mesh's, presses for itself.
const PLACES: [f64; 2] = [0.4, 0.06];

/// How deep a point is inside, or less (m).
type Depth = Box<dyn Fn(&Vector3<f64>) -> f64>;

/// What a ring goes through.
struct Through {
    name: &'static str,
    shape: Shape,
    depth_m: Depth,
    /// It has no inside: near it is as good as in it.
    is_sheet: bool,
}

fn in_box(size: [f64; 3]) -> impl Fn(&Vector3<f64>) -> f64 {
    move |p| (0..3).map(|i| 0.5 * size[i] - p[i].abs()).fold(f64::INFINITY, f64::min)
}

fn in_frustum(bottom: f64, top: f64, length: f64) -> impl Fn(&Vector3<f64>) -> f64 {
    move |p| {
        let radius = 0.5 * (bottom + top) + (top - bottom) * p.y / length;
        let side = (radius - p.x.hypot(p.z)) * length / length.hypot(bottom - top);
        side.min(0.5 * length - p.y.abs())
    }
}

fn forms() -> Vec<Through> {
    let through = |name, shape, depth_m| Through { name, shape, depth_m, is_sheet: false };
    let (brick, slab) = ([0.02, 0.05, 0.03], [0.2, 0.03, 0.2]);
    let radii = Vector3::new(0.03, 0.015, 0.02);
    let in_ellipsoid = move |p: &Vector3<f64>| (1.0 - p.component_div(&radii).norm()) * radii.min();
    let in_capsule = |p: &Vector3<f64>| 0.012 - Vector3::new(p.x, (p.y.abs() - 0.025).max(0.0), p.z).norm();
    let in_torus = |p: &Vector3<f64>| 0.012 - (p.x.hypot(p.z) - 0.03).hypot(p.y);
    vec![
        through("box", Cuboid::new(brick).unwrap().into(), Box::new(in_box(brick))),
        through("slab", Cuboid::new(slab).unwrap().into(), Box::new(in_box(slab))),
        through(
            "cone",
            Cone::new(0.034, 0.008, 0.022).unwrap().into(),
            Box::new(in_frustum(0.034, 0.008, 0.022)),
        ),
        through(
            "cylinder",
            Cylinder::new(0.02, 0.03).unwrap().into(),
            Box::new(in_frustum(0.02, 0.02, 0.03)),
        ),
        through("ellipsoid", Ellipsoid::new(radii.into()).unwrap().into(), Box::new(in_ellipsoid)),
        through("sphere", Sphere::new(0.02).unwrap().into(), Box::new(|p| 0.02 - p.norm())),
        through("capsule", Capsule::new(0.012, 0.05).unwrap().into(), Box::new(in_capsule)),
        through("ring", Torus::new(0.03, 0.012).unwrap().into(), Box::new(in_torus)),
    ]
}

fn solid_meshes() -> Vec<Through> {
    let through = |name, shape, depth_m| Through { name, shape, depth_m, is_sheet: false };
    let brick = [0.02, 0.05, 0.03];
    let fine = cut_in_four(&cut_in_four(&make::cuboid(brick)));
    let in_angle = |p: &Vector3<f64>| {
        let of = |(centre, size): &([f64; 3], [f64; 3])| in_box(*size)(&(p - Vector3::from(*centre)));
        meshes::ANGLE_PARTS.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
    };
    let half = 0.0105;
    let around_hole = move |p: &Vector3<f64>| {
        let to_hole = Vector3::new(p.x.abs() - half, -p.y, p.z.abs() - half).sup(&Vector3::zeros()).norm();
        in_box([0.1, 0.06, 0.1])(p).min(to_hole)
    };
    vec![
        through("box of triangles", build(make::cuboid(brick)).into(), Box::new(in_box(brick))),
        through("fine box of triangles", build(fine).into(), Box::new(in_box(brick))),
        through("angle of triangles", build(meshes::angle()).into(), Box::new(in_angle)),
        through("hole", build(meshes::block_with_hole(half, 0.0)).into(), Box::new(around_hole)),
        // Its faces are no more than 0.4 mm below the ball.
        through(
            "ball of triangles",
            build(make::uv_sphere(32, 17, 0.02)).into(),
            Box::new(|p| 0.0196 - p.norm()),
        ),
    ]
}

/// A level square of 60 mm, of the ring's tube (m).
fn sheet(tube_m: f64) -> Through {
    let depth_m = move |p: &Vector3<f64>| {
        let beyond = Vector3::new(p.x.abs() - 0.03, 0.0, p.z.abs() - 0.03).sup(&Vector3::zeros());
        tube_m - beyond.norm().hypot(p.y)
    };
    let shape = build(meshes::terrain(4, 0.06, |_, _| 0.0)).into();
    Through { name: "sheet", shape, depth_m: Box::new(depth_m), is_sheet: true }
}

fn all(tube_m: f64) -> Vec<Through> {
    forms().into_iter().chain(solid_meshes()).chain([sheet(tube_m)]).collect()
}

impl Through {
    fn touched_by(&self, ring: &Shape, X: &Isometry3<f64>, memory: &mut PairMemory) -> Vec<ContactPoint> {
        let (mut found, at) = (ContactPoints::default(), Isometry3::identity());
        let (ring, through) = (Solid { shape: ring, X_W: X }, Solid { shape: &self.shape, X_W: &at });
        contact_points(ring, through, REACH, memory, &mut found);
        found.as_slice().to_vec()
    }

    /// How deep the deepest point of the circle in the tube is (m).
    fn deepest_m(&self, ring_m: f64, X: &Isometry3<f64>, points: usize) -> f64 {
        let depth_m = |at: usize| {
            let (sine, cosine) = (at as f64 / points as f64 * TAU).sin_cos();
            (self.depth_m)(&(X * Point3::new(cosine * ring_m, 0.0, sine * ring_m)).coords)
        };
        (0..points).map(depth_m).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Of all points' springs, per stiffness (m).
fn force_m(points: &[ContactPoint]) -> Vector3<f64> {
    points.iter().map(|point| point.normal_W * (-point.gap_m).max(0.0)).sum()
}

fn touches(points: &[ContactPoint]) -> bool {
    points.iter().any(|point| point.gap_m < 0.0)
}

/// So many poses of each ring in each solid.
fn put_into_all(seed: u64, poses: usize) {
    for [ring_m, tube_m] in RINGS {
        let ring: Shape = Torus::new(ring_m, tube_m).unwrap().into();
        for through in all(tube_m) {
            let noise = &mut Noise::new(seed);
            let mut deep = 0;
            for _ in 0..poses {
                let X = Isometry3::from_parts(noise.vector(0.05).into(), noise.turn());
                if through.deepest_m(ring_m, &X, 360) < 0.5 * tube_m {
                    continue;
                }
                deep += 1;
                let points = through.touched_by(&ring, &X, &mut PairMemory::default());
                assert!(touches(&points), "{tube_m} {}: {X} {points:?}", through.name);
            }
            assert!(deep * 14 > poses, "{tube_m} {}: {deep}", through.name);
        }
    }
}

#[test]
fn wherever_a_ring_is_put_into_a_solid_it_touches_it() {
    put_into_all(3, 500);
}

#[test]
#[ignore = "half a minute; see the top of the file"]
fn wherever_of_thousands_of_places_a_ring_is_put_into_a_solid_it_touches_it() {
    put_into_all(4, 5000);
}

/// Steps of 10 um and up to 1 mrad about the ring's middle.
struct Path {
    from: Vector3<f64>,
    turn: UnitQuaternion<f64>,
    step: Vector3<f64>,
    axis: Vector3<f64>,
}

impl Path {
    /// Through somewhere in the middle.
    fn new(noise: &mut Noise) -> Self {
        let (to, way) = (noise.vector(0.015), noise.direction());
        let most = if noise.chance(0.5) { 1e-3 } else { 1e-4 };
        Self {
            from: to - way * (0.5 * STEPS as f64 * 1e-5),
            turn: noise.turn(),
            step: way * 1e-5,
            axis: noise.direction() * most,
        }
    }

    fn at(&self, step: f64) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(self.axis * step) * self.turn;
        Isometry3::from_parts((self.from + self.step * step).into(), turn)
    }
}

const STEPS: usize = 4000;

/// The most that the force may change where a ring of this shape is as deep as that and its points move by so much (m).
///
/// Loads: of a run of n pieces one that comes to it changes at most 2/n of what presses, which sums up to twice the harmonic
/// number of all pieces, 11.7 for 192; and three where it becomes longer than half the ring, and one where it closes; and as
/// much again for a second run, and three where they meet. Directions: of at most four springs, each by the distances of three
/// points a quarter of the tube's radius away, and of two along the ring. What places press with fades within a fifth of the
/// tube's radius (forms) or a twenty-fifth (meshes), of at most twice four springs.
fn most_change_m([ring_m, tube_m]: [f64; 2], depth_m: f64, moved_m: f64, is_mesh: bool) -> f64 {
    let pieces = if ring_m > 6.0 * tube_m { 192.0 } else { 96.0 };
    let loads = 2.0 * (11.7 + 3.0 + 1.0) + 3.0;
    let turns_per_m = (4.0 / (0.75 * tube_m)).hypot(pieces / (TAU * ring_m));
    let [places, fades_m] = if is_mesh { [PLACES[1], 0.04 * tube_m] } else { [PLACES[0], 0.2 * tube_m] };
    let fading = 8.0 * places * tube_m / fades_m;
    moved_m * (loads + 4.0 * depth_m * turns_per_m + fading)
}

/// What is looked for along a path.
#[derive(Default, Debug)]
struct Seen {
    deep: usize,
    largest_m: f64,
    /// Changes that do not become smaller with the steps.
    jumps: usize,
}

fn go(through: &Through, radii_m: [f64; 2], path: &Path, seen: &mut Seen) {
    let [ring_m, tube_m] = radii_m;
    let ring: Shape = Torus::new(ring_m, tube_m).unwrap().into();
    let is_mesh = matches!(through.shape, Shape::Mesh(_));
    let moved_m = 1e-5 + path.axis.norm() * (ring_m + 0.25 * tube_m);
    let mut memory = PairMemory::default();
    let mut last: Option<(Vector3<f64>, PairMemory)> = None;
    for step in 0..STEPS {
        let X = path.at(step as f64);
        let points = through.touched_by(&ring, &X, &mut memory);
        let inside_m = through.deepest_m(ring_m, &X, 90);
        let told = || format!("{tube_m} {} {step}: {points:?}", through.name);
        if inside_m >= 0.5 * tube_m {
            seen.deep += 1;
            assert!(touches(&points), "{}", told());
        }
        let now_m = force_m(&points);
        // A sheet is held on the side it was met on, which ends somewhere.
        if let Some((last_m, was)) = last.filter(|_| !through.is_sheet) {
            let change_m = (now_m - last_m).norm();
            seen.largest_m = seen.largest_m.max(change_m);
            let depth_m = inside_m + tube_m;
            let most_m = most_change_m(radii_m, depth_m.max(0.0), moved_m, is_mesh);
            if change_m > SMALL_M && is_jump(through, &ring, path, step, (last_m, was), change_m) {
                seen.jumps += 1;
                // Of places, where they alone press or not all of the ring yet: some come and go.
                let places_m = PLACES[usize::from(is_mesh)] * tube_m;
                let deepest_m = points.iter().map(ContactPoint::depth_m).fold(0.0, f64::max);
                assert!(deepest_m < 1.5 * places_m, "jumps by {change_m}: {}", told());
                assert!(change_m < 2.0 * places_m, "jumps by {change_m}: {}", told());
            } else {
                assert!(change_m < most_m, "changes by {change_m}, not {most_m}: {}", told());
            }
        }
        last = Some((now_m, memory.clone()));
    }
}

/// Less is not looked at \[m\].
const SMALL_M: f64 = 5e-5;

/// Whether a tenth of the step changes nearly as much.
fn is_jump(
    through: &Through,
    ring: &Shape,
    path: &Path,
    step: usize,
    (mut last_m, mut memory): (Vector3<f64>, PairMemory),
    change_m: f64,
) -> bool {
    let mut largest_m = 0.0_f64;
    for tenth in 1..=10 {
        let X = path.at(step as f64 - 1.0 + 0.1 * f64::from(tenth));
        let now_m = force_m(&through.touched_by(ring, &X, &mut memory));
        largest_m = largest_m.max((now_m - last_m).norm());
        last_m = now_m;
    }
    largest_m > 0.4 * change_m
}

/// Every solid with every `of`-th ring: all rings go through some, and each solid is gone through.
fn go_through_all(seed: u64, paths: usize, of: usize) {
    let noise = &mut Noise::new(seed);
    let (mut all_seen, mut pairs) = (Seen::default(), 0);
    for (number, radii_m) in RINGS.into_iter().enumerate() {
        for (_, through) in (number..).zip(all(radii_m[1])).filter(|(turn, _)| turn % of == 0) {
            pairs += 1;
            let mut seen = Seen::default();
            (0..paths).for_each(|_| go(&through, radii_m, &Path::new(noise), &mut seen));
            println!("{:6} {:22} {seen:?}", radii_m[1], through.name);
            all_seen.deep += seen.deep;
            all_seen.jumps += seen.jumps;
        }
    }
    assert!(all_seen.deep > 1000 * paths * pairs, "{all_seen:?}");
    // Places' own.
    assert!(all_seen.jumps * 200 < all_seen.deep, "{all_seen:?}");
}

#[test]
fn on_its_way_through_a_solid_a_ring_is_pressed_all_the_time_and_by_forces_that_do_not_jump() {
    go_through_all(5, 1, RINGS.len());
}

#[test]
#[ignore = "some minutes; see the top of the file"]
fn on_hundreds_of_ways_through_solids_rings_are_pressed_all_the_time_and_by_forces_that_do_not_jump() {
    go_through_all(9, 8, 1);
}

#[test]
fn a_ring_that_is_thrown_through_a_solid_gains_no_energy() {
    let noise = &mut Noise::new(7);
    let free = |entity: Entity| entity.with_friction(Friction::coulomb(0.0).unwrap()).unwrap();
    let mut deepest_m = 0.0_f64;
    for [ring_m, tube_m] in RINGS {
        let ring: Shape = Torus::new(ring_m, tube_m).unwrap().into();
        for through in all(tube_m) {
            for _ in 0..4 {
                let wall = free(Entity::new(through.shape.clone(), Isometry3::identity(), 1000.0).unwrap());
                let (to, way) = (noise.vector(0.015), noise.direction());
                let X_WB = Isometry3::from_parts((to - way * 0.22).into(), noise.turn());
                let thing = free(object(ring.clone(), X_WB, noise.log_within(100.0, 2000.0), 0.0));
                let thing = thing.with_damping(0.0).unwrap();
                let state = body(&thing, 0.1).moving(way * noise.within(0.7, 2.0), noise.vector(20.0));
                let settings = Settings { gravity_W: Vector3::zeros(), ..Settings::default() };
                let mut world = World::new(vec![wall, thing], &[(1, state)], settings, 0);
                let energy_j =
                    |world: &World| world.body().kinetic_energy_j() + world.manipulation.elastic_energy_j();
                let mut was_j = energy_j(&world);
                for tick in 0..500 {
                    // The middle of a turn of h is wrong by h^3; and the roundings of some hundred operations.
                    let turn = world.body().angular_velocity_W().norm() * DT;
                    let slack_j = was_j * (turn.powi(3) + 1e-13);
                    world.step(&[]);
                    let now_j = energy_j(&world);
                    assert!(now_j <= was_j + slack_j, "{} {tick}: {was_j} {now_j}", through.name);
                    was_j = now_j;
                    deepest_m = deepest_m.max(through.deepest_m(ring_m, &world.entities[1].X_WB, 90));
                }
            }
        }
    }
    assert!(deepest_m > 0.01, "{deepest_m}");
}
