//! The list of entities: which of them are shown, and what touches them.

use crate::news::Status;
use crate::stage::{Known, Stage};
use std::borrow::Cow;
use std::collections::HashMap;

/// Those whose names have all words of a filter, whatever their case. Remembers what it found.
#[derive(Debug, Default)]
pub struct Filtered {
    words: String,
    /// Of how many.
    of: usize,
    found: Option<Vec<usize>>,
}

impl Filtered {
    /// Their numbers, in the order of the scene.
    pub fn of(&mut self, known: &[Known], words: &str) -> &[usize] {
        if self.words != words || self.of != known.len() {
            self.found = None;
        }
        self.found.get_or_insert_with(|| {
            (self.words, self.of) = (words.into(), known.len());
            let words: Vec<String> = words.split_whitespace().map(str::to_lowercase).collect();
            let matches = |known: &Known| {
                let name = known.name.to_lowercase();
                words.iter().all(|word| name.contains(word))
            };
            (0..known.len()).filter(|&number| matches(&known[number])).collect()
        })
    }
}

/// Who touches whom, by entity.
#[derive(Debug, Default)]
pub struct Contacts {
    fingers: HashMap<usize, Vec<usize>>,
    others: HashMap<usize, Vec<usize>>,
}

impl Contacts {
    /// As a run tells.
    pub fn new(status: &Status) -> Self {
        let mut contacts = Self::default();
        for (finger, felt) in status.felt.iter().enumerate() {
            for entity in felt {
                contacts.fingers.entry(*entity).or_default().push(finger);
            }
        }
        for [a, b] in &status.touching {
            contacts.others.entry(*a).or_default().push(*b);
            contacts.others.entry(*b).or_default().push(*a);
        }
        contacts
    }

    /// The fingers that touch an entity.
    pub fn fingers(&self, entity: usize) -> &[usize] {
        self.fingers.get(&entity).map_or(&[], Vec::as_slice)
    }

    /// The names of the other entities that do.
    pub fn others<'s>(&self, entity: usize, stage: &'s Stage) -> impl Iterator<Item = &'s str> {
        let others = self.others.get(&entity).map_or(&[][..], Vec::as_slice);
        others.iter().filter_map(|other| stage.known.get(*other)).map(|known| known.name.as_str())
    }
}

/// The list that has an entity, and how long ago that stood where it is shown, if that is longer than nobody sees.
pub fn list(known: &Known, entity: usize, status: &Status) -> Cow<'static, str> {
    match (known.mass, status.slow_ms.get(entity).copied().flatten()) {
        (None, _) => "fixed".into(),
        (Some(_), Some(ms)) if ms >= SEEN_MS => format!("slow, -{ms} ms").into(),
        (Some(_), Some(_)) => "slow".into(),
        (Some(_), None) => "fast".into(),
    }
}

/// Age below which a place is as good as new (ms): a frame of a display.
const SEEN_MS: u64 = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use world::{FrictionSpec, MassSpec};

    fn known(name: &str) -> Known {
        Known {
            name: name.into(),
            kind: "box",
            mass: None,
            stiffness_n_per_m: 1.0,
            damping_n_s_per_m: 0.0,
            friction: FrictionSpec::None,
            is_felt: true,
        }
    }

    #[test]
    fn a_filter_s_words_may_stand_anywhere_in_a_name() {
        let all = ["red-cube", "Blue-Cube", "table", "red-ball"].map(known);
        let mut filtered = Filtered::default();
        assert_eq!(filtered.of(&all, ""), [0, 1, 2, 3]);
        assert_eq!(filtered.of(&all, "CUBE"), [0, 1]);
        assert_eq!(filtered.of(&all, " cube red "), [0]);
        assert!(filtered.of(&all, "cubes").is_empty());
        assert!(filtered.of(&all[..1], "cubes").is_empty());
        assert_eq!(filtered.of(&all[1..], "ball"), [2], "another scene");
    }

    #[test]
    fn who_touches_an_entity_is_told_from_both_sides() {
        let stage = Stage { known: ["table", "cube", "ball"].map(known).into(), ..Stage::default() };
        let status =
            Status { felt: vec![vec![1], vec![1, 2]], touching: vec![[1, 0], [2, 0]], ..Status::default() };
        let contacts = Contacts::new(&status);
        assert_eq!([0, 1, 2].map(|entity| contacts.fingers(entity).to_vec()), [vec![], vec![0, 1], vec![1]]);
        let others = |entity| contacts.others(entity, &stage).collect::<Vec<_>>();
        assert_eq!((others(0), others(1), others(2)), (vec!["cube", "ball"], vec!["table"], vec!["table"]));
    }

    #[test]
    fn what_has_no_mass_is_in_no_list() {
        let moves = Known { mass: Some(MassSpec::Mass(0.1)), ..known("cube") };
        let slow_ms = vec![None, Some(15), Some(0), Some(16)];
        let status = Status { slow_ms, ..Status::default() };
        let lists = [(&moves, 0), (&moves, 1), (&known("table"), 2), (&moves, 3)];
        let told = lists.map(|(known, number)| list(known, number, &status));
        assert_eq!(told, ["fast", "slow", "fixed", "slow, -16 ms"]);
        assert_eq!(list(&moves, 5, &Status::default()), "fast");
    }
}
