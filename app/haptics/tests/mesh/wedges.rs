//! Edges of 10 to 350 degrees: no force into the material, no contact with a finger that is out and round the edge.

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::mesh::Mesh;
use haptics::{Contact, Entity, Feature, Finger, Friction};
use nalgebra::Vector3;
use std::sync::Arc;

const DEGREES: std::ops::RangeInclusive<u32> = 1..=35;

/// A finger that roams around the middle of the edge, 20 mm wide.
fn around_the_edge(seed: u64) -> Roaming {
    Roaming::new(seed, 0.02, 2e-4)
}

fn contact(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> Option<Contact> {
    step(finger, entity, hip);
    finger.contact(0).copied()
}

/// Whether a force leads out of the material, or presses into a groove as both of its flanks' normals together do: in
/// one of less than 90 degrees each flank's normal points into the other.
fn is_explained(degrees: f64, mesh: &Mesh, contact: &Contact) -> bool {
    if contact.feature == Feature::Edge && degrees > 270.0 {
        let between_normals = (0.5 * degrees - 90.0).to_radians();
        return contact.force_on_user_W.angle(&Vector3::y()) <= between_normals + 1e-9;
    }
    let is_flank_of_groove = degrees > 270.0 && contact.god_object_W.xy().norm() < 1e-6;
    is_flank_of_groove || !leads_inside(mesh, &contact.god_object_W, &contact.force_on_user_W)
}

/// Whether a way from a point of the surface leads into the material at once.
fn leads_inside(mesh: &Mesh, from: &Vector3<f64>, way: &Vector3<f64>) -> bool {
    // Far above rounding, far below the mesh's size.
    winding_number(mesh, &(from + way.normalize() * 1e-9)) > 0.75
}

#[test]
fn frictionless_forces_point_out_of_the_material() {
    for degrees in DEGREES {
        let mesh = built(wedge(f64::from(10 * degrees)));
        let entity = touchable(&mesh, Friction::None);
        let (mut finger, mut roaming) = (point_finger(), around_the_edge(u64::from(degrees)));
        let mut touching = 0;
        for _ in 0..8000 {
            let hip = roaming.next();
            let Some(contact) = contact(&mut finger, &entity, &hip) else { continue };
            if contact.normal_force_n < 1e-6 {
                continue;
            }
            touching += 1;
            let told = || format!("{degrees}0 degrees, {hip:?}: {contact:?}");
            assert!(is_explained(10.0 * f64::from(degrees), &mesh, &contact), "{}", told());
            // And the user is pushed towards the surface, not along it.
            let aslant = contact.force_on_user_W.cross(&(contact.god_object_W - hip)).norm();
            assert!(aslant < 1e-13, "{}", told());
        }
        assert!(touching > 200, "{degrees}0 degrees: {touching}");
    }
}

#[test]
fn friction_does_not_pull_into_the_face_it_is_felt_on() {
    for mu in [0.5, 1.5] {
        for degrees in DEGREES {
            let entity = touchable(&built(wedge(f64::from(10 * degrees))), Friction::Coulomb { mu });
            let (mut finger, mut roaming) = (point_finger(), around_the_edge(u64::from(degrees)));
            for _ in 0..4000 {
                let hip = roaming.next();
                let Some(contact) = contact(&mut finger, &entity, &hip) else { continue };
                let outward_n = contact.force_on_user_W.dot(&contact.normal_W);
                let along_n = (contact.force_on_user_W - contact.normal_W * outward_n).norm();
                let told = || format!("{degrees}0 degrees, mu {mu}, {hip:?}: {contact:?}");
                // A rounding of 20 N.
                assert!(outward_n >= 0.0 && (outward_n - contact.normal_force_n).abs() < 1e-13, "{}", told());
                assert!(along_n <= mu * outward_n + 1e-10, "{}", told());
            }
        }
    }
}

#[test]
fn friction_lets_go_of_a_finger_when_the_frictionless_god_object_does() {
    for mu in [0.5, 1.5] {
        for degrees in DEGREES {
            let mesh = built(wedge(f64::from(10 * degrees)));
            let (rough, smooth) =
                (touchable(&mesh, Friction::Coulomb { mu }), touchable(&mesh, Friction::None));
            let (mut held, mut free) = (point_finger(), point_finger());
            let mut roaming = around_the_edge(u64::from(degrees));
            for tick in 0..4000 {
                let hip = roaming.next();
                let rough = contact(&mut held, &rough, &hip);
                let smooth = contact(&mut free, &smooth, &hip);
                assert_eq!(rough.is_some(), smooth.is_some(), "{degrees}0 degrees, tick {tick}: {hip:?}");
            }
        }
    }
}

#[test]
fn a_finger_that_is_out_and_round_the_edge_is_free() {
    // Out of the angle, and not pressed through a flank: its foot on the flank is beyond the edge.
    for degrees in DEGREES {
        let angle = f64::from(10 * degrees);
        let mesh: Arc<Mesh> = built(wedge(angle));
        for friction in [Friction::None, Friction::Coulomb { mu: 0.5 }, Friction::Coulomb { mu: 1.5 }] {
            let entity = touchable(&mesh, friction);
            let mut noise = Noise(u64::from(degrees));
            for _ in 0..200 {
                // In through one flank, 10 mm from the edge and 1 mm deep, then up and out beyond the edge.
                let half = 0.5 * angle.to_radians();
                let flank = Vector3::new(half.sin(), -half.cos(), 0.0);
                let outward = Vector3::new(half.cos(), half.sin(), 0.0);
                let depth = noise.between(1e-5, 1e-3);
                let mut finger = point_finger();
                for i in 0..=40 {
                    let along = 0.01 - 5e-4 * f64::from(i);
                    let height = if i == 0 { 1e-3 } else { -depth };
                    let hip = flank * along + outward * height + Vector3::z() * 3e-3;
                    let out = step(&mut finger, &entity, &hip);
                    if !is_in_wedge(angle, &hip) && along < 0.0 {
                        assert_eq!(out.entity, None, "{angle} degrees: {hip:?}");
                    }
                    // While its foot is on the flank, it is held: pressed right through a thin wedge, too.
                    if i > 0 && along > 1e-9 {
                        assert_eq!(out.entity, Some(0), "{angle} degrees: {hip:?}");
                    }
                }
            }
        }
    }
}
