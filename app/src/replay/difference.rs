//! How two plays of the same fingers differ.
//!
//! Model: tick by tick, for each finger its force, god-object and words, for each object its place; sizes as root mean
//! square and maximum. *Same* means the same bits in everything that rendering computed; what a device was then made to
//! render is no part of it.

use crate::columns::Names;
use crate::row::{BodyRow, FingerRow, Row};
use io_driver::device::run_time_s;
use nalgebra::Vector3;
use std::fmt;

/// A difference of vectors over ticks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Size {
    squares: f64,
    most: f64,
}

impl Size {
    fn add(&mut self, difference: f64) {
        self.squares += difference * difference;
        self.most = self.most.max(difference);
    }

    fn rms(&self, ticks: u64) -> f64 {
        (self.squares / ticks.max(1) as f64).sqrt()
    }
}

/// Of one finger.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct FingerDifference {
    name: String,
    force: Size,
    god_object: Size,
    /// The recorded force itself, to compare with.
    recorded_force: Size,
    entity: u64,
    feature: u64,
    friction: u64,
    first: Option<u64>,
}

/// Of one object.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ObjectDifference {
    name: String,
    position: Size,
    first: Option<u64>,
}

/// Of a run.
#[derive(Debug, Clone, Default)]
pub(super) struct Difference {
    /// Which finger of the recording each finger of the scene is.
    fingers: Vec<(usize, FingerDifference)>,
    /// Which object of the recording and of the scene.
    objects: Vec<(usize, usize, ObjectDifference)>,
    ticks: u64,
    period_ns: u64,
    /// Names that are in one of both only.
    unmatched: Vec<String>,
    /// Number of rows, in words, if not all were to be compared.
    of_rows: Option<String>,
}

impl Difference {
    /// Nothing was compared yet. `fingers`: which of the recording each of the scene is.
    pub(super) fn new(fingers: &[Option<usize>], recorded: &Names, played: &Names, period_ns: u64) -> Self {
        let pair = |(index, finger): (&Option<usize>, &String)| {
            let name = finger.clone();
            index.map(|index| (index, FingerDifference { name, ..FingerDifference::default() }))
        };
        let object = |(index, name): (usize, &String)| {
            let of_scene = played.bodies.iter().position(|other| other == name)?;
            Some((index, of_scene, ObjectDifference { name: name.clone(), ..ObjectDifference::default() }))
        };
        let not_played = |index: &usize| !fingers.contains(&Some(*index));
        let lone = recorded.fingers.iter().enumerate().filter(|(index, _)| not_played(index));
        let lone = lone.map(|(_, name)| format!("finger {name} is not in the scene"));
        let rests = fingers.iter().zip(&played.fingers).filter(|(index, _)| index.is_none());
        let rests = rests.map(|(_, name)| format!("finger {name} is not in the recording and rests"));
        let missing = |here: &[String], there: &[String], where_: &str| {
            let lone = here.iter().filter(|name| !there.contains(name));
            lone.map(|name| format!("object {name} is not in the {where_}")).collect::<Vec<_>>()
        };
        let objects = missing(&recorded.bodies, &played.bodies, "scene").into_iter().chain(missing(
            &played.bodies,
            &recorded.bodies,
            "recording",
        ));
        Self {
            fingers: fingers.iter().zip(&played.fingers).filter_map(pair).collect(),
            objects: recorded.bodies.iter().enumerate().filter_map(object).collect(),
            ticks: 0,
            period_ns,
            unmatched: lone.chain(rests).chain(objects).collect(),
            of_rows: None,
        }
    }

    /// It ended before its time: so many rows there were to compare, in words.
    pub(super) fn end_before(&mut self, of_rows: String) {
        self.of_rows = Some(of_rows);
    }

    /// Compares a tick. `scene_fingers` has the fingers of the scene that are in both, in their order.
    pub(super) fn add(
        &mut self,
        recorded: (&Row, &[BodyRow], &Names),
        played: (&Row, &[BodyRow], &Names),
        fingers: &[Option<usize>],
    ) {
        self.ticks += 1;
        let run_tick = recorded.0.run_tick;
        let in_both = fingers.iter().enumerate().filter(|(_, index)| index.is_some());
        for ((of_scene, _), (of_recording, difference)) in in_both.zip(&mut self.fingers) {
            let before = (&recorded.0.fingers[*of_recording], *of_recording, recorded.2);
            let now = (&played.0.fingers[of_scene], of_scene, played.2);
            difference.add(run_tick, before, now);
        }
        for (before, now, difference) in &mut self.objects {
            difference.add(run_tick, &recorded.1[*before], &played.1[*now]);
        }
    }

    /// Whether nothing differs, to the bit.
    pub(super) fn is_none(&self) -> bool {
        self.unmatched.is_empty()
            && self.fingers.iter().all(|(_, finger)| finger.first.is_none())
            && self.objects.iter().all(|(.., object)| object.first.is_none())
    }

    /// How many ticks were compared.
    pub(super) fn ticks(&self) -> u64 {
        self.ticks
    }
}

impl FingerDifference {
    fn add(&mut self, run_tick: u64, before: (&FingerRow, usize, &Names), now: (&FingerRow, usize, &Names)) {
        let ((a, index_a, names_a), (b, index_b, names_b)) = (before, now);
        self.force.add((b.force_on_user - a.force_on_user).norm());
        self.recorded_force.add(a.force_on_user.norm());
        self.god_object.add((b.god_object - a.god_object).norm());
        let words = [
            (&mut self.entity, names_a.entity(a.entity) != names_b.entity(b.entity)),
            (&mut self.feature, a.feature != b.feature),
            (&mut self.friction, a.friction != b.friction),
        ];
        let mut differs = false;
        for (count, is_other) in words {
            *count += u64::from(is_other);
            differs |= is_other;
        }
        differs |= bits(&a.force_on_user) != bits(&b.force_on_user);
        differs |= bits(&a.god_object) != bits(&b.god_object) || bits(&a.hip) != bits(&b.hip);
        if names_a.has_torque(index_a) && names_b.has_torque(index_b) {
            differs |= bits(&a.torque_on_user) != bits(&b.torque_on_user);
        }
        if names_a.ties(index_a) && names_b.ties(index_b) {
            differs |= names_a.entity(a.attached) != names_b.entity(b.attached);
        }
        if differs {
            self.first.get_or_insert(run_tick);
        }
    }
}

impl ObjectDifference {
    fn add(&mut self, run_tick: u64, a: &BodyRow, b: &BodyRow) {
        self.position.add((b.position - a.position).norm());
        let vectors =
            |body: &BodyRow| [body.position, body.velocity, body.angular_velocity].map(|v| bits(&v));
        let turned = |body: &BodyRow| <[f64; 4]>::from(body.orientation.coords).map(f64::to_bits);
        if vectors(a) != vectors(b) || turned(a) != turned(b) {
            self.first.get_or_insert(run_tick);
        }
    }
}

fn bits(vector: &Vector3<f64>) -> [u64; 3] {
    [vector.x, vector.y, vector.z].map(f64::to_bits)
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let first = |tick: Option<u64>| {
            tick.map_or_else(
                || "none".into(),
                |tick| format!("{} s", run_time_s(tick.cast_signed(), self.period_ns)),
            )
        };
        writeln!(
            f,
            "{:<12} {:>12} {:>12} {:>12} {:>12} {:>12} {:>8} {:>8} {:>8}  first tick that differs",
            "finger",
            "recorded N",
            "force N",
            "most N",
            "god-obj. m",
            "most m",
            "entity",
            "feature",
            "friction"
        )?;
        for (_, finger) in &self.fingers {
            writeln!(
                f,
                "{:<12} {:>12.6} {:>12.3e} {:>12.3e} {:>12.3e} {:>12.3e} {:>8} {:>8} {:>8}  {}",
                finger.name,
                finger.recorded_force.rms(self.ticks),
                finger.force.rms(self.ticks),
                finger.force.most,
                finger.god_object.rms(self.ticks),
                finger.god_object.most,
                finger.entity,
                finger.feature,
                finger.friction,
                first(finger.first)
            )?;
        }
        if !self.objects.is_empty() {
            writeln!(f, "{:<12} {:>12} {:>12}  first tick that differs", "object", "place m", "most m")?;
        }
        for (.., object) in &self.objects {
            let position = object.position;
            let (rms, most) = (position.rms(self.ticks), position.most);
            writeln!(f, "{:<12} {rms:>12.3e} {most:>12.3e}  {}", object.name, first(object.first))?;
        }
        for line in &self.unmatched {
            writeln!(f, "{line}")?;
        }
        if self.ticks == 0 {
            return write!(f, "nothing was compared");
        }
        write!(f, "{}", if self.is_none() { "identical" } else { "different" })?;
        if let Some(of_rows) = &self.of_rows {
            write!(f, " so far ({} of {of_rows} rows)", self.ticks)?;
        }
        write!(
            f,
            ": {}",
            if self.is_none() {
                "every number is the same to the bit"
            } else {
                "root mean squares and maxima above; of words, the ticks in which they differ"
            }
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::ContactState;

    #[test]
    fn a_last_bit_is_a_difference_and_sizes_are_those_of_the_vectors() {
        let names = Names { fingers: vec!["f0".into()], ..Names::default() };
        let fingers = [Some(0)];
        let mut difference = Difference::new(&fingers, &names, &names, 1_000_000);
        let row = |run_tick, force: f64, friction| {
            let mut row = Row { run_tick, ..Row::empty() };
            (row.fingers[0].force_on_user.x, row.fingers[0].friction) = (force, friction);
            row
        };
        let (stick, slip) = (ContactState::Stick, ContactState::Slip);
        let mut add = |before: Row, now: Row| {
            difference.add((&before, &[], &names), (&now, &[], &names), &fingers);
            difference.clone()
        };
        assert!(add(row(0, 1.0, stick), row(0, 1.0, stick)).is_none());
        let last_bit = add(row(1, 1.0, stick), row(1, 1.0 + f64::EPSILON, stick));
        assert!(!last_bit.is_none());
        assert_eq!(last_bit.fingers[0].1.first, Some(1));
        add(row(2, 1.0, stick), row(2, 4.0, slip));
        let last = add(row(3, 1.0, stick), row(3, 5.0, stick));
        let finger = &last.fingers[0].1;
        // The squares of 0, an epsilon, 3 and 4 over four ticks.
        assert_eq!((finger.force.rms(4), finger.force.most), (2.5, 4.0));
        assert_eq!((finger.friction, finger.entity, finger.first), (1, 0, Some(1)));
    }

    #[test]
    fn nothing_is_called_identical_that_was_not_compared() {
        let names = Names { fingers: vec!["f0".into()], ..Names::default() };
        let mut difference = Difference::new(&[Some(0)], &names, &names, 1_000_000);
        let end = |difference: &Difference| difference.to_string().lines().last().map(str::to_owned);
        assert_eq!(end(&difference).as_deref(), Some("nothing was compared"));
        let row = Row { run_tick: 0, ..Row::empty() };
        difference.add((&row, &[], &names), (&row, &[], &names), &[Some(0)]);
        let whole = "identical: every number is the same to the bit";
        assert_eq!(end(&difference).as_deref(), Some(whole));
        difference.end_before("more than 70".into());
        let part = "identical so far (1 of more than 70 rows): every number is the same to the bit";
        assert_eq!(end(&difference).as_deref(), Some(part));
    }

    #[test]
    fn what_is_in_one_of_both_only_is_a_difference() {
        let names = |fingers: &[&str], bodies: &[&str]| Names {
            fingers: fingers.iter().map(|name| (*name).into()).collect(),
            bodies: bodies.iter().map(|name| (*name).into()).collect(),
            ..Names::default()
        };
        let (before, now) = (names(&["a", "b"], &["cube"]), names(&["a", "c"], &[]));
        let difference = Difference::new(&[Some(0), None], &before, &now, 1_000_000);
        assert!(!difference.is_none());
        assert_eq!(difference.unmatched.len(), 3, "{:?}", difference.unmatched);
    }
}
