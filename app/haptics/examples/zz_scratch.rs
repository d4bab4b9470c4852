#![allow(non_snake_case, missing_docs)]
use haptics::mesh::*;
use haptics::*;
use nalgebra::*;
use std::sync::Arc;
use std::time::Instant;
fn main() {
    for bumpy in [false, true] {
        for mu in [0.0, 0.5] {
            for nu in [32usize, 100, 316, 1000] {
                let nv = nu / 2 + 1;
                let R = 0.1;
                let soup = if bumpy { make::bumpy_sphere(nu, nv, R) } else { make::uv_sphere(nu, nv, R) };
                let t = Instant::now();
                let (mesh, rep) = Mesh::build(soup).unwrap();
                let build = t.elapsed();
                let _ = rep;
                let friction = if mu == 0.0 { Friction::None } else { Friction::coulomb(mu).unwrap() };
                let e = [Entity::new(Arc::new(mesh), Isometry3::identity(), 500.0)
                    .unwrap()
                    .with_friction(friction)
                    .unwrap()];
                let mut path = vec![];
                let (mut th, k, ds) = (0.05f64, 10.0f64, 2e-4);
                let rad = |th: f64, u: f64| {
                    if bumpy { R * (1.0 + 0.05 * (8.0 * u).sin() * (8.0 * th).sin()) } else { R }
                };
                let pt = |th: f64, u: f64, r: f64| {
                    Vector3::new(th.sin() * u.cos(), th.cos(), th.sin() * u.sin()) * r
                };
                let step = |th: f64| {
                    let d = ds / (R * (1.0 + (k * (th).sin()).powi(2)).sqrt());
                    let mid = th + d / 2.0;
                    th + ds / (R * (1.0 + k * k * mid.sin().powi(2)).sqrt())
                };
                let u = |th: f64| 0.0137 + 10.0 * (th - 0.05);
                for _ in 0..5000 {
                    path.push((0, pt(th, u(th), 0.12), th));
                    th = step(th);
                    if th > 3.09 {
                        th = 0.05;
                    }
                }
                th = 0.05;
                for i in 0..500 {
                    let r0 = 0.12;
                    let r1 = rad(th, u(th)) - 0.005;
                    path.push((1, pt(th, u(th), r0 + (r1 - r0) * i as f64 / 500.0), th));
                }
                for _ in 0..10000 {
                    path.push((2, pt(th, u(th), rad(th, u(th)) - 0.005), th));
                    th = step(th);
                    if th > 3.09 {
                        break;
                    }
                }
                for i in 0..500 {
                    let r0 = rad(th, u(th)) - 0.005;
                    path.push((3, pt(th, u(th), r0 + (0.12 - r0) * i as f64 / 500.0), th));
                }
                for pass in 0..2 {
                    let mut f = Finger::new(0.0, 1).unwrap();
                    let mut times = vec![vec![], vec![], vec![], vec![]];
                    let mut last: Option<Vector3<f64>> = None;
                    let (mut se, mut n, mut jump, mut lost) = (0.0, 0, 0.0f64, 0);
                    let mut fsum = 0.0;
                    for (i, (ph, h, _)) in path.iter().enumerate() {
                        let t = Instant::now();
                        let out = f.step(&e, h, 1e-3);
                        let dt = t.elapsed().as_nanos() as f64;
                        times[*ph as usize].push(dt);
                        if *ph == 2 {
                            let want = h.normalize() * 2.5;
                            se += (out.force_on_user_W - want).norm_squared();
                            n += 1;
                            fsum += out.force_on_user_W.norm();
                            if out.entity.is_none() {
                                lost += 1;
                            }
                            if let Some(l) = last {
                                let j = (out.force_on_user_W - l).norm();
                                if j > jump {
                                    jump = j;
                                }
                            }
                            last = Some(out.force_on_user_W);
                        }
                        let _ = i;
                    }
                    if pass == 1 {
                        let q = |v: &mut Vec<f64>, p: f64| {
                            v.sort_by(f64::total_cmp);
                            v[((v.len() - 1) as f64 * p) as usize]
                        };
                        print!(
                            "{} mu {mu} nu {nu:4} build {:6.1?} rms {:.4} jump {:.4} lost {lost} mean {:.3} |",
                            if bumpy { "bumpy" } else { "plain" },
                            build,
                            (se / n as f64).sqrt(),
                            jump,
                            fsum / n as f64
                        );
                        for ph in 0..4 {
                            print!(
                                " {ph}: {:.0}/{:.0}/{:.0}",
                                q(&mut times[ph], 0.5),
                                q(&mut times[ph], 0.999),
                                q(&mut times[ph], 1.0)
                            );
                        }
                        println!();
                    }
                }
            }
        }
    }
}
