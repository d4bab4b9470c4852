//! What was found and repaired while a mesh was built.

use std::fmt;

use nalgebra::Vector3;

/// How often something was found, and where first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Finding {
    /// How often.
    pub count: usize,
    /// Index in the input of the first face or vertex concerned, from 0.
    pub first: Option<usize>,
}

impl Finding {
    /// Counts one more, at this index of the input.
    pub(super) fn note(&mut self, index: usize) {
        self.count += 1;
        self.first = Some(self.first.map_or(index, |first| first.min(index)));
    }
}

/// So many holes are told with their places.
pub(super) const TOLD: usize = 3;

/// Holes that stay open: loops of edges of one face each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OpenHoles {
    /// Number of them.
    pub count: usize,
    /// The largest few, the largest first.
    pub largest: [Option<OpenHole>; TOLD],
}

/// A hole that stays open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenHole {
    /// Diagonal of the box around its rim (m).
    pub size_m: f64,
    /// Mean of its rim's vertices (m).
    pub middle_B: [f64; 3],
}

impl fmt::Display for OpenHoles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, largest } = self;
        write!(f, "{count} {} open, the largest: ", plural(*count, "hole stays", "holes stay"))?;
        for (index, OpenHole { size_m, middle_B }) in largest.iter().flatten().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            // What is far below the hole's size is rounding.
            let [x, y, z] = middle_B.map(|x| if x.abs() < ROUNDING * size_m { 0.0 } else { short(x) });
            write!(f, "{comma}{} m at [{x}, {y}, {z}]", short(*size_m))?;
        }
        Ok(())
    }
}

/// Of a hole's size.
const ROUNDING: f64 = 1e-6;

/// Three digits that say something.
fn short(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

/// Faces of closed parts that lie beside other parts, without a gap or with one that no finger feels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NarrowGaps {
    /// Number of them.
    pub faces: usize,
    /// The widest such gap (m).
    pub widest_m: f64,
    /// The middle of one of them (m).
    pub first_B: Option<[f64; 3]>,
    /// Number of vertices of walls that were moved outward, so that the parts overlap.
    pub moved: usize,
    /// Bound on how far these walls were moved (m).
    pub moved_by_m: f64,
}

impl fmt::Display for NarrowGaps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { faces, widest_m, first_B, moved, moved_by_m } = self;
        let has = plural(*faces, "face lies", "faces lie");
        let widest = short(*widest_m);
        write!(f, "{faces} {has} beside another part, {widest} m away or less")?;
        if let Some(at) = first_B {
            let [x, y, z] = at.map(|x| if x.abs() < ROUNDING { 0.0 } else { short(x) });
            write!(f, " (one at [{x}, {y}, {z}])")?;
        }
        f.write_str(
            ": a point slides over such gaps; join the parts in the program that made them if they are one",
        )?;
        if *moved > 0 {
            let (vertices, by) = (plural(*moved, "vertex", "vertices"), short(*moved_by_m));
            write!(
                f,
                " ({moved} {vertices} of their walls moved outward by {by} m, so that the parts overlap)"
            )?;
        }
        Ok(())
    }
}

/// Rims of open parts that end a little before another part.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ShortRims {
    /// Number of edges.
    pub edges: usize,
    /// The widest gap (m).
    pub widest_m: f64,
    /// The middle of the edge with the widest gap (m).
    pub widest_B: [f64; 3],
}

impl ShortRims {
    /// Counts one more.
    pub(super) fn note(&mut self, gap_m: f64, middle_B: Vector3<f64>) {
        self.edges += 1;
        if gap_m > self.widest_m {
            (self.widest_m, self.widest_B) = (gap_m, middle_B.into());
        }
    }
}

impl fmt::Display for ShortRims {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.widest_B.map(|x| if x.abs() < ROUNDING { 0.0 } else { short(x) });
        write!(
            f,
            "{} {} before another part, up to {} m away (there at [{x}, {y}, {z}]): a finger that is smaller than such a gap gets \
             through; make both meet if they should",
            self.edges,
            plural(self.edges, "edge of an open rim ends", "edges of open rims end"),
            short(self.widest_m)
        )
    }
}

/// What a mesh is made of, and what had to be done to the input to make it.
///
/// Indices are those of the input, from 0: of faces, unless a field says vertices.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeshReport {
    /// Faces of the mesh.
    pub faces: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Parts that do not share an edge with one another.
    pub components: usize,
    /// Input vertices that were equal to an earlier one up to rounding, not to the bit, and were merged with it.
    pub welded_vertices: Finding,
    /// Input vertices that no face uses; left out.
    pub unused_vertices: Finding,
    /// Faces without an area; left out.
    pub degenerate: Finding,
    /// Faces divided, because a vertex of other faces lay on their edge.
    pub divided: Finding,
    /// Slivers that were folded over their neighbour, up to 10 um wide: another edge divides the two now, or the sliver is gone.
    pub unfolded: Finding,
    /// Faces with the same three vertices as an earlier one; left out.
    pub duplicate: Finding,
    /// Faces wound against most of their neighbours; turned over.
    pub flipped: Finding,
    /// Closed parts that were inside out as a whole; turned outward. The face is the first of the part.
    pub inside_out: Finding,
    /// Closed parts that face inward, as cavities do; left so.
    pub cavities: Finding,
    /// Edges along which parts touch, so that four or more faces share them; each face was joined to the next one
    /// across the outside.
    pub touching_edges: Finding,
    /// Other edges of three and more faces: two of the same piece were joined, or two that bound the same wedge of outside;
    /// what was left ends there.
    pub crowded_edges: Finding,
    /// Holes that were closed with a lid, so that the part is a solid. The face is one beside the hole.
    pub closed_holes: Finding,
    /// Parts that have no inside, since they are open or cannot be oriented. The face is the first of the part.
    pub sheets: Finding,
    /// Those of them that have a rim, or a stretch of one, which does not lie on other faces.
    pub open_parts: Finding,
    /// Those of them that have rims, all of which lie on other faces.
    pub sealed_parts: Finding,
    /// Those of them that have no rim, and cannot be oriented.
    pub rimless_parts: Finding,
    /// Edges where the mesh ends: the rim of an open mesh, or a crack.
    pub boundary_edges: Finding,
    /// Those of them that lie on other faces.
    pub sealed_edges: usize,
    /// Those of them that end a little before another part: by more than rounding, and by less than a hundredth of the extent.
    pub short_rims: ShortRims,
    /// Edges across which inside and outside change places: the mesh cannot be oriented.
    pub turned_edges: Finding,
    /// Faces of the mesh that others pass through.
    pub crossed: usize,
    /// [Radius](super::Mesh::point_radius_m) with which a point rolls over the mesh \[m\].
    pub point_radius_m: f64,
    /// Faces of the mesh that lie beside other parts.
    pub narrow_gaps: NarrowGaps,
    /// Rims of the mesh that are whole loops, with their sizes.
    pub open_holes: OpenHoles,
}

impl MeshReport {
    /// Whether the input was closed, wound consistently outward and free of defects.
    ///
    /// Merged vertices and cavities are no defects: STL has no other way to share a vertex, and hollow things exist.
    pub fn is_clean(&self) -> bool {
        let defects = [
            self.unused_vertices,
            self.degenerate,
            self.divided,
            self.unfolded,
            self.duplicate,
            self.flipped,
            self.inside_out,
            self.touching_edges,
            self.crowded_edges,
            self.closed_holes,
            self.boundary_edges,
            self.turned_edges,
        ];
        defects.iter().all(|finding| finding.count == 0)
    }
}

impl fmt::Display for MeshReport {
    /// One line for the mesh, one for each kind of finding.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { faces, vertices, components, .. } = self;
        write!(
            f,
            "{faces} faces, {vertices} vertices, {components} {}",
            plural(*components, "part", "parts")
        )?;
        let lines = [
            (self.welded_vertices, "vertex", "vertices", "equal to an earlier one up to rounding: merged"),
            (self.unused_vertices, "vertex", "vertices", "of no face: left out"),
            (self.degenerate, "face", "faces", "without an area: left out"),
            (self.divided, "face", "faces", "with a vertex on an edge: divided"),
            (self.unfolded, "sliver", "slivers", "folded over a neighbour: unfolded"),
            (self.duplicate, "face", "faces", "given before: left out"),
            (self.flipped, "face", "faces", "wound against the neighbours: turned over"),
            (self.inside_out, "part", "parts", "inside out: turned"),
            (self.cavities, "part", "parts", "facing inward: taken for a cavity"),
            (self.touching_edges, "edge", "edges", "along which parts touch: joined across the outside"),
            (
                self.crowded_edges,
                "edge",
                "edges",
                "of three or more faces: two and two joined, the others end there",
            ),
            (self.closed_holes, "hole", "holes", "closed with a lid"),
            (
                self.open_parts,
                "part",
                "parts",
                "not closed: felt from both sides; a finger that comes in by a rim is free within",
            ),
            (
                self.sealed_parts,
                "part",
                "parts",
                "not closed, all its rims on other faces: felt from both sides, as walls that end there",
            ),
            (
                self.rimless_parts,
                "part",
                "parts",
                "without a rim and without an outside: felt from both sides",
            ),
            (self.boundary_edges, "edge", "edges", "of one face only: an open rim or a crack"),
            (self.turned_edges, "edge", "edges", "where outside becomes inside: it cannot be oriented"),
        ];
        for (Finding { count, first }, one, many, what) in lines {
            let Some(first) = first else { continue };
            let of = if one == "vertex" { "vertex" } else { "face" };
            write!(f, "\n{count} {} {what} (first: {of} {first})", plural(count, one, many))?;
        }
        if self.crossed > 0 {
            let faces = plural(self.crossed, "face", "faces");
            write!(
                f,
                "\n{} {faces} that others cross or touch: felt as far as they are outside of what is closed",
                self.crossed
            )?;
        }
        if self.point_radius_m > 0.0 {
            write!(
                f,
                "\nopen parts that meet or cross, or folds that go through each other: a finger of radius 0 rolls over this mesh as a \
                 ball of {:.2e} m, since a point would slip between them",
                self.point_radius_m
            )?;
        }
        if self.narrow_gaps.faces > 0 {
            write!(f, "\n{}", self.narrow_gaps)?;
        }
        if self.short_rims.edges > 0 {
            write!(f, "\n{}", self.short_rims)?;
        }
        if self.open_holes.count > 0 {
            write!(f, "\n{}", self.open_holes)?;
            if self.boundary_edges.count == self.sealed_edges {
                f.write_str("; all rims lie on other faces")?;
            }
        }
        Ok(())
    }
}

pub(crate) fn plural(count: usize, one: &'static str, many: &'static str) -> &'static str {
    if count == 1 { one } else { many }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_has_a_line_for_each_kind_of_finding() {
        let mut report = MeshReport { faces: 12, vertices: 8, components: 1, ..MeshReport::default() };
        assert!(report.is_clean());
        assert_eq!(report.to_string(), "12 faces, 8 vertices, 1 part");
        report.degenerate.note(9);
        report.degenerate.note(4);
        report.welded_vertices.note(2);
        assert!(!report.is_clean());
        assert_eq!(
            report.to_string(),
            "12 faces, 8 vertices, 1 part\n\
             1 vertex equal to an earlier one up to rounding: merged (first: vertex 2)\n\
             2 faces without an area: left out (first: face 4)"
        );
    }
}
