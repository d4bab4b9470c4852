//! Where the fingers of one hand have their tips, so that each knows where its partners are.
//!
//! Model: each simulated device writes its own place and reads the others', all in the loop's thread; the words are
//! atomic only because devices are sent to that thread. A place that nobody wrote is nobody's.

#![allow(non_snake_case)] // Frames are capital letters: a point p_W is in the world.

use nalgebra::Vector3;
use shm_abi::MAX_DEVICES;
use std::sync::atomic::{AtomicU64, Ordering};

/// The tips of all devices, in W (m).
#[derive(Debug)]
pub struct TipBoard([[AtomicU64; 3]; MAX_DEVICES]);

impl Default for TipBoard {
    fn default() -> Self {
        Self(std::array::from_fn(|_| std::array::from_fn(|_| AtomicU64::new(f64::NAN.to_bits()))))
    }
}

impl TipBoard {
    /// The tip of the device in this place is here.
    pub fn tell(&self, place: usize, tip_W: Vector3<f64>) {
        let Some(words) = self.0.get(place) else { return };
        for (word, coordinate) in words.iter().zip(tip_W.iter()) {
            word.store(coordinate.to_bits(), Ordering::Relaxed);
        }
    }

    /// The middle of all the others; `None` if there is none.
    pub fn others(&self, place: usize) -> Option<Vector3<f64>> {
        let tips = self.0.iter().enumerate().filter(|(other, _)| *other != place);
        let tips = tips.map(|(_, words)| {
            Vector3::from_fn(|axis, _| f64::from_bits(words[axis].load(Ordering::Relaxed)))
        });
        let known = tips.filter(|tip| tip.iter().all(|c| c.is_finite()));
        let (sum, count) = known.fold((Vector3::zeros(), 0u32), |(sum, n), tip| (sum + tip, n + 1));
        (count > 0).then(|| sum / f64::from(count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_others_leaves_out_oneself_and_nobody() {
        let board = TipBoard::default();
        board.tell(0, Vector3::new(9.0, 9.0, 9.0));
        assert_eq!(board.others(0), None);
        board.tell(1, Vector3::new(1.0, 0.0, 2.0));
        board.tell(2, Vector3::new(3.0, 4.0, 0.0));
        assert_eq!(board.others(0), Some(Vector3::new(2.0, 2.0, 1.0)));
        board.tell(MAX_DEVICES, Vector3::zeros());
        assert_eq!(board.others(1), Some(Vector3::new(6.0, 6.5, 4.5)));
    }
}
