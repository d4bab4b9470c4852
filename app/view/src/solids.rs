//! The triangles of a solid that is joined from others (CSG), with its sharp edges.

use crate::triangles::Triangles;
use haptics::Csg;
use nalgebra::Point3;

/// Looks of the solid; what of it reaches beyond its bounded parts is cut off there.
pub(crate) fn triangles(csg: &Csg) -> Triangles {
    let facets = csg.facets();
    Triangles {
        places: facets.places.into_iter().map(Point3::from).collect(),
        normals: facets.normals,
        corners: facets.triangles,
        uv: Vec::new(),
    }
}
