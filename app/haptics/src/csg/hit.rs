//! Where a path crosses the solid's boundary.
//!
//! Model: a path starts on known sides of the patches nearby. In the order in which it crosses them its sides change one by one,
//! and where the table says solid after free, it has entered the solid: whatever thin part it may leave again. A path
//! longer than a neighbourhood is followed from one to the next.
//!
//! Invariant: a path whose ends lie on different sides of a patch crosses it, whatever rounding says in between.
//! Cost: for each piece a neighbourhood that is found soon, one level for each patch nearby, another of those within
//! reach, and one search for each crossing; bounded by [`MAX_PIECES`].

use nalgebra::Vector3;

use super::Csg;
use super::near::{MAX_NEAR, Neighbourhood, Sides};

/// Where a path entered the solid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub(super) point_B: Vector3<f64>,
    pub(super) near: Neighbourhood,
    /// Free.
    pub(super) sides: Sides,
    /// The patch that it crossed.
    pub(super) patch: Sides,
}

/// The crossings of a path, in order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Events {
    events: [(f64, usize); MAX_EVENTS],
    count: usize,
}

/// Eight patches, each crossed twice; a path through more rings than two is followed in parts.
const MAX_EVENTS: usize = 24;
/// Neighbourhoods that a path is followed through within one tick.
const MAX_PIECES: u32 = 256;

/// Where a path first enters the solid, beginning `sides` in `near`.
pub(super) fn first_hit(
    csg: &Csg,
    near: &Neighbourhood,
    sides: Sides,
    from_B: &Vector3<f64>,
    to_B: &Vector3<f64>,
) -> Option<Hit> {
    let (mut near, mut sides, mut from_B) = (*near, sides, *from_B);
    for _ in 0..MAX_PIECES {
        let path_B = to_B - from_B;
        let length_m = path_B.norm();
        let before = near;
        let is_left = !near.holds(&from_B, length_m.min(0.25 * near.radius_m));
        if is_left {
            // Through a crowd it is followed in pieces as small as the last one.
            let wish_m = (LARGER * length_m).min(GROWTH * near.radius_m.max(COMMON * csg.extent_m));
            near = Neighbourhood::amid(csg, &from_B, wish_m);
        }
        let levels_m = near.levels_m(csg, &from_B);
        if is_left {
            sides = near.sides_known(csg, &levels_m, &before, sides);
        }
        let room_m = near.room_m(&from_B);
        let is_last = length_m <= room_m;
        let end_B = if is_last { *to_B } else { from_B + path_B * (room_m / length_m) };
        let events = Events::between(csg, &near, &levels_m, sides, 0, &from_B, &end_B);
        if let Some(hit) = events.first_hit(&near, &mut sides, &from_B, &end_B) {
            return Some(hit);
        }
        if is_last || length_m.is_nan() {
            return None;
        }
        from_B = end_B;
    }
    None
}

impl Events {
    /// The crossings of all patches but those in `skip`.
    #[inline]
    pub(super) fn along(
        csg: &Csg,
        near: &Neighbourhood,
        sides: Sides,
        skip: Sides,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
    ) -> Self {
        Self::between(csg, near, &near.levels_m(csg, from_B), sides, skip, from_B, to_B)
    }

    /// The same, of a path that begins at these levels.
    #[inline]
    fn between(
        csg: &Csg,
        near: &Neighbourhood,
        levels_m: &[f64; MAX_NEAR],
        sides: Sides,
        skip: Sides,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
    ) -> Self {
        let mut events = Self { events: [(0.0, 0); MAX_EVENTS], count: 0 };
        let length_m = (to_B - from_B).norm();
        for index in (0..near.count()).filter(|index| skip >> index & 1 == 0) {
            let before = levels_m[index];
            if before.abs() > length_m + csg.tolerance_m() {
                // Levels are no steeper than one.
                continue;
            }
            let patch = near.patch(csg, index);
            let after = patch.level(to_B);
            let starts_inside = sides >> index & 1 == 1;
            let beyond_m = if starts_inside { after } else { -after };
            // Who starts on a patch has left it when rounding can no longer have done it.
            let starts_on_it = before.abs() <= csg.tolerance_m();
            let crosses = if starts_on_it { beyond_m > csg.tolerance_m() } else { beyond_m >= 0.0 };
            let may_dip =
                !crosses && !patch.is_plane() && !starts_on_it && before.abs() + after.abs() <= length_m;
            if crosses || may_dip {
                let crossings = patch.crossings(from_B, to_B, [starts_inside, starts_inside != crosses]);
                crossings.shares().iter().for_each(|&share| events.push(share, index));
            }
        }
        events
    }

    /// The first of them that leads into the solid; `sides` follows.
    fn first_hit(
        &self,
        near: &Neighbourhood,
        sides: &mut Sides,
        from_B: &Vector3<f64>,
        to_B: &Vector3<f64>,
    ) -> Option<Hit> {
        for (share, index) in self.iter() {
            let was_free = !near.is_solid(*sides);
            let before = *sides;
            *sides ^= 1 << index;
            if was_free && near.is_solid(*sides) {
                let point_B = from_B + (to_B - from_B) * share;
                return Some(Hit { point_B, near: *near, sides: before, patch: 1 << index });
            }
        }
        None
    }

    fn push(&mut self, share: f64, index: usize) {
        if self.count == MAX_EVENTS {
            return;
        }
        let mut at = self.count;
        while at > 0 && self.events[at - 1].0 > share {
            self.events[at] = self.events[at - 1];
            at -= 1;
        }
        self.events[at] = (share, index);
        self.count += 1;
    }

    /// Where a patch is crossed for the last time, if it is crossed twice: the path ends on the side that it began on.
    pub(super) fn left_again(&self, index: usize) -> Option<f64> {
        let mut shares = self.iter().filter(|(_, crossed)| *crossed == index).map(|(share, _)| share);
        let (_, second, third) = (shares.next()?, shares.next()?, shares.next());
        if third.is_some() { None } else { Some(second) }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (f64, usize)> {
        self.events[..self.count].iter().copied()
    }
}

impl Neighbourhood {
    /// The sides of a point that had some in a neighbourhood before: on a patch it keeps them.
    pub(super) fn sides_after(
        &self,
        csg: &Csg,
        point_B: &Vector3<f64>,
        before: &Self,
        sides: Sides,
    ) -> Sides {
        self.sides_known(csg, &self.levels_m(csg, point_B), before, sides)
    }

    /// The same, of a point with these levels.
    fn sides_known(&self, csg: &Csg, levels_m: &[f64; MAX_NEAR], before: &Self, sides: Sides) -> Sides {
        (0..self.count()).fold(0, |here, index| {
            let level = levels_m[index];
            let is_on = level.abs() <= csg.tolerance_m();
            let known = before.position(self.number(index)).filter(|_| is_on);
            let is_inside = known.map_or(level <= 0.0, |place| sides >> place & 1 == 1);
            here | usize::from(is_inside) << index
        })
    }
}

/// A neighbourhood is asked for this much larger than the path.
const LARGER: f64 = 1.5;
/// The next neighbourhood of a path is asked for this much larger than the last one: a long way through the open takes
/// few of them.
const GROWTH: f64 = 4.0;
/// Radius of a common neighbourhood, in terms of the extent.
const COMMON: f64 = 0.02;
