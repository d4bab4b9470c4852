//! How large a neighbourhood can be where more patches are near than it can list.

use super::near::MAX_NEAR;

/// The nearest nine, if there are as many: the ninth decides how large a neighbourhood can be.
pub(super) struct Crowd {
    /// Of those that are listed.
    heights_m: [f64; MAX_NEAR],
    /// Once there are too many.
    nearest: Option<[(f64, u16); MAX_NEAR + 1]>,
}

impl Crowd {
    pub(super) fn new() -> Self {
        Self { heights_m: [f64::INFINITY; MAX_NEAR], nearest: None }
    }

    /// Takes note of how far away the next one is that is listed.
    #[inline(always)]
    pub(super) fn listed(&mut self, place: usize, height_m: f64) {
        self.heights_m[place] = height_m;
    }

    pub(super) fn is_too_large(&self) -> bool {
        self.nearest.is_some()
    }

    /// Takes note of one more than can be listed.
    #[cold]
    #[inline(never)]
    pub(super) fn overflow(&mut self, listed: &[u16; MAX_NEAR], number: u16, height_m: f64) {
        let nearest = self.nearest.get_or_insert_with(|| {
            let mut nearest = [(f64::INFINITY, u16::MAX); MAX_NEAR + 1];
            for (&number, &height_m) in listed.iter().zip(&self.heights_m) {
                insert(&mut nearest, number, height_m);
            }
            nearest
        });
        insert(nearest, number, height_m);
    }

    /// How far away the ninth is (m).
    pub(super) fn ninth_m(&self) -> f64 {
        self.nearest.map_or(f64::INFINITY, |nearest| nearest[MAX_NEAR].0)
    }
}

/// Patches beyond the eighth are not listed, and may come twice.
fn insert(nearest: &mut [(f64, u16); MAX_NEAR + 1], number: u16, height_m: f64) {
    if nearest.iter().any(|&(_, known)| known == number) {
        return;
    }
    let mut newcomer = (height_m, number);
    for place in nearest {
        if newcomer.0 < place.0 {
            std::mem::swap(place, &mut newcomer);
        }
    }
}
