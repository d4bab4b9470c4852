//! Drags a finger over a table and prints what it feels: `cargo run -p haptics --example slide`.
#![allow(non_snake_case)]

use haptics::{Entity, Finger, Friction, ParameterError, Plane};
use nalgebra::{Isometry3, Vector3};

fn main() -> Result<(), ParameterError> {
    // The experiment of Melder ch. 8.1: 500 N/m, 5 mm deep, mu_s = 0.7, mu_d = 0.3.
    let table = Entity::new(Plane::new(Vector3::y(), 0.0)?, Isometry3::identity(), 500.0)?
        .with_friction(Friction::stiction(0.7, 0.3)?)?;
    let entities = [table];
    let mut finger = Finger::new(0.0, entities.len())?;

    println!("{:>6} {:>8} {:>8} {:>8} {:>8}  state", "t [ms]", "hip x", "god x", "F_x [N]", "F_y [N]");
    for tick in 0..100 {
        // Down 5 mm in 20 ms, then sideways at 0.1 m/s.
        let press = f64::from(tick.min(20)) / 20.0;
        let slide = 1e-4 * f64::from((tick - 20).max(0));
        let hip_W = Vector3::new(slide, 1e-4 - press * 5.1e-3, 0.0);
        let out = finger.step(&entities, &hip_W, 1e-3);
        if tick % 5 == 0 {
            let (god, force) = (out.god_object_W, out.force_on_user_W);
            println!(
                "{tick:>6} {:>8.5} {:>8.5} {:>8.4} {:>8.4}  {:?}",
                hip_W.x, god.x, force.x, force.y, out.friction
            );
        }
    }
    Ok(())
}
