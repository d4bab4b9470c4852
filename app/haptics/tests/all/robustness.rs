//! What holds for every input: finite, within the cone, out of the material.
#![allow(non_snake_case)]

use crate::{common, trees};

use common::laws::{any_friction, largest_ratio};
use common::meshes::{bumpy_sphere, touchable};
use common::*;
use haptics::{
    Border, Capsule, Cone, ConeInput, ContactState, Cuboid, Cylinder, Ellipsoid, Entity, Finger, Form,
    Friction, FrictionCone, FrictionState, HeightForm, HeightMap, MAX_SLIDE_ROUNDS, PictureScale, Plane,
    Scaled, Shading, ShadingForm, Sphere, Surface, Torus,
};
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

fn any_shape() -> impl Strategy<Value = Form> {
    let length = || (-3.0..-0.7f64).prop_map(|e| 10f64.powf(e));
    let lengths = move || prop::array::uniform3(length());
    let solid = prop_oneof![
        lengths().prop_map(|size| Form::from(Cuboid::new(size).unwrap())),
        lengths().prop_map(|[r, l, _]| Cylinder::new(r, l).unwrap().into()),
        lengths().prop_map(|[bottom, top, l]| Cone::new(bottom, top, l).unwrap().into()),
        lengths().prop_map(|[r, l, _]| Cone::new(0.0, r, l).unwrap().into()),
        lengths().prop_map(|[r, l, _]| Capsule::new(r, l).unwrap().into()),
        lengths().prop_map(|[tube, more, _]| Torus::new(tube + more, tube).unwrap().into()),
        lengths().prop_map(|radii| Ellipsoid::new(radii).unwrap().into()),
    ];
    prop_oneof![
        4 => solid.clone(),
        2 => (solid, prop::array::uniform3(0.5..2.0f64)).prop_map(|(form, factors)| Scaled::new(form, factors).unwrap()),
        1 => (0.001..0.2f64).prop_map(|r| Sphere::new(r).unwrap().into()),
        1 => (prop::array::uniform3(-1.0..1.0f64), -0.05..0.05f64)
            .prop_filter_map("a direction", |(n, offset)| Plane::new(Vector3::from(n), offset).ok())
            .prop_map(Form::from),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn contacts_never_pull_and_stay_within_their_cone(
        shape in any_shape(), friction in any_friction(), damping in prop_oneof![Just(0.0), 0.0..20.0f64],
        turn in prop::array::uniform3(-3.0..3.0f64), seed: u64, step in -5.0..-1.0f64,
    ) {
        let X_WB = Isometry3::new(Vector3::new(0.01, -0.02, 0.03), Vector3::from(turn));
        let entity = Entity { X_WB, previous_X_WB: X_WB, friction: friction.clone(), damping_n_s_per_m: damping, ..entity(shape, friction.clone()) };
        let mut finger = point_finger();
        let mut noise = Noise(seed);
        let mut hip = X_WB.translation.vector;
        for _ in 0..300 {
            let moved = noise.vector(10f64.powf(step));
            hip += moved;
            let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
            let Some(contact) = finger.contact(0) else { continue };
            prop_assert!(contact.normal_force_n >= 0.0);
            let normal_force = out.force_on_user_W.dot(&contact.normal_W);
            let tangential = (out.force_on_user_W - contact.normal_W * normal_force).norm();
            // Forces are rounded against their own size, rotated once; what is cut off the damper as well. What is along a way
            // that is nearly along the normal has its direction from what is left of it.
            let across = (moved - contact.normal_W * contact.normal_W.dot(&moved)).norm();
            let rounding = 1e-14 * out.force_on_user_W.norm()
                + 1e-15 * damping * moved.norm() / DT
                + f64::EPSILON * tangential * moved.norm() / across;
            prop_assert!((normal_force - contact.normal_force_n).abs() <= rounding);
            prop_assert!(normal_force >= -rounding);
            if let Some(mu) = largest_ratio(&friction, contact.normal_force_n) {
                // What is felt beside the spring is added to a slide that ended within 1e-12 of the load, or
                // within some roundings of a position.
                let beside = 1e-12 * contact.normal_force_n + K * 1e-15 * hip.norm();
                let beside = if matches!(friction, Friction::LuGre(_)) { 2.0 * beside } else { 0.0 };
                let limit = mu * contact.normal_force_n + beside;
                prop_assert!(tangential <= limit + rounding, "{tangential} {mu} {contact:?}");
            }
            // And the god-object is on the surface.
            let at_B = X_WB.inverse_transform_point(&contact.god_object_W.into()).coords;
            prop_assert!(shape.signed_distance(&at_B).abs() <= 1e-15 * (1.0 + hip.norm()));
        }
    }

    /// Also with a HIP deep in a small ball, where slides are longest.
    #[test]
    fn a_slide_that_meets_its_bound_goes_on_and_comes_to_rest(
        mu in 0.0..0.5f64, rho in -6.0..-0.1f64, phi in 0.0..3.13f64,
    ) {
        let sphere = Sphere::new(0.01).unwrap();
        let rho = 0.01 * 10f64.powf(rho);
        let law = Friction::Coulomb { mu };
        let mut cone = FrictionCone::new(sphere.nearest(&Vector3::y()));
        let input = ConeInput { hip_B: on_circle(rho, phi), hip_velocity_B: Vector3::zeros(),
            stiffness_n_per_m: K, damping_n_s_per_m: 0.0, dt_s: DT };
        let mut rounds = 0;
        for _ in 0..4 {
            rounds = cone.update(&sphere, &law, &input).rounds;
        }
        prop_assert!(cone.state() == FrictionState::Stick || rounds < MAX_SLIDE_ROUNDS);
    }

    #[test]
    fn every_finite_input_gives_a_finite_output(
        shape in any_shape(), friction in any_friction(),
        hips in prop::collection::vec(prop::array::uniform3(any_size()), 1..20),
        shift in prop::array::uniform3(any_size()), k in any_size(), b in any_size(), dt in any_size(), r in 0.0..0.1f64,
    ) {
        let mut entity = Entity { stiffness_n_per_m: k, damping_n_s_per_m: b, ..entity(shape, friction) };
        let mut finger = Finger::new(r, 2).unwrap();
        for hip in hips {
            let out = finger.step(&[entity.clone(), entity.clone()], &Vector3::from(hip), dt);
            prop_assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{out:?}");
            prop_assert!(out.god_object_W.iter().all(|x| x.is_finite()), "{out:?}");
            entity.move_to(Isometry3::translation(shift[0], shift[1], shift[2]));
        }
    }
}

#[test]
fn shaded_forces_stay_finite_and_as_large_as_they_were_for_every_input() {
    let mesh = bumpy_sphere(16);
    let cuboid = Cuboid::new([0.1; 3]).unwrap();
    let odd = [0.0, -0.0, 5e-324, 1e-160, 1e-9, 0.05, 0.0999, 0.1, f64::INFINITY, f64::NAN];
    let (rotate, bisect) = (ShadingForm::Rotate, ShadingForm::Bisect);
    for (form, largest) in
        [(rotate, 1e9), (bisect, 1e9), (rotate, 1e154), (bisect, 1e154), (rotate, f64::MAX)]
    {
        let plain = [touchable(&mesh, stiction()), entity(cuboid, stiction())];
        let shaded = [
            plain[0].clone().with_shading(Shading::interpolated(&mesh, 1.0, form).unwrap()),
            plain[0].clone().with_shading(Shading::regions(&mesh, 1e-3, 3.0, form).unwrap()),
            plain[1].clone().with_shading(Shading::box_regions(&cuboid, 1e-2, form).unwrap()),
        ];
        for (shaded, plain) in shaded.into_iter().zip([&plain[0], &plain[0], &plain[1]]) {
            let (mut noise, mut fingers) = (Noise(12), [point_finger(), point_finger()]);
            let mut touched = 0;
            for i in 0..20_000 {
                let pick = |noise: &mut Noise| {
                    let pick = (noise.uniform() * (odd.len() + 1) as f64) as usize;
                    odd.get(pick).copied().unwrap_or(largest)
                };
                let hip =
                    if i % 4 == 0 { Vector3::from_fn(|_, _| pick(&mut noise)) } else { noise.vector(0.05) };
                let felt = fingers[0].step(std::slice::from_ref(&shaded), &hip, DT).force_on_user_W;
                let before = fingers[1].step(std::slice::from_ref(plain), &hip, DT).force_on_user_W;
                assert!(felt.iter().all(|x| x.is_finite()), "{felt:?} at {hip:?}");
                // Beyond that squares overflow, and contacts that have no finite force end.
                if largest < 1e100 {
                    assert!(
                        (felt.norm() - before.norm()).abs() <= 1e-14 * before.norm(),
                        "{felt:?} {before:?}"
                    );
                }
                touched += u32::from(felt != Vector3::zeros());
            }
            assert!(touched > 2000, "{touched}");
        }
    }
}

proptest! {
    #[test]
    fn every_finite_input_to_a_tree_gives_a_finite_output(
        which in 0..7usize, friction in any_friction(),
        hips in prop::collection::vec(prop::array::uniform3(any_size()), 1..20),
        shift in prop::array::uniform3(any_size()), k in any_size(), b in any_size(), dt in any_size(),
        radius in prop_oneof![Just(0.0), 1e-6..0.1f64, 1e-300..1e12f64],
    ) {
        let tree = &trees::all()[which];
        let mut entity =
            Entity { stiffness_n_per_m: k, damping_n_s_per_m: b, ..trees::touchable(&tree.tree, friction) };
        let mut finger = Finger::new(radius, 2).unwrap();
        for hip in hips {
            let out = finger.step(&[entity.clone(), entity.clone()], &Vector3::from(hip), dt);
            prop_assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{out:?}");
            prop_assert!(out.god_object_W.iter().all(|x| x.is_finite()), "{out:?}");
            entity.move_to(Isometry3::translation(shift[0], shift[1], shift[2]));
        }
    }

    /// With every friction law: within its cone, out of the material, on the boundary.
    #[test]
    fn a_contact_with_a_tree_stays_within_the_friction_cone(
        which in 0..7usize, friction in any_friction(),
        hips in prop::collection::vec(prop::array::uniform3(-1.1..1.1f64), 2..40),
    ) {
        let tree = &trees::all()[which];
        let entity = trees::touchable(&tree.tree, friction.clone());
        let csg = trees::built(&tree.tree);
        let mut finger = Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap();
        for hip in hips {
            finger.step(std::slice::from_ref(&entity), &(Vector3::from(hip) * tree.size_m), DT);
            let Some(contact) = finger.contact(0) else { continue };
            let normal_n = contact.force_on_user_W.dot(&contact.normal_W);
            let tangential_n = (contact.force_on_user_W - contact.normal_W * normal_n).norm();
            prop_assert!(normal_n >= -1e-12, "{contact:?}");
            if let Some(mu) = largest_ratio(&friction, contact.normal_force_n) {
                // LuGre's damping stands beside the spring within a circle that a slide may miss by its rest.
                let slack = if matches!(friction, Friction::LuGre(_)) { 1e-9 } else { 1e-11 };
                prop_assert!(tangential_n <= mu * contact.normal_force_n + slack * (1.0 + normal_n), "{mu} {contact:?}");
            }
            prop_assert!(csg.signed_distance(&contact.god_object_W).abs() < 1e-12, "{contact:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_ball_on_a_tree_stays_within_the_friction_cones_of_all_that_it_touches(
        which in 0..7usize, friction in any_friction(), radius in 5e-4..8e-3f64,
        hips in prop::collection::vec(prop::array::uniform3(-1.1..1.1f64), 2..12), steps in 1..60u32,
    ) {
        stays_within_the_cones(which, &friction, radius, &hips, steps)?;
    }
}

/// Of a ball's loads together, wherever it is wedged; and nothing is nearer to its centre than its radius.
fn stays_within_the_cones(
    which: usize,
    friction: &Friction,
    radius: f64,
    hips: &[[f64; 3]],
    steps: u32,
) -> Result<(), TestCaseError> {
    let tree = &trees::all()[which];
    let entity = trees::touchable(&tree.tree, friction.clone());
    let csg = trees::built(&tree.tree);
    let mut finger = Finger::new(radius, 1).unwrap().with_ramp_in(0.0).unwrap();
    let mut from = Vector3::new(2.0, 2.1, 1.9);
    for &hip in hips {
        let to = Vector3::from(hip);
        for i in 1..=steps {
            let at = from + (to - from) * (f64::from(i) / f64::from(steps));
            finger.step(std::slice::from_ref(&entity), &(at * tree.size_m), DT);
            let points = finger.touch_points(std::slice::from_ref(&entity), 0);
            let (mut loads_n, mut sum) = (0.0, Vector3::zeros());
            let mut touched_by_m: Option<f64> = None;
            for point in points.as_slice() {
                loads_n += point.force_on_user_W.dot(&point.normal_W);
                sum += point.force_on_user_W;
                let Some(contact) = finger.contact(0) else { continue };
                let distance_m = (point.point_W - contact.god_object_W).norm();
                // A ball that has leapt to where there is no room for it is smaller; in all places it is as large.
                let touched_by_m = *touched_by_m.get_or_insert(distance_m);
                // What is touched still; and an edge is where both patches are within a millionth of its coordinates.
                let off_m = 1e-6 * (radius + point.point_W.amax());
                prop_assert!((distance_m - touched_by_m).abs() <= off_m, "{distance_m:e} {contact:?}");
                prop_assert!(distance_m <= radius + off_m, "{distance_m:e} {contact:?}");
                prop_assert!(steps < 10 || distance_m >= radius - off_m, "{distance_m:e} {contact:?}");
                prop_assert!(csg.signed_distance(&point.point_W).abs() < 1e-11, "{point:?}");
            }
            let Some(contact) = finger.contact(0) else { continue };
            prop_assert!((sum - contact.force_on_user_W).norm() <= 1e-9 * (1.0 + loads_n));
            prop_assert!(csg.signed_distance(&contact.god_object_W) > 0.0, "{contact:?}");
            if let Some(mu) = largest_ratio(friction, loads_n) {
                let normal: Vector3<f64> =
                    points.as_slice().iter().map(|p| p.normal_W * p.force_on_user_W.dot(&p.normal_W)).sum();
                let tangential_n = (sum - normal).norm();
                prop_assert!(
                    tangential_n <= mu * loads_n + 1e-6 * (1.0 + loads_n),
                    "{mu} {tangential_n} {loads_n} {contact:?}"
                );
            }
        }
        from = to;
    }
    Ok(())
}

/// The hollow is as tight as the ball, so that all of it is about as near: it did not settle, and pressed on what it was 0.07 um
/// away from.
#[test]
fn a_ball_in_a_hollow_of_its_own_radius_touches_all_that_holds_it() {
    let hips = [
        [0.8034402841330721, -0.709375252106668, 1.0640466167765292],
        [1.0023804237225842, -0.5707789698202086, -0.6707680139991665],
        [-0.032045023175403135, 0.23858687117634345, 0.0023723248244507723],
        [-0.5545639235954066, -0.646591567761448, -0.09667484873855023],
        [-0.5088434432575808, 0.21183108005047624, 0.018994456183374208],
        [0.11339986048501592, -0.645034027233078, 0.48186972721358934],
        [0.8456834602744794, -0.7289762584033229, -0.18008808961086972],
        [-0.20031711038802053, 0.4558942291794332, -0.27878510028570114],
    ];
    stays_within_the_cones(5, &Friction::None, 0.0034368997534865078, &hips, 3).unwrap();
    let hips = [
        [0.309775242616974, 0.42316069711650844, -0.17861026249593323],
        [-0.7488447437231011, -0.13083806768349532, -0.5179117800450254],
        [-0.3114904797127342, 0.02434656749501718, 0.5403628748262085],
        [1.011650334904883, -0.07718628059096995, 0.38187479320778145],
        [0.6135070016592975, 0.5818999998659552, -0.49831709688647374],
        [0.9404344750880056, -0.02405789843097194, 0.5669309159821178],
        [-0.9622427727588251, -0.21485919280022975, -0.8037783652964577],
        [0.9836088953760258, -0.9653557254187631, 0.2509438233016362],
        [-0.18525134279403596, -0.7645445980581844, -0.7740921806105827],
        [0.20569810389881754, -0.46863747738552364, -0.6363206108127328],
        [0.39300789278738757, -0.18016794650218423, -1.0945993823821596],
    ];
    stays_within_the_cones(5, &Friction::None, 0.0034193461452351123, &hips, 48).unwrap();
}

/// A small ball in a pip of a die grows, and comes out over its rim: it hung 0.26 mm above that.
#[test]
fn a_ball_that_grows_out_of_a_pip_touches_all_that_holds_it() {
    let friction = Friction::CoulombViscous { mu: 1.9533421313515131, mu_v_s_per_m: 0.0 };
    let hips = [
        [0.2267257002119097, 0.5961561193500069, 0.7192335596609926],
        [0.37349809661616856, 0.0, 1.0816735319103299],
    ];
    stays_within_the_cones(4, &friction, 0.006934472582147894, &hips, 1).unwrap();
}

fn any_height_map() -> impl Strategy<Value = HeightMap> {
    let numbers = prop::array::uniform2(prop_oneof![0.01..10.0f64, Just(1e-300), Just(1e300), Just(5e-324)]);
    let scale = (prop::bool::ANY, numbers)
        .prop_map(|(is_size, n)| if is_size { PictureScale::Size(n) } else { PictureScale::Repeat(n) });
    let words = (prop::bool::ANY, prop::bool::ANY, prop::bool::ANY);
    let amplitude = prop_oneof![-2e-3..2e-3f64, -1.0..=1.0f64, Just(5e-324)];
    (scale, words, amplitude, 0.0..=1.0f64, 1..5usize, any::<u64>()).prop_map(
        |(scale, (is_along, is_clamped, is_inverted), amplitude_m, zero_level, side, seed)| {
            let map = HeightMap::new(pictures::rough(side, seed), amplitude_m, scale).unwrap();
            let map = map.with_zero_level(zero_level).unwrap();
            let map = if is_along { map.with_form(HeightForm::AlongForce) } else { map };
            let map = if is_clamped { map.with_border(Border::Clamp) } else { map };
            if is_inverted { map.inverted() } else { map }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn on_heights_contacts_never_pull_and_stay_within_their_cone(
        shape in any_shape(), friction in any_friction(), map in any_height_map(), damping in prop_oneof![Just(0.0), 0.0..20.0f64],
        turn in prop::array::uniform3(-3.0..3.0f64), seed: u64, step in -5.0..-1.0f64,
    ) {
        let X_WB = Isometry3::new(Vector3::new(0.01, -0.02, 0.03), Vector3::from(turn));
        let entity = pictures::with(Entity { X_WB, previous_X_WB: X_WB, damping_n_s_per_m: damping, ..entity(shape, friction.clone()) }, map);
        let mut finger = point_finger();
        let mut noise = Noise(seed);
        let mut hip = X_WB.translation.vector;
        for _ in 0..200 {
            hip += noise.vector(10f64.powf(step));
            let out = finger.step(std::slice::from_ref(&entity), &hip, DT);
            prop_assert!(out.force_on_user_W.iter().all(|x| x.is_finite()));
            let Some(contact) = finger.contact(0) else { continue };
            let normal_n = contact.force_on_user_W.dot(&contact.normal_W);
            let rounding = 1e-12 * contact.force_on_user_W.norm();
            prop_assert!(contact.normal_force_n >= 0.0 && normal_n >= -rounding, "{contact:?}");
            prop_assert!((contact.normal_W.norm() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn on_heights_every_finite_input_gives_a_finite_output(
        shape in any_shape(), friction in any_friction(), map in any_height_map(),
        hips in prop::collection::vec(prop::array::uniform3(any_size()), 1..20),
        shift in prop::array::uniform3(any_size()), k in any_size(), b in any_size(), dt in any_size(), r in 0.0..0.1f64,
    ) {
        let entity = Entity { stiffness_n_per_m: k, damping_n_s_per_m: b, ..entity(shape, friction) };
        let mut entity = pictures::with(entity, map);
        let mut finger = Finger::new(r, 2).unwrap();
        for hip in hips {
            let out = finger.step(&[entity.clone(), entity.clone()], &Vector3::from(hip), dt);
            prop_assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{out:?}");
            prop_assert!(out.god_object_W.iter().all(|x| x.is_finite()), "{out:?}");
            entity.move_to(Isometry3::translation(shift[0], shift[1], shift[2]));
        }
    }
}

/// Ordinary numbers, and those at which arithmetic ends.
fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -0.1..0.1f64,
        1 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO,
        1 => prop::sample::select(vec![f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -0.0, 1e154, 1e-160]),
    ]
}

#[test]
fn a_hip_that_is_not_finite_counts_as_lifted() {
    let entities = [table(Friction::coulomb(1.0).unwrap())];
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut finger = point_finger();
        let place = |x: f64| Vector3::new(x, -DEPTH, 0.0);
        finger.step(&entities, &place(0.0), DT);
        let out = finger.step(&entities, &Vector3::new(0.0, bad, 0.0), DT);
        assert_eq!(out.force_on_user_W, Vector3::zeros());
        assert_eq!(out.god_object_W, place(0.0), "the last finite HIP");
        assert_eq!((out.entity, out.friction), (None, ContactState::Free));
        assert_eq!(finger.contacts().count(), 0);
        let out = finger.step(&entities, &place(1e-3), DT);
        assert_eq!(out.god_object_W, Vector3::new(1e-3, 0.0, 0.0), "then it begins anew");
    }
}

#[test]
fn a_pose_that_is_not_finite_is_not_felt() {
    let mut entity = table(stiction());
    let mut finger = point_finger();
    entity.move_to(Isometry3::translation(0.0, f64::NAN, 0.0));
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    assert_eq!((out.entity, out.force_on_user_W), (None, Vector3::zeros()));
    entity.move_to(Isometry3::identity());
    let out = finger.step(std::slice::from_ref(&entity), &Vector3::new(0.0, -DEPTH, 0.0), DT);
    assert_eq!(out.force_on_user_W.y, K * DEPTH);
}

#[test]
fn entities_beyond_the_capacity_are_not_felt() {
    let mut finger = Finger::new(0.0, 1).unwrap();
    assert_eq!(finger.capacity(), 1);
    let far = Entity { X_WB: Isometry3::translation(0.0, -1.0, 0.0), ..table(stiction()) };
    assert_eq!(finger.step(&[far, table(stiction())], &Vector3::new(0.0, -DEPTH, 0.0), DT).entity, None);
    assert!(Finger::new(-1e-3, 1).is_err());
}

#[test]
fn forces_that_overflow_in_their_sum_become_zero() {
    let wall = Entity { stiffness_n_per_m: 1e308, ..table(Friction::None) };
    let hip = Vector3::new(0.0, -1.5, 0.0);
    assert_eq!(point_finger().step(std::slice::from_ref(&wall), &hip, DT).force_on_user_W.y, 1.5e308);
    assert_eq!(point_finger().step(&[wall.clone(), wall], &hip, DT).force_on_user_W, Vector3::zeros());
}

/// Begun in a pip of a die, where it has no room, and drawn through the whole die in the next tick, it grows on its way.
#[test]
fn a_ball_that_grows_touches_nothing_that_is_farther_than_its_radius() {
    let tree = trees::die();
    let entity = trees::touchable(&tree.tree, Friction::stiction(2.0341792900945452, 0.0).unwrap());
    let radius_m = 0.004990125675915328;
    let mut finger = Finger::new(radius_m, 1).unwrap().with_ramp_in(0.0).unwrap();
    for hip in [[0.5200594311765062, 0.5073963306613587, 0.8925603779487865], [0.0, -0.6856462348476833, 0.0]]
    {
        let at = Vector3::from(hip) * tree.size_m;
        let out = finger.step(std::slice::from_ref(&entity), &at, DT);
        let points = finger.touch_points(std::slice::from_ref(&entity), 0);
        assert!(!points.as_slice().is_empty());
        for point in points.as_slice() {
            let away_m = (point.point_W - out.god_object_W).norm();
            assert!(away_m <= radius_m * (1.0 + 1e-6), "{away_m} {out:?}");
        }
    }
}
