//! Sets of CPUs in the kernel's two notations: lists (`0-3,8`) and masks (`ff,00000003`).

use std::fmt::Write as _;

/// The set without one CPU.
#[must_use]
pub fn without(cpus: &[usize], cpu: usize) -> Vec<usize> {
    cpus.iter().copied().filter(|other| *other != cpu).collect()
}

/// As a list; `cpus` ascending.
#[must_use]
pub fn list_of(cpus: &[usize]) -> String {
    let mut list = String::new();
    for range in cpus.chunk_by(|a, b| a + 1 == *b) {
        let (first, last) = (range[0], range[range.len() - 1]);
        let comma = if list.is_empty() { "" } else { "," };
        // Writing to a string does not fail.
        let _ = match last - first {
            0 => write!(list, "{comma}{first}"),
            _ => write!(list, "{comma}{first}-{last}"),
        };
    }
    list
}

/// As a hexadecimal mask in groups of 32 CPUs.
#[must_use]
pub fn mask_of(cpus: &[usize]) -> String {
    let words = cpus.iter().max().map_or(1, |last| last / 32 + 1);
    let word = |index: usize| {
        cpus.iter().filter(|cpu| **cpu / 32 == index).fold(0_u32, |word, cpu| word | 1 << (cpu % 32))
    };
    let mut mask = format!("{:x}", word(words - 1));
    for index in (0..words - 1).rev() {
        let _ = write!(mask, ",{:08x}", word(index));
    }
    mask
}

/// The CPUs in a mask, ascending; none if it is not a mask.
#[must_use]
pub fn parse_mask(mask: &str) -> Option<Vec<usize>> {
    let mut cpus = Vec::new();
    let words: Vec<&str> = mask.trim().split(',').collect();
    for (index, word) in words.iter().rev().enumerate() {
        if word.is_empty() || word.len() > 8 || word.starts_with('+') {
            return None;
        }
        let bits = u32::from_str_radix(word, 16).ok()?;
        cpus.extend((0..32).filter(|bit| bits >> bit & 1 == 1).map(|bit| index * 32 + bit));
    }
    Some(cpus)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::parse_cpu_list;
    use proptest::prelude::*;

    #[test]
    fn lists_and_masks_are_written_as_the_kernel_writes_them() {
        assert_eq!(list_of(&[]), "");
        assert_eq!(list_of(&[0, 1, 2, 5, 7, 8]), "0-2,5,7-8");
        assert_eq!(mask_of(&[0, 1, 2]), "7");
        assert_eq!(mask_of(&[0, 33]), "2,00000001");
        assert_eq!(mask_of(&[]), "0");
    }

    #[test]
    fn what_is_no_mask_is_refused() {
        for garbage in ["", "x", "3,,1", "123456789", "+1", "-1", "0x3", "3 1"] {
            assert_eq!(parse_mask(garbage), None, "{garbage}");
        }
    }

    proptest! {
        #[test]
        fn both_notations_are_read_back_as_written(set in proptest::collection::btree_set(0..200_usize, 0..40)) {
            let cpus: Vec<usize> = set.into_iter().collect();
            prop_assert_eq!(parse_mask(&mask_of(&cpus)), Some(cpus.clone()));
            prop_assert_eq!(parse_cpu_list(&list_of(&cpus)), Some(cpus));
        }
    }
}
