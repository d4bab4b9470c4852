//! Boxes of one file side by side, their tops flush, with cracks between them that no finger feels, or overlapping by as much:
//! a point slides over them as over one surface.

use crate::common::meshes::*;
use crate::common::*;
use haptics::mesh::{Mesh, MeshReport, TriangleSoup, make};
use haptics::{Finger, Friction};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::sync::Arc;

/// The widest crack that is none, of meshes that are not small: `beside.rs`.
const WIDEST_M: f64 = 1e-5;
/// A step over a crack is twice as long, and above it the god-object waits at the edge.
const LAG_M: f64 = 2.0 * WIDEST_M;

/// Four boxes of about 5 cm, the second row shifted against the first; their tops are at y = 0, or lower by at most a ledge.
struct Tiles {
    mesh: Arc<Mesh>,
    report: MeshReport,
    /// Tiles' frame to the mesh's.
    X_BT: Isometry3<f64>,
    /// Places of the cracks: of each row in x, and between the rows in z.
    x_m: [f64; 2],
    z_m: f64,
    /// Widths of the cracks, and how much lower than y = 0 the tops are.
    told: String,
}

/// Wider or narrower than nothing, of any size.
fn any_crack(noise: &mut Noise) -> f64 {
    if noise.uniform() < 0.1 {
        return 0.0;
    }
    let is_overlap = noise.uniform() < 0.4;
    let largest_m = if is_overlap { 1e-3 } else { WIDEST_M };
    let width_m = largest_m * 1e-10_f64.powf(noise.uniform());
    if is_overlap { -width_m } else { width_m }
}

impl Tiles {
    fn new(noise: &mut Noise) -> Self {
        let offset_m = if noise.uniform() < 0.5 { 0.0 } else { 10.0 * noise.uniform().powi(3) };
        let turn = if noise.uniform() < 0.3 { Vector3::zeros() } else { noise.vector(2.0) };
        let X_BT = Isometry3::from_parts(
            Translation3::from(unit_vector(noise) * offset_m),
            UnitQuaternion::new(turn),
        );
        let is_level = noise.uniform() < 0.5;
        let mut soup = TriangleSoup::default();
        let [z_m, x0_m, x1_m] = [0.0; 3].map(|_| noise.between(-0.01, 0.01));
        let z_crack_m = any_crack(noise);
        let mut told = format!("{z_crack_m:.1e} between rows,");
        for (row, x_m) in [x0_m, x1_m].into_iter().enumerate() {
            let crack_m = any_crack(noise);
            told += &format!(" {crack_m:.1e} in a row:");
            let z = if row == 0 { [-0.06, z_m - 0.5 * z_crack_m] } else { [z_m + 0.5 * z_crack_m, 0.06] };
            for x in [[-0.06, x_m - 0.5 * crack_m], [x_m + 0.5 * crack_m, 0.06]] {
                let ledge_m = if is_level { 0.0 } else { noise.between(0.0, WIDEST_M) };
                told += &format!(" {ledge_m:.1e}");
                let size = [x[1] - x[0], 0.02, z[1] - z[0]];
                let middle = Vector3::new(0.5 * (x[0] + x[1]), -0.01 - ledge_m, 0.5 * (z[0] + z[1]));
                let tile = make::cuboid(size);
                let first = soup.vertices.len() as u32;
                soup.vertices.extend(tile.vertices.iter().map(|v| (X_BT * Point3::from(v + middle)).coords));
                soup.faces.extend(tile.faces.iter().map(|face| face.map(|v| v + first)));
            }
        }
        let (mesh, report) = Mesh::build(soup).unwrap();
        Self { mesh: Arc::new(mesh), report, X_BT, x_m: [x0_m, x1_m], z_m, told }
    }

    fn in_mesh(&self, p: &Vector3<f64>) -> Vector3<f64> {
        (self.X_BT * Point3::from(*p)).coords
    }

    /// Above a crack now and then, else anywhere within the rim.
    fn any_foot(&self, noise: &mut Noise) -> [f64; 2] {
        let [x, z] = [0.0; 2].map(|_| noise.between(-0.05, 0.05));
        let [near_x, near_z] = [0.0; 2].map(|_| noise.gaussian() * 1e-6);
        match (noise.uniform() * 4.0) as u32 {
            0 => [self.x_m[usize::from(z > self.z_m)] + near_x, z],
            1 => [x, self.z_m + near_z],
            _ => [x, z],
        }
    }

    /// Follows a finger that comes down somewhere, slides about and leaves, again and again.
    fn follow(&self, friction: Friction, noise: &mut Noise) -> Result<u32, String> {
        let is_smooth = matches!(friction, Friction::None);
        let entity = touchable(&self.mesh, friction);
        let mut finger = point_finger();
        let mut touched = 0;
        for _ in 0..12 {
            let [mut x, mut z] = self.any_foot(noise);
            let depth_m = noise.between(1e-4, 3e-3);
            self.look(&mut finger, &entity, &Vector3::new(x, 1e-3, z), is_smooth)?;
            for _ in 0..4 {
                let [to_x, to_z] = self.any_foot(noise);
                let ticks = [3, 30, 300][(noise.uniform() * 3.0) as usize];
                let by = [to_x - x, to_z - z].map(|way| way / f64::from(ticks));
                for _ in 0..ticks {
                    (x, z) = (x + by[0], z + by[1]);
                    let y = -depth_m * noise.between(0.9, 1.1);
                    self.look(&mut finger, &entity, &Vector3::new(x, y, z), is_smooth)?;
                    touched += 1;
                }
            }
            self.look(&mut finger, &entity, &Vector3::new(x, 1e-3, z), is_smooth)?;
        }
        Ok(touched)
    }

    /// One tick: held to within the lag where the finger is below the tops, and free above them.
    fn look(
        &self,
        finger: &mut Finger,
        entity: &haptics::Entity,
        p: &Vector3<f64>,
        is_smooth: bool,
    ) -> Result<(), String> {
        let out = step(finger, entity, &self.in_mesh(p));
        let force = self.X_BT.inverse_transform_vector(&out.force_on_user_W);
        let expected = Vector3::y() * (K * (-p.y).max(0.0));
        let slack_n = K * 2.0 * LAG_M;
        let is_right = if is_smooth {
            (force - expected).norm() <= slack_n
        } else {
            // Friction pulls along, by half the normal force at most.
            (force.y - expected.y).abs() <= 0.02 * expected.y + slack_n
                && force.xz().norm() <= 0.5 * expected.y + slack_n
        };
        if is_right && out.entity.is_some() == (p.y < 0.0) {
            return Ok(());
        }
        Err(format!("{p:?}: {force:?}, expected {expected:?}, {:?}", out.feature))
    }
}

#[test]
fn a_point_slides_over_hairline_cracks_as_over_one_surface() {
    let (mut touched, mut wrong) = (0, Vec::new());
    for seed in 0..200 {
        let mut noise = Noise(seed);
        let tiles = Tiles::new(&mut noise);
        assert!(tiles.report.narrow_gaps.faces > 0, "{}", tiles.report);
        for friction in [Friction::None, Friction::coulomb(0.5).unwrap()] {
            let name = format!("{friction:?}");
            match tiles.follow(friction, &mut noise) {
                Ok(ticks) => touched += ticks,
                Err(told) => wrong.push(format!(
                    "{seed}, {name}, {}, at {:?} and {:e}: {told}",
                    tiles.told, tiles.x_m, tiles.z_m
                )),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of 400\n{}", wrong.len(), wrong[..wrong.len().min(16)].join("\n"));
    assert!(touched > 500_000, "{touched}");
}

#[test]
fn a_finger_that_begins_inside_beside_a_crack_is_led_to_the_top() {
    for seed in 0..2000 {
        let mut noise = Noise(seed);
        let tiles = Tiles::new(&mut noise);
        let entity = touchable(&tiles.mesh, Friction::None);
        let [x, z] = tiles.any_foot(&mut noise);
        let p = Vector3::new(x + 2e-5, -noise.between(5e-4, 5e-3), z + 2e-5);
        let out = step(&mut point_finger(), &entity, &tiles.in_mesh(&p));
        let off = tiles.X_BT.inverse_transform_point(&Point3::from(out.god_object_W)).coords
            - Vector3::new(p.x, 0.0, p.z);
        assert!(off.norm() <= 2.0 * LAG_M, "{seed}, {}: {p:?} {off:?} {out:?}", tiles.told);
    }
}

#[test]
fn parts_that_pass_through_each_other_do_not_lie_beside_each_other() {
    let mut soup = make::cuboid([0.1, 0.02, 0.1]);
    let other = make::cuboid([0.1, 0.02, 0.1]);
    soup.vertices.extend(other.vertices.iter().map(|v| v + Vector3::new(0.05, 0.005, 0.03)));
    soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 8)));
    let (_, report) = Mesh::build(soup).unwrap();
    assert!(report.crossed > 0 && report.narrow_gaps.faces == 0, "{report}");
}

#[test]
fn a_gap_that_can_be_felt_is_one_and_parts_far_from_each_other_have_none() {
    for (gap_m, has_gap) in [(1e-5, false), (1e-4, true), (1e-2, true)] {
        let mut soup = make::cuboid([0.1, 0.02, 0.1]);
        let other = make::cuboid([0.1, 0.02, 0.1]);
        soup.vertices.extend(other.vertices.iter().map(|v| v + Vector3::x() * (0.1 + gap_m)));
        soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 8)));
        let (mesh, report) = Mesh::build(soup).unwrap();
        assert_eq!(report.narrow_gaps.faces == 0, has_gap, "{report}");
        assert_eq!(report.to_string().contains("beside another part"), !has_gap, "{report}");
        let entity = touchable(&Arc::new(mesh), Friction::None);
        // Right into it.
        let mut finger = point_finger();
        for y in [0.02, 0.009, 0.005] {
            let out = step(&mut finger, &entity, &Vector3::new(0.05 + 0.5 * gap_m, y, 0.013));
            let is_free = y > 0.01 || has_gap;
            assert_eq!(out.entity.is_none(), is_free, "{gap_m}, {y}: {out:?}");
        }
    }
}
