//! The bristle model through a finger, with a single bond: that bond is the gap itself.
//!
//! It is stretched as the HIP moves and by nothing else, until it is longer than `3/2 mu N / k`; then a new one forms
//! somewhere between, evenly spread. On a ball the load falls while the bond is turned, and the circle with it.

use super::ground::{Drawn, GROUNDS, Ground};
use crate::common::Noise;
use haptics::{ContactState, Friction};

const MU: f64 = 0.3;

#[test]
fn a_bond_is_stretched_by_the_fingers_way_alone_until_it_snaps_to_somewhere_between() {
    let friction = Friction::bristle(MU, 1, 11).unwrap();
    for ground in GROUNDS {
        let mut drawn = Drawn::begin(ground, &friction, 1e-3);
        let (mut s, mut god, mut snaps, mut backward) = (0.0_f64, 0.0, Vec::new(), 0);
        let (mut noise, mut speed_m_s) = (Noise(9), 0.05);
        for tick in 0..6000 {
            // Turns and stops every 40 ticks or so.
            if noise.uniform() < 0.025 {
                speed_m_s = [0.05, -0.05, 0.0, 0.2, -0.2][(5.0 * noise.uniform()) as usize];
            }
            // Not beyond the triangles.
            speed_m_s = if s.abs() > 0.04 { -0.05 * s.signum() } else { speed_m_s };
            s += speed_m_s * 1e-3;
            let stretched_m = ground.gap_m(s, god);
            let snap_m = 1.5 * MU * ground.load_m(s, god);
            let felt = drawn.to(s);
            let name = format!("{ground:?}, tick {tick}: {felt:?}, stretched to {stretched_m}");
            if stretched_m.abs() <= snap_m {
                assert_eq!(felt.state, ContactState::Stick, "{name}");
                assert!((felt.god_m - god).abs() < 1e-16, "{name}");
                assert!((felt.spring_m - stretched_m).abs() < 1e-14, "{name}");
            } else {
                assert_eq!(felt.state, ContactState::Slip, "{name}");
                let share = felt.spring_m / (1.5 * MU * ground.load_m(s, felt.god_m));
                assert!((0.0..1.0).contains(&(share * stretched_m.signum())), "{name}");
                backward += u32::from(stretched_m < 0.0);
                snaps.push(share.abs());
            }
            god = felt.god_m;
        }
        let (count, mean) = (snaps.len() as f64, snaps.iter().sum::<f64>() / snaps.len() as f64);
        assert!(count > 80.0 && backward > 20, "{ground:?}: {count} snaps, {backward} of them backward");
        // Of evenly spread numbers 1/2, with 0.29 / sqrt(n): four times that. On a ball the share is of the load after it.
        assert!((mean - 0.5).abs() < 4.0 * 0.29 / count.sqrt(), "{ground:?}: {mean} of {count}");
        let spread = snaps.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / count;
        assert!((spread.sqrt() - 0.29).abs() < 0.06, "{ground:?}: spread {spread}");
    }
}

#[test]
fn after_a_reversal_bonds_are_a_spring_for_the_length_of_one() {
    // All are stretched forwards, so none snaps before the HIP has come back by the whole length of a bond.
    let friction = Friction::bristle(MU, 12, 5).unwrap();
    for ground in [Ground::Plane, Ground::Triangles] {
        let mut drawn = Drawn::begin(ground, &friction, 1e-3);
        let out = (1..400).map(|tick| 5e-5 * f64::from(tick));
        let turned = out.map(|s| (s, drawn.to(s))).last().expect("ticks");
        let length_m = 1.5 * MU * crate::common::DEPTH;
        let ticks = (length_m / 5e-5).floor();
        for tick in 1..=ticks as i32 {
            let back_m = 5e-5 * f64::from(tick);
            let felt = drawn.to(turned.0 - back_m);
            let is_spring = (felt.spring_m - (turned.1.spring_m - back_m)).abs() < 1e-14;
            assert!(
                is_spring && felt.state == ContactState::Stick,
                "{ground:?}, tick {tick}: {felt:?}, {turned:?}"
            );
        }
    }
}
