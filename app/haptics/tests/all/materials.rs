//! Every material of the table feels as the table says.
#![allow(non_snake_case)]

use crate::common;

use common::*;
use haptics::{ContactState, Entity, Limits, Material, Plane};
use nalgebra::{Isometry3, Vector3};

#[test]
fn every_material_holds_up_to_its_static_ratio_and_slides_at_its_dynamic_one() {
    for material in Material::ALL {
        let plane = Plane::new(Vector3::y(), 0.0).unwrap();
        let entity = Entity::new(plane, Isometry3::identity(), material.stiffness_n_per_m).unwrap();
        let entity = entity.with_damping(material.damping_n_s_per_m).unwrap();
        let entity = entity.with_friction(material.friction().unwrap()).unwrap();
        let mut finger = point_finger();
        let (mut largest_held, mut slid) = (0.0f64, 0);
        for i in 0..1000 {
            // 2 N deep, and 0.01 mm along it a tick.
            let hip = Vector3::new(1e-5 * f64::from(i), -2.0 / material.stiffness_n_per_m, 0.0);
            let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
            let spring = material.stiffness_n_per_m * (out.god_object_W - hip).x / 2.0;
            match out.friction {
                ContactState::Stick => largest_held = largest_held.max(-spring),
                _ => {
                    slid += 1;
                    // A slide ends on its circle to rounding.
                    assert!((ratio(&out, &Vector3::y()) - material.mu_d).abs() < 1e-12, "{}", material.name);
                }
            }
        }
        // A step of 0.01 mm over 2 N is the resolution of where it broke away.
        let step = 1e-5 * material.stiffness_n_per_m / 2.0;
        assert!(largest_held <= material.mu_s + 1e-12, "{}: {largest_held}", material.name);
        // Foam would have to be dragged further than that.
        if material.mu_s * 2.0 / material.stiffness_n_per_m < 9e-3 {
            assert!(slid > 10, "{}: {slid}", material.name);
            assert!(largest_held > material.mu_s - step - 1e-12, "{}: {largest_held}", material.name);
        }
    }
}

#[test]
fn every_material_is_named_once_has_a_source_and_keeps_the_limits() {
    let limits = Limits::at(DT).unwrap();
    for (i, material) in Material::ALL.iter().enumerate() {
        assert_eq!(Material::named(material.name), Some(material));
        assert_eq!(Material::NAMES[i], material.name);
        assert!(Material::ALL[..i].iter().all(|other| other.name != material.name));
        assert!(material.source.contains("choice"), "the studies give one number, not two");
        // Two digits are rounded: half of 0.01 each.
        assert!((material.mu_d - 0.8 * material.mu_s).abs() < 0.0091, "{material:?}");
        // From foam to steel.
        assert!((10.0..=8000.0).contains(&material.density_kg_m3), "{material:?}");
        assert!(!material.density_source.is_empty());
        assert!(material.stiffness_n_per_m <= limits.stiffness_n_per_m() + 1e-9, "{material:?}");
        assert!(material.damping_n_s_per_m <= limits.damping_n_s_per_m(), "{material:?}");
    }
    assert_eq!(Material::named("unobtainium"), None);
}
