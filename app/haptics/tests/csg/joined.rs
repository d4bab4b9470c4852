//! Fingers on random trees of joined shapes, against what springs and boundaries allow.
//!
//! Nothing of the reference is shared with the trees: inside and outside is what the leaves' equations say.

use std::ops::AddAssign;

use crate::common::*;
use crate::joints::{Leaf, SIZE_M, contains, joined, leaves};
use crate::trees::{built, random_tree, touchable};
use haptics::{Capsule, Cone, CsgPart, CsgTree, Cuboid, Cylinder, Entity, Friction, Plane, Sphere, Torus};
use nalgebra::Vector3;

/// Ticks with a fault, by kind.
#[derive(Debug, Clone, Copy, Default)]
struct Faults {
    touched: u32,
    /// Inside, but nothing felt.
    unfelt: u32,
    off_boundary: u32,
    /// A free place beside it is nearer to the HIP.
    unsettled: u32,
    /// The force is not that of the spring.
    no_spring: u32,
    /// The spring became longer by the god-object's own way.
    loaded: u32,
}

impl Faults {
    fn count(&self) -> u32 {
        self.unfelt + self.off_boundary + self.unsettled + self.no_spring + self.loaded
    }
}

impl AddAssign for Faults {
    fn add_assign(&mut self, other: Self) {
        self.touched += other.touched;
        self.unfelt += other.unfelt;
        self.off_boundary += other.off_boundary;
        self.unsettled += other.unsettled;
        self.no_spring += other.no_spring;
        self.loaded += other.loaded;
    }
}

/// A solid under test.
struct Trial {
    tree: CsgTree,
    leaves: Vec<Leaf>,
    extent_m: f64,
    frictionless: Entity,
    rough: Entity,
}

impl Trial {
    fn new(tree: CsgTree) -> Self {
        let extent_m = built(&tree).extent_m();
        Self {
            leaves: leaves(&tree),
            extent_m,
            frictionless: touchable(&tree, Friction::None),
            rough: touchable(&tree, Friction::coulomb(0.3).unwrap()),
            tree,
        }
    }

    /// A place of the boundary where many leaves meet, from outside to inside.
    fn place(&self, noise: &mut Noise) -> Option<[Vector3<f64>; 2]> {
        let mut best: Option<(usize, [Vector3<f64>; 2])> = None;
        for _ in 0..60 {
            let [mut out, mut inside] = [(); 2].map(|()| noise.vector(SIZE_M));
            if contains(&self.tree, &out) {
                std::mem::swap(&mut out, &mut inside);
            }
            if contains(&self.tree, &out) || !contains(&self.tree, &inside) {
                continue;
            }
            for _ in 0..40 {
                let middle = 0.5 * (out + inside);
                if contains(&self.tree, &middle) { inside = middle } else { out = middle }
            }
            let around: Vec<_> = (0..6).map(|_| out + noise.vector(0.05 * SIZE_M)).collect();
            let is_cut = |leaf: &&Leaf| {
                let is_in = contains(&leaf.tree, &around[0]);
                around.iter().any(|p| contains(&leaf.tree, p) != is_in)
            };
            let meeting = self.leaves.iter().filter(is_cut).count();
            if best.is_none_or(|(most, _)| meeting > most) {
                best = Some((meeting, [out, inside]));
            }
        }
        best.map(|(_, place)| place)
    }

    /// Into the material, around in it, and out again.
    fn path(&self, noise: &mut Noise) -> Option<Vec<Vector3<f64>>> {
        let [at, _] = self.place(noise)?;
        // Out of the material, more or less.
        let out = (0..40)
            .map(|_| noise.vector(1.0).normalize())
            .filter(|d| !contains(&self.tree, &(at + d * 0.05 * SIZE_M)))
            .fold(Vector3::zeros(), |sum, d| sum + d);
        if out.norm() < 0.5 {
            return None;
        }
        let out = out.normalize();
        let depth_m = SIZE_M * 10f64.powf(noise.between(-2.0, -0.7));
        let aside = out.cross(&noise.vector(1.0)).normalize();
        let other = out.cross(&aside);
        let reach_m = SIZE_M * 10f64.powf(noise.between(-1.5, 0.0));
        let [a, b, c, phase] = [1.0, 2.0, 3.0, 6.2]
            .map(|most| if most > 4.0 { noise.between(0.0, most) } else { (noise.uniform() * most).ceil() });
        let begin = at + out * depth_m;
        // Whoever begins inside has less than a spring at first.
        if contains(&self.tree, &begin) {
            return None;
        }
        let tau = std::f64::consts::TAU;
        Some(
            (0..TICKS)
                .map(|tick| {
                    let t = f64::from(tick) / f64::from(TICKS - 1);
                    let press = (10.0 * t).min(10.0 * (1.0 - t)).min(1.0);
                    begin - out * (depth_m * press * (1.5 + 0.5 * (c * tau * t).cos()))
                        + aside * (reach_m * (a * tau * t).sin())
                        + other * (reach_m * ((b * tau * t + phase).sin() - phase.sin()))
                })
                .collect(),
        )
    }

    fn walk(&self, entity: &Entity, path: &[Vector3<f64>], name: &str) -> Faults {
        let mut finger = point_finger();
        let mut faults = Faults::default();
        let mut god_before: Option<Vector3<f64>> = None;
        let is_frictionless = std::ptr::eq(entity, &raw const self.frictionless);
        for (tick, hip) in path.iter().enumerate() {
            let out = finger.step(std::slice::from_ref(entity), hip, DT);
            let Some(contact) = finger.contact(0) else {
                let is_unfelt = tick > 0 && self.is_deep(hip);
                faults.unfelt += u32::from(is_unfelt);
                god_before = None;
                if is_unfelt {
                    println!("{name} tick {tick}: unfelt: {hip:?}");
                }
                continue;
            };
            faults.touched += 1;
            let god = contact.god_object_W;
            let spring = god - hip;
            if self.is_on_thin_wall(&god) {
                // Felt or not: nobody says.
                god_before = None;
                continue;
            }
            let tell_it = |what: &str| println!("{name} tick {tick}: {what}: {hip:?} {out:?}");
            if !self.is_on_boundary(&god) {
                faults.off_boundary += 1;
                tell_it("off the boundary");
            }
            // Forces within a share of the spring that slides rest at, and roundings of positions.
            let off_n = (out.force_on_user_W - spring * K).norm();
            if is_frictionless && off_n > K * (1e-9 * spring.norm() + 1e-11 * self.extent_m) {
                faults.no_spring += 1;
                tell_it(&format!("{off_n} N off its spring"));
            }
            if let Some(before) = god_before {
                let gain_m = spring.norm() - (before - hip).norm();
                if gain_m > 1e-8 * self.extent_m + 1e-9 * spring.norm() {
                    faults.loaded += 1;
                    tell_it(&format!("loaded by {gain_m}"));
                }
            }
            if is_frictionless && !self.is_settled(&god, hip) {
                faults.unsettled += 1;
                tell_it("unsettled");
            }
            god_before = Some(god);
        }
        faults
    }

    /// Whether a HIP is so far inside that rounding or a slit cannot be the reason.
    fn is_deep(&self, hip: &Vector3<f64>) -> bool {
        let step_m = RESOLUTION * self.extent_m;
        contains(&self.tree, hip) && directions(26).all(|d| contains(&self.tree, &(hip + d * step_m)))
    }

    /// Whether two leaves lie against each other here, one of them taken away from the other or both facing each other: walls
    /// and gaps without thickness, felt or not.
    fn is_on_thin_wall(&self, god: &Vector3<f64>) -> bool {
        let step_m = 3.0 * RESOLUTION * self.extent_m;
        let pattern = |leaf: &Leaf| -> Vec<bool> {
            directions(26).map(|d| contains(&leaf.tree, &(god + d * step_m)) != leaf.is_taken_away).collect()
        };
        let is_cut = |pattern: &Vec<bool>| pattern.iter().any(|is_in| *is_in != pattern[0]);
        let cut: Vec<_> = self.leaves.iter().map(pattern).filter(is_cut).collect();
        let opposed = |a: &[bool], b: &[bool]| a.iter().zip(b).filter(|(a, b)| a == b).count() <= 3;
        cut.iter().enumerate().any(|(i, a)| cut[..i].iter().any(|b| opposed(a, b)))
    }

    /// True where both material and free space are right beside a point. In the tip of a pit few directions are free.
    fn is_on_boundary(&self, god: &Vector3<f64>) -> bool {
        let step_m = 0.1 * RESOLUTION * self.extent_m;
        [64, 20_000].into_iter().any(|count| {
            let mut around = directions(count).map(|d| contains(&self.tree, &(god + d * step_m)));
            let first = around.next();
            around.any(|is_in| Some(is_in) != first)
        })
    }

    /// Whether all steps of some small length that lead nearer to the HIP lead into the material.
    fn is_settled(&self, god: &Vector3<f64>, hip: &Vector3<f64>) -> bool {
        let way = hip - god;
        let step_m = RESOLUTION * self.extent_m;
        if way.norm() < 100.0 * step_m {
            return true;
        }
        let way = way.normalize();
        let a = way.cross(&Vector3::ith(way.iamin(), 1.0)).normalize();
        let b = way.cross(&a);
        (0..RAYS).all(|i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(RAYS);
            let aside = a * angle.cos() + b * angle.sin();
            [0.02, 0.3].iter().any(|nearer| contains(&self.tree, &(god + (aside + way * *nearer) * step_m)))
        })
    }
}

/// Directions all around.
fn directions(count: u32) -> impl Iterator<Item = Vector3<f64>> {
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
        let (rho, angle) = ((1.0 - y * y).sqrt(), 2.399_963 * f64::from(i));
        Vector3::new(rho * angle.cos(), y, rho * angle.sin())
    })
}

/// Walks over trees; what was wrong, in which of them, and an example.
fn walk_over(seeds: std::ops::Range<u64>, tree: fn(u64) -> CsgTree) -> (Faults, Vec<u64>) {
    let (mut all, mut wrong) = (Faults::default(), Vec::new());
    for seed in seeds {
        let trial = Trial::new(tree(seed));
        let mut noise = Noise(seed ^ 0xABCD);
        let mut here = Faults::default();
        for round in 0..PATHS {
            let Some(path) = trial.path(&mut noise) else { continue };
            here += trial.walk(&trial.frictionless, &path, &format!("tree {seed} path {round}"));
            here += trial.walk(&trial.rough, &path, &format!("tree {seed} path {round} rough"));
        }
        if here.count() > 0 {
            wrong.push(seed);
        }
        all += here;
    }
    (all, wrong)
}

/// Forces are springs, nobody is lost and no energy is given, without exception. At walls that are thinner than the trees
/// resolve (a leaf taken away from one that it all but equals) a god-object may wait where the equations see a way.
fn check(name: &str, (faults, wrong): (Faults, Vec<u64>)) {
    println!("{name}: {faults:?} {} trees {wrong:?}", wrong.len());
    assert!(faults.touched > 10_000, "{name} {faults:?}");
    assert_eq!((faults.unfelt, faults.no_spring, faults.loaded), (0, 0, 0), "{name} {faults:?} {wrong:?}");
    assert!(1000 * (faults.unsettled + faults.off_boundary) <= faults.touched, "{name} {faults:?} {wrong:?}");
}

#[test]
fn joined_trees_hold_a_finger_at_the_nearest_place_by_its_spring() {
    check("joined", walk_over(0..60, joined));
}

#[test]
fn crossing_trees_hold_a_finger_at_the_nearest_place_by_its_spring() {
    check("crossing", walk_over(0..45, |seed| random_tree(seed).0));
}

/// One tree in which no tick may have a fault.
fn check_tree(seed: u64) {
    let (faults, _) = walk_over(seed..seed + 1, joined);
    assert_eq!(faults.count(), 0, "{faults:?}");
}

/// In one tick of a way through this tree a god-object leaves one leaf for another more often than a tick has time for.
#[test]
fn a_finger_whose_god_object_flies_from_leaf_to_leaf_is_not_lost() {
    check_tree(8552);
}

/// In one tick of a way around a bend of this tree the god-object is beyond where it was to go when the tick has no time left.
#[test]
fn a_finger_whose_god_object_overshoots_without_end_has_all_of_its_spring() {
    check_tree(35_604);
}

/// A conical pit of this tree has a tip, where its wall has no normal.
#[test]
fn in_the_tip_of_a_conical_pit_a_finger_has_all_of_its_spring() {
    check_tree(11_582);
}

/// A rod of this tree fills a ring that is taken away up to where it is highest, and its wall ends where both touch.
#[test]
fn before_a_gap_that_rounding_leaves_a_god_object_stays_on_its_edge() {
    check_tree(61_466);
}

/// Two all but equal balls of this tree meet where nobody can tell from afar.
#[test]
fn where_balls_all_but_coincide_a_god_object_finds_their_edge_from_nearby() {
    check_tree(72_931);
}

/// A way for a finger without friction over a tree made by hand: nothing may be wrong in any of its ticks.
fn check_way(name: &str, tree: CsgTree, way: impl Fn(f64) -> Vector3<f64>) {
    let trial = Trial::new(tree);
    let path: Vec<_> = (0..TICKS).map(|tick| way(f64::from(tick) / f64::from(TICKS - 1))).collect();
    let faults = trial.walk(&trial.frictionless, &path, name);
    assert!(faults.touched > TICKS / 2, "{name} {faults:?}");
    assert_eq!(faults.count(), 0, "{name} {faults:?}");
}

/// The end of a capsule and a ball in it coincide, and end together where both are cut; below lies a ball that is smaller by far
/// more than what counts as one place. Beyond the cut neither of the two holds a finger.
#[test]
fn where_leaves_that_coincide_are_cut_off_a_god_object_falls_onto_what_is_below() {
    let end = Vector3::new(0.0, -0.01, 0.0);
    let sphere = |radius_m: f64| CsgPart::at(Sphere::new(radius_m).unwrap(), end);
    for lower_m in [1e-7, 1e-6, 1e-5] {
        let ends = CsgTree::union([CsgPart::from(Capsule::new(0.0126, 0.02).unwrap()), sphere(0.0126)]);
        let cut =
            CsgTree::difference([CsgPart::from(ends), Plane::new(-Vector3::y(), 0.013).unwrap().into()]);
        let tree = CsgTree::union([CsgPart::from(cut), sphere(0.0126 - lower_m)]);
        // Past the cut, where the normal falls by 0.24 of its length.
        check_way(&format!("lower by {lower_m}"), tree, |t| {
            let press_m = 1e-3 * (10.0 * t).min(10.0 * (1.0 - t)).min(1.0);
            let (down, around) = (0.35 * t - 0.4, 3.0 * t);
            let rho = (1.0 - down * down).sqrt();
            end + Vector3::new(rho * around.cos(), down, rho * around.sin()) * (0.0128 - press_m)
        });
    }
}

/// A ring bored out of a block is filled again within its circle, up to where it is highest, and a little less or more. The filling
/// and the roof touch right behind the edge of both: along it the finger is drawn around, under the roof and back.
#[test]
fn where_a_filling_touches_the_roof_behind_its_edge_a_finger_follows_the_edge() {
    let (circle_m, radius_m) = (0.0269, 0.0097);
    let less = [0.0, 1e-16, 1e-15, 1e-14, 1e-13, 3e-13, 1e-11, 1e-10, 1e-9, 1e-8];
    let more = [-1e-15, -1e-14, -1e-13, -1e-12, -1e-11, -3e-11, -1e-9];
    for lower in less.into_iter().chain(more) {
        let block = CsgPart::from(Cuboid::new([0.1, 0.05, 0.1]).unwrap());
        let ring = CsgPart::from(Torus::new(circle_m, radius_m).unwrap());
        let filling = Cylinder::new(circle_m, 2.0 * radius_m * (1.0 - lower)).unwrap();
        let bored = CsgPart::from(CsgTree::difference([block, ring]));
        let tree = CsgTree::union([bored, filling.into()]);
        for (turn, press_m, reach_m) in [(2.0, 1e-3, 0.01), (1.0, 2e-4, 1e-3), (0.1, 1e-5, 1e-6)] {
            check_way(&format!("lower by {lower}, {turn}"), tree.clone(), |t| {
                let pressed = (10.0 * t).min(10.0 * (1.0 - t)).min(1.0);
                let rho_m = circle_m + reach_m * (0.3 + (17.0 * t).cos()) * pressed + 1e-3 * (1.0 - pressed);
                let height_m = radius_m - 1e-3 * (1.0 - pressed) + press_m * pressed;
                Vector3::new(rho_m * (turn * t).cos(), height_m, rho_m * (turn * t).sin())
            });
        }
    }
}

/// Whoever is pressed beyond the tip of a conical pit is held in the tip, also where the wall all but leads on.
#[test]
fn beyond_the_tip_of_a_conical_pit_a_finger_is_held_in_the_tip() {
    // A radius of 0.03 over a length of 0.024: across the wall it is 0.024 to 0.03.
    let steepest = 0.024 / 0.03;
    for share in [0.0, 0.5, 0.9, 0.97, 0.99, 0.999] {
        for scale in [[1.0; 3], [1.3, 1.0, 1.3]] {
            let pit = CsgPart::from(Cone::new(0.03, 0.0, 0.024).unwrap()).scaled(scale);
            let tree = CsgTree::difference([CsgPart::from(Cuboid::new([0.1; 3]).unwrap()), pit]);
            let steepest = steepest / scale[0];
            check_way(&format!("share {share} {scale:?}"), tree, |t| {
                let height_m = 4e-3 * (std::f64::consts::PI * t).sin() - 5e-4;
                let aside_m = share * steepest * height_m.max(0.0);
                let angle = 4.0 * t;
                Vector3::new(aside_m * angle.cos(), 0.012 + height_m, aside_m * angle.sin())
            });
        }
    }
}

/// Both, a hundred thousand trees and more: `cargo test --release -p haptics --test csg joined:: -- --ignored --nocapture`, with
/// `FIRST=35000` in front from that tree on.
#[test]
#[ignore = "the long version, hours"]
fn a_hundred_thousand_trees_hold_a_finger_at_the_nearest_place_by_its_spring() {
    let begin = std::env::var("FIRST").ok().and_then(|first| first.parse().ok()).unwrap_or(0);
    let mut failed = Vec::new();
    for first in (begin..100_000).step_by(1000) {
        let crossing = first / 4..first / 4 + 250;
        let blocks = [
            ("joined", walk_over(first..first + 1000, joined)),
            ("crossing", walk_over(crossing, |seed| random_tree(seed).0)),
        ];
        for (name, (faults, wrong)) in blocks {
            let name = format!("{name} from {first}");
            let result = std::panic::catch_unwind(|| check(&name, (faults, wrong)));
            failed.extend(result.is_err().then_some(name));
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

const TICKS: u32 = 200;
const PATHS: u32 = 3;
const RAYS: u32 = 24;
/// Steps to the side, as a share of the extent: leaves nearer to each other than 1e-9 of it are one.
const RESOLUTION: f64 = 1e-7;
