#![allow(non_snake_case, missing_docs, clippy::all)]
use haptics::mesh::{Mesh, TriangleSoup};
use haptics::{Entity, Finger, Friction};
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

pub struct Rng(u64);
impl Rng {
    fn u(&mut self) -> f64 { self.0 ^= self.0 << 13; self.0 ^= self.0 >> 7; self.0 ^= self.0 << 17; (self.0 >> 11) as f64 / (1u64 << 53) as f64 }
    fn unit(&mut self) -> Vector3<f64> { loop { let v = Vector3::new(self.u()-0.5, self.u()-0.5, self.u()-0.5)*2.0; let n=v.norm(); if n>0.01 && n<1.0 { return v/n } } }
}
pub fn load(path: &str) -> TriangleSoup {
    let text = String::from_utf8_lossy(&std::fs::read(path).unwrap()).into_owned();
    let (mut vertices, mut faces) = (vec![], vec![]);
    for l in text.lines() {
        let mut w = l.split_whitespace();
        match w.next() {
            Some("v") => { let c: Vec<f64> = w.take(3).map(|x| x.parse().unwrap()).collect(); vertices.push(Vector3::new(c[0],c[1],c[2])); }
            Some("f") => { let c: Vec<i64> = w.map(|x| x.split('/').next().unwrap().parse().unwrap()).collect();
                let n = vertices.len() as i64; let c: Vec<u32> = c.into_iter().map(|i| if i<0 {(n+i) as u32} else {(i-1) as u32}).collect();
                for i in 1..c.len().max(2)-1 { faces.push([c[0],c[i],c[i+1]]); } }
            _ => {}
        }
    }
    let mut lo = Vector3::repeat(f64::INFINITY); let mut hi = -lo;
    for v in &vertices { lo = lo.inf(v); hi = hi.sup(v); }
    let s = 0.2 / (hi-lo).max(); let mid = (lo+hi)*0.5;
    for v in &mut vertices { *v = (*v-mid)*s; }
    TriangleSoup { vertices, faces }
}
fn strokes(n: usize, paths: &[String]) {
    let k = 500.0;
    for path in paths {
        let name = path.rsplit('/').next().unwrap();
        let Ok((mesh, _)) = Mesh::build(load(path)) else { continue };
        let mesh = Arc::new(mesh);
        let mut areas = vec![]; let mut sum = 0.0;
        for f in mesh.faces() { let [p,q,r] = f.vertices.map(|v| mesh.vertices()[v as usize]); sum += (q-p).cross(&(r-p)).norm(); areas.push(sum); }
        for (friction, fname) in [(Friction::None, "none"), (Friction::stiction(0.7, 0.3).unwrap(), "stiction")] {
        for radius in [0.0, 1e-3, 5e-3] {
            let mut rng = Rng(0x1234_5678_9abc_def1);
            let entity = Entity::new(mesh.clone(), Isometry3::identity(), k).unwrap().with_friction(friction.clone()).unwrap();
            let (mut rises, mut worst, mut near_bad, mut nearest, mut away, mut away_worst, mut lost, mut told, mut fmax) = (0, 0.0f64, 0, 0.0f64, 0, 0.0f64, 0, String::new(), 0.0f64);
            let mut ticks = 0;
            for stroke in 0..n {
                let t = rng.u()*sum; let i = areas.partition_point(|x| *x < t).min(areas.len()-1);
                let [p,q,r] = mesh.faces()[i].vertices.map(|v| mesh.vertices()[v as usize]);
                let normal = mesh.faces()[i].normal_B;
                let (mut u, mut v) = (rng.u(), rng.u()); if u+v>1.0 { u=1.0-u; v=1.0-v }
                let at = p+(q-p)*u+(r-p)*v;
                let mut hip = at + normal*(radius + 1e-3);
                let mut finger = Finger::new(radius, 1).unwrap().with_ramp_in(0.0).unwrap();
                let along = rng.unit();
                let along = (along - normal*along.dot(&normal)).normalize();
                let mut last: Option<(Vector3<f64>, Vector3<f64>, Vector3<f64>)> = None;
                for tick in 0..400 {
                    let depth = if tick < 60 { -5e-5*tick as f64 + radius + 1e-3 } else { -2e-3 + radius };
                    hip = at + normal*depth + along * (2e-4 * (tick as f64 - 60.0).max(0.0)) + rng.unit()*2e-5;
                    let out = finger.step(std::slice::from_ref(&entity), &hip, 1e-3);
                    ticks += 1;
                    let force = out.force_on_user_W;
                    fmax = fmax.max(force.norm());
                    if let Some((h, f, c)) = last {
                        let way = (hip-h).norm();
                        let excess = force.norm() - f.norm() - k*way;
                        if excess > 1e-6 { rises += 1; if excess > worst { worst = excess; told = format!("stroke {stroke} tick {tick}"); } }
                        if f.norm() > 0.0 && force.norm() > 0.0 {
                            let a = (out.god_object_W-hip).norm() - (c-hip).norm();
                            if a > 1e-8 { away += 1; away_worst = away_worst.max(a); }
                        }
                        if f.norm() > 2.0*k*2.2e-4 && force.norm() == 0.0 { lost += 1 }
                    }
                    if force.norm() > 0.0 && radius > 0.0 {
                        let d = mesh.nearest_unbounded(&out.god_object_W).distance_m;
                        if d < radius*(1.0-1e-6) { near_bad += 1; nearest = nearest.max(radius-d); }
                    }
                    last = Some((hip, force, out.god_object_W));
                }
            }
            println!("{name} {fname} r {radius}: ticks {ticks} max {fmax:.2} N rises {rises} worst {worst:.3} N ({told}); away {away} worst {away_worst:.2e}; near {near_bad} by {nearest:.2e}; dropped {lost}");
        }}
    }
}
fn main() {
    if std::env::args().nth(1).unwrap() == "strokes" { let a: Vec<String> = std::env::args().collect(); strokes(a[2].parse().unwrap(), &a[3..]); return; }
    let a: Vec<String> = std::env::args().collect();
    let n: usize = a[1].parse().unwrap();
    let k = 500.0;
    for path in &a[2..] {
        let name = path.rsplit('/').next().unwrap();
        let (mesh, report) = match Mesh::build(load(path)) { Ok(x) => x, Err(e) => { println!("{name}: REFUSED {e}"); continue } };
        let mesh = Arc::new(mesh);
        let mut areas = vec![]; let mut sum = 0.0;
        for f in mesh.faces() { let [p,q,r] = f.vertices.map(|v| mesh.vertices()[v as usize]); sum += (q-p).cross(&(r-p)).norm(); areas.push(sum); }
        for radius in [0.0, 1e-3, 5e-3] {
            let mut rng = Rng(0x1234_5678_9abc_def1);
            let (mut worst, mut bad, mut felt, mut most) = (0.0f64, 0, 0, String::new());
            let entity = Entity::new(mesh.clone(), Isometry3::identity(), k).unwrap().with_friction(Friction::None).unwrap();
            for _ in 0..n {
                let t = rng.u()*sum; let i = areas.partition_point(|x| *x < t).min(areas.len()-1);
                let [p,q,r] = mesh.faces()[i].vertices.map(|v| mesh.vertices()[v as usize]);
                let (mut u, mut v) = (rng.u(), rng.u()); if u+v>1.0 { u=1.0-u; v=1.0-v }
                let hip = p+(q-p)*u+(r-p)*v + rng.unit()*(0.8e-3*rng.u());
                let mut finger = Finger::new(radius, 1).unwrap().with_ramp_in(0.0).unwrap();
                let out = finger.step(std::slice::from_ref(&entity), &hip, 1e-3);
                let f = out.force_on_user_W.norm();
                if f>0.0 { felt+=1 }
                let near = mesh.nearest_unbounded(&hip).distance_m;
                let inside = mesh.is_inside_unbounded(&hip);
                let overlap = if inside { radius+near } else { (radius-near).max(0.0) };
                if f > k*overlap*(1.0+1e-6)+1e-9 { bad+=1; if f-k*overlap>worst { worst=f-k*overlap; most=format!("{hip:?} inside {inside} near {near:e} f {f} overlap {overlap:e}"); } }
            }
            println!("{name}: {:?} parts {} rims {} r {radius}: felt {felt}/{n}, beyond {bad}, worst excess {worst:.3} N  {most}", mesh.sides(), report.components, report.boundary_edges.count);
        }
    }
}
