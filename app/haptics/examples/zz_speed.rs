#![allow(non_snake_case, missing_docs)]
use haptics::mesh::*;
use haptics::*;
use nalgebra::*;
use std::sync::Arc;
use std::time::Instant;
fn main() {
    for (nu, mu) in [(32usize, 0.0), (1000, 0.0), (32, 0.5), (1000, 0.5)] {
        let R = 0.1;
        let (mesh, _) = Mesh::build(make::uv_sphere(nu, nu / 2 + 1, R)).unwrap();
        let friction = if mu == 0.0 { Friction::None } else { Friction::coulomb(mu).unwrap() };
        let e = [Entity::new(Arc::new(mesh), Isometry3::identity(), 500.0)
            .unwrap()
            .with_friction(friction)
            .unwrap()];
        let (mut th, k, ds) = (0.05f64, 10.0f64, 2e-4);
        let pt = |th: f64, r: f64| {
            let u = 0.0137 + 10.0 * (th - 0.05);
            Vector3::new(th.sin() * u.cos(), th.cos(), th.sin() * u.sin()) * r
        };
        let mut path = vec![pt(th, 0.101)];
        for _ in 0..10000 {
            path.push(pt(th, R - 0.005));
            let d = ds / (R * (1.0 + (k * (th).sin()).powi(2)).sqrt());
            let mid = th + d / 2.0;
            th += ds / (R * (1.0 + k * k * mid.sin().powi(2)).sqrt());
        }
        let mut best = f64::INFINITY;
        let mut all = vec![];
        for _ in 0..80 {
            let mut f = Finger::new(0.0, 1).unwrap();
            let t = Instant::now();
            let mut s = 0.0;
            for h in &path {
                s += f.step(&e, h, 1e-3).force_on_user_W.x;
            }
            let ns = t.elapsed().as_nanos() as f64 / path.len() as f64;
            std::hint::black_box(s);
            best = best.min(ns);
            all.push(ns);
        }
        all.sort_by(f64::total_cmp);
        println!("nu {nu} mu {mu}: best {best:.0} median {:.0} ns/tick", all[all.len() / 2]);
    }
}
