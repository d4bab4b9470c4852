//! Physical ranges of numbers, by the unit that a key's name ends in.
//!
//! Problem: `damping_n_s_per_m = 1e308` is a finite number, and whatever is computed of it is none: squares overflow,
//! iterations end nowhere.
//! Model: a key tells its unit (`mass_kg`, `velocity_m_s`). A number of a unit is refused beyond a bound that no scene on
//! Earth comes near: a thousand times a building, a bulldozer, a bullet. Numbers without a unit have no such bound.

/// A unit at the end of keys, and the largest size of its numbers; a unit that ends like a shorter one stands before it.
const UNITS: [(&str, f64); 21] = [
    ("_n_m_s_per_rad", 1e6),
    ("_n_m_per_rad", 1e9),
    ("_n_s_per_m", 1e6),
    ("_n_per_m", 1e9),
    ("_s_per_m", 1e6),
    ("_n_m", 1e6),
    ("_kg_m3", 1e6),
    ("_kg_m2", 1e12),
    ("_kg", 1e9),
    ("_rad_s", 1e6),
    ("_m_per_s2", 1e6),
    ("_m_s2", 1e6),
    ("_m_s", 1e6),
    ("_m2", 1e12),
    ("_m", 1e6),
    ("_hz", 1e9),
    ("_deg", 1e6),
    ("_n", 1e6),
    ("_j", 1e6),
    ("_w", 1e6),
    ("_s", 1e6),
];

/// The largest size that a number at this path, such as `entity[1].shape.size_m[0]`, may have.
pub(crate) fn most_at(path: &str) -> f64 {
    let key = path.rsplit('.').next().unwrap_or_default();
    let key = key.split_once('[').map_or(key, |(key, _)| key);
    UNITS.iter().find(|(unit, _)| key.ends_with(unit)).map_or(f64::INFINITY, |(_, most)| *most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_key_is_the_longest_that_it_ends_in() {
        for (path, most) in [
            ("entity[0].damping_n_s_per_m", 1e6),
            ("entity[0].shape.size_m[1]", 1e6),
            ("finger[1].soft.damping_n_m_s_per_rad", 1e6),
            ("entity[3].stiffness_n_per_m", 1e9),
            ("entity[3].friction.mu", f64::INFINITY),
            ("gravity_m_s2[1]", 1e6),
            ("", f64::INFINITY),
        ] {
            assert_eq!(most_at(path), most, "{path}");
        }
    }

    #[test]
    fn no_unit_hides_behind_a_shorter_one() {
        for (index, (unit, _)) in UNITS.iter().enumerate() {
            let shorter = UNITS[..index].iter().find(|(other, _)| unit.ends_with(other));
            assert_eq!(shorter, None, "{unit}");
        }
    }
}
