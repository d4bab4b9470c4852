//! Many entities from one: `grid = { count = [10, 100, 10], spacing_m = [0.1, 0.05, 0.1] }`, a shelf.
//!
//! They are called `name_0_0_0` to `name_9_99_9`, by their places along x, y and z of the world; the first is where the
//! entity is, and all are turned alike. Each is an entity of its own; shapes and models are shared.

use nalgebra::Vector3;

use crate::error::SceneError;
use crate::reader::{Bound, Table};
use crate::vocabulary::Vocabulary;

/// The most entities of a scene.
pub const MAX_ENTITIES: usize = 100_000;

/// How many there are, and how far apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    count: [usize; 3],
    spacing_m: [f64; 3],
}

impl Grid {
    pub(crate) fn read(entity: &Table<'_>) -> Result<Option<Self>, SceneError> {
        let Some(value) = entity.get("grid") else { return Ok(None) };
        let table = value.table(EXAMPLE)?;
        table.check_keys(&KEYS)?;
        let count = table.require("count", COUNT)?;
        let items = count.items(COUNT)?;
        if items.len() != 3 {
            return Err(count.out_of_range(COUNT));
        }
        let mut grid = Self { count: [1; 3], spacing_m: [0.0; 3] };
        for (place, item) in grid.count.iter_mut().zip(&items) {
            *place = item.whole(1..=MAX_ENTITIES as u64)? as usize;
        }
        if grid.len() > MAX_ENTITIES {
            return Err(count.out_of_range(format!("at most {MAX_ENTITIES} entities in all")));
        }
        grid.spacing_m = table.require("spacing_m", SPACING)?.numbers_in(Bound::Any)?;
        Ok(Some(grid))
    }

    /// How many entities it makes.
    pub(crate) fn len(&self) -> usize {
        self.count.iter().fold(1, |product, count| product.saturating_mul(*count))
    }

    /// The places, x running fastest: how each is called after the name, and how far from the first (m).
    pub(crate) fn places(self) -> impl Iterator<Item = (String, Vector3<f64>)> {
        let [nx, ny, nz] = self.count;
        let places = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        places.map(move |[i, j, k]| {
            let steps = Vector3::new(i as f64, j as f64, k as f64);
            (format!("_{i}_{j}_{k}"), steps.component_mul(&Vector3::from(self.spacing_m)))
        })
    }
}

const EXAMPLE: &str = "a table such as { count = [10, 100, 10], spacing_m = [0.1, 0.05, 0.1] }";
const COUNT: &str = "an array of 3 whole numbers above 0, along x, y and z";
const SPACING: &str = "an array of 3 numbers, along x, y and z";
const KEYS: Vocabulary = Vocabulary { available: &["count", "spacing_m"], later: &[] };
