//! A finger's stay on an entity, along the way it goes there.

use super::recorded::RecordedFinger;
use nalgebra::Vector3;
use world::is_name;

/// From where a finger touches an entity first to where it does so last; between them it may be free.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Visit {
    pub(super) entity: String,
    /// How far the HIP has gone since the visit began (m).
    pub(super) way_m: Vec<f64>,
    /// On the user (N).
    pub(super) forces: Vec<Vector3<f64>>,
}

/// The finger's visits to all entities, in the order of their beginnings.
pub(super) fn visits(finger: Option<&RecordedFinger>) -> Vec<Visit> {
    let Some(finger) = finger else { return Vec::new() };
    let mut known: Vec<&String> = Vec::new();
    for entity in finger.entities.iter().filter(|entity| !entity.is_empty()) {
        if !known.contains(&entity) {
            known.push(entity);
        }
    }
    known.into_iter().filter_map(|entity| visit(finger, entity)).collect()
}

/// What the files of these visits are called: as the entity, if a scene may call something so. Another name comes from
/// another program and may be a path; its files are called `entity-N`, as nobody else is.
pub(super) fn file_stems(visits: &[Visit]) -> Vec<String> {
    let is_free = |made: &String| visits.iter().all(|visit| visit.entity != *made);
    let mut made = (1u64..).map(|number| format!("entity-{number}")).filter(is_free);
    let mut stem = |entity: &String| if is_name(entity) { Some(entity.clone()) } else { made.next() };
    // As many as there are visits, since numbers do not end.
    visits.iter().filter_map(|visit| stem(&visit.entity)).collect()
}

fn visit(finger: &RecordedFinger, entity: &String) -> Option<Visit> {
    let first = finger.entities.iter().position(|other| other == entity)?;
    let last = finger.entities.iter().rposition(|other| other == entity)?;
    let mut gone_m = 0.0;
    let way_m = (first..=last).map(|row| {
        if row > first {
            gone_m += (finger.hips[row] - finger.hips[row - 1]).norm();
        }
        gone_m
    });
    Some(Visit {
        entity: entity.clone(),
        way_m: way_m.collect(),
        forces: finger.forces[first..=last].to_vec(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_visit_lasts_from_the_first_touch_to_the_last_and_goes_along_the_hip() {
        let at = |x: f64| Vector3::new(x, 0.0, 0.0);
        let finger = RecordedFinger {
            name: "f0".into(),
            hips: [0.0, 1.0, 3.0, 2.0, 5.0].map(at).to_vec(),
            forces: [0.0, 10.0, 0.0, 20.0, 30.0].map(at).to_vec(),
            entities: ["", "ball", "", "ball", "box"].map(String::from).to_vec(),
        };
        let visits = visits(Some(&finger));
        assert_eq!(visits.iter().map(|visit| visit.entity.as_str()).collect::<Vec<_>>(), ["ball", "box"]);
        assert_eq!(visits[0].way_m, [0.0, 2.0, 3.0]);
        assert_eq!(visits[0].forces, [10.0, 0.0, 20.0].map(at));
        assert_eq!(visits[1].way_m, [0.0]);
    }
}
