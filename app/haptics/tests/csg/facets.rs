//! Facets of joined solids: closed, where the boundary is, and of what is thin, small or far as well.

use std::f64::consts::PI;

use crate::common::*;
use crate::joints::{SIZE_M, contains, joined};
use crate::trees::{self, ball, built, cuboid, v};
use haptics::{Capsule, Csg, CsgPart, CsgTree, Cylinder, Facets, Plane, Torus};
use nalgebra::{Isometry3, Vector3};

/// Sum of the tetrahedra's volumes over the origin.
fn volume_m3(facets: &Facets) -> f64 {
    let at = |corner: u32| facets.places[corner as usize];
    facets.triangles.iter().map(|[a, b, c]| at(*a).dot(&at(*b).cross(&at(*c)))).sum::<f64>() / 6.0
}

fn size(facets: &Facets) -> Vector3<f64> {
    let first = [facets.places[0]; 2];
    let [least, most] =
        facets.places.iter().fold(first, |[least, most], place| [least.inf(place), most.sup(place)]);
    most - least
}

/// Number of times that a way goes in through facets, less those that it goes out.
fn entries(facets: &Facets, from: &Vector3<f64>, to: &Vector3<f64>) -> i32 {
    let way = to - from;
    let enters = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| facets.places[corner as usize] - from);
        let sides = [a.cross(&b).dot(&way), b.cross(&c).dot(&way), c.cross(&a).dot(&way)];
        let sign = if sides.iter().all(|side| *side >= 0.0) {
            -1
        } else if sides.iter().all(|side| *side < 0.0) {
            1
        } else {
            return 0;
        };
        let normal = (b - a).cross(&(c - a));
        let share = normal.dot(&a) / normal.dot(&way);
        if (0.0..1.0).contains(&share) { sign } else { 0 }
    };
    facets.triangles.iter().map(enters).sum()
}

/// Of ways between random places that are clear of the boundary, how many there are and how many facets tell wrongly.
fn told(
    csg: &Csg,
    facets: &Facets,
    is_in: &dyn Fn(&Vector3<f64>) -> bool,
    size_m: f64,
    noise: &mut Noise,
) -> [u32; 2] {
    let mut counts = [0; 2];
    for _ in 0..400 {
        let [from, to] = [(); 2].map(|()| Vector3::from_fn(|_, _| noise.between(-1.0, 1.0) * size_m));
        // Twice what a chord misses of its arc.
        if [from, to].iter().any(|place| csg.signed_distance(place).abs() < 0.003 * size_m) {
            continue;
        }
        counts[0] += 1;
        let expected = i32::from(is_in(&to)) - i32::from(is_in(&from));
        counts[1] += u32::from(entries(facets, &from, &to) != expected);
    }
    counts
}

/// A chord of 64 around misses 0.12 % of its arc's radius.
const MISSED: f64 = 0.0013;

#[test]
fn facets_of_trees_are_closed_and_on_their_boundary() {
    let mut noise = Noise(77);
    for trees::Tree { name, tree, contains, size_m } in trees::all() {
        let csg = built(&tree);
        let facets = csg.facets();
        let off_m = facets.places.iter().map(|place| csg.signed_distance(place).abs()).fold(0.0, f64::max);
        let [ways, wrong] = told(&csg, &facets, &contains, size_m, &mut noise);
        let triangles = facets.triangles.len();
        println!("{name}: {triangles} triangles, off {:.1e}, {wrong} of {ways} ways wrong", off_m / size_m);
        assert!(ways > 300 && wrong == 0, "{name}: {wrong} of {ways}");
        // Corners of two bends may miss both.
        assert!(off_m < 2.0 * MISSED * size_m, "{name}: {off_m}");
        assert!(triangles < 50_000, "{name}: {triangles} triangles");
        assert!(facets.normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-12));
    }
}

/// Tangent, coincident and nearly coincident surfaces, huge and tiny ones.
#[test]
fn facets_of_random_trees_leave_few_ways_through() {
    let (mut noise, mut all) = (Noise(78), [0; 2]);
    for seed in 0..80 {
        let tree = joined(seed);
        let csg = built(&tree);
        let facets = csg.facets();
        let size_m = csg.extent_m().min(3.0 * SIZE_M);
        let [ways, wrong] = told(&csg, &facets, &|p| contains(&tree, p), size_m, &mut noise);
        let triangles = facets.triangles.len();
        assert!(triangles < 50_000, "{seed}: {triangles} triangles");
        (all[0], all[1]) = (all[0] + ways, all[1] + wrong);
    }
    println!("{} of {} ways wrong", all[1], all[0]);
    // A few where two surfaces lie within a millionth of their size of each other.
    assert!(all[0] > 25_000 && all[1] * 200 < all[0], "{all:?}");
}

fn area_m2(facets: &Facets) -> f64 {
    let at = |corner: u32| facets.places[corner as usize];
    facets.triangles.iter().map(|[a, b, c]| 0.5 * (at(*b) - at(*a)).cross(&(at(*c) - at(*a))).norm()).sum()
}

#[test]
fn thin_plates_are_whole() {
    for wall_m in [1e-3, 1e-4, 1e-6] {
        let parts = [CsgPart::from(cuboid([0.1; 3])), CsgPart::at(cuboid([0.1; 3]), v(wall_m, 0.0, 0.0))];
        let facets = built(&CsgTree::difference(parts)).facets();
        assert_eq!(facets.triangles.len(), 12);
        assert!((size(&facets) - v(wall_m, 0.1, 0.1)).amax() < 1e-12, "{wall_m}: {}", size(&facets));
        assert!((volume_m3(&facets) / (0.01 * wall_m) - 1.0).abs() < 1e-9, "{wall_m}");
    }
}

#[test]
fn cups_and_shells_of_thin_walls_are_whole() {
    let (r, h) = (0.04, 0.1);
    for wall_m in [1.5e-3, 5e-4, 1e-4, 1e-5] {
        let tube = |radius_m| Cylinder::new(radius_m, h).unwrap();
        let inner = CsgPart::at(tube(r - wall_m), v(0.0, wall_m, 0.0));
        let cup = built(&CsgTree::difference([CsgPart::from(tube(r)), inner])).facets();
        let ring = r * r - (r - wall_m).powi(2);
        let walls = 2.0 * r * h + 2.0 * (r - wall_m) * (h - wall_m) + r * r + (r - wall_m).powi(2);
        assert!((size(&cup) - v(2.0 * r, h, 2.0 * r)).amax() < 1e-12, "{wall_m}: {}", size(&cup));
        // Of the rim, what is narrower than a chord misses may be left out.
        let share = area_m2(&cup) / PI / walls;
        assert!(share > 1.0 - 2.0 * MISSED && share < 1.0 + ring / walls + 1e-9, "{wall_m}: {share}");
        let shell = CsgTree::difference([CsgPart::from(ball(r)), ball(r - wall_m).into()]);
        let shell = built(&shell).facets();
        assert!((size(&shell) - v(2.0 * r, 2.0 * r, 2.0 * r)).amax() < 1e-12, "{wall_m}: {}", size(&shell));
        let share = area_m2(&shell) / (4.0 * PI * (r * r + (r - wall_m).powi(2)));
        assert!(share > 1.0 - 2.0 * MISSED && share < 1.0, "{wall_m}: {share}");
    }
}

#[test]
fn parts_far_from_each_other_and_small_bores_are_whole() {
    let far =
        CsgTree::union([CsgPart::from(cuboid([0.01; 3])), CsgPart::at(cuboid([0.01; 3]), v(5.0, 0.0, 0.0))]);
    let facets = built(&far).facets();
    assert_eq!(facets.triangles.len(), 24);
    assert!((size(&facets) - v(5.01, 0.01, 0.01)).amax() < 1e-12, "{}", size(&facets));
    // Of a meter, a bore of a millimeter.
    let (side, r) = (1.0, 5e-4);
    let bore = Cylinder::new(r, 2.0).unwrap();
    let facets = built(&CsgTree::difference([CsgPart::from(cuboid([side; 3])), bore.into()])).facets();
    let expected = side * side * side - PI * r * r * side;
    let left = (side * side * side - volume_m3(&facets)) / (side * side * side - expected);
    assert!((left - 1.0).abs() < 3.0 * MISSED, "{left}");
}

#[test]
fn what_lies_upon_each_other_is_there_once() {
    // Side by side, flush, twice the same; the end of a capsule, and a ball in it.
    let boxes =
        [v(0.0, 0.0, 0.0), v(0.1, 0.0, 0.0), v(0.05, 0.0, 0.0)].map(|at| CsgPart::at(cuboid([0.1; 3]), at));
    let facets = built(&CsgTree::union(boxes)).facets();
    assert!((area_m2(&facets) - 0.1).abs() < 1e-12, "{}", area_m2(&facets));
    let end = CsgPart::at(ball(0.02), v(0.0, 0.03, 0.0));
    let parts = [CsgPart::from(Capsule::new(0.02, 0.06).unwrap()), end];
    let facets = built(&CsgTree::union(parts)).facets();
    let share = area_m2(&facets) / (2.0 * PI * 0.02 * 0.06 + 4.0 * PI * 0.02 * 0.02);
    assert!(share > 1.0 - 2.0 * MISSED && share < 1.0, "{share}");
}

#[test]
fn facets_of_many_leaves_are_bounded() {
    let mut noise = Noise(79);
    let mut part = |k: i32| {
        let at = Vector3::from_fn(|_, _| noise.between(-0.05, 0.05));
        if k % 2 == 0 {
            CsgPart::at(ball(0.03), at)
        } else {
            CsgPart::at(Torus::new(0.03, 0.01).unwrap(), at)
        }
    };
    let tree = CsgTree::union((0..256).map(&mut part));
    let facets = built(&tree).facets();
    println!("{} triangles", facets.triangles.len());
    assert!((1000..200_000).contains(&facets.triangles.len()), "{}", facets.triangles.len());
}

/// More than is cut with fine steps: a box with 60 bores, whose cylinders reach far out of it.
#[test]
fn a_box_with_many_long_bores_is_as_large_as_the_box() {
    let mut parts = vec![CsgPart::from(cuboid([0.1; 3]))];
    for at in 0..60_i32 {
        let [x, z] = [at % 8, at / 8].map(|step| 0.011 * f64::from(step) - 0.038);
        parts.push(CsgPart::at(Cylinder::new(1e-3, 0.2).unwrap(), v(x, 0.0, z)));
    }
    let facets = built(&CsgTree::difference(parts)).facets();
    assert!((size(&facets) - v(0.1, 0.1, 0.1)).amax() < 1e-6, "{}", size(&facets));
    // Of a circle 12 chords leave 4.5 % out.
    let bored = 60.0 * PI * 1e-6 * 0.1;
    let missing = 1e-3 - volume_m3(&facets);
    assert!((0.9..1.01).contains(&(missing / bored)), "{missing}");
}

/// A solid of planes alone is as large as its corners are far.
#[test]
fn a_solid_of_planes_alone_is_drawn_to_its_corners() {
    let wall = |normal: [f64; 3], offset_m: f64| {
        CsgPart::new(Plane::new(Vector3::from(normal).normalize(), offset_m).unwrap(), Isometry3::identity())
    };
    let pyramid = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]];
    let facets = built(&CsgTree::intersection(pyramid.map(|normal| wall(normal, 0.05)))).facets();
    // Corners are three times as far from the middle as the walls are, on the diagonals of a cube.
    let edge_m = 2.0 * 3.0 * 0.05 / 3f64.sqrt();
    assert!((size(&facets) - Vector3::repeat(edge_m)).amax() < 1e-9, "{:?}", size(&facets));
    assert!((volume_m3(&facets) - edge_m.powi(3) / 3.0).abs() < 1e-9, "{}", volume_m3(&facets));
    assert_eq!(facets.triangles.len(), 4);
    // A corner of a room goes on for ever; it is cut off a little behind what is bounded.
    let room = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|normal| wall(normal, 0.05));
    assert!(size(&built(&CsgTree::intersection(room)).facets()).amax() < 0.11);
}

/// A slice of a ring, as thin as the hundredth part of its tube.
#[test]
fn a_ring_is_as_thick_as_its_tube() {
    let ring = CsgPart::new(Torus::new(0.05, 0.02).unwrap(), Isometry3::identity());
    let slice = CsgPart::at(cuboid([0.2, 0.01, 0.2]), v(0.0, 0.0249, 0.0));
    let facets = built(&CsgTree::intersection([ring, slice])).facets();
    // A chord of the tube misses 0.12 % of its radius.
    assert!((size(&facets).y - 1e-4).abs() < MISSED * 0.02, "{:?}", size(&facets));
}

/// The largest distance of triangles' corners, middles of edges and middles from the boundary (m), at least.
fn missed_m(csg: &Csg, facets: &Facets) -> f64 {
    let at = |corner: u32| facets.places[corner as usize];
    let places = facets.triangles.iter().flat_map(|triangle| {
        let [a, b, c] = triangle.map(at);
        [a, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0]
    });
    places.map(|place| csg.signed_distance(&place).abs()).fold(0.0, f64::max)
}

/// Two hundred rings, linked and through each other, and fewer: more than is drawn with many steps.
#[test]
fn a_crowd_of_rings_is_drawn_as_finely_as_its_triangles_allow() {
    let (ring_m, tube_m) = (0.026, 0.006);
    for (count, reach_m, at_most_m) in [(200, 0.1, 1e-3), (100, 0.4, 1e-3)] {
        let mut noise = Noise(1);
        let rings = (0..count).map(|_| {
            let place = Vector3::from_fn(|_, _| noise.between(-1.0, 1.0) * reach_m);
            let axis = Vector3::from_fn(|_, _| noise.between(-1.0, 1.0)).normalize();
            CsgPart::new(Torus::new(ring_m, tube_m).unwrap(), trees::along(axis, place))
        });
        let csg = built(&CsgTree::union(rings));
        let begin = std::time::Instant::now();
        let facets = csg.facets();
        let took = begin.elapsed();
        let missed_m = missed_m(&csg, &facets);
        println!("{count}, {reach_m}: {} triangles, off {missed_m:e} m, {took:?}", facets.triangles.len());
        // With 12 steps around both, the chords of ring and tube miss 1.3 mm together.
        assert!(missed_m < at_most_m, "{count}, {reach_m}: {missed_m}");
    }
}
