//! Small balls on fine meshes of smooth surfaces.
#![allow(non_snake_case)]

use crate::common::meshes::*;
use crate::common::*;
use haptics::Friction;
use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;

const ROUND_M: f64 = 0.08;

/// The cap of a ball of triangles of this size, open below.
fn dome(cell_m: f64) -> TriangleSoup {
    sheet((0.04 / cell_m) as u32, 0.04, |x, z| (ROUND_M * ROUND_M - x * x - z * z).sqrt())
}

/// Without friction the centre is where it is nearest to the HIP: straight above it, but for what faces are flat.
#[test]
fn over_a_dome_a_ball_of_any_size_stays_above_the_hip() {
    for (cell_m, radius_m) in [(5e-4, 1e-5), (5e-4, 1e-4), (1.25e-3, 1e-5), (5e-4, 1e-3)] {
        let entity = touchable(&built(dome(cell_m)), Friction::None);
        let mut noise = Noise(5);
        let mut finger = finger(radius_m);
        let mut aim = Vector3::y();
        let mut place = aim;
        let depth_m = 1e-3;
        let (mut wrong, mut ticks) = (0, 0);
        for tick in 0..20_000 {
            if (aim - place).norm() < 1e-3 {
                aim = Vector3::new(noise.between(-0.2, 0.2), 1.0, noise.between(-0.2, 0.2)).normalize();
            }
            // At 0.1 m/s.
            place = (place + (aim - place).normalize() * (1e-4 / ROUND_M)).normalize();
            let height_m = if tick < 10 { 5e-3 } else { -depth_m };
            let out = step(&mut finger, &entity, &(place * (ROUND_M + height_m)));
            if tick >= 10 {
                let aside_m = (out.god_object_W - place * place.dot(&out.god_object_W)).norm();
                ticks += 1;
                // Over a face it stays above its middle: a face is as steep as half of its size over the radius, times the depth.
                wrong += u32::from(aside_m > 2.0 * cell_m * (1.0 + (depth_m + radius_m) / ROUND_M));
            }
        }
        assert_eq!(wrong, 0, "of {ticks}: cells of {cell_m} m, radius {radius_m} m");
    }
}
