//! Balls around things, so that those near a place are found among thousands.
//!
//! Model: balls of about one size are sorted along x; of each size those whose x is near are asked.
//! Cost: of a place, a search in each size, and a look at what is as far along x.

use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Balls of numbered things.
#[derive(Debug, Default)]
pub(super) struct Whereabouts {
    endless: Vec<u32>,
    /// By powers of two of their radii, ascending along x.
    sizes: BTreeMap<i32, Vec<(u32, Vector3<f64>, f64)>>,
}

impl Whereabouts {
    /// Of things with their centres and radii (m); `None`: without an end.
    pub(super) fn of(things: impl Iterator<Item = (u32, Option<(Vector3<f64>, f64)>)>) -> Self {
        let mut made = Self::default();
        for (thing, ball) in things {
            match ball {
                Some((centre, radius_m)) => {
                    let size = radius_m.max(f64::MIN_POSITIVE).log2().ceil() as i32;
                    made.sizes.entry(size).or_default().push((thing, centre, radius_m));
                }
                None => made.endless.push(thing),
            }
        }
        made.sizes.values_mut().for_each(|balls| balls.sort_by(|a, b| a.1.x.total_cmp(&b.1.x)));
        made
    }

    /// Things whose balls are no farther from a place than this; ascending.
    pub(super) fn near(&self, place: &Vector3<f64>, within_m: f64) -> Vec<u32> {
        let mut near = self.endless.clone();
        for (size, balls) in &self.sizes {
            let reach_m = f64::from(*size).exp2() + within_m;
            let first = balls.partition_point(|(_, centre, _)| centre.x < place.x - reach_m);
            let beside = balls[first..].iter().take_while(|(_, centre, _)| centre.x <= place.x + reach_m);
            let is_near =
                |centre: &Vector3<f64>, radius_m: f64| (centre - place).norm() <= radius_m + within_m;
            near.extend(
                beside.filter(|(_, centre, radius_m)| is_near(centre, *radius_m)).map(|(thing, ..)| *thing),
            );
        }
        near.sort_unstable();
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_are_near_are_found_whatever_their_sizes() {
        let spread = |i: u32, step: f64| 2.0 * (f64::from(i) * step).fract() - 1.0;
        let ball = |i: u32| {
            let centre = Vector3::new(spread(i, 0.618_034), spread(i, 0.414_214), spread(i, 0.732_051));
            (!i.is_multiple_of(50)).then(|| (centre, 10f64.powi(-((i % 5) as i32)) * 0.5))
        };
        let all: Vec<_> = (0..500).map(|i| (i, ball(i))).collect();
        let whereabouts = Whereabouts::of(all.iter().copied());
        for i in 0..200 {
            let place = Vector3::new(spread(i, 0.31), spread(i, 0.77), spread(i, 0.53));
            let within_m = 0.01 * f64::from(i % 4);
            let is_near = |ball: &Option<(Vector3<f64>, f64)>| {
                ball.is_none_or(|(centre, radius_m)| (centre - place).norm() <= radius_m + within_m)
            };
            let expected: Vec<u32> = all.iter().filter(|(_, ball)| is_near(ball)).map(|(i, _)| *i).collect();
            assert_eq!(whereabouts.near(&place, within_m), expected, "{i}");
        }
    }
}
