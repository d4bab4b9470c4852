//! A mesh and another solid, a closed form or a mesh: where either presses on the other.
//!
//! Model: about where they meet there is a plane; what of the mesh lies low over it from one side and of the other one from
//! the other side may touch. That is: vertices of the mesh, chosen as those on a plane are ([`mesh_span`](super::mesh_span)),
//! against the other one's surface; points of the other one (corners, points of rims, ends of axes, vertices) against the
//! mesh; and where an outline of the one is cut off by the other, the places where it is. Each counts with its own normal and
//! gap, which are exact; the plane chooses only. It is that of the last tick's contact points; where there were none, it is
//! found by going to and fro between the two. In a hole or around a corner there are several planes
//! ([`mesh_patch`](super::mesh_patch)), each with its points ([`mesh_search`](super::mesh_search) finds them).
//! A vertex in the middle of a flat face presses nothing that the other one's corners do not: it is left out. Of two meshes so
//! is one that no edge sticks out at, be it the one's or the other's: a floor's vertex below the slanted side of a prism
//! would be as deep as it is far from the edge that stands there, and come and go with micrometres.
//! Frames: the mesh's frame M; normals from the mesh to the other one.
//! Of all that is found, what [carries](super::mesh_carry) counts.
//! Two convex ones meet in one place, whose plane is that along which they touch ([`mesh_convex`](super::mesh_convex)). Coarse ones
//! that are in each other all the same are parted ([`mesh_overlap`](super::mesh_overlap)).
//! Limits: six places a pair. Crossings are found of a box's edges, of the lines along which cylinders, cones and capsules
//! touch, and of sharp or long edges that leave the vertices of a mesh that were chosen, as far as these go straight on; where
//! they bend, vertices lie as near. Rims of round forms are not cut off. An ellipsoid touches with one point: a flat one that tumbles comes down on its
//! other end at once, deep, and is let out slowly. A sheet has no inside: what is far behind it is taken for what has always
//! been there, and limbs that are thin beside the way of a tick are lost now and then (`tests/all/meshes_sheets.rs` counts them).
//! Cost: for each place two choices of vertices and at most eight queries for the nearest point for each side; and a search
//! when the two have moved by a millimetre; bounded.

use haptics::Feature;
use haptics::mesh::{Linear, Mesh, Sides};
use nalgebra::{Isometry3, Point3, Vector3};

use super::PairMemory;
use super::mesh::{About, Contact, Told};
use super::mesh_convex::Touch;
use super::mesh_corner::Corner;
use super::mesh_cut::{Edge, WayOut};
use super::mesh_found::Found;
use super::mesh_other::{Extent, Meeting, Other, Solidity};
use super::mesh_overlap;
use super::mesh_own::Own;
use super::mesh_patch::{MAX_PATCHES, Patch, Patches};
use super::mesh_search::look_around;
use super::mesh_see::{Seen, Side, see, see_side};
use super::mesh_span::Standing;

pub(super) fn contact_points(
    mesh: &Mesh,
    other: &Other<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    told: &mut Told<'_>,
) {
    let travel_m = (reach_m - crate::pair::REACH_M).max(0.0);
    let touch = Touch::of(mesh, other, &mut memory.words);
    let patches: &mut Patches = &mut memory.patches;
    let do_meet = match &touch {
        Some(touch) => touch.gap_m <= reach_m,
        None => meet(mesh, other, reach_m, patches),
    };
    if !do_meet {
        if patches.all[0].is_known {
            *patches = Patches::default();
        }
        return;
    }
    let was_pressed = patches.are_pressed();
    if let Some(touch) = &touch {
        touch.settle(patches);
    } else {
        look_around(mesh, other, reach_m, travel_m, patches);
    }
    let mut found = find(mesh, other, [reach_m, travel_m], patches, touch.as_ref());
    if touch.is_none() && was_pressed && !patches.are_pressed() {
        // The plane of the last tick's points shows them no more: as if there had been none.
        let mut anew = *patches;
        if meet(mesh, other, reach_m, &mut anew) {
            look_around(mesh, other, reach_m, travel_m, &mut anew);
            let found_anew = find(mesh, other, [reach_m, travel_m], &mut anew, None);
            if anew.are_pressed() {
                (found, *patches) = (found_anew, anew);
            }
        }
    }
    if let (None, Solidity::Mesh(second)) = (&touch, other.solid) {
        mesh_overlap::part(mesh, second, &other.X_MO, &mut found);
    }
    let stands = told.mesh_is_a || !memory.is_b_fixed || matches!(other.solid, Solidity::Mesh(_));
    let (is_soft, mut spread) = (memory.is_soft && stands, patches.spread);
    spread.set_crowded(is_soft);
    let one = if is_soft { patches.as_one() } else { None };
    let is_told = one.is_some_and(|one| {
        let meeting = Meeting::of(&one.all[0], reach_m, travel_m);
        let place = Place { mesh, other, meeting, number: 0, patches: &one, touch: touch.as_ref() };
        place.tell_springs(found.all(), &mut spread, told)
    });
    if !is_told {
        found.all().iter().for_each(|contact| told.tell(contact));
    }
    patches.spread = spread;
    patches.all.iter_mut().enumerate().for_each(|(number, patch)| patch.carried = found.carried(number));
    patches.put_a_pressed_one_first();
}

/// All contacts, of each place by its plane.
fn find(
    mesh: &Mesh,
    other: &Other<'_>,
    [reach_m, travel_m]: [f64; 2],
    patches: &mut Patches,
    touch: Option<&Touch>,
) -> Found {
    let mut found = Found::new();
    for number in 0..MAX_PATCHES {
        found.begin(number, &patches.all[number].carried);
        if patches.all[number].is_known {
            let meeting = Meeting::of(&patches.all[number], reach_m, travel_m);
            let mut stands = patches.all[number].stands;
            let place = Place { mesh, other, meeting, number, patches, touch };
            place.vertices(&mut stands[0], &mut found);
            place.owns(&mut stands[1], &mut found);
            place.touch(&mut found);
            patches.all[number].stands = stands;
            let are_several = patches.are_several();
            patches.all[number].remember(found.end(&meeting.normal_M, are_several));
        }
    }
    found
}

/// About where they meet: as in the last tick, or else found by going to and fro; `false` where they are far apart.
fn meet(mesh: &Mesh, other: &Other<'_>, reach_m: f64, patches: &mut Patches) -> bool {
    if patches.all[0].is_pressed() {
        return true;
    }
    let (centre_M, radius_m) = other.ball();
    let mut at_M = mesh.nearest(&centre_M).point_B;
    if (at_M - centre_M).norm() > radius_m + reach_m && !mesh.is_inside(&centre_M) {
        return false;
    }
    let [low_M, high_M] = mesh.bounds_B();
    // Out of the larger one is where the smaller one's middle is.
    let is_smaller = 0.5 * (high_M - low_M).norm() < radius_m;
    let middle_M = (low_M + high_M) * 0.5;
    let out_M = |at_M: &Vector3<f64>| {
        let out_M = match (other.is_sheet(), is_smaller) {
            // Of a sheet, from where it is there to the middle: it has no inside that could tell.
            (true, _) => {
                let seen = other.see(at_M, &Vector3::y(), 0.0);
                middle_M - (at_M - seen.out * seen.gap_m)
            }
            (false, true) => middle_M - at_M,
            (false, false) => at_M - centre_M,
        };
        out_M.try_normalize(0.0).unwrap_or_else(Vector3::y)
    };
    let mut seen = other.see(&at_M, &out_M(&at_M), 0.0);
    for _ in 0..TO_AND_FRO {
        at_M = mesh.nearest(&(at_M - seen.out * seen.gap_m)).point_B;
        seen = other.see(&at_M, &out_M(&at_M), 0.0);
    }
    if let Some((lower, at_lower_M)) =
        lowest(mesh, other, &at_M).filter(|(lower, _)| lower.gap_m < seen.gap_m)
    {
        (seen, at_M) = (Seen { out: -lower.out, ..lower }, at_lower_M);
    }
    let (normal_M, first) = (-seen.out, &mut patches.all[0]);
    if !first.is_same(&normal_M, &at_M, other.is_convex()) {
        patches.searched = None;
    }
    (first.normal_M, first.at_M, first.depth_m) = (normal_M, at_M, (-seen.gap_m).max(0.0));
    first.is_known = true;
    true
}

/// Of an ellipsoid that is over a flat face there: the point of it that lies lowest, as the mesh sees it, and what is below it. To
/// and fro, a flat one comes to that in small steps only.
fn lowest(mesh: &Mesh, other: &Other<'_>, at_M: &Vector3<f64>) -> Option<(Seen, Vector3<f64>)> {
    let nearest = mesh.nearest(at_M);
    let normal_M = mesh.faces()[nearest.face as usize].normal_B;
    if nearest.feature != Feature::Face || mesh.sides() == Sides::Sheet {
        return None;
    }
    let point_M = other.lowest(&normal_M)?;
    let seen = see(mesh, &point_M, &normal_M, 0.0);
    Some((seen, point_M - seen.out * seen.gap_m))
}

impl Patch {
    /// The mean of the contact points, by their depth. Where nothing presses any more, it stays where it was.
    fn remember(&mut self, contacts: &[Contact]) {
        let deepest_m = contacts.iter().fold(0.0_f64, |deepest_m, contact| deepest_m.max(-contact.gap_m));
        let (mut normal_M, mut at_M, mut sum) = (Vector3::zeros(), Vector3::zeros(), 0.0);
        for contact in contacts.iter().filter(|contact| contact.gap_m < 0.0) {
            normal_M -= contact.normal_M * contact.gap_m;
            at_M -= contact.on_mesh_M * contact.gap_m;
            sum -= contact.gap_m;
        }
        self.depth_m = 0.0;
        if let Some(normal_M) = normal_M.try_normalize(1e-3 * sum).filter(|_| sum > 0.0) {
            (self.normal_M, self.at_M, self.depth_m) = (normal_M, at_M / sum, deepest_m);
        }
    }
}

/// A place whose contact points are being found.
pub(super) struct Place<'m> {
    pub(super) mesh: &'m Mesh,
    pub(super) other: &'m Other<'m>,
    pub(super) meeting: Meeting,
    number: usize,
    pub(super) patches: &'m Patches,
    touch: Option<&'m Touch>,
}

impl Place<'_> {
    /// The mesh's vertices against the other one.
    fn vertices(&self, stands: &mut super::Stands, found: &mut Found) {
        let (height, limits) = self.limits_of_mesh(self.beside_m(self.mesh));
        let limits = self.limits(self.mesh, &limits);
        let chosen = self.standing(height, limits).choose(stands);
        for contact in chosen.into_iter().flatten().filter_map(|corner| self.contact_of_vertex(corner)) {
            self.push(contact, found);
        }
        chosen.into_iter().flatten().for_each(|corner| self.edges_of_mesh(corner, found));
    }

    /// Height of the mesh's vertices over the other one, and limits of what may touch or is so far beside that (m).
    pub(super) fn limits_of_mesh(&self, beside_m: f64) -> (Linear, [Linear; 5]) {
        let (mesh, other, meeting) = (self.mesh, self.other, self.meeting);
        let n = meeting.normal_M;
        let height = Linear::from(&other.front(&-n, &meeting, mesh.extent_m()), -n);
        (height, meeting.limits(&other.extent(), beside_m, &height, self.behind_m()))
    }

    /// The mesh over the other one.
    pub(super) fn standing<'l>(&'l self, height: Linear, limits: &'l [Linear]) -> Standing<'l> {
        let Meeting { reach_m, travel_m, .. } = self.meeting;
        Standing { mesh: self.mesh, height, limits, reach_m, travel_m }
    }

    /// A vertex of the mesh, if it is one that counts.
    pub(super) fn contact_of_vertex(&self, corner: Corner) -> Option<Contact> {
        let mesh = self.mesh;
        let counts = match self.other.solid {
            Solidity::Mesh(_) => corner.sticks_out(mesh),
            Solidity::Form(_) => !corner.is_in_a_plane(mesh),
        };
        if !counts {
            return None;
        }
        let on_mesh_M = *corner.point_M(mesh);
        let seen = self.of_vertex(&on_mesh_M)?;
        let looks = !self.patches.are_several() || corner.looks(mesh, &-seen.out);
        let about = About::Vertex(corner.vertex(mesh));
        let is_round = || corner.is_round(mesh, &-seen.out);
        looks.then(|| Contact::new(about, on_mesh_M, -seen.out, seen.gap_m).rolling(is_round))
    }

    /// Of one place among several, what lies behind it does not count; but what lies beside it does, where that is the end
    /// of a long edge.
    fn limits<'l>(&self, of: &Mesh, limits: &'l [Linear; 5]) -> &'l [Linear] {
        match (!self.patches.is_alone(self.number), of.vertices().len() <= COARSE) {
            (false, _) => &limits[..4],
            (true, false) => limits,
            (true, true) => &limits[4..],
        }
    }

    /// What lies so far behind a place is another side of the same; the first one takes what is nobody else's \[m\].
    fn behind_m(&self) -> f64 {
        let (_, radius_m) = self.other.ball();
        // In a bore, what lies far behind is its other side.
        let is_around = self.patches.searched.is_some_and(|searched| searched.is_crowded);
        if self.number == 0 && !is_around { BEHIND_M.max(0.5 * radius_m) } else { BEHIND_M }
    }

    /// An edge that is cut off by the outline of a single place leaves a vertex so far beside it \[m\].
    fn beside_m(&self, mesh: &Mesh) -> f64 {
        if self.patches.is_alone(self.number) { mesh.longest_edge_m() } else { 0.0 }
    }

    fn of_vertex(&self, at_M: &Vector3<f64>) -> Option<Seen> {
        let along_M = -self.meeting.normal_M;
        let seen = self
            .side(at_M, along_M, -1.0, 0.0)
            .and_then(|side| self.other.see_side(at_M, &side))
            .unwrap_or_else(|| self.other.see(at_M, &along_M, self.meeting.deep_m()));
        self.unless_beyond(seen, self.other.is_sheet(), 0.0)
    }

    fn of_own(&self, own: &Own) -> Option<Seen> {
        let along_M = self.meeting.normal_M;
        let seen = self
            .side(&own.at_M, along_M, 1.0, own.radius_m)
            .and_then(|side| see_side(self.mesh, &own.at_M, &side))
            .unwrap_or_else(|| see(self.mesh, &own.at_M, &along_M, self.meeting.deep_m()));
        self.unless_beyond(seen, self.mesh.sides() == Sides::Sheet, own.radius_m)
    }

    /// What is deeper in a sheet than anything can have come is not in it, but beyond.
    fn unless_beyond(&self, seen: Seen, is_sheet: bool, radius_m: f64) -> Option<Seen> {
        (!is_sheet || seen.gap_m - radius_m >= -self.meeting.deep_in_sheet_m()).then_some(seen)
    }

    /// The side that is looked at here, if others are pressed, too.
    fn side(&self, at_M: &Vector3<f64>, along: Vector3<f64>, sign: f64, radius_m: f64) -> Option<Side> {
        let meeting = &self.meeting;
        self.patches.others_press(self.number).then(|| Side {
            along,
            lift: self.lift_M(at_M, sign),
            above_m: meeting.deep_m().max(meeting.reach_m),
            below_m: radius_m + meeting.reach_m,
        })
    }

    /// So far at most leads the way out where an edge is cut off \[m\].
    fn way_m(&self) -> f64 {
        self.meeting.deep_m().max(2.0 * self.meeting.travel_m)
    }

    /// To where nothing presses elsewhere: from what is of the other one, or, with the sign -1, of the mesh.
    fn lift_M(&self, point_M: &Vector3<f64>, sign: f64) -> Vector3<f64> {
        self.patches.lift_M(self.number, point_M, sign, self.meeting.travel_m)
    }

    /// The other one's points against the mesh.
    fn owns(&self, stands: &mut super::Stands, found: &mut Found) {
        let second = if let Solidity::Mesh(second) = self.other.solid { Some(second) } else { None };
        let limits = self.limits_of_other(second.map_or(0.0, |second| self.beside_m(second)));
        let limits = second.map_or(&limits[..], |second| self.limits(second, &limits));
        let owns = self.other.owns(&self.meeting, limits, stands);
        for contact in owns.iter().flatten().filter_map(|own| self.contact_of_own(own)) {
            self.push(contact, found);
        }
        self.edges(found);
        let corners = owns.into_iter().flatten().filter_map(|own| own.corner);
        corners.for_each(|corner| self.edges_of_other(corner, found));
    }

    /// Limits of what of the other one may touch, or is so far beside that (m).
    pub(super) fn limits_of_other(&self, beside_m: f64) -> [Linear; 5] {
        let height = Linear::from(&self.meeting.at_M, self.meeting.normal_M);
        let extent = Extent::of(self.mesh.bounds_B(), &Isometry3::identity());
        self.meeting.limits(&extent, beside_m, &height, self.behind_m())
    }

    /// A point of the other one, if it is one that counts.
    pub(super) fn contact_of_own(&self, own: &Own) -> Option<Contact> {
        let (mesh, other, meeting) = (self.mesh, self.other, self.meeting);
        let far_m = own.radius_m + meeting.reach_m + FAR * meeting.depth_m;
        // Far from all faces it is outside, or so deep inside that it does not matter where others press.
        if !other.sticks_out(own) || mesh.clearance(&own.at_M, far_m) >= far_m {
            return None;
        }
        let seen = self.of_own(own)?;
        let looks = !self.patches.are_several() || other.looks(own, &-seen.out);
        let on_mesh_M = own.at_M - seen.out * seen.gap_m;
        let about = About::Other(own.number);
        let is_round = || other.is_round(own, &-seen.out);
        looks.then(|| Contact::new(about, on_mesh_M, seen.out, seen.gap_m - own.radius_m).rolling(is_round))
    }

    /// Where edges of a form are cut off by the mesh.
    fn edges(&self, found: &mut Found) {
        let n = self.meeting.normal_M;
        for (number, edge) in self.other.edges(&-n).into_iter().flatten().enumerate() {
            let about = About::Cut { edge: number as u32, of_mesh: false, place: 0 };
            self.cuts_by_mesh(&edge, about, found);
        }
    }

    /// Where edges that leave a vertex of the other mesh are cut off by this one.
    fn edges_of_other(&self, corner: Corner, found: &mut Found) {
        let Solidity::Mesh(second) = self.other.solid else { return };
        let X_MO = self.other.X_MO;
        let place = |point: &Vector3<f64>| (X_MO * Point3::from(*point)).coords;
        let from = place(corner.point_M(second));
        corner.for_each_edge(second, |to, face, edge| {
            let about = About::Cut { edge: 3 * face + edge as u32, of_mesh: false, place: 0 };
            self.cuts_by_mesh(&Edge { ends: [from, place(to)] }, about, found);
        });
    }

    fn cuts_by_mesh(&self, edge: &Edge, about: About, found: &mut Found) {
        let lift = |point_M: &Vector3<f64>| self.lift_M(point_M, 1.0);
        let way = WayOut {
            along: self.meeting.normal_M,
            most_m: self.way_m(),
            ahead_m: self.meeting.reach_m,
            lift: &lift,
        };
        let cuts = edge.cuts(self.mesh, &way);
        for (at, cut) in cuts.into_iter().enumerate() {
            if let Some(cut) = cut {
                let about = about.at_place(at as u32);
                self.push(Contact::new(about, cut.on_mesh, cut.out, cut.gap_m), found);
            }
        }
    }

    /// Where edges that leave a vertex of this mesh are cut off by the other one.
    fn edges_of_mesh(&self, corner: Corner, found: &mut Found) {
        let (mesh, meeting, X_MO) = (self.mesh, self.meeting, self.other.X_MO);
        let Solidity::Mesh(second) = self.other.solid else { return };
        let place = |point: &Vector3<f64>| X_MO.inverse_transform_point(&Point3::from(*point)).coords;
        let turned = |v: &Vector3<f64>| X_MO.inverse_transform_vector(v);
        let (patches, number, most_m) = (self.patches, self.number, self.way_m());
        let lift = |point: &Vector3<f64>| {
            let point_M = (X_MO * Point3::from(*point)).coords;
            turned(&patches.lift_M(number, &point_M, -1.0, meeting.travel_m))
        };
        let way = WayOut { along: turned(&-meeting.normal_M), most_m, ahead_m: meeting.reach_m, lift: &lift };
        let from = place(corner.point_M(mesh));
        corner.for_each_edge(mesh, |to, face, edge| {
            let cuts = Edge { ends: [from, place(to)] }.cuts(second, &way);
            for (at, cut) in cuts.into_iter().enumerate() {
                let about = About::Cut { edge: 3 * face + edge as u32, of_mesh: true, place: at as u32 };
                if let Some(cut) = cut {
                    let on_mesh_M = (X_MO * Point3::from(cut.on_edge)).coords;
                    self.push(Contact::new(about, on_mesh_M, -(X_MO * cut.out), cut.gap_m), found);
                }
            }
        });
    }

    /// The place at which two convex ones touch, if nothing else presses there.
    fn touch(&self, found: &mut Found) {
        let contact = self.touch.and_then(|touch| touch.unless_found(found.own()));
        contact.into_iter().for_each(|contact| found.push_apart(contact));
    }

    fn push(&self, contact: Contact, found: &mut Found) {
        if self.is_here(&contact) {
            found.push(contact);
        }
    }

    /// True of what is not a point of another place that one finds. A corner that is beside a single place by next to nothing would
    /// take the room of one that is on it.
    pub(super) fn is_here(&self, contact: &Contact) -> bool {
        if contact.gap_m > self.meeting.reach_m {
            return false;
        }
        if let Some(touch) = self.touch {
            return touch.counts(contact);
        }
        let is_single = self.meeting.depth_m > 0.0 && self.patches.is_alone(self.number);
        let is_beside =
            is_single && contact.gap_m >= 0.0 && contact.normal_M.dot(&self.meeting.normal_M) < BESIDE;
        !is_beside && !self.patches.belongs_elsewhere(self.number, &contact.normal_M)
    }
}

/// A mesh of no more vertices has long edges.
const COARSE: usize = 16;
/// From a place among several \[m\].
const BEHIND_M: f64 = 1e-3;
/// Cosine between a normal and that of a place that it is beside.
const BESIDE: f64 = 0.3;
/// Turns between the two until the nearest points are about found.
const TO_AND_FRO: usize = 4;
/// Points at most so many times as deep as the deepest of the last tick are found.
const FAR: f64 = 2.0;
