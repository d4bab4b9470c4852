//! Points, normals and nearest points of a patch with uneven knots and weights against those of another library.
//!
//! `nurbs_oracle/curvo.csv` was written by `curvo` 0.3.3 for the patch below: as a dev-dependency it would bring more
//! than a hundred crates into every build.

use haptics::{Nurbs, NurbsPatch, Surface};
use nalgebra::Vector3;

const KNOTS_U: [f64; 12] = [0.0, 0.0, 0.0, 0.0, 0.7, 1.1, 2.0, 2.6, 3.0, 3.0, 3.0, 3.0];
/// One of them twice, as often as degree 2 allows: there the patch is cut.
const KNOTS_V: [f64; 10] = [0.0, 0.0, 0.0, 1.0, 1.5, 1.5, 3.0, 4.0, 4.0, 4.0];

fn hill() -> Nurbs {
    let point = |(i, j): (i32, i32)| {
        let y = 0.012 * f64::from((i * i + 3 * j) % 7) / 7.0;
        [f64::from(i) * 0.01, y, f64::from(j) * 0.012, 1.0 + 0.25 * f64::from((2 * i + j) % 4)]
    };
    let points = (0..7).flat_map(|j| (0..8).map(move |i| (i, j))).map(point).collect();
    let patch = NurbsPatch { degree: [3, 2], knots: [KNOTS_U.to_vec(), KNOTS_V.to_vec()], points };
    Nurbs::build(&[patch]).unwrap().0
}

fn rows(kind: &str) -> Vec<Vec<f64>> {
    let text = include_str!("../nurbs_oracle/curvo.csv");
    let of_kind = text.lines().filter_map(|line| line.strip_prefix(kind)?.strip_prefix(','));
    of_kind.map(|line| line.split(',').map(|word| word.parse().unwrap()).collect()).collect()
}

#[test]
fn points_and_normals_are_another_librarys() {
    let nurbs = hill();
    assert_eq!(nurbs.parts(), 2);
    let rows = rows("at");
    assert_eq!(rows.len(), 100);
    for row in rows {
        let (u, v) = (row[0] / 3.0, row[1]);
        let (part, v) = if v < 1.5 { (0, v / 1.5) } else { (1, (v - 1.5) / 2.5) };
        let (point, normal) = nurbs.at(part, u, v);
        let (p, n) = (Vector3::new(row[2], row[3], row[4]), Vector3::new(row[5], row[6], row[7]));
        // Some roundings of coordinates below 0.1 on either side.
        assert!((point - p).norm() < 1e-15 * 100.0, "{row:?} {point:?}");
        // Which side is the front is each library's own business.
        let off = (normal - n).norm().min((normal + n).norm());
        assert!(off < 1e-12, "{row:?} {normal:?}");
    }
}

#[test]
fn no_nearest_point_of_another_library_is_nearer() {
    let nurbs = hill();
    let surface = nurbs.surface(0.0);
    let rows = rows("near");
    assert!(rows.len() > 80);
    let mut same = 0;
    for row in &rows {
        let (p, theirs) = (Vector3::new(row[0], row[1], row[2]), Vector3::new(row[3], row[4], row[5]));
        let ours = surface.nearest(&p).point_B;
        let (a, b) = ((ours - p).norm(), (theirs - p).norm());
        assert!(a <= b + 1e-12, "{row:?}: {a} {b}");
        // Its Newton stops at about 1e-6.
        same += u32::from((a - b).abs() < 1e-6);
    }
    assert!(same > 60, "{same} of {}", rows.len());
}
