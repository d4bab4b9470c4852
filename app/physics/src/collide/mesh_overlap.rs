//! Regions that two coarse meshes have in common, and the way along which each is left soonest.
//!
//! Problem: of sharp meshes with hollows (angles, channels, gears) that are in each other, vertices and edges see ways out that
//! disagree, or see none: they lodged, or went through.
//! Model: surfaces that cross have closed loops in common, with a segment for each two triangles. When the two are moved, a
//! region's volume changes by the area, as a vector, of that part of the one's surface which is in the other; by Stokes' theorem
//! that is half the sum of `p x q` over the loop's segments. So it is that across both edges where edges cross, the face's normal
//! where a corner is behind it, and a mean of these where there is more. The two are as deep as the region is thick along that,
//! through a point within the loop; where there is none, as of a peg that presses floor and walls, it is no single place, and is
//! left out.
//! Frames: the mesh's frame M; normals from the mesh to the other one.
//! Limits: meshes of [`MOST_VERTICES`]; of more, vertices lie near each other. Of more triangles or segments than there is room for,
//! nothing is found.
//! Cost: one box against box for each two triangles that are near both.

use haptics::mesh::{Mesh, Sides};
use nalgebra::{Isometry3, Point3, Vector3};

use super::mesh::{About, Contact};
use super::mesh_found::Found;

/// A part of the space that is in both.
#[derive(Debug, Clone, Copy, Default)]
struct Region {
    normal_M: Vector3<f64>,
    /// Of the mesh, in the middle of the loop \[m\].
    on_mesh_M: Vector3<f64>,
    depth_m: f64,
    /// All of the loop is so near to that \[m\].
    radius_m: f64,
    /// One of the mesh's faces.
    face: u32,
}

/// A piece of a loop.
#[derive(Debug, Clone, Copy, Default)]
struct Segment {
    ends: [Vector3<f64>; 2],
    faces: [u32; 2],
    region: usize,
}

#[derive(Debug, Clone, Copy, Default)]
struct Triangle {
    corners: [Vector3<f64>; 3],
    /// The box around it.
    bounds: [Vector3<f64>; 2],
    normal: Vector3<f64>,
    offset_m: f64,
    number: u32,
}

/// Triangles of one that are near the other.
struct Triangles {
    all: [Triangle; MOST_TRIANGLES],
    count: usize,
}

/// Presses apart what is in both of two coarse meshes, where nothing does that yet.
pub(super) fn part(mesh: &Mesh, second: &Mesh, X_MO: &Isometry3<f64>, found: &mut Found) {
    let (regions, count) = regions(mesh, second, X_MO);
    for region in regions[..count].iter().filter(|region| region.depth_m > LITTLE_M) {
        let agrees = |contact: &Contact| {
            let is_there = (contact.on_mesh_M - region.on_mesh_M).norm() < region.depth_m + region.radius_m;
            is_there.then(|| contact.normal_M.dot(&region.normal_M))
        };
        let presses = |contact: &Contact| {
            contact.gap_m < -0.5 * region.depth_m && agrees(contact).is_some_and(|agrees| agrees > ALONG)
        };
        if !found.so_far().iter().any(presses) {
            let (at_M, about) = (region.on_mesh_M, About::Region(region.face));
            found.push_apart(Contact::new(about, at_M, region.normal_M, -region.depth_m.min(PARTED_M)));
        }
    }
}

/// The regions; none if there are too many of anything.
fn regions(mesh: &Mesh, second: &Mesh, X_MO: &Isometry3<f64>) -> ([Region; MOST_REGIONS], usize) {
    let mut found = ([Region::default(); MOST_REGIONS], 0);
    let is_coarse = |mesh: &Mesh| mesh.vertices().len() <= MOST_VERTICES && mesh.sides() == Sides::Solid;
    if !is_coarse(mesh) || !is_coarse(second) {
        return found;
    }
    let mut placed = [Vector3::zeros(); MOST_VERTICES];
    let vertices = &mut placed[..second.vertices().len()];
    vertices.iter_mut().zip(second.vertices()).for_each(|(at, own)| *at = (X_MO * Point3::from(*own)).coords);
    let [low, high] = mesh.bounds_B();
    let bounds = |points: &[Vector3<f64>]| {
        points.iter().fold([points[0]; 2], |[low, high], at| [low.inf(at), high.sup(at)])
    };
    let [other_low, other_high] = bounds(vertices);
    let both = [low.sup(&other_low), high.inf(&other_high)];
    let own = Triangles::of(mesh, mesh.vertices(), &both, |normal| *normal);
    let others = Triangles::of(second, vertices, &both, |normal| X_MO * normal);
    let (Some(own), Some(others)) = (own, others) else { return found };
    let mut segments = [Segment::default(); MOST_SEGMENTS];
    let mut count = 0;
    for a in own.as_slice() {
        for b in others.as_slice() {
            if let Some(ends) = a.crosses(b) {
                let Some(segment) = segments.get_mut(count) else { return found };
                *segment = Segment { ends, faces: [a.number, b.number], region: count };
                count += 1;
            }
        }
    }
    let segments = &mut segments[..count];
    join(segments, SAME * mesh.extent_m().max(second.extent_m()));
    for first in 0..count {
        if segments[first].region != first {
            continue;
        }
        if let (Some(place), Some(region)) =
            (found.0.get_mut(found.1), region(segments, first, mesh, second, X_MO))
        {
            *place = region;
            found.1 += 1;
        }
    }
    found
}

/// Gives those that hang together one number: that of the first of them.
fn join(segments: &mut [Segment], near_m: f64) {
    for at in 1..segments.len() {
        for before in 0..at {
            let (a, b) = (segments[at], segments[before]);
            let shares = a.faces[0] == b.faces[0] || a.faces[1] == b.faces[1];
            let touches =
                || a.ends.iter().any(|p| b.ends.iter().any(|q| (p - q).norm_squared() < near_m * near_m));
            if a.region != b.region && shares && touches() {
                let (from, to) = (a.region.max(b.region), a.region.min(b.region));
                segments[..=at].iter_mut().filter(|one| one.region == from).for_each(|one| one.region = to);
            }
        }
    }
}

fn region(
    segments: &[Segment],
    number: usize,
    mesh: &Mesh,
    second: &Mesh,
    X_MO: &Isometry3<f64>,
) -> Option<Region> {
    let own = || segments.iter().filter(|segment| segment.region == number);
    let count = own().count() as f64;
    let middle = own().flat_map(|segment| segment.ends).sum::<Vector3<f64>>() / (2.0 * count);
    let area: Vector3<f64> =
        own().map(|segment| (segment.ends[0] - middle).cross(&(segment.ends[1] - middle)) * 0.5).sum();
    let radius_m = own().flat_map(|segment| segment.ends).map(|at| (at - middle).norm()).fold(0.0, f64::max);
    // Of a loop that is not closed, or goes to and fro, it tells nothing.
    let normal_M = area.try_normalize(LEAST_AREA * radius_m * radius_m)?;
    let seen = |at: &Vector3<f64>| X_MO.inverse_transform_point(&Point3::from(*at)).coords;
    let is_in_both = |at: &Vector3<f64>| mesh.is_inside(at) && second.is_inside(&seen(at));
    // Into the region, on which side of the loop that is.
    let aside = |at: Vector3<f64>, into: [f64; 2]| into.map(|into| at + normal_M * (into * radius_m));
    let central = aside(middle, INTO).into_iter().find(is_in_both);
    let inside = central.or_else(|| {
        let far_from = |at: Vector3<f64>| {
            let ends = own().map(|segment| segment.ends[0]);
            ends.max_by(|a, b| (a - at).norm_squared().total_cmp(&(b - at).norm_squared())).unwrap_or(at)
        };
        let across =
            own().take(MOST_CHORDS).map(|segment| (segment.ends[0] + far_from(segment.ends[0])) * 0.5);
        aside(middle, FARTHER).into_iter().chain(across.flat_map(|at| aside(at, INTO))).find(is_in_both)
    })?;
    let far = normal_M * (2.0 * mesh.extent_m());
    let out_of_mesh = |at: &Vector3<f64>| Some(mesh.first_crossing(at, &(at + far))?.point_B);
    let out_of_second = |at: &Vector3<f64>| {
        let left = second.first_crossing(&seen(at), &seen(&(at - far)))?;
        Some((X_MO * Point3::from(left.point_B)).coords)
    };
    let on_mesh_M = out_of_mesh(&inside)?;
    let depth_m = normal_M.dot(&(on_mesh_M - out_of_second(&inside)?));
    if central.is_none() {
        // In a layer along several sides it leads along that.
        let halfway = on_mesh_M - normal_M * (0.5 * depth_m);
        let room_m = mesh.nearest(&halfway).distance_m.min(second.nearest(&seen(&halfway)).distance_m);
        if room_m * THIN < depth_m {
            return None;
        }
    }
    let face = own().map(|segment| segment.faces[0]).min()?;
    Some(Region { normal_M, on_mesh_M, depth_m, radius_m, face })
}

fn are_apart([low, high]: &[Vector3<f64>; 2], [other_low, other_high]: &[Vector3<f64>; 2]) -> bool {
    (0..3).any(|axis| low[axis] > other_high[axis] || high[axis] < other_low[axis])
}

impl Triangles {
    fn of(
        mesh: &Mesh,
        vertices: &[Vector3<f64>],
        [low, high]: &[Vector3<f64>; 2],
        turn: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    ) -> Option<Self> {
        let mut triangles = Self { all: [Triangle::default(); MOST_TRIANGLES], count: 0 };
        for (number, face) in mesh.faces().iter().enumerate() {
            let corners = face.vertices.map(|vertex| vertices[vertex as usize]);
            let [a, b, c] = &corners;
            let bounds = [a.inf(b).inf(c), a.sup(b).sup(c)];
            if are_apart(&bounds, &[*low, *high]) {
                continue;
            }
            let normal = turn(&face.normal_B);
            let offset_m = normal.dot(a);
            *triangles.all.get_mut(triangles.count)? =
                Triangle { corners, bounds, normal, offset_m, number: number as u32 };
            triangles.count += 1;
        }
        Some(triangles)
    }

    fn as_slice(&self) -> &[Triangle] {
        &self.all[..self.count]
    }
}

impl Triangle {
    fn heights_m(&self, other: &Self) -> [f64; 3] {
        other.corners.map(|corner| self.normal.dot(&corner) - self.offset_m)
    }

    /// The segment that two have in common, along `own normal x other normal`.
    fn crosses(&self, other: &Self) -> Option<[Vector3<f64>; 2]> {
        if are_apart(&self.bounds, &other.bounds) {
            return None;
        }
        let heights = [self.heights_m(other), other.heights_m(self)];
        let is_aside =
            |heights: &[f64; 3]| heights.iter().all(|at| *at > 0.0) || heights.iter().all(|at| *at <= 0.0);
        if heights.iter().any(is_aside) {
            return None;
        }
        let along = self.normal.cross(&other.normal);
        // Where each of them meets the line that their planes have in common.
        let parts = [(self, &heights[1]), (other, &heights[0])].map(|(triangle, heights)| {
            let mut ends = [(f64::INFINITY, Vector3::zeros()), (f64::NEG_INFINITY, Vector3::zeros())];
            for at in 0..3 {
                let next = (at + 1) % 3;
                let (from_m, to_m) = (heights[at], heights[next]);
                if (from_m > 0.0) == (to_m > 0.0) {
                    continue;
                }
                let point = triangle.corners[at]
                    + (triangle.corners[next] - triangle.corners[at]) * (from_m / (from_m - to_m));
                let place = along.dot(&point);
                if place < ends[0].0 {
                    ends[0] = (place, point);
                }
                if place > ends[1].0 {
                    ends[1] = (place, point);
                }
            }
            ends
        });
        let first = if parts[0][0].0 > parts[1][0].0 { parts[0][0] } else { parts[1][0] };
        let last = if parts[0][1].0 < parts[1][1].0 { parts[0][1] } else { parts[1][1] };
        (first.0 < last.0).then_some([first.1, last.1])
    }
}

/// A region counts as no deeper \[m\]: it may be found when it is deep at once, and nothing is to be thrown out of it.
const PARTED_M: f64 = 3e-4;
/// Less deep regions are left to what is found otherwise \[m\].
const LITTLE_M: f64 = 5e-5;
/// Cosine to a region's way out of what presses along it.
const ALONG: f64 = 0.6;
/// Of a mesh that is coarse.
const MOST_VERTICES: usize = 1024;
/// Of either, near the other.
const MOST_TRIANGLES: usize = 256;
const MOST_SEGMENTS: usize = 128;
const MOST_REGIONS: usize = 4;
/// Ends of segments of one loop are nearer to each other, in extents.
const SAME: f64 = 1e-9;
/// Of a loop's area, in squares of its radius.
const LEAST_AREA: f64 = 1e-3;
/// So far from a loop, in its radii, is within the region or beside it; and farther.
const INTO: [f64; 2] = [-0.01, 0.01];
const FARTHER: [f64; 2] = [-0.2, 0.2];
/// A region that is so many times as thick as a ball in it is a layer.
const THIN: f64 = 10.0;
/// Chords of a loop on which its inside is looked for.
const MOST_CHORDS: usize = 6;
