//! Prints the encoder trace of a Premium 1.5 whose tip leaves home and draws three circles:
//! `cargo run -p io-driver --example circle_trace > config/driver/traces/circle.csv`

use io_driver::device_file::{DeviceFile, builtin};
use io_driver::encoders::wrapped;
use io_driver::kinematics::Mechanism;
use nalgebra::Vector3;
use std::path::Path;

const SECONDS: f64 = 6.0;
const STEP_S: f64 = 0.002;
const RADIUS_M: f64 = 0.03;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let text = builtin("premium-1.5").ok_or("no such description")?;
    let DeviceFile::Arm(premium) = DeviceFile::parse(text, Path::new("premium-1.5"))? else {
        return Err("not a Premium".into());
    };
    let map = premium.joint_map();
    let mut trace = String::from("t,c0,c1,c2\n");
    for row in 0..=(SECONDS / STEP_S) as u32 {
        let t = f64::from(row) * STEP_S;
        let joints = premium.mechanism.inverse(tip(t))?;
        let [c0, c1, c2] =
            map.angles_to_counts(joints).map(|count| wrapped(count, premium.encoders.count_bits));
        trace += &format!("{},{c0},{c1},{c2}\n", f64::from(row * 2) / 1000.0);
    }
    print!("{trace}");
    Ok(())
}

/// Begins and ends at home, at rest: the angle runs through a smooth step.
fn tip(t: f64) -> Vector3<f64> {
    let s = t / SECONDS;
    let angle = 3.0 * std::f64::consts::TAU * s * s * (3.0 - 2.0 * s);
    Vector3::new(RADIUS_M * angle.sin(), RADIUS_M * (1.0 - angle.cos()), 0.0)
}
