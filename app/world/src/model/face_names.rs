//! Names of a model's faces: the objects, groups and materials that its file says they are of.

use std::collections::BTreeMap;

/// Names of each face of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaceNames {
    /// All that faces are called alike by.
    sets: Vec<Vec<String>>,
    numbers: BTreeMap<Vec<String>, u32>,
    /// Of each face, which set.
    of_face: Vec<u32>,
    /// Of all sets.
    bytes: usize,
    /// There were more names than are kept; the faces of the others have none.
    is_cut: bool,
}

/// Bytes that all names of a model may take: a million of fifty letters. A small file can repeat a long one as often as it likes.
const MOST_BYTES: usize = 1 << 26;
/// Bytes of a set beside its letters.
const OF_A_SET_BYTES: usize = 64;

impl FaceNames {
    /// The number of a set of names, of which empty ones are none.
    pub(super) fn set(&mut self, names: impl IntoIterator<Item = impl AsRef<str>>) -> u32 {
        let mut names: Vec<String> = names
            .into_iter()
            .map(|name| name.as_ref().trim().to_owned())
            .filter(|name| !name.is_empty())
            .collect();
        if let Some(known) = self.numbers.get(&names) {
            return *known;
        }
        let bytes = OF_A_SET_BYTES + names.iter().map(|name| OF_A_SET_BYTES + name.len()).sum::<usize>();
        if self.bytes + bytes > MOST_BYTES {
            self.is_cut = true;
            names.clear();
            if let Some(known) = self.numbers.get(&names) {
                return *known;
            }
        }
        self.bytes += bytes;
        let number = self.sets.len() as u32;
        self.sets.push(names.clone());
        self.numbers.insert(names, number);
        number
    }

    /// The next faces are called so.
    pub(super) fn add(&mut self, set: u32, faces: usize) {
        self.of_face.extend(std::iter::repeat_n(set, faces));
    }

    /// A face is called otherwise.
    pub(super) fn rename(&mut self, face: usize, set: u32) {
        if let Some(own) = self.of_face.get_mut(face) {
            *own = set;
        }
    }

    /// Names of a face.
    pub fn of(&self, face: usize) -> &[String] {
        self.of_face.get(face).and_then(|set| self.sets.get(*set as usize)).map_or(&[], Vec::as_slice)
    }

    /// Whether there were too many names to keep them all.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// All names, in alphabetical order, each with the number of faces that are called so.
    pub fn all(&self) -> BTreeMap<&str, usize> {
        self.of_faces(0..self.of_face.len())
    }

    /// All names, each with the number of these faces that are called so.
    pub fn of_faces(&self, those: impl Iterator<Item = usize>) -> BTreeMap<&str, usize> {
        let mut faces = vec![0_usize; self.sets.len()];
        those.filter_map(|face| self.of_face.get(face)).for_each(|set| faces[*set as usize] += 1);
        let mut all = BTreeMap::new();
        for (set, faces) in self.sets.iter().zip(faces) {
            let once: std::collections::BTreeSet<&str> = set.iter().map(String::as_str).collect();
            once.into_iter().for_each(|name| *all.entry(name).or_default() += faces);
        }
        all
    }

    /// Of each face the number of the first of these lists, from 1, that has one of its names; 0 if none has.
    pub fn labels<S: AsRef<[String]>>(&self, lists: &[S]) -> Vec<u16> {
        let label = |set: &Vec<String>| {
            let names = |list: &S| list.as_ref().iter().any(|name| set.contains(name));
            let found = lists.iter().position(names);
            found.map_or(0, |found| u16::try_from(found + 1).unwrap_or(0))
        };
        let of_sets: Vec<u16> = self.sets.iter().map(label).collect();
        self.of_face.iter().map(|set| of_sets[*set as usize]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_list_that_knows_a_name_of_a_face_labels_it() {
        let mut names = FaceNames::default();
        let sets = [
            names.set(["tyre", "rubber"]),
            names.set(["rim", " steel "]),
            names.set([""; 1]),
            names.set(["tyre", "rubber"]),
        ];
        assert_eq!(sets, [0, 1, 2, 0]);
        sets.into_iter().for_each(|set| names.add(set, 2));
        names.rename(7, 1);
        let lists = [vec!["steel".to_owned(), "iron".into()], vec!["tyre".into()], vec!["rubber".into()]];
        assert_eq!(names.labels(&lists), [2, 2, 1, 1, 0, 0, 2, 1]);
        let all: Vec<_> = names.all().into_iter().collect();
        assert_eq!(all, [("rim", 3), ("rubber", 3), ("steel", 3), ("tyre", 3)]);
    }

    #[test]
    fn names_without_end_are_cut_and_said_to_be() {
        let mut names = FaceNames::default();
        for number in 0..100_000 {
            let set = names.set([number.to_string(), "all".into()]);
            names.add(set, 1);
        }
        assert!(!names.is_cut() && names.all().len() == 100_001 && names.all()["all"] == 100_000);
        for number in 0..1000 {
            let set = names.set(["n".repeat(100_000), number.to_string()]);
            names.add(set, 1);
        }
        assert!(names.is_cut() && names.sets.len() < 101_000);
    }
}
