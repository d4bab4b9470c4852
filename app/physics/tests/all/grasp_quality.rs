//! Rank, force closure, margin and equilibrium of grasps: cases of the literature, and slow oracles.
#![allow(non_snake_case)]

use crate::held;

use nalgebra::{DMatrix, Vector3, Vector6};
use physics::{Grasp, GraspContact, SoftFinger, TorsionModel};

/// Numbers that look random, the same in each run.
struct Noise(u64);

impl Noise {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn unit(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::from_fn(|_, _| self.number());
            if (0.1..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }

    /// A point on a box of half edges 3, 2 and 1 cm, and the normal into it.
    fn on_a_box(&mut self) -> (Vector3<f64>, Vector3<f64>) {
        let half = Vector3::new(0.03, 0.02, 0.01);
        let mut point = Vector3::from_fn(|_, _| self.number()).component_mul(&half);
        let axis = ((self.number() + 1.0) * 1.5) as usize % 3;
        let sign = self.number().signum();
        point[axis] = sign * half[axis];
        let mut normal = Vector3::zeros();
        normal[axis] = -sign;
        (point, normal)
    }
}

fn contact(point: [f64; 3], normal: [f64; 3], mu: f64, torsion_m: f64) -> GraspContact {
    GraspContact { point_W: point.into(), normal_W: Vector3::from(normal).normalize(), mu, torsion_m }
}

fn grasp(contacts: &[GraspContact]) -> Grasp {
    let mut grasp = Grasp::about(Vector3::zeros());
    for contact in contacts {
        assert!(grasp.add(*contact));
    }
    grasp
}

#[test]
fn two_points_with_friction_have_rank_5_and_no_closure() {
    let two = |torsion_m| {
        let left = contact([-0.02, 0.0, 0.0], [1.0, 0.0, 0.0], 0.5, torsion_m);
        let right = contact([0.02, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.5, torsion_m);
        grasp(&[left, right])
    };
    assert_eq!((two(0.0).rank(), two(0.0).matrix().columns().len()), (5, 6));
    assert!(!two(0.0).has_force_closure());
    // Soft, they have it: 6 x 4n.
    assert_eq!((two(1e-3).rank(), two(1e-3).matrix().columns().len()), (6, 8));
    assert!(two(1e-3).has_force_closure());
}

#[test]
fn two_soft_fingers_have_closure_if_the_line_between_them_lies_in_both_cones() {
    let mu: f64 = 0.5;
    for degrees in 0..60 {
        let angle = f64::from(degrees).to_radians();
        let left = contact([-0.02, 0.0, 0.0], [angle.cos(), angle.sin(), 0.0], mu, 1e-3);
        let right = contact([0.02, 0.01, 0.0], [-1.0, 0.0, 0.0], mu, 1e-3);
        // The line rises by 1 in 4: 14 degrees; the cones open by 26.6.
        let line = (0.25_f64).atan();
        let both = (angle - line).abs() < mu.atan() && line < mu.atan();
        assert_eq!(grasp(&[left, right]).has_force_closure(), both, "{degrees}");
    }
    let away = contact([0.02, 0.0, 0.0], [1.0, 0.0, 0.0], mu, 1e-3);
    let left = contact([-0.02, 0.0, 0.0], [1.0, 0.0, 0.0], mu, 1e-3);
    assert!(!grasp(&[left, away]).has_force_closure());
}

#[test]
fn three_points_with_friction_that_lie_on_no_line_have_closure() {
    let at = |degrees: f64, mu: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        contact([0.02 * cos, 0.02 * sin, 0.0], [-cos, -sin, 0.0], mu, 0.0)
    };
    let three = |mu: f64| grasp(&[at(90.0, mu), at(210.0, mu), at(330.0, mu)]);
    assert_eq!(three(0.5).rank(), 6);
    assert!(three(0.5).has_force_closure());
    assert!(three(0.5).margin().at_least > 0.0);
    // Without friction three have rank 3 at most, here 2: all normals meet in the centre.
    assert_eq!(three(0.0).rank(), 2);
    assert!(!three(0.0).has_force_closure());
    // On a line they turn about it.
    let row = [-0.02, 0.0, 0.02]
        .map(|x| contact([x, 0.0, 0.0], [0.0, if x == 0.0 { -1.0 } else { 1.0 }, 0.0], 0.5, 0.0));
    assert_eq!(grasp(&row).rank(), 5);
    assert!(!grasp(&row).has_force_closure());
    // All from one side: nothing holds against the other.
    let side = [(0.0, 0.02), (0.02, -0.01), (-0.02, -0.01)]
        .map(|(x, y)| contact([x, y, -0.01], [0.0, 0.0, 1.0], 0.5, 0.0));
    assert_eq!(grasp(&side).rank(), 6);
    assert!(!grasp(&side).has_force_closure());
}

#[test]
fn what_can_be_turned_one_way_has_no_closure() {
    // Two points with friction, and a third in front of the line between them, which only pushes up.
    let left = contact([-0.02, 0.0, 0.0], [1.0, 0.0, 0.0], 0.8, 0.0);
    let right = contact([0.02, 0.0, 0.0], [-1.0, 0.0, 0.0], 0.8, 0.0);
    let up = |z: f64| contact([0.0, -0.01, z], [0.0, 1.0, 0.0], 0.2, 0.0);
    let three = grasp(&[left, right, up(0.015)]);
    // Its friction acts 10 mm below the line, a fifth of what it pushes: it does not turn the other way.
    assert_eq!(three.rank(), 6);
    assert!(!three.has_force_closure());
    // One on either side does.
    assert!(grasp(&[left, right, up(0.015), up(-0.015)]).has_force_closure());
}

#[test]
fn without_friction_it_takes_seven_contacts_in_space() {
    let mut noise = Noise(7);
    let frictionless = |noise: &mut Noise, count: usize| {
        let contacts: Vec<_> = (0..count)
            .map(|_| {
                let (point_W, normal_W) = noise.on_a_box();
                GraspContact { point_W, normal_W, mu: 0.0, torsion_m: 0.0 }
            })
            .collect();
        contacts
    };
    for count in 1..=6 {
        for _ in 0..2000 {
            let grasp = grasp(&frictionless(&mut noise, count));
            assert!(grasp.rank() <= count);
            assert!(!grasp.has_force_closure(), "{grasp:?}");
        }
    }
    let mut closed = 0;
    for _ in 0..5000 {
        let contacts = frictionless(&mut noise, 7);
        if grasp(&contacts).has_force_closure() {
            closed += 1;
            // Each of the seven is needed.
            for left_out in 0..7 {
                let mut fewer = contacts.clone();
                fewer.remove(left_out);
                assert!(!grasp(&fewer).has_force_closure());
            }
        }
    }
    assert!(closed > 10, "{closed}");
    // A ball cannot be held from turning by any number.
    let ball: Vec<_> = (0..8)
        .map(|_| {
            let normal_W = noise.unit();
            GraspContact { point_W: normal_W * -0.03, normal_W, mu: 0.0, torsion_m: 0.0 }
        })
        .collect();
    assert_eq!(grasp(&ball).rank(), 3);
}

/// A grasp of so many contacts at random on a box.
fn random(noise: &mut Noise, count: usize) -> Vec<GraspContact> {
    (0..count)
        .map(|_| {
            let (point_W, normal_W) = noise.on_a_box();
            let (mu, torsion_m) = (0.4 + 0.4 * noise.number(), (3e-3 * noise.number()).max(0.0));
            GraspContact { point_W, normal_W, mu, torsion_m }
        })
        .collect()
}

#[test]
fn the_rank_is_that_of_a_singular_value_decomposition() {
    let mut noise = Noise(3);
    let mut seen = [0; 7];
    for turn in 0..3000 {
        let mut contacts = random(&mut noise, 1 + turn % 8);
        if turn % 3 == 0 {
            // Nearly all on a line, without friction.
            for contact in &mut contacts {
                (contact.mu, contact.torsion_m) = (0.0, 0.0);
                contact.point_W.x = 0.0;
            }
        }
        let grasp = grasp(&contacts);
        let matrix = grasp.matrix();
        let dense = DMatrix::from_columns(
            &matrix
                .columns()
                .iter()
                .map(|c| nalgebra::DVector::from_column_slice(c.as_slice()))
                .collect::<Vec<_>>(),
        );
        let values = dense.singular_values();
        let most = values.max();
        let rank = values.iter().filter(|value| **value > 1e-9 * most).count();
        assert_eq!(grasp.rank(), rank, "{values}");
        seen[rank] += 1;
    }
    assert!(seen[1..].iter().all(|count| *count > 20), "{seen:?}");
}

/// The least that the contacts can give in the direction that resists them best, as far as a perceptron finds it: the
/// whole cones, with this share of their friction. Not above 0: nothing, so there is no closure.
fn weakest(contacts: &[GraspContact], share_of_mu: f64, rounds: usize) -> f64 {
    let length = contacts.iter().map(|c| c.point_W.norm()).fold(0.0, f64::max);
    let pull = |contact: &GraspContact, d: &Vector6<f64>| -> Vector6<f64> {
        let (force, turn) = (d.fixed_rows::<3>(0).into_owned(), d.fixed_rows::<3>(3) / length);
        // What the direction asks of a force at the contact.
        let asked = force + turn.cross(&contact.point_W);
        let n = contact.normal_W;
        let across = asked - n * n.dot(&asked);
        let friction = across.try_normalize(1e-300).unwrap_or_default() * contact.mu * share_of_mu;
        let torsion = n * (contact.torsion_m * turn.dot(&n).signum());
        // What gives most in this direction, of friction and torsion.
        let best = if across.norm() * contact.mu * share_of_mu > (turn.dot(&n) * contact.torsion_m).abs() {
            (n + friction, Vector3::zeros())
        } else {
            (n, torsion)
        };
        let torque = (contact.point_W.cross(&best.0) + best.1) / length;
        Vector6::new(best.0.x, best.0.y, best.0.z, torque.x, torque.y, torque.z)
    };
    let mut d = Vector6::zeros();
    for contact in contacts {
        d -= pull(contact, &d);
    }
    let mut least = f64::INFINITY;
    for _ in 0..rounds {
        let worst = contacts
            .iter()
            .map(|contact| pull(contact, &d))
            .max_by(|a, b| (a.dot(&d) / a.norm()).total_cmp(&(b.dot(&d) / b.norm())))
            .unwrap();
        least = least.min(worst.dot(&d) / (worst.norm() * d.norm()));
        if least <= 0.0 {
            break;
        }
        d -= worst.normalize();
    }
    least
}

#[test]
fn force_closure_is_never_claimed_where_a_direction_is_open_and_nearly_always_where_none_is() {
    let mut noise = Noise(11);
    let (mut closed, mut open, mut nearly) = (0, 0, 0);
    for turn in 0..600 {
        let contacts = random(&mut noise, 3 + turn % 3);
        if grasp(&contacts).has_force_closure() {
            closed += 1;
            assert!(weakest(&contacts, 1.0, 3000) > 0.0, "{contacts:?}");
        } else {
            open += 1;
            // The pyramids of eight edges contain the cones of 0.92 of their friction: cos(22.5 degrees).
            // Some resist everything but one direction, in which they give just nothing: where all others turn the body the
            // same way about the line between two. A perceptron only comes near such a direction.
            let left = weakest(&contacts, 0.92, 200_000);
            nearly += usize::from(left > 0.0);
            assert!(left < 0.03, "{left}: {contacts:?}");
        }
    }
    assert!(closed > 50 && open > 50 && nearly < open / 50, "{closed} {open} {nearly}");
}

#[test]
fn the_margin_bounds_what_is_resisted_in_every_direction() {
    let mut noise = Noise(5);
    let (mut seen, mut tried) = (0, 0);
    while seen < 12 {
        tried += 1;
        assert!(tried < 10_000, "{seen} grasps with force closure");
        let contacts = random(&mut noise, 4);
        let grasp = grasp(&contacts);
        let margin = grasp.margin();
        if !grasp.has_force_closure() {
            assert_eq!((margin.at_least, margin.at_most), (0.0, 0.0));
            continue;
        }
        seen += 1;
        assert!(0.0 < margin.at_least && margin.at_least <= margin.at_most, "{margin:?}");
        // The support of the whole cones (friction or torsion) in many directions; the pyramids lie 8 % inside.
        let length = contacts.iter().map(|c| c.point_W.norm()).fold(0.0, f64::max);
        let mut least = f64::INFINITY;
        for _ in 0..100_000 {
            let d = Vector6::from_fn(|_, _| noise.number()).normalize();
            let (force, turn) = (d.fixed_rows::<3>(0).into_owned(), d.fixed_rows::<3>(3) / length);
            let support = contacts.iter().map(|c| {
                let asked = force + turn.cross(&c.point_W);
                let along = c.normal_W.dot(&asked);
                let across = (asked - c.normal_W * along).norm();
                along + (c.mu * across).max(c.torsion_m * turn.dot(&c.normal_W).abs())
            });
            least = least.min(support.fold(f64::NEG_INFINITY, f64::max));
        }
        assert!(margin.at_most <= least + 1e-9, "{margin:?} {least}");
        assert!(margin.at_least <= least, "{margin:?} {least}");
    }
}

#[test]
fn a_held_cube_tells_how_it_is_held() {
    let quality = |soft: SoftFinger, force: f64| {
        let mut held = held::Held::new(soft, 500.0, 0.5, 0.0, 0.0);
        held.squeeze_for(3.0, force);
        held.world.manipulation.grasp_quality(0).unwrap()
    };
    let points = quality(SoftFinger::POINT, 2.0);
    assert_eq!((points.contacts, points.rank, points.has_force_closure), (2, 5, false));
    // It has come to rest: what the springs still do after 3 s of damping.
    assert!(points.residual < 1e-9, "{points:?}");
    let soft = quality(SoftFinger::default(), 2.0);
    assert_eq!((soft.contacts, soft.rank, soft.has_force_closure), (2, 6, true));
    // Held off its centre by torsion alone, it is in equilibrium all the same.
    let mut held = held::Held::new(SoftFinger::default(), 500.0, 0.5, 0.005, 1.5);
    held.squeeze_for(3.0, 3.0);
    let off_centre = held.world.manipulation.grasp_quality(0).unwrap();
    assert!(off_centre.residual < 1e-9, "{off_centre:?}");
    let viscous = quality(SoftFinger::default().with_model(TorsionModel::of_name("viscous").unwrap()), 2.0);
    assert_eq!((viscous.contacts, viscous.rank), (2, 5));
    // Nothing: it falls, and nothing acts against its weight.
    let none = quality(SoftFinger::POINT, -5.0);
    assert_eq!((none.contacts, none.rank, none.has_force_closure), (0, 0, false));
    assert!((none.residual - 1.0).abs() < 1e-12);
    assert!(
        held::Held::new(SoftFinger::POINT, 500.0, 0.5, 0.0, 0.0)
            .world
            .manipulation
            .grasp_quality(1)
            .is_none()
    );
}

#[test]
fn what_is_no_contact_is_refused() {
    let mut grasp = Grasp::about(Vector3::zeros());
    let good = contact([0.0, 0.0, 1.0], [0.0, 0.0, -1.0], 0.5, 0.0);
    for bad in [
        GraspContact { point_W: Vector3::repeat(f64::NAN), ..good },
        GraspContact { normal_W: Vector3::zeros(), ..good },
        GraspContact { mu: -0.1, ..good },
        GraspContact { torsion_m: f64::INFINITY, ..good },
    ] {
        assert!(!grasp.add(bad), "{bad:?}");
    }
    for _ in 0..physics::grasp::MAX_CONTACTS {
        assert!(grasp.add(good));
    }
    assert!(!grasp.add(good));
    // All at one place.
    assert_eq!(grasp.rank(), 3);
    assert!(!grasp.has_force_closure());
}
