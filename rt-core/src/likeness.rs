//! The word that was probably meant, of those that a place knows.
//!
//! Model: few insertions, deletions, replacements and swaps of neighbours lead from what was written to what is known.

/// The nearest of these names, if it is near enough to be what was meant.
pub fn nearest<'n>(word: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let near = names.filter_map(|name| Some((name, likeness(word, name)?)));
    near.min_by_key(|(_, distance)| *distance).map(|(name, _)| name)
}

/// Edits from `word` to `known`, if they are few; a known word that begins with `word` counts
/// as near, because leaving off the unit (`stiffness` for `stiffness_n_per_m`) is the usual slip.
fn likeness(word: &str, known: &str) -> Option<usize> {
    if word.len() > LONGEST_GUESS_BYTES {
        return None;
    }
    let edits = edit_distance(word, known);
    let few = 1 + known.len().min(word.len()) / 4;
    if edits <= few {
        Some(edits)
    } else {
        let is_stem = word.len() >= SHORTEST_STEM_BYTES && known.starts_with(word);
        is_stem.then_some(few + 1)
    }
}

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment).
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before_last = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = vec![i + 1];
        for j in 0..b.len() {
            let replaced = last[j] + usize::from(a[i] != b[j]);
            let mut best = replaced.min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                best = best.min(before_last[j - 1] + 1);
            }
            row.push(best);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

/// No known word is near this length; the bound keeps a megabyte of nonsense cheap.
const LONGEST_GUESS_BYTES: usize = 64;
/// Shorter beginnings fit too many words.
const SHORTEST_STEM_BYTES: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_count_swaps_of_neighbours_once() {
        assert_eq!(edit_distance("raduis_m", "radius_m"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("same", "same"), 0);
    }

    #[test]
    fn the_nearest_is_named_if_it_is_near() {
        let names = || ["stiffness_n_per_m", "name", "mass_kg"].into_iter();
        assert_eq!(nearest("nmae", names()), Some("name"));
        assert_eq!(nearest("stiffness", names()), Some("stiffness_n_per_m"));
        assert_eq!(nearest("wobble", names()), None);
        assert_eq!(nearest(&"n".repeat(1 << 20), names()), None);
    }
}
