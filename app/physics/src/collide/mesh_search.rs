//! Looks for all places where a mesh and another solid come near each other.
//!
//! Problem: a peg in a hole touches its floor and two of its walls, two interlocked arches touch wherever they do; to follow
//! one place finds none of the others.
//! Model: faces of the mesh are taken from its hierarchy by what may be as near to the other one as is asked, first those
//! that lie far from the planes of places that are known. From each, going to and fro between face and the other one finds
//! the nearest points of both. Of places with the same normal and plane one is enough: it finds its points itself.
//! A search finds more than touches, so it is right until the two have moved that much: at rest there is none.
//! In a tick it tries [`MOST_TRIED`] faces, farthest from known planes first, and goes on with the next ones in the ticks that follow:
//! with the same ones again, the other end of a bar of many sides that lay across a hollow was not found before it was deep.
//! Error: after [`MOST_TICKS`] more ticks it ends; and a wall that rises less than [`BAND_M`] over a known plane is not seen.
//! Frames: the mesh's frame M.

use haptics::Feature;
use haptics::mesh::{Mesh, Sides};
use nalgebra::{Isometry3, Vector3};

use super::mesh_other::Other;
use super::mesh_patch::{MAX_PATCHES, Patch, Patches, Searched};
use super::mesh_see::Seen;

/// Finds all places anew, if the two have moved since they were sought.
pub(super) fn look_around(
    mesh: &Mesh,
    other: &Other<'_>,
    reach_m: f64,
    travel_m: f64,
    patches: &mut Patches,
) {
    let is_known = |searched: &Searched| {
        searched.ticks == 0 && has_moved_m(searched, mesh, other) + reach_m <= searched.within_m
    };
    if patches.searched.as_ref().is_some_and(is_known) {
        return;
    }
    let within_m = reach_m + MARGIN_M + 4.0 * travel_m;
    let begins = Searched { X_MO: other.X_MO, within_m, is_crowded: false, ticks: 0, tried: 0 };
    let mut searched = patches.searched.filter(|searched| searched.ticks > 0).unwrap_or(begins);
    let mut places = Places::new(within_m, patches, &searched);
    let (_, radius_m) = other.ball();
    let is_convex = other.is_convex();
    let is_complete = mesh.for_each_face_in_boxes(
        &mut places,
        |places, middle_M, half_M| places.key(other, middle_M, half_M),
        |places, face| {
            if places.knows(mesh, face) {
                return true;
            }
            places.met = places.met.saturating_add(1);
            if places.met > searched.tried {
                places.tried += 1;
                let place = nearest_to(mesh, face, other, radius_m, within_m);
                let is_new = |place: &Place| places.is_better(place, is_convex) && place.is_nearest(mesh);
                if let Some(place) = place.filter(is_new) {
                    places.add(place, is_convex);
                }
            }
            places.tried < MOST_TRIED
        },
        MOST_VISITS * (1 + usize::from(searched.ticks)),
    );
    searched.is_crowded |= places.is_crowded || !is_complete;
    if !is_complete && !places.is_crowded && searched.ticks < MOST_TICKS && places.tried > 0 {
        (searched.ticks, searched.tried) = (searched.ticks + 1, searched.tried + places.tried);
    } else if is_complete && !places.is_crowded {
        (searched.ticks, searched.tried) = (0, 0);
    } else {
        let margin_m = if places.is_crowded { CROWDED_M } else { 0.5 * MARGIN_M };
        searched = Searched { within_m: reach_m + margin_m, is_crowded: true, ..begins };
    }
    patches.searched = Some(searched);
    places.settle(patches, is_convex);
}

/// How far any point of the smaller one is from where it was, seen from the larger one \[m\].
fn has_moved_m(searched: &Searched, mesh: &Mesh, other: &Other<'_>) -> f64 {
    let (was, now) = (&searched.X_MO, &other.X_MO);
    let [low_M, high_M] = mesh.bounds_B();
    let (middle_M, own_m) = ((low_M + high_M) * 0.5, 0.5 * (high_M - low_M).norm());
    let (centre_M, radius_m) = other.ball();
    let turned = 2.0 * (2.0 - 2.0 * was.rotation.coords.dot(&now.rotation.coords).abs().min(1.0)).sqrt();
    if own_m < radius_m {
        let at = |pose: &Isometry3<f64>| pose.inverse_transform_point(&middle_M.into());
        return (at(was) - at(now)).norm() + turned * own_m;
    }
    let was_M = was * now.inverse_transform_point(&centre_M.into());
    (centre_M - was_M.coords).norm() + turned * radius_m
}

#[derive(Clone, Copy, Default)]
struct Place {
    normal_M: Vector3<f64>,
    at_M: Vector3<f64>,
    gap_m: f64,
    /// On an edge of a face.
    is_edge: bool,
    /// It is pressed, and has this number.
    number: Option<usize>,
}

impl Place {
    /// Of an edge, only if no other face is nearer.
    fn is_nearest(&self, mesh: &Mesh) -> bool {
        if !self.is_edge || self.gap_m <= 0.0 {
            return true;
        }
        let across_M = self.at_M + self.normal_M * self.gap_m;
        mesh.nearest(&across_M).distance_m >= self.gap_m * (1.0 - ROUNDING)
    }

    fn is_same(&self, other: &Self, is_convex: bool) -> bool {
        let (normal_M, at_M, depth_m) = (self.normal_M, self.at_M, (-self.gap_m).max(0.0));
        Patch { normal_M, at_M, depth_m, ..Patch::default() }.is_same(&other.normal_M, &other.at_M, is_convex)
    }
}

struct Places {
    all: [Place; MAX_PATCHES],
    count: usize,
    within_m: f64,
    /// So deep is the deepest of those that press \[m\].
    deepest_m: f64,
    /// Faces that were met in this search in no plane of a known place, and those of them that were tried.
    met: u16,
    tried: u16,
    /// There are more than it has room for.
    is_crowded: bool,
}

impl Places {
    /// Those that are pressed, and the first one; of a search that goes on, all that it has found.
    fn new(within_m: f64, patches: &Patches, searched: &Searched) -> Self {
        let mut places = Self {
            all: [Place::default(); MAX_PATCHES],
            count: 0,
            within_m,
            deepest_m: 0.0,
            met: 0,
            tried: 0,
            is_crowded: false,
        };
        for (number, patch) in patches.all.iter().enumerate() {
            if number == 0 || patch.is_pressed() || searched.ticks > 0 && patch.is_known {
                let Patch { normal_M, at_M, depth_m, .. } = *patch;
                places.all[places.count] =
                    Place { normal_M, at_M, gap_m: -depth_m, is_edge: false, number: Some(number) };
                places.count += 1;
                places.deepest_m = places.deepest_m.max(depth_m);
            }
        }
        places
    }

    fn as_slice(&self) -> &[Place] {
        &self.all[..self.count]
    }

    /// Whether anything in a box may be a place that is not known: how far it is from the known ones, times -1.
    fn key(&self, other: &Other<'_>, middle_M: &Vector3<f64>, half_M: &Vector3<f64>) -> Option<f64> {
        let room_m = half_M.norm() + self.within_m + self.deepest_m;
        if !other.may_be_near(middle_M, room_m) {
            return None;
        }
        let mut least_m = f64::INFINITY;
        for place in self.as_slice() {
            let off_m = place.normal_M.dot(&(middle_M - place.at_M)).abs();
            if off_m + place.normal_M.abs().dot(half_M) < BAND_M + self.deepest_m {
                return None;
            }
            least_m = least_m.min(off_m);
        }
        Some(-least_m.min(1e9))
    }

    /// Whether a face lies in the plane of a known place.
    fn knows(&self, mesh: &Mesh, face: u32) -> bool {
        let face = &mesh.faces()[face as usize];
        let corner_M = mesh.vertices()[face.vertices[0] as usize];
        let sheet = mesh.sides() == Sides::Sheet;
        self.as_slice().iter().any(|place| {
            let agrees = place.normal_M.dot(&face.normal_B);
            let agrees = if sheet { agrees.abs() } else { agrees };
            agrees > PARALLEL && place.normal_M.dot(&(corner_M - place.at_M)).abs() < BAND_M + self.deepest_m
        })
    }

    /// Whether it is none of those that are known, or nearer.
    fn is_better(&self, place: &Place, is_convex: bool) -> bool {
        let same = self.as_slice().iter().find(|one| one.is_same(place, is_convex));
        same.is_none_or(|same| same.number.is_none() && place.gap_m < same.gap_m)
    }

    /// Adds one that is better; without room, in the place of the farthest one, if that is not pressed.
    fn add(&mut self, place: Place, is_convex: bool) {
        let same = self.all[..self.count].iter_mut().find(|one| one.is_same(&place, is_convex));
        if let Some(same) = same {
            *same = place;
            return;
        }
        if let Some(free) = self.all.get_mut(self.count) {
            *free = place;
            self.count += 1;
            return;
        }
        self.is_crowded = true;
        let free = self.all.iter_mut().filter(|one| one.number.is_none());
        let farthest = free.max_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        if let Some(farthest) = farthest.filter(|farthest| place.gap_m < farthest.gap_m) {
            *farthest = place;
        }
    }

    /// Gives those that were found numbers: those that they had.
    fn settle(&self, patches: &mut Patches, is_convex: bool) {
        let mut is_taken = [false; MAX_PATCHES];
        self.as_slice().iter().filter_map(|place| place.number).for_each(|number| is_taken[number] = true);
        let was = patches.all.map(|patch| patch.is_known);
        (1..MAX_PATCHES).filter(|&at| !is_taken[at]).for_each(|at| patches.all[at].is_known = false);
        for again in [true, false] {
            for place in self.as_slice().iter().filter(|place| place.number.is_none()) {
                if patches.all.iter().enumerate().any(|(at, patch)| {
                    at > 0 && patch.is_known && patch.is_same(&place.normal_M, &place.at_M, is_convex)
                }) {
                    continue;
                }
                let fits = |at: &usize| {
                    !is_taken[*at]
                        && (!again
                            || was[*at] && patches.all[*at].is_same(&place.normal_M, &place.at_M, is_convex))
                };
                let Some(at) = (1..MAX_PATCHES).find(fits) else { continue };
                is_taken[at] = true;
                let Patch { stands, carried, .. } = if again { patches.all[at] } else { Patch::default() };
                let (normal_M, at_M) = (place.normal_M, place.at_M);
                let depth_m = (-place.gap_m).max(0.0);
                patches.all[at] = Patch { normal_M, at_M, depth_m, stands, carried, is_known: true };
            }
        }
    }
}

/// The nearest points of a face and the other one, if they are near enough and look at each other.
fn nearest_to(mesh: &Mesh, number: u32, other: &Other<'_>, radius_m: f64, within_m: f64) -> Option<Place> {
    let face = &mesh.faces()[number as usize];
    let corners = face.vertices.map(|vertex| mesh.vertices()[vertex as usize]);
    let middle_M = (corners[0] + corners[1] + corners[2]) / 3.0;
    let (centre_M, _) = other.ball();
    // Of a large one, the part that is near the other one.
    let is_large = (corners[1] - corners[0]).norm() + (corners[2] - corners[0]).norm() > radius_m;
    let mut at_M = if is_large { mesh.nearest_of_face(number, &centre_M).0 } else { middle_M };
    let mut feature = Feature::Face;
    for _ in 0..TO_AND_FRO {
        let seen = other.see(&at_M, &-face.normal_B, 0.0);
        (at_M, feature) = mesh.nearest_of_face(number, &(at_M - seen.out * seen.gap_m));
    }
    let seen = other.see(&at_M, &-face.normal_B, 0.0);
    let side = if mesh.sides() == Sides::Sheet && face.normal_B.dot(&seen.out) > 0.0 { -1.0 } else { 1.0 };
    let of_face_M = face.normal_B * side;
    let faces = -of_face_M.dot(&seen.out);
    if seen.gap_m > within_m || seen.gap_m < -DEEP_M || faces < FACES {
        return None;
    }
    if other.is_sheet() && seen.gap_m < 0.0 && !has_come_through(mesh, &at_M, &seen) {
        return None;
    }
    if feature == Feature::Face {
        return Some(Place { normal_M: of_face_M, at_M, gap_m: seen.gap_m, ..Place::default() });
    }
    Some(Place { normal_M: -seen.out, at_M, gap_m: seen.gap_m, is_edge: true, number: None })
}

/// True for a point of a mesh that has come through a sheet: all from it to the sheet, and as far beyond, is inside of the
/// mesh. Else another side of the mesh is nearer to the sheet, which has no inside that could tell.
fn has_come_through(mesh: &Mesh, at_M: &Vector3<f64>, seen: &Seen) -> bool {
    let way_M = seen.out * -seen.gap_m;
    let [beyond_M, behind_M] = [2.0, LITTLE].map(|share| at_M + way_M * share);
    mesh.is_inside(&beyond_M) && mesh.first_hit(&beyond_M, &behind_M).is_none()
}

/// So much farther than reach is sought \[m\]: so far may two move until the next search.
const MARGIN_M: f64 = 1e-3;
/// And where not all could be kept, or looked at.
const CROWDED_M: f64 = 1e-4;
/// What lies so near to the plane of a known place is found there \[m\].
const BAND_M: f64 = 2.5e-4;
/// Cosine between normals of what is one plane but for its curvature.
const PARALLEL: f64 = 0.98;
/// Deeper than this is another side of the other one \[m\].
const DEEP_M: f64 = 2e-3;
/// Cosine between what looks at each other.
const FACES: f64 = 0.1;
const ROUNDING: f64 = 1e-6;
/// Of a way, off its ends.
const LITTLE: f64 = 1e-2;
/// Turns between a face and the other one.
const TO_AND_FRO: usize = 3;
/// Nodes and runs of the hierarchy that are looked at, in the first tick; in those that follow as many more.
const MOST_VISITS: usize = 192;
/// Faces from which it is gone to and fro in a tick.
const MOST_TRIED: u16 = 128;
/// Ticks in which a search goes on.
const MOST_TICKS: u8 = 8;
