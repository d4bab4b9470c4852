//! Where a path crosses a surface.

/// Where a path crosses a patch, in shares of the path, in order.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Crossings {
    shares: [f64; MAX_CROSSINGS],
    count: usize,
}

impl Crossings {
    pub(super) fn push(&mut self, share: f64) {
        if let Some(place) = self.shares.get_mut(self.count) {
            *place = share.clamp(0.0, 1.0);
            self.count += 1;
        }
    }

    pub(crate) fn shares(&self) -> &[f64] {
        &self.shares[..self.count]
    }
}

/// A line meets a ring four times at the most.
const MAX_CROSSINGS: usize = 4;
