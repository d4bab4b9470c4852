//! Points with Coulomb friction in grooves, pits and on rugged meshes, tick by tick against what Coulomb's law allows there.
//!
//! The force is what one friction cone about the direction of the force allows: the law on a groove whose bottom is
//! round, however little ([`Rounded`]). The faces of a sharp groove, each with its own cone, could always bear it, and along
//! the groove they could bear more.

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::coulomb::{
    Coulomb, Ended, Rule, distance_from_sum, distance_from_sum_by_projections,
};
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{ContactState, Friction};
use nalgebra::Vector3;
use std::sync::Arc;

/// A thousand roundings of positions of 0.05 m: the slide itself ends at 1e-12 of a load of some 10 mm (m).
const SAME_PLACE: f64 = 1e-14;
const COEFFICIENTS: [f64; 7] = [0.0, 0.1, 0.3, 0.5, 0.8, 1.1, 1.5];
const DEGREES: [f64; 8] = [20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 170.0];

/// One tick of a finger, and what each rule makes of it from the same god-object.
struct Tick {
    from: Vector3<f64>,
    hip: Vector3<f64>,
    ours: Vector3<f64>,
    is_held: bool,
    faces: usize,
    /// Part of its spring that forces in the cones of all faces that it touches could not bear (m).
    unexplained: f64,
    one_cone: Option<Ended>,
    least: Option<Ended>,
    most: Option<Ended>,
}

impl Tick {
    fn spring(&self) -> f64 {
        (self.ours - self.hip).norm()
    }

    fn spring_of(&self, other: Option<Ended>) -> f64 {
        other.map_or(0.0, |other| (other.god_object - self.hip).norm())
    }

    fn apart(&self, other: Option<Ended>) -> f64 {
        other.map_or(f64::INFINITY, |other| (other.god_object - self.ours).norm())
    }

    /// A rule leaves the god-object where it was.
    fn holds(&self, other: Option<Ended>) -> bool {
        other.is_some_and(|other| (other.god_object - self.from).norm() <= SAME_PLACE)
    }

    fn is_moved(&self) -> bool {
        (self.ours - self.from).norm() > SAME_PLACE
    }

    fn is_more_than(&self, other: Option<Ended>) -> bool {
        self.spring() > self.spring_of(other) + SAME_PLACE
    }
}

/// Leads a finger along, and looks at every tick in which it touches.
fn follow(mesh: &Arc<Mesh>, mu: f64, hips: impl Iterator<Item = Vector3<f64>>, mut look: impl FnMut(&Tick)) {
    let entity = touchable(mesh, Friction::coulomb(mu).unwrap());
    let mut finger = point_finger();
    let [mut one_cone, mut least, mut most] =
        [Rule::OneCone, Rule::Least, Rule::Most].map(|rule| Coulomb::new(mesh, mu, rule));
    let (mut last_hip, mut last): (Option<Vector3<f64>>, Option<Vector3<f64>>) = (None, None);
    for hip in hips {
        let out = step(&mut finger, &entity, &hip);
        let was = last_hip.replace(hip);
        let from = last.take();
        if out.entity.is_none() {
            continue;
        }
        let ours = out.god_object_W;
        last = Some(ours);
        let Some(from) = from.or_else(|| one_cone.hit(&was?, &hip)) else { continue };
        let slid = one_cone.step(from, &hip);
        if slid.is_some_and(|ended| ended.pieces > haptics::mesh::MAX_FEATURE_CHANGES as usize - 2) {
            // Over decimetres in a tick, which takes it two.
            continue;
        }
        // Held or at the rim of its circle, what is felt is the whole spring, to the 1e-12 of the load that a slide leaves.
        let spring = ours - hip;
        assert!(
            (out.force_on_user_W - spring * K).norm() < K * (1e-11 * spring.norm() + SAME_PLACE),
            "{out:?}"
        );
        look(&Tick {
            from,
            hip,
            ours,
            is_held: out.friction == ContactState::Stick,
            faces: one_cone.touched(&ours).len(),
            unexplained: one_cone.unexplained(&ours, &hip),
            one_cone: slid,
            least: least.step(from, &hip),
            most: most.step(from, &hip),
        });
    }
}

/// Counts and extremes of a run, to be printed.
#[derive(Debug, Default)]
struct Seen {
    ticks: usize,
    held: usize,
    on_several: usize,
    along_grooves: usize,
    /// It slides where [`Rule::Least`] holds, and slides farther than that does.
    slides_for_held: usize,
    slides_farther: usize,
    /// The same of [`Rule::Most`].
    slides_for_most: usize,
    /// Of the spring, the share that is missing: of the least and the most that Coulomb allows.
    missing: [f64; 2],
}

impl Seen {
    /// Takes note of a tick that must never be felt more than Coulomb's law explains.
    fn note(&mut self, tick: &Tick) {
        self.ticks += 1;
        self.held += usize::from(tick.is_held);
        self.on_several += usize::from(tick.faces > 1);
        self.along_grooves += usize::from(tick.one_cone.is_some_and(|ended| ended.along_groove));
        assert!(tick.unexplained <= SAME_PLACE, "{}: no forces in the cones bear {}", tick.ours, tick.hip);
        let apart = tick.apart(tick.one_cone);
        assert!(apart <= SAME_PLACE, "{apart}: {} {} {:?}", tick.ours, tick.hip, tick.one_cone);
        assert!(
            !tick.is_more_than(tick.least) && !tick.is_more_than(tick.most),
            "{} {}",
            tick.ours,
            tick.hip
        );
        let is_less = [tick.least, tick.most].map(|other| tick.spring() < tick.spring_of(other) - SAME_PLACE);
        if !tick.is_moved() {
            // What one cone holds, more friction holds.
            assert!(tick.holds(tick.least) && tick.holds(tick.most), "{} {}", tick.ours, tick.hip);
        }
        self.slides_for_held += usize::from(is_less[0] && tick.holds(tick.least));
        self.slides_farther += usize::from(is_less[0] && !tick.holds(tick.least));
        self.slides_for_most += usize::from(is_less[1] && tick.holds(tick.most));
        for (missing, other) in self.missing.iter_mut().zip([tick.least, tick.most]) {
            *missing = missing.max(1.0 - tick.spring() / tick.spring_of(other));
        }
    }
}

/// A finger that comes from the open and roams about the bottom of a groove.
fn into_the_groove(seed: u64) -> Roaming {
    let mut roaming = Roaming::new(seed, 0.02, 2e-4);
    roaming.hip = Vector3::y() * 0.05;
    roaming
}

/// A double pyramid over a triangle, whose upper tip was pushed in: a pit of three faces.
fn pit(tip: [f64; 3]) -> TriangleSoup {
    let corner = |turn: f64| Vector3::new(0.06 * turn.cos(), 0.0, 0.06 * turn.sin());
    let mut vertices: Vec<_> = [0.0, -2.0, -4.2].map(corner).to_vec();
    vertices.extend([Vector3::from(tip), Vector3::new(0.0, -0.4, 0.0)]);
    TriangleSoup { vertices, faces: vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]] }
}

/// A ball whose vertices went in and out by this share of its radius: steep grooves, pits and ridges, but no face through
/// another.
fn rugged(subdivisions: u32, share: f64, seed: u64) -> TriangleSoup {
    let mut soup = icosphere(subdivisions, 0.05);
    let mut noise = Noise(seed);
    soup.vertices.iter_mut().for_each(|vertex| *vertex *= (share * noise.gaussian()).exp());
    soup
}

/// Of these faces no one goes through another: what a point does not see of other parts does not matter.
fn whole_meshes(seed: u64) -> Vec<(String, TriangleSoup)> {
    let mut meshes = Vec::new();
    for (subdivisions, share) in [(1, 0.3), (2, 0.1), (2, 0.3), (3, 0.03), (3, 0.1), (3, 0.2)] {
        meshes.push((format!("rugged {subdivisions} {share}"), rugged(subdivisions, share, seed)));
    }
    let few = ["noisy scan", "slotted block", "slivers"];
    let ugly = ugly::all(seed).into_iter().filter(|(name, _)| few.contains(name));
    let flawed = flawed::flawed_solids().into_iter().filter(|(name, _)| *name == "cavity");
    meshes.extend(ugly.chain(flawed).map(|(name, soup)| (name.to_string(), soup)));
    meshes
}

#[test]
fn the_oracle_finds_the_same_sum_of_cones_in_two_ways() {
    let (mut noise, mut same) = (Noise(5), 0);
    for _ in 0..60 {
        let normals: Vec<_> = (0..4).map(|_| (noise.vector(1.0) + Vector3::y()).normalize()).collect();
        let (mu, force) = (noise.between(0.0, 1.5), noise.vector(1.0));
        for count in 1..=4 {
            let exact = distance_from_sum(&normals[..count], mu, &force);
            let found = distance_from_sum_by_projections(&normals[..count], mu, &force);
            // Projections come from above, slowly where only a strong squeeze bears the force.
            assert!(found >= exact - 1e-12 && found <= exact + 0.02, "{exact} {found} {mu} {count}");
            same += usize::from(found - exact < 1e-9);
        }
    }
    assert!(same > 220, "{same} of 240");
}

#[test]
fn the_oracle_slides_in_a_groove_as_can_be_worked_out_by_hand() {
    for degrees in DEGREES {
        let mesh = built(wedge(360.0 - degrees));
        let sine = (0.5 * degrees).to_radians().sin();
        for mu in COEFFICIENTS {
            // From far along the groove, to a HIP below its bottom: both walls bear depth / (2 sine).
            let (depth, from) = (5e-3, Vector3::z() * 0.045);
            let rests = |rule| {
                Coulomb::new(&mesh, mu, rule).step(from, &(Vector3::y() * -depth)).unwrap().god_object.z
            };
            assert!((rests(Rule::OneCone) - mu * depth).abs() < SAME_PLACE);
            assert!((rests(Rule::Least) - (mu * depth / sine).min(from.z)).abs() < SAME_PLACE);
            // Walls nearer to each other than both friction angles squeeze what they hold.
            let jams = 0.5 * degrees.to_radians() < mu.atan();
            let most = rests(Rule::Most);
            assert_eq!(
                jams,
                (most - from.z).abs() < SAME_PLACE && mu * depth / sine < from.z || jams && most == from.z
            );
            assert!(most >= rests(Rule::Least) - SAME_PLACE);
        }
    }
}

/// In a groove along z with this angle: where the god-object ends at the bottom, it lags by `sin` of half the angle as far
/// as the walls, each with its own cone, let it at the least.
fn wedges(seeds: std::ops::Range<u64>, ticks: usize) {
    for degrees in DEGREES {
        let mesh = built(wedge(360.0 - degrees));
        let sine = (0.5 * degrees).to_radians().sin();
        for mu in COEFFICIENTS {
            let mut seen = Seen::default();
            for seed in seeds.clone() {
                let mut roaming = into_the_groove(seed);
                follow(&mesh, mu, (0..ticks).map(|_| roaming.next()), |tick| {
                    seen.note(tick);
                    let Some(least) = tick.least.filter(|least| least.along_groove) else { return };
                    let lags = [tick.ours, least.god_object].map(|god| (god.z - tick.hip.z).abs());
                    let is_between =
                        sine * lags[1] <= lags[0] + SAME_PLACE && lags[0] <= lags[1] + SAME_PLACE;
                    assert!(is_between, "{degrees} degrees, mu {mu}: {lags:?}");
                });
            }
            println!("{degrees} degrees, mu {mu}: {seen:?}");
            assert!(seen.ticks > ticks / 4, "{seen:?}");
            assert!(
                degrees > 100.0 || mu > 0.5 || seen.along_grooves > 10,
                "{degrees} degrees, mu {mu}: {seen:?}"
            );
        }
    }
}

fn pits(seeds: std::ops::Range<u64>, ticks: usize) {
    for tip in [[0.0, -0.02, 0.0], [0.0, -0.05, 0.0], [0.0, -0.15, 0.0], [0.015, -0.1, 0.0]] {
        let mesh = built(pit(tip));
        for mu in COEFFICIENTS {
            let mut seen = Seen::default();
            for seed in seeds.clone() {
                let mut roaming = Roaming::new(seed, 0.015, 3e-4);
                roaming.hip = Vector3::y() * (0.04 - tip[1]);
                let hips = (0..ticks).map(|_| roaming.next() + Vector3::from(tip));
                follow(&mesh, mu, hips, |tick| seen.note(tick));
            }
            println!("tip {tip:?}, mu {mu}: {seen:?}");
            assert!(seen.on_several > 100, "{seen:?}");
        }
    }
}

/// A force of more than three times what the nearest surface explains is one of these too.
const MUCH: f64 = 3.0;

fn whole(seeds: std::ops::Range<u64>, ticks: usize) {
    for seed in seeds {
        for (name, soup) in whole_meshes(seed) {
            let mesh = built(soup);
            let looks = Coulomb::new(&mesh, 0.0, Rule::OneCone);
            for mu in [0.0, 0.3, 0.8, 1.5] {
                let (mut seen, mut much) = (Seen::default(), 0);
                let mut roaming = Roaming::new(seed, 0.055, 5e-4);
                follow(&mesh, mu, (0..ticks).map(|_| roaming.next()), |tick| {
                    seen.note(tick);
                    let explained = MUCH * looks.distance(&tick.hip);
                    if tick.spring() > explained {
                        much += 1;
                        let others =
                            [tick.one_cone, tick.least, tick.most].map(|other| tick.spring_of(other));
                        assert!(others.iter().all(|spring| *spring > explained - SAME_PLACE));
                    }
                });
                println!("{name}, mu {mu}: {much} above {MUCH} k d; {seen:?}");
            }
        }
    }
}

#[test]
fn in_wedges_no_more_is_felt_than_cones_of_both_walls_explain() {
    wedges(0..1, 1200);
}

#[test]
fn in_pits_no_more_is_felt_than_cones_of_all_walls_explain() {
    pits(0..1, 1500);
}

#[test]
fn on_rugged_meshes_no_more_is_felt_than_cones_of_all_touched_faces_explain() {
    whole(1..2, 700);
}

/// Held in a corner by a face that the HIP had since gone round, a god-object stayed there, with up to five times the force,
/// though nothing was in its way.
#[test]
fn a_corner_holds_only_what_it_is_in_the_way_of() {
    for (subdivisions, seed, mu) in [(2, 10, 0.8), (1, 11, 0.3), (1, 11, 0.8), (2, 12, 0.3)] {
        let mesh = built(rugged(subdivisions, 0.3, seed));
        let (mut roaming, mut seen) = (Roaming::new(seed, 0.055, 5e-4), Seen::default());
        follow(&mesh, mu, (0..5000).map(|_| roaming.next()), |tick| seen.note(tick));
        assert!(seen.held > 1000 && seen.on_several > 1000, "{seen:?}");
    }
}

/// `cargo test --release -p haptics --test mesh grooves:: -- --ignored --nocapture`
#[test]
#[ignore = "the long version, a minute"]
fn in_four_million_ticks_of_grooves_no_more_is_felt_than_cones_explain() {
    wedges(1..6, 10_000);
    pits(1..6, 10_000);
    whole(10..15, 5000);
}

/// A groove along z with a round bottom, by equation: everywhere smooth, so that a point touches it in one place and has
/// one friction cone there.
struct Rounded {
    half_angle: f64,
    radius_m: f64,
    mu: f64,
}

impl Rounded {
    /// The point of it that is nearest, and the normal there.
    fn nearest(&self, p: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let (sine, cosine) = self.half_angle.sin_cos();
        let middle = Vector3::new(0.0, self.radius_m / sine, p.z);
        let way = p - middle;
        let side = way.x.signum();
        let (flank, normal) =
            (Vector3::new(side * sine, cosine, 0.0), Vector3::new(-side * cosine, sine, 0.0));
        let up = flank.dot(&way);
        if up >= 0.0 {
            return (middle + flank * up - normal * self.radius_m, normal);
        }
        let out = Vector3::new(way.x, way.y, 0.0).normalize();
        (middle + out * self.radius_m, -out)
    }

    /// Draws a god-object on in little steps, until its one friction cone holds it.
    fn step(&self, from: &Vector3<f64>, hip: &Vector3<f64>) -> Vector3<f64> {
        let (mut at, mut normal) = self.nearest(from);
        for _ in 0..1_000_000 {
            let pull = hip - at;
            let load = -normal.dot(&pull);
            let along = pull + normal * load;
            let left = along.norm() - self.mu * load;
            if left <= SMALLEST {
                return at;
            }
            let from_bottom = at.xy().norm();
            let step = if from_bottom > 4.0 * self.radius_m / self.half_angle.sin() {
                left.min(0.25 * from_bottom)
            } else {
                // On the bend what is left falls as fast as the normal turns.
                (left / (1.0 + load.abs() / self.radius_m)).clamp(SMALLEST, 0.02 * self.radius_m)
            };
            (at, normal) = self.nearest(&(at + along * (step / along.norm())));
        }
        panic!("it does not come to rest: {from} {hip}");
    }
}

/// Ten thousand roundings of positions (m).
const SMALLEST: f64 = 1e-13;

#[test]
fn a_point_feels_a_groove_as_if_its_bottom_was_round() {
    for degrees in [20.0_f64, 60.0, 90.0, 140.0] {
        let mesh = built(wedge(360.0 - degrees));
        for mu in [0.1, 0.5, 1.5] {
            let worst = [1e-4, 1e-5].map(|radius_m| {
                let round = Rounded { half_angle: 0.5 * degrees.to_radians(), radius_m, mu };
                let entity = touchable(&mesh, Friction::coulomb(mu).unwrap());
                let (mut finger, mut roaming) = (point_finger(), into_the_groove(degrees as u64));
                let mut last: Option<Vector3<f64>> = None;
                let (mut worst, mut compared) = (0.0_f64, 0);
                for _ in 0..1000 {
                    let hip = roaming.next();
                    let out = step(&mut finger, &entity, &hip);
                    last = out.entity.map(|_| round.step(&last.unwrap_or(out.god_object_W), &hip));
                    let Some(there) = last else { continue };
                    worst = worst.max((out.god_object_W - there).norm());
                    compared += 1;
                }
                assert!(compared > 200, "{compared}");
                worst / radius_m
            });
            println!("{degrees} degrees, mu {mu}: {worst:?} radii");
            // The bend lifts the bottom by less than its radius over the sine, and what friction keeps of that is as much.
            let most = 2.0 / (0.5 * degrees).to_radians().sin();
            assert!(worst.iter().all(|worst| *worst < most), "{degrees} degrees, mu {mu}: {worst:?} {most}");
        }
    }
}
