//! Rims of meshes: where a finger gets behind what it should not.
//!
//! Model: every edge of a felt mesh that has a face on one side only is drawn as a thin tube, so that people see where a scan
//! is open.

use crate::stage::Thing;
use crate::triangles::Triangles;
use haptics::mesh::Mesh;
use haptics::{Entity, Shape};
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;
use world::SceneEntity;

/// Orange.
const COLOUR: [f64; 4] = [0.95, 0.45, 0.0, 1.0];
/// Of a tube, as a part of the mesh's size.
const RADIUS: f64 = 1.0 / 150.0;
/// Sides of a tube.
const SIDES: u32 = 5;
/// A cloud of single triangles has as many edges as one likes.
const MOST_EDGES: usize = 20_000;

/// The rims of all meshes that are felt and seen; those of one mesh are made once.
pub(crate) fn all(specs: &[SceneEntity], entities: &[Entity]) -> Vec<Thing> {
    let mut made: Vec<(*const Mesh, Option<Arc<Triangles>>)> = Vec::new();
    let mut rims = Vec::new();
    for (index, (spec, entity)) in specs.iter().zip(entities).enumerate() {
        let Shape::Mesh(mesh) = &entity.shape else { continue };
        if !entity.is_haptic || spec.visuals.is_empty() {
            continue;
        }
        let of: *const Mesh = &raw const **mesh;
        let known = made.iter().find(|(known, _)| *known == of).map(|(_, triangles)| triangles.clone());
        let triangles = known.unwrap_or_else(|| {
            let triangles = tubes(mesh).map(Arc::new);
            made.push((of, triangles.clone()));
            triangles
        });
        rims.extend(triangles.map(|triangles| Thing {
            entity: index,
            triangles,
            pose: Isometry3::identity(),
            colour: COLOUR,
            is_coloured: true,
            texture: None,
            casts_shadow: false,
            space: entity.space,
        }));
    }
    rims
}

/// `None`: it is closed.
fn tubes(mesh: &Mesh) -> Option<Triangles> {
    let edges = mesh.faces().iter().flat_map(|face| {
        (0..3).filter(|edge| face.links[*edge].is_boundary()).map(|edge| {
            let ends = [edge, (edge + 1) % 3].map(|corner| face.vertices[corner] as usize);
            ends.map(|vertex| mesh.vertices()[vertex])
        })
    });
    let mut made = Triangles::default();
    let radius_m = RADIUS * mesh.extent_m();
    edges.take(MOST_EDGES).for_each(|ends| add_tube(&mut made, ends, radius_m));
    (!made.corners.is_empty()).then_some(made)
}

fn add_tube(made: &mut Triangles, [from, to]: [Vector3<f64>; 2], radius_m: f64) {
    let Some(along) = (to - from).try_normalize(f64::MIN_POSITIVE) else { return };
    // Whichever axis is farther from it.
    let aside = if along.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let across = along.cross(&aside).normalize();
    let over = along.cross(&across);
    let first = made.places.len() as u32;
    for side in 0..SIDES {
        let (sin, cos) = (TAU * f64::from(side) / f64::from(SIDES)).sin_cos();
        let out = across * cos + over * sin;
        for end in [from, to] {
            made.places.push(Point3::from(end + out * radius_m));
            made.normals.push(out);
        }
    }
    for side in 0..SIDES {
        let [a, b] = [side, (side + 1) % SIDES].map(|side| first + 2 * side);
        made.corners.push([a, b, b + 1]);
        made.corners.push([a, b + 1, a + 1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptics::mesh::make;

    /// A box without its top.
    fn open_box() -> Mesh {
        let mut soup = make::cuboid([0.1; 3]);
        let is_top = |face: &[u32; 3]| face.iter().all(|v| soup.vertices[*v as usize].y > 0.0);
        soup.faces = soup.faces.iter().filter(|face| !is_top(face)).copied().collect();
        Mesh::build_closing(soup, haptics::mesh::CloseHoles::UpTo(0.0)).unwrap().0
    }

    #[test]
    fn rims_of_an_open_box_are_the_four_edges_of_its_open_side() {
        let open = tubes(&open_box()).expect("rims");
        assert_eq!(open.corners.len() as u32, 4 * 2 * SIDES);
        let radius_m = RADIUS * 0.05;
        for (place, normal) in open.places.iter().zip(&open.normals) {
            let on_edge = place - normal * radius_m;
            assert!((on_edge.y - 0.05).abs() < 1e-12, "{place}");
            assert!((on_edge.x.abs() - 0.05).abs() < 1e-12 && (on_edge.z.abs() - 0.05).abs() < 1e-12);
        }
        // Seen from outside they turn to the left.
        for corners in &open.corners {
            let [a, b, c] = corners.map(|corner| open.places[corner as usize]);
            let outward: Vector3<f64> = corners.iter().map(|corner| open.normals[*corner as usize]).sum();
            assert!((b - a).cross(&(c - a)).dot(&outward) > 0.0);
        }
        assert!(tubes(&Mesh::build(make::cuboid([0.1; 3])).unwrap().0).is_none());
    }
}
