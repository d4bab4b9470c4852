#![allow(non_snake_case)]
mod common;
mod mesh_oracle;
use common::meshes::*;
use common::*;
use haptics::Friction;
use nalgebra::Vector3;
#[test]
fn acc() {
    let mut soup = wedge(300.0);
    soup.vertices.iter_mut().for_each(|v| *v *= 10.0);
    let m = built(soup);
    let (from, target) = (
        Vector3::new(-2.3572493772099214, 1.2321312111182492, 2.5777834874107937),
        Vector3::new(0.0, 0.0, -0.40972852967494733),
    );
    let last = Vector3::new(0.0020935100750629765, -0.001094275017829771, -0.4123817858673591);
    let e = touchable(&m, Friction::None);
    for before in [0.0, 0.1, 0.3, 0.5, 0.6, 0.62, 0.65, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999] {
        let mut f = point_finger();
        println!("before {before}");
        for hip in [from, from + (target - from) * before, from + (target - from) * 1.0, last] {
            let o = step(&mut f, &e, &hip);
            println!(
                "  {hip:?} {:?} {:?} {:?} wn {}",
                o.entity,
                o.god_object_W,
                o.feature,
                mesh_oracle::winding_number(&m, &hip)
            );
        }
    }
}
