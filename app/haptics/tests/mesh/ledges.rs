//! Slabs of one part whose top has ledges that no finger feels, straight, aslant and leaning over: a point slides over them.

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// The highest ledge that is none, of meshes that are not small: `ledge.rs`.
const HIGHEST_M: f64 = 1e-5;
/// A step over a ledge is twice as long, and before it the god-object waits.
const LAG_M: f64 = 2.0 * HIGHEST_M;
/// Way that the god-object may be behind, of the depth: at a slope of 20 degrees, as repairs make of some walls.
const GENTLE: f64 = 0.364;
/// Half an edge of the slab.
const HALF_M: f64 = 0.05;

/// A slab, its top at y = 0 at both ends of z and with ledges across x between them.
struct Slab {
    mesh: Arc<Mesh>,
    /// Slab's frame to the mesh's.
    X_BS: Isometry3<f64>,
    /// Lowest and highest place of the top.
    tops_m: [f64; 2],
    told: String,
}

impl Slab {
    fn new(noise: &mut Noise) -> Self {
        let turn = if noise.uniform() < 0.3 { Vector3::zeros() } else { noise.vector(2.0) };
        let X_BS = Isometry3::from_parts(Translation3::from(noise.vector(0.1)), UnitQuaternion::new(turn));
        let (ledges, rows) = (1 + (noise.uniform() * 4.0) as usize, 2 + (noise.uniform() * 5.0) as usize);
        let mut soup = TriangleSoup::default();
        let mut vertex = |x: f64, y: f64, z: f64| {
            soup.vertices.push((X_BS * Point3::new(x, y, z)).coords);
            soup.vertices.len() as u32 - 1
        };
        let z = |row: usize| HALF_M * (2.0 * row as f64 / rows as f64 - 1.0);
        let mut heights_m = vec![0.0; rows + 1];
        let mut tops_m = [0.0_f64; 2];
        let mut told = String::new();
        // Columns of vertices from the left to the right: the end, foot and top of each ledge, the other end.
        let mut columns: Vec<Vec<u32>> = vec![(0..=rows).map(|row| vertex(-HALF_M, 0.0, z(row))).collect()];
        for ledge in 1..=ledges {
            let x_m = HALF_M * (2.0 * ledge as f64 / (ledges + 1) as f64 - 1.0);
            let lean = if noise.uniform() < 0.3 { 0.0 } else { noise.between(-1.0, 1.0) };
            let sign = (1.0 - 2.0 * noise.uniform()).signum();
            // As low as a step along the wall.
            let height_m = sign * HIGHEST_M * 1e-4_f64.powf(noise.uniform()) / 1.0_f64.hypot(lean);
            told += &format!(" {height_m:.1e} leans {lean:.2}");
            let shifts: Vec<f64> = (0..=rows).map(|_| noise.between(-2e-3, 2e-3)).collect();
            let foot = (0..=rows).map(|row| vertex(x_m + shifts[row], heights_m[row], z(row))).collect();
            columns.push(foot);
            let top = |row: usize| {
                if row == 0 || row == rows {
                    return columns[columns.len() - 1][row];
                }
                heights_m[row] += height_m;
                vertex(x_m + shifts[row] - lean * height_m.abs(), heights_m[row], z(row))
            };
            columns.push((0..=rows).map(top).collect());
            tops_m = [tops_m[0].min(heights_m[1]), tops_m[1].max(heights_m[1])];
        }
        columns.push((0..=rows).map(|row| vertex(HALF_M, heights_m[row], z(row))).collect());
        let [left, right] = [-HALF_M, HALF_M].map(|x| [0, rows].map(|row| vertex(x, -0.02, z(row))));
        let mut triangle = |a: u32, b: u32, c: u32| {
            if a != b && b != c && c != a {
                soup.faces.push([a, b, c]);
            }
        };
        for pair in columns.windows(2) {
            for row in 0..rows {
                let [a, b, c, d] = [pair[0][row], pair[0][row + 1], pair[1][row + 1], pair[1][row]];
                let (first, second) =
                    if noise.uniform() < 0.5 { ([a, b, c], [a, c, d]) } else { ([a, b, d], [b, c, d]) };
                triangle(first[0], first[1], first[2]);
                triangle(second[0], second[1], second[2]);
            }
        }
        // Bottom, both ends in x as fans, and the sides, which see each column once.
        let [a, b, c, d] = [left[0], left[1], right[1], right[0]];
        triangle(a, c, b);
        triangle(a, d, c);
        for (of, low, is_right) in [(&columns[0], left, false), (&columns[columns.len() - 1], right, true)] {
            let mut facing =
                |a: u32, b: u32, c: u32| if is_right { triangle(a, c, b) } else { triangle(a, b, c) };
            of.windows(2).for_each(|pair| facing(low[0], pair[1], pair[0]));
            facing(low[0], low[1], of[rows]);
        }
        for (row, is_far) in [(0, false), (rows, true)] {
            let (low, high) = (left[usize::from(is_far)], right[usize::from(is_far)]);
            let mut facing =
                |a: u32, b: u32, c: u32| if is_far { triangle(a, c, b) } else { triangle(a, b, c) };
            columns.windows(2).for_each(|pair| facing(low, pair[0][row], pair[1][row]));
            facing(low, columns[columns.len() - 1][row], high);
        }
        let (mesh, report) = Mesh::build(soup).unwrap();
        assert!(report.boundary_edges.count == 0, "{report}");
        Self { mesh: Arc::new(mesh), X_BS, tops_m, told }
    }

    /// Slides to and fro below the top; the first place at which it is held as nobody should be.
    fn follow(&self, friction: Friction, noise: &mut Noise) -> Result<u32, String> {
        let is_smooth = matches!(friction, Friction::None);
        let entity = touchable(&self.mesh, friction);
        let mut finger = point_finger();
        let mut touched = 0;
        let slack_m = self.tops_m[1] - self.tops_m[0] + 2.0 * LAG_M;
        let any = |noise: &mut Noise| [0.0; 2].map(|_| noise.between(-0.9 * HALF_M, 0.9 * HALF_M));
        let mut look = |p: Vector3<f64>| {
            let out = step(&mut finger, &entity, &(self.X_BS * Point3::from(p)).coords);
            let force = self.X_BS.inverse_transform_vector(&out.force_on_user_W);
            let expected = Vector3::y() * (K * (-p.y).max(0.0));
            let slack_m = slack_m + GENTLE * (-p.y).max(0.0);
            let is_right = if is_smooth {
                (force - expected).norm() <= K * slack_m
            } else {
                (force.y - expected.y).abs() <= 0.02 * expected.y + K * slack_m
                    && force.xz().norm() <= 0.5 * expected.y + K * slack_m
            };
            if is_right {
                Ok(())
            } else {
                Err(format!("{p:?}: {force:?}, expected {expected:?}, {:?}", out.feature))
            }
        };
        for _ in 0..8 {
            let [mut x, mut z] = any(noise);
            let depth_m = noise.between(1e-4, 3e-3);
            look(Vector3::new(x, 1e-3, z))?;
            for _ in 0..4 {
                let [to_x, to_z] = any(noise);
                let ticks = [3, 30, 300][(noise.uniform() * 3.0) as usize];
                let by = [to_x - x, to_z - z].map(|way| way / f64::from(ticks));
                for _ in 0..ticks {
                    (x, z) = (x + by[0], z + by[1]);
                    look(Vector3::new(x, -depth_m * noise.between(0.9, 1.1), z))?;
                    touched += 1;
                }
            }
            look(Vector3::new(x, 1e-3, z))?;
        }
        Ok(touched)
    }
}

#[test]
fn a_point_slides_over_ledges_that_no_finger_feels() {
    let (mut touched, mut wrong) = (0, Vec::new());
    for seed in 0..200 {
        let mut noise = Noise(seed);
        let slab = Slab::new(&mut noise);
        for friction in [Friction::None, Friction::coulomb(0.5).unwrap()] {
            let name = format!("{friction:?}");
            match slab.follow(friction, &mut noise) {
                Ok(ticks) => touched += ticks,
                Err(what) => wrong.push(format!("{seed}, {name}, {}: {what}", slab.told)),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of 400: {:#?}", wrong.len(), &wrong[..wrong.len().min(12)]);
    assert!(touched > 100_000, "{touched}");
}
