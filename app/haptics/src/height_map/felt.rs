//! Heights as they are felt from tick to tick: never steeper than [`HeightMap::STEEPEST`].
//!
//! Problem: a picture may have cliffs of centimetres from one texel to the next, and noise that no way of a hand explains.
//! Model: the height that is felt follows the picture as the finger goes, by [`HeightMap::STEEPEST`] of its way at most; the slope
//! follows by [`LEAN_PER_M`] of it. A touch begins with the picture's own; over a dent, where nothing is felt, it goes on.
//! Invariant: a picture that is nowhere steeper, and leans over more slowly, is felt as it is, to the bit.

use super::{Height, HeightMap};

/// Change of the slope by the way \[1/m\]: waves of 1 mm that are as steep as 0.8 lean over as fast.
const LEAN_PER_M: f64 = 5000.0;

/// Height that was felt in the last tick of a touch.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FeltHeight(Option<Height>);

/// Height that is felt now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) height: Height,
    /// Difference from the last tick \[m\]; in the first one, height or depth.
    pub(super) change_m: f64,
    /// Change of the slope.
    pub(super) lean: f64,
}

impl FeltHeight {
    /// The touch is over.
    pub(crate) fn reset(&mut self) {
        self.0 = None;
    }

    /// Goes on to what the picture says, in a tick in which the finger went so far \[m\].
    pub(super) fn follow(&mut self, picture: Height, way_m: f64) -> Step {
        let slope_B = picture.slope_B.cap_magnitude(HeightMap::STEEPEST);
        let Some(last) = self.0 else {
            let height = Height { slope_B, ..picture };
            self.0 = Some(height);
            return Step { height, change_m: height.h_m.abs(), lean: slope_B.norm() };
        };
        let (most_m, rise_m) = (HeightMap::STEEPEST * way_m, picture.h_m - last.h_m);
        let h_m = if rise_m.abs() <= most_m { picture.h_m } else { last.h_m + most_m.copysign(rise_m) };
        let over_B = slope_B - last.slope_B;
        let most = LEAN_PER_M * way_m;
        let leans = over_B.norm() > most;
        let slope_B = if leans { last.slope_B + over_B.normalize() * most } else { slope_B };
        let height = Height { h_m, slope_B };
        self.0 = Some(height);
        Step { height, change_m: (h_m - last.h_m).abs(), lean: over_B.norm().min(most) }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    fn height(h_m: f64, slope: f64) -> Height {
        Height { h_m, slope_B: Vector3::x() * slope }
    }

    #[test]
    fn a_gentle_picture_is_felt_as_it_is_and_a_cliff_as_a_slope_of_2() {
        let mut felt = FeltHeight::default();
        let at = |x_m: f64| height(1e-3 * (x_m * 1e3).sin(), (x_m * 1e3).cos());
        assert!(
            (0..500).all(
                |tick| felt.follow(at(1e-4 * f64::from(tick)), 1e-4).height == at(1e-4 * f64::from(tick))
            )
        );
        felt.reset();
        assert_eq!(felt.follow(height(0.0, 9.0), 1e-4).height, height(0.0, 2.0));
        // 10 mm and down again, within 5 mm of the finger's way each.
        for (goes_to_m, ticks) in [(0.01, 50), (0.0, 50)] {
            for tick in 1..=ticks {
                let step = felt.follow(height(goes_to_m, 0.0), 1e-4);
                let way_m = 2e-4 * f64::from(tick);
                let expected_m = if goes_to_m > 0.0 { way_m } else { 0.01 - way_m };
                assert!((step.height.h_m - expected_m).abs() < 1e-15 && (step.change_m - 2e-4).abs() < 1e-15);
            }
            assert_eq!(felt.follow(height(goes_to_m, 0.0), 0.0).change_m, 0.0, "it is there");
        }
    }

    #[test]
    fn a_slope_turns_over_by_the_way_however_long_that_takes() {
        let mut felt = FeltHeight::default();
        felt.follow(height(0.0, -50.0), 1e-4);
        let slopes = [2e-4, 0.0, 2e-4, 4e-4, 1e-4].map(|way_m| felt.follow(height(0.0, 50.0), way_m));
        assert_eq!(slopes.map(|step| step.height.slope_B.x), [-1.0, -1.0, 0.0, 2.0, 2.0]);
        assert_eq!(slopes.map(|step| step.lean), [1.0, 0.0, 1.0, 2.0, 0.0]);
    }
}
