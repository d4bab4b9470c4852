//! What meshes answer, against slow and obvious oracles; and that nothing slips through them.

use crate::common::Noise;
use crate::mesh_oracle as oracle;
use haptics::Feature;
use haptics::mesh::{Bvh, Mesh, Sides, TriangleSoup, Triangles, make};
use nalgebra::{Rotation3, Vector3};

fn mesh(soup: TriangleSoup) -> Mesh {
    Mesh::build(soup).expect("a mesh").0
}

fn tiny_triangle() -> TriangleSoup {
    let vertices =
        vec![Vector3::new(0.01, 0.0, 0.0), Vector3::new(0.0, 0.02, 0.0), Vector3::new(0.0, 0.0, 0.03)];
    TriangleSoup { vertices, faces: vec![[0, 1, 2]] }
}

/// A disc of slivers: a thousand triangles, each two thousand times longer than wide at its end.
fn slivers() -> TriangleSoup {
    let n = 1000_u32;
    let rim = |i: u32| {
        let angle = 0.003 * f64::from(i) / 6.0;
        Vector3::new(0.1 * angle.cos(), 1e-4 * (0.3 * f64::from(i)).sin(), 0.1 * angle.sin())
    };
    let vertices = std::iter::once(Vector3::zeros()).chain((0..=n).map(rim)).collect();
    TriangleSoup { vertices, faces: (1..=n).map(|i| [0, i + 1, i]).collect() }
}

/// Small meshes of every kind, for oracles that look at every face.
fn small_meshes() -> Vec<(&'static str, Mesh)> {
    vec![
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("plate", mesh(make::cuboid([0.1, 0.0005, 0.1]))),
        ("wedge", mesh(make::wedge(0.05, 0.05, 0.1))),
        ("star", mesh(make::star(5, 0.1, 0.03, 0.02))),
        ("sphere", mesh(make::uv_sphere(32, 16, 0.1))),
        ("metre-sized bumpy sphere", mesh(make::bumpy_sphere(48, 24, 1.0))),
        ("bumpy sphere of a centimetre", mesh(make::bumpy_sphere(48, 24, 0.01))),
        ("torus", mesh(make::torus(40, 20, 0.1, 0.03))),
        ("Klein bottle", mesh(make::klein_bottle(40, 20, 0.1))),
        ("triangle", mesh(tiny_triangle())),
        ("slivers", mesh(slivers())),
    ]
}

/// A point of the mesh at which things may go wrong: in a face, on an edge, on a vertex.
fn target(mesh: &Mesh, noise: &mut Noise) -> Vector3<f64> {
    let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
    let [a, b, c] = oracle::corners(mesh, face);
    let (u, v) = (noise.uniform(), noise.uniform());
    match (noise.uniform() * 4.0) as u32 {
        0 => a,
        1 => a + (b - a) * u,
        2 => a + (b - a) * 0.5,
        _ => {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            a + (b - a) * u + (c - a) * v
        }
    }
}

/// Far away and close by, in powers of ten.
fn reach(mesh: &Mesh, noise: &mut Noise) -> f64 {
    mesh.extent_m() * 10f64.powf(noise.between(-6.0, 0.7))
}

#[test]
fn the_nearest_point_is_the_one_that_looking_at_every_face_finds() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(1);
        for _ in 0..1000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let (found, expected) = (mesh.nearest_unbounded(&p), oracle::distance(&mesh, &p));
            // Points are some 10 roundings of coordinates this large off; the oracle's regions lose two digits on
            // slivers.
            let tolerance = 1e-13 * (mesh.extent_m() + p.amax());
            assert!((found.distance_m - expected).abs() <= tolerance, "{name}: {p:?} {found:?} {expected}");
            assert!(((p - found.point_B).norm() - found.distance_m).abs() <= tolerance, "{name}: {found:?}");
        }
    }
}

#[test]
fn the_first_hit_is_the_one_that_looking_at_every_face_finds() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(2);
        // A face has its say a little inside its rim for certain, a little outside it perhaps. On slivers the
        // oracle's barycentric coordinates are differences of products that nearly cancel.
        let (rim, slack) = if name == "slivers" { (1e-3, 1e-6) } else { (1e-6, 1e-9) };
        let mut hits = 0;
        for i in 0..2000 {
            let at = target(&mesh, &mut noise);
            let path = noise.vector(1.0) * reach(&mesh, &mut noise);
            // Every other segment may end before it is there.
            let from = at - path * noise.uniform();
            let to = if i % 2 == 0 { from + path } else { at + path * noise.between(-0.5, 0.5) };
            let found = mesh.first_hit(&from, &to).map(|hit| hit.fraction);
            let surely = oracle::first_fraction(&mesh, &from, &to, rim);
            let perhaps = oracle::first_fraction(&mesh, &from, &to, -rim);
            hits += u32::from(found.is_some());
            // Starts and ends on the surface are decided by rounding.
            let end = slack + 1e-12 * mesh.extent_m() / (to - from).norm();
            let is_vague = |fraction: f64| fraction < end || fraction > 1.0 - end;
            let case = format!("{name}: {from:?} {to:?} {found:?} {surely:?} {perhaps:?}");
            match found {
                None => assert!(surely.is_none_or(is_vague), "{case}"),
                Some(found) => {
                    let is_in_time = surely.is_none_or(|surely| found <= surely + end);
                    let is_real = is_vague(found) || perhaps.is_some_and(|perhaps| found >= perhaps - end);
                    assert!(is_in_time && is_real, "{case}");
                }
            }
        }
        assert!(hits > 250, "{name}: {hits}");
    }
}

#[test]
fn a_hit_lies_on_its_face_and_on_the_segment() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(6);
        for _ in 0..2000 {
            let at = target(&mesh, &mut noise);
            let path = noise.vector(1.0) * reach(&mesh, &mut noise);
            let (from, to) = (at - path * noise.uniform(), at + path * noise.uniform());
            let Some(hit) = mesh.first_hit(&from, &to) else { continue };
            let corners = oracle::corners(&mesh, hit.face as usize);
            let normal = mesh.faces()[hit.face as usize].normal_B;
            let scale = mesh.extent_m() + from.amax() + to.amax();
            // Ericson's regions are differences of products: on the plate's flanks, 200 times as long as high, they
            // lose three digits, on slivers all.
            let tolerance = if name == "slivers" { 1e-10 } else { 1e-12 };
            let off = (oracle::closest(&corners, &hit.point_B) - hit.point_B).norm();
            assert!(off <= tolerance * scale, "{name}: {hit:?} {off}");
            // Where the segment meets a plane under a small angle, roundings move the place along it.
            let slope = normal.dot(&(to - from).normalize()).abs();
            let on_segment = from + (to - from) * hit.fraction;
            assert!(
                (hit.point_B - on_segment).norm() <= 1e-14 * scale / slope + 2e-13 * scale,
                "{name} {hit:?}"
            );
            assert_eq!(hit.is_front, normal.dot(&(to - from)) < 0.0, "{name}");
        }
    }
}

#[test]
fn inside_is_where_the_mesh_goes_around_once() {
    for (name, mesh) in small_meshes() {
        if mesh.sides() == Sides::Sheet {
            assert!(!mesh.is_inside_unbounded(&Vector3::zeros()));
            continue;
        }
        let mut noise = Noise(3);
        for _ in 0..1000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let times = oracle::winding_number(&mesh, &p);
            assert_eq!(mesh.is_inside_unbounded(&p), times > 0.5, "{name}: {p:?} {times}");
        }
    }
}

/// Beyond an edge this sharp most directions are behind one of its faces. Tilted, so that the box does not help.
#[test]
fn beyond_a_sharp_edge_is_outside() {
    let tilt = Rotation3::from_euler_angles(0.5, 0.6, 0.7);
    let soup = make::wedge(0.3, 0.05, 0.1);
    let vertices = soup.vertices.iter().map(|vertex| tilt * vertex).collect();
    let mesh = mesh(TriangleSoup { vertices, ..soup });
    let mut noise = Noise(17);
    for _ in 0..5000 {
        let p = tilt * (Vector3::z() * noise.between(-0.051, 0.051) + noise.vector(0.002));
        let times = oracle::winding_number(&mesh, &p);
        assert_eq!(mesh.is_inside_unbounded(&p), times > 0.5, "{p:?} {times}");
    }
}

#[test]
fn the_clearance_is_never_more_than_the_distance() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(4);
        for _ in 0..1000 {
            let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
            let distance = oracle::distance(&mesh, &p);
            let at_most = distance * noise.between(0.0, 3.0);
            let clearance = mesh.clearance(&p, at_most);
            assert!(clearance <= distance + 1e-15 * mesh.extent_m(), "{name}: {p:?} {clearance} {distance}");
            assert!((0.0..=at_most).contains(&clearance));
        }
    }
}

#[test]
fn the_clearance_is_not_more_than_a_distance_whose_square_is_below_the_normal_numbers() {
    let soup = make::cuboid([0.05, 0.05, 0.05]);
    let lowest = soup.vertices.iter().fold(Vector3::zeros(), |low: Vector3<f64>, v| low.inf(v));
    let mesh = mesh(TriangleSoup { vertices: soup.vertices.iter().map(|v| v - lowest).collect(), ..soup });
    for k in 1..1000 {
        let below = 3.7e-23 * f64::from(k);
        let clearance = mesh.clearance(&Vector3::new(0.02, 0.02, -below), 1.0);
        assert!((0.0..=below).contains(&clearance), "{clearance} {below}");
    }
}

#[test]
fn nothing_slips_into_a_closed_mesh() {
    let meshes = [
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("sphere", mesh(make::uv_sphere(100, 50, 0.1))),
        ("bumpy sphere", mesh(make::bumpy_sphere(316, 158, 0.1))),
    ];
    for (name, mesh) in meshes {
        let mut noise = Noise(5);
        for _ in 0..333_334 {
            let at = target(&mesh, &mut noise);
            // These shapes are stars around their middle: towards it is inside, away from it outside.
            let (from, to) = (at * noise.between(1.01, 4.0), at * noise.between(-0.5, 0.99));
            assert!(mesh.first_hit(&from, &to).is_some(), "{name}: {from:?} {to:?}");
        }
    }
}

#[test]
fn nothing_slips_in_along_the_axes() {
    // Through poles, along edges of the grid and in the planes of faces: every number is round.
    let meshes = [
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("sphere", mesh(make::uv_sphere(100, 50, 0.1))),
        ("bumpy sphere", mesh(make::bumpy_sphere(316, 158, 0.1))),
    ];
    for (name, mesh) in meshes {
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut from = Vector3::zeros();
                from[axis] = 0.3 * sign;
                for end in [0.0, -0.02, -0.3] {
                    let hit = mesh.first_hit(&from, &(from * (end / 0.3))).expect(name);
                    assert!(hit.point_B[axis] * sign > 0.02, "{name}: it goes in where it comes in");
                }
            }
        }
        for vertex in mesh.vertices() {
            assert!(mesh.first_hit(&(vertex * 2.0), &(vertex * 0.5)).is_some(), "{name}: {vertex:?}");
        }
    }
}

#[test]
fn nothing_slips_into_a_mesh_of_any_shape() {
    for (name, mesh) in small_meshes() {
        if mesh.sides() == Sides::Sheet {
            continue;
        }
        let mut noise = Noise(7);
        let mut pairs = 0;
        let mut outside = mesh.vertices()[0] * 1.5;
        for _ in 0..1500 {
            let p =
                target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise).min(mesh.extent_m());
            // The oracle is not asked on the surface itself.
            if oracle::distance(&mesh, &p) < 1e-12 * mesh.extent_m() {
                continue;
            }
            if oracle::winding_number(&mesh, &p) < 0.5 {
                outside = p;
            } else {
                assert!(mesh.first_hit(&outside, &p).is_some(), "{name}: {outside:?} {p:?}");
                pairs += 1;
            }
        }
        assert!(pairs > 100, "{name}: {pairs}");
    }
}

/// Steps that nearly end on the surface: rounding calls them outside or inside as it likes.
#[test]
fn nothing_slips_through_in_steps() {
    let meshes = [
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("metre-sized sphere", mesh(make::uv_sphere(32, 16, 1.0))),
        ("bumpy sphere", mesh(make::bumpy_sphere(316, 158, 0.1))),
    ];
    for (name, mesh) in meshes {
        let mut noise = Noise(8);
        for _ in 0..100_000 {
            let at = target(&mesh, &mut noise);
            let (from, to) = (at * noise.between(1.0001, 2.0), at * noise.between(0.1, 0.9999));
            // Some roundings of the coordinates: up to the tolerance, which is 300 of them.
            let rounding = mesh.extent_m() * 10f64.powf(noise.between(-17.5, -14.5));
            let mut chain = vec![from];
            chain.extend((0..3).map(|_| at + noise.vector(rounding)));
            chain.push(to);
            let hits: Vec<_> =
                chain.windows(2).filter_map(|step| mesh.first_hit(&step[0], &step[1])).collect();
            assert!(!hits.is_empty(), "{name}: {chain:?}");
            let off = (hits[0].point_B - at).norm();
            assert!(off <= 1e-13 * mesh.extent_m(), "{name}: {chain:?} {off}");
        }
    }
}

/// A start that rounding has put beside the rim of the face that is entered, behind the one next to it.
#[test]
fn nothing_slips_in_beside_the_rim_of_a_concave_edge() {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let mut noise = Noise(23);
    for case in 0..3000 {
        let turn = Rotation3::new(noise.vector(2.0));
        let end = |z: f64| outline.iter().map(move |[x, y]| turn * Vector3::new(*x, *y, z));
        let vertices = end(1.0).chain(end(-1.0)).collect();
        let front = [[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]];
        let mut faces = front.to_vec();
        faces.extend(front.map(|[a, b, c]| [a + 6, c + 6, b + 6]));
        (0..6).for_each(|a| faces.extend([[a, a + 6, (a + 1) % 6 + 6], [a, (a + 1) % 6 + 6, (a + 1) % 6]]));
        let mesh = mesh(TriangleSoup { vertices, faces });
        // Along one side, away from it or into it by little, and into the other one.
        let little = noise.between(-1.0, 1.0) * 1e-6;
        let way = if case % 2 == 0 { [-0.1, little] } else { [little, -0.1] };
        let from = turn * (Vector3::new(1.0, 1.0, noise.between(-0.5, 0.5)) + noise.vector(2e-14));
        let to = from + turn * Vector3::new(way[0], way[1], noise.between(-0.1, 0.1));
        assert!(mesh.first_hit(&from, &to).is_some(), "{case}: {from:?} {to:?}");
    }
}

#[test]
fn a_segment_that_ends_on_a_face_up_to_rounding_has_met_it() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(21);
        for _ in 0..1000 {
            let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
            let [a, b, c] = oracle::corners(&mesh, face);
            let out = mesh.faces()[face].normal_B * mesh.extent_m();
            // The middle of a face lies in its plane up to a rounding, a thousandth of the tolerance.
            let on_it = (a + b + c) / 3.0;
            let met = |height: f64| mesh.first_hit(&(on_it + out * 0.01), &(on_it + out * height));
            assert!(met(0.5e-13).is_some() && met(-0.5e-13).is_some(), "{name}: {face}");
            if matches!(name, "cube" | "plate" | "sphere") {
                assert!(met(3e-13).is_none(), "{name}: {face}");
            }
        }
    }
}

#[test]
fn a_chain_of_steps_hits_where_the_long_segment_does() {
    let meshes = [
        ("cube", mesh(make::cuboid([0.05, 0.05, 0.05]))),
        ("sphere", mesh(make::uv_sphere(100, 50, 0.1))),
        ("bumpy sphere", mesh(make::bumpy_sphere(316, 158, 0.1))),
    ];
    for (name, mesh) in meshes {
        let mut noise = Noise(9);
        for _ in 0..5000 {
            let at = target(&mesh, &mut noise);
            let (from, to) = (at * noise.between(1.0, 1.1), at * noise.between(0.9, 1.0));
            let Some(expected) = mesh.first_hit(&from, &to) else {
                assert!((to - at).norm().min((from - at).norm()) < 1e-13 * mesh.extent_m());
                continue;
            };
            let steps = 1 + (noise.uniform() * 100.0) as u32;
            let place =
                |i: u32| if i == steps { to } else { from + (to - from) * (f64::from(i) / f64::from(steps)) };
            let found = (0..steps).find_map(|i| mesh.first_hit(&place(i), &place(i + 1)));
            let found = found.unwrap_or_else(|| panic!("{name}: {from:?} {to:?} {steps}"));
            // Each step's ends are rounded, and the faces lie at 30 degrees to the path or more.
            assert!(
                (found.point_B - expected.point_B).norm() <= 1e-14 * mesh.extent_m(),
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn a_random_walk_into_a_mesh_is_noticed() {
    let mesh = mesh(make::bumpy_sphere(316, 158, 0.1));
    let mut noise = Noise(10);
    let mut entries = 0;
    for _ in 0..300 {
        let at = target(&mesh, &mut noise);
        let mut p = at * 1.0002;
        let mut is_free = true;
        for _ in 0..300 {
            let next = p + noise.vector(2e-5) - at.normalize() * 3e-6;
            if mesh.first_hit(&p, &next).is_some() {
                (is_free, entries) = (false, entries + 1);
                break;
            }
            p = next;
        }
        // The hills are flat enough for the nearest face to tell the side of a point this near.
        assert!(!is_free || !mesh.is_inside_unbounded(&p), "{p:?}");
    }
    assert!(entries > 250, "{entries}");
}

#[test]
fn the_nearest_feature_is_told() {
    let mesh = mesh(make::cuboid([0.2, 0.2, 0.2]));
    let cases = [
        (Vector3::new(0.03, 0.02, 0.2), Feature::Face, Vector3::new(0.03, 0.02, 0.1), 0.1),
        (Vector3::new(0.13, 0.02, 0.14), Feature::Edge, Vector3::new(0.1, 0.02, 0.1), 0.05),
        (Vector3::new(0.12, -0.14, 0.14), Feature::Vertex, Vector3::new(0.1, -0.1, 0.1), 0.06),
        (Vector3::new(0.03, 0.02, 0.07), Feature::Face, Vector3::new(0.03, 0.02, 0.1), 0.03),
        (Vector3::new(-0.1, 0.1, 0.1), Feature::Vertex, Vector3::new(-0.1, 0.1, 0.1), 0.0),
    ];
    for (p, feature, point, distance) in cases {
        let nearest = mesh.nearest_unbounded(&p);
        assert_eq!(nearest.feature, feature);
        // A handful of roundings of numbers of size 0.1.
        assert!((nearest.point_B - point).norm() < 1e-16 && (nearest.distance_m - distance).abs() < 1e-16);
        let corners = oracle::corners(&mesh, nearest.face as usize);
        let (a, b) = (corners[nearest.corner], corners[(nearest.corner + 1) % 3]);
        match feature {
            Feature::Vertex => assert_eq!(nearest.point_B, a),
            Feature::Edge => assert!((b - a).cross(&(nearest.point_B - a)).norm() < 1e-17),
            _ => assert_eq!(nearest.corner, 0),
        }
    }
}

#[test]
fn of_equally_near_faces_the_first_is_told() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(11);
        for _ in 0..500 {
            let face = (noise.uniform() * mesh.faces().len() as f64) as usize;
            let vertex = mesh.faces()[face].vertices[0];
            let p = mesh.vertices()[vertex as usize];
            let first = mesh.faces().iter().position(|face| face.vertices.contains(&vertex)).unwrap();
            let nearest = mesh.nearest_unbounded(&p);
            assert_eq!((nearest.feature, nearest.distance_m), (Feature::Vertex, 0.0), "{name}");
            // Where the mesh passes through itself, or slivers lie within rounding, another face may be as near.
            assert!(nearest.face as usize <= first, "{name}: {nearest:?} {first}");
        }
    }
}

#[test]
fn of_the_two_faces_of_an_edge_the_first_is_told() {
    let mesh = mesh(make::uv_sphere(100, 50, 0.1));
    let mut noise = Noise(16);
    for (index, face) in mesh.faces().iter().enumerate() {
        for (edge, link) in face.links.iter().enumerate() {
            let across = &mesh.faces()[link.face() as usize];
            // Quads are flat: above their diagonals both faces are near, by rounding one is nearer.
            if face.normal_B.dot(&across.normal_B) > 1.0 - 1e-6 {
                continue;
            }
            let corners = oracle::corners(&mesh, index);
            let along = corners[(edge + 1) % 3] - corners[edge];
            let on_edge = corners[edge] + along * noise.between(0.01, 0.99);
            let p = on_edge + (face.normal_B + across.normal_B) * noise.between(1e-4, 0.1);
            let nearest = mesh.nearest_unbounded(&p);
            assert_eq!(
                (nearest.feature, nearest.face),
                (Feature::Edge, link.face().min(index as u32)),
                "{p:?}"
            );
        }
    }
}

#[test]
fn sheets_are_met_from_both_sides_and_solids_from_outside() {
    let sheet = mesh(tiny_triangle());
    let (above, below) = (Vector3::repeat(0.02), Vector3::repeat(-0.02));
    assert!(sheet.first_hit(&above, &below).unwrap().is_front);
    assert!(!sheet.first_hit(&below, &above).unwrap().is_front);
    let cube = mesh(make::cuboid([0.01, 0.01, 0.01]));
    assert!(cube.first_hit(&Vector3::zeros(), &above).is_none());
    let through = cube.first_hit(&above, &below).unwrap();
    assert!(through.is_front && through.point_B.x > 0.0);
}

#[test]
fn a_segment_in_the_plane_of_a_face_is_no_entry_into_it() {
    let cube = mesh(make::cuboid([0.25, 0.25, 0.25]));
    let at = |x, z| Vector3::new(x, 0.125, z);
    for (from, to) in
        [(at(-0.05, 0.0), at(0.07, 0.03)), (at(-0.12, -0.12), at(0.125, 0.125)), (at(0.2, 0.0), at(0.3, 0.0))]
    {
        assert!(cube.first_hit(&from, &to).is_none(), "{from:?} {to:?}");
    }
    // From beside it in its plane, it is the side that is met.
    let hit = cube.first_hit(&at(0.2, 0.0), &at(0.0, 0.0)).unwrap();
    assert_eq!((hit.point_B, cube.faces()[hit.face as usize].normal_B), (at(0.125, 0.0), Vector3::x()));
}

#[test]
fn any_numbers_are_survived() {
    let odd =
        [0.0, -0.0, 1e-320, 1e-160, 0.05, 1.0, 1e3, 1e18, 1e20, 1e160, f64::MAX, f64::INFINITY, f64::NAN];
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(12);
        let mut any =
            || odd[(noise.uniform() * odd.len() as f64) as usize] * (noise.uniform() - 0.5).signum();
        for _ in 0..5000 {
            let (from, to) = (Vector3::new(any(), any(), any()), Vector3::new(any(), any(), any()));
            let is_finite = from.iter().chain(&to).all(|number| number.is_finite());
            let hit = mesh.first_hit(&from, &to);
            assert!(hit.is_none_or(|hit| is_finite && (0.0..=1.0).contains(&hit.fraction)), "{name}");
            assert!(mesh.first_hit(&from, &from).is_none(), "{name}: no length");
            let nearest = mesh.nearest_unbounded(&from);
            assert!(
                nearest.point_B.amax() <= mesh.extent_m() && nearest.distance_m >= 0.0,
                "{name}: {nearest:?}"
            );
            let bounded = mesh.nearest(&from);
            assert!(bounded.point_B.amax() <= mesh.extent_m() && bounded.distance_m >= nearest.distance_m);
            assert!((0.0..=1e30).contains(&mesh.clearance(&from, 1e30)), "{name}");
            assert!(!(mesh.is_inside(&from) && from.amax() > mesh.extent_m()), "{name}");
            assert!(!(mesh.is_inside_unbounded(&from) && from.amax() > mesh.extent_m()), "{name}");
        }
    }
}

#[test]
fn a_segment_of_a_kilometre_hits_as_a_short_one_does() {
    for (name, mesh) in small_meshes() {
        let mut noise = Noise(13);
        for _ in 0..1000 {
            let at = target(&mesh, &mut noise);
            let direction = noise.vector(1.0).normalize();
            let long = mesh.first_hit(&(at + direction * 1e3), &(at - direction * 1e3));
            let short = mesh.first_hit(&(at + direction * 10.0), &(at - direction * 10.0));
            // Starts a kilometre away are rounded to 1e-13 m; under small angles to a face, or past a rim, that
            // may be anywhere. Nearly all of the hits are neither.
            let (Some(long), Some(short)) = (long, short) else { continue };
            let normal = mesh.faces()[short.face as usize].normal_B;
            if long.face == short.face && normal.dot(&direction) > 0.1 {
                assert!((long.point_B - short.point_B).norm() < 1e-11, "{name}: {long:?} {short:?}");
            }
        }
    }
}

#[test]
fn the_clearance_is_worth_asking_for() {
    let mesh = mesh(make::bumpy_sphere(316, 158, 0.1));
    let mut noise = Noise(14);
    let mut fractions: Vec<_> = (0..2000)
        .map(|_| {
            let p = noise.vector(1.0).normalize() * 0.125;
            mesh.clearance(&p, 1.0) / mesh.nearest_unbounded(&p).distance_m
        })
        .collect();
    fractions.sort_by(f64::total_cmp);
    // Of the distance, which is 2 to 3 cm here; found by trying.
    assert!(fractions[0] > 0.25 && fractions[1000] > 0.6, "{} {}", fractions[0], fractions[1000]);
}

#[test]
fn trees_of_any_width_answer_alike() {
    let mesh = mesh(make::bumpy_sphere(100, 50, 0.1));
    let triangles = Triangles { faces: mesh.faces(), vertices: mesh.vertices() };
    let (two, eight) =
        (Bvh::<2>::build(mesh.faces(), mesh.vertices()), Bvh::<8>::build(mesh.faces(), mesh.vertices()));
    let mut noise = Noise(15);
    for _ in 0..5000 {
        let p = target(&mesh, &mut noise) + noise.vector(1.0) * reach(&mesh, &mut noise);
        let q = target(&mesh, &mut noise);
        assert_eq!(two.nearest_unbounded(triangles, &p), mesh.nearest_unbounded(&p));
        assert_eq!(eight.nearest_unbounded(triangles, &p), mesh.nearest_unbounded(&p));
        assert_eq!(two.first_hit(triangles, Sides::Solid, &p, &q), mesh.first_hit(&p, &q));
        assert_eq!(eight.first_hit(triangles, Sides::Solid, &p, &q), mesh.first_hit(&p, &q));
    }
}
