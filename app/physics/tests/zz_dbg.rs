#![allow(non_snake_case, missing_docs)]
mod common;
#[path = "common/meshes.rs"]
mod meshes;
use common::*;
use haptics::mesh::make;
use meshes::*;
use nalgebra::*;
use physics::Settings;
#[test]
fn dbg() {
    for (nu,nv,kind) in [(316,159,0),(60,31,0),(316,159,1)] {
    let pose = Isometry3::from_parts(Vector3::new(0.0, 0.06, 0.0).into(), UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.2, -0.7)));
    let entity = object(build(if kind==0 {make::bumpy_sphere(nu, nv, 0.05)} else {make::uv_sphere(nu,nv,0.05)}), pose, 1000.0, 0.5).with_damping(3.0).unwrap();
    let body = body(&entity, 0.1);
    let mut w = World::new(vec![floor(0.0, 2000.0, 0.5), entity], &[(1, body)], Settings::default(), 0);
    let mut last = 1.0;
    let mut shown = 0;
    for t in 0..4000 {
        w.step(&[]);
        let b = w.body();
        let k = 1000.0*2000.0/3000.0;
        let e = b.kinetic_energy_j() + 0.1*G*b.centre_W.y + w.manipulation.rows().iter().map(|r| r.force_W.norm_squared()/k/2.0).sum::<f64>();
        if t % 500 == 499 { println!("{t} E {:.6} v {:.4} rows {}", e, b.velocity_W.norm(), w.manipulation.rows().len()); }
        if e > last + 2e-5 && shown < 3 { shown += 1; println!("   {t} +{:.2e}: {:?}", e-last, w.manipulation.rows().iter().map(|r| { let p = r.arms_W[0]; ((p.x*1e4).round() as i64, (p.z*1e4).round() as i64, (r.force_W.y*1e3) as i64, (r.force_W.x*1e3) as i64, (r.force_W.z*1e3) as i64)}).collect::<Vec<_>>()); }
        last = e;
    }
    }
}
