//! Surfaces of rational tensor-product patches, NURBS, touched without tessellation (Melder ch. 4.2.2 and 9.2).
//!
//! Problem: there is no formula for where a path meets such a surface, nor for its nearest point; a finger needs both
//! every tick, exactly, and must get through neither seams between patches nor points that edges have shrunk to.
//!
//! Model: patches are cut into Bezier elements once (`bezier`), with all derivatives at hand (`local`); a tree of
//! cells tells what is near (`tree`); where a path first crosses is found by halving hulls (`crossing`); from then on
//! a god-object's place is known by patch and parameters, and a step of Newton's or two a tick keep it up to date
//! (`descend`), across borders (`seams`). The Friction Cone Algorithm runs on that as on every surface
//! (`walker`, `nurbs_cone`).
//!
//! Frames and signs: everything in the object's frame B. A closed set has an inside and is turned outward here; a set
//! with open edges, or one that cannot be turned (a Klein bottle), is a sheet and is felt from both sides.
//! Cost: memory about 0.5 kB per cell of a bicubic patch; a tick does not allocate.
//! Limits: parts of a set do not see each other: where two overlap, the one that was come through is felt, and where one
//! hollows out another, it must be joined to it. A spherical finger rolls on the surface that lies its radius
//! above. Where the surface is bent inward more tightly than the finger, that surface has a fold; the finger then
//! rests on one side of the hollow at a time and goes over to the other when the side it is on lets it go.

mod bezier;
mod budget;
mod chord;
mod crossing;
mod descend;
mod edge_boxes;
mod error;
mod foot;
mod local;
pub mod make;
mod nurbs_cone;
mod patch;
mod poles;
mod seams;
mod tree;
mod walker;

use nalgebra::Vector3;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

pub use error::NurbsError;
pub(crate) use nurbs_cone::NurbsCone;
pub use patch::{MAX_DEGREE, NurbsPatch};
pub use seams::SMOOTH_RAD;
pub(crate) use walker::Walker;

use crate::mesh::{Sides, plural};
use bezier::{Control, elements_of};
use poles::Pole;
use seams::Edge;
use tree::{Cell, Node};

/// A surface of patches that can be touched.
#[derive(Debug, PartialEq)]
pub struct Nurbs {
    patches: Vec<Patch>,
    elements: Vec<Element>,
    controls: Vec<Control>,
    poles: Vec<Pole>,
    cells: Vec<Cell>,
    nodes: Vec<Node>,
    sides: Sides,
    extent_m: f64,
    /// What is this near may be the same point.
    slack_m: f64,
    /// No other has it.
    identity: u64,
}

/// A patch without inner corners, its parameters from 0 to 1.
#[derive(Debug, Clone, PartialEq)]
struct Patch {
    degree: [usize; 2],
    breaks: [Box<[f64]>; 2],
    first_element: usize,
    /// Whether `S_u x S_v` points inward.
    is_turned: bool,
    /// Patches with seams between them have the same.
    group: u32,
    edges: [Edge; 4],
    /// The poles at its corners that none of its own edges has shrunk to, in the order of [`poles::CORNERS`].
    corner_poles: [Option<u32>; 4],
    /// About one element.
    longest_step: [f64; 2],
    /// Which of the patches it was given it is of.
    source: usize,
}

/// One polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Element {
    net: usize,
    origin_B: Vector3<f64>,
}

/// What was found when patches were joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NurbsReport {
    /// Patches, as given.
    pub patches: usize,
    /// Polynomials that they consist of.
    pub elements: usize,
    /// Cells for the search.
    pub cells: usize,
    /// Stretches along which two patches meet.
    pub seams: usize,
    /// How many of them are creases.
    pub creases: usize,
    /// Edges, or parts of edges, at which the surface ends.
    pub rims: usize,
    /// Points that edges have shrunk to.
    pub poles: usize,
    /// Closed parts that were inside out.
    pub turned: usize,
    /// Patches without an area, since they have collapsed to a point or a curve; left out.
    pub without_area: usize,
    /// The first of these, as given, from 0.
    pub first_without_area: Option<usize>,
    /// Whether it cannot be told which side is outside.
    pub is_one_sided: bool,
}

impl fmt::Display for NurbsReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { patches, elements, cells, seams, creases, rims, poles, turned, .. } = self;
        let of = |count: usize, one: &'static str, more: &'static str| {
            format!("{count} {}", plural(count, one, more))
        };
        write!(
            f,
            "{} of {} in {}, {} ({creases} of them creases), {}",
            of(*patches, "patch", "patches"),
            of(*elements, "polynomial", "polynomials"),
            of(*cells, "cell", "cells"),
            of(*seams, "seam", "seams"),
            of(*poles, "pole", "poles"),
        )?;
        if *rims > 0 {
            write!(f, "; it ends at {}: a sheet, felt from both sides", of(*rims, "edge", "edges"))?;
        }
        if self.is_one_sided {
            write!(f, "; it has no inside: felt from both sides")?;
        }
        if *turned > 0 {
            let (parts, were) = if *turned == 1 { ("part was", "has") } else { ("parts were", "have") };
            write!(f, "; {turned} closed {parts} inside out and {were} been turned")?;
        }
        if let Some(first) = self.first_without_area {
            let patches = if self.without_area == 1 { "patch" } else { "patches" };
            write!(f, "; {} {patches} without an area: left out (first: patch {first})", self.without_area)?;
        }
        Ok(())
    }
}

impl Nurbs {
    /// Joins patches to a surface.
    ///
    /// Errors: a patch that is none, edges at which more than two meet, and nothing that has an area.
    pub fn build(patches: &[NurbsPatch]) -> Result<(Self, NurbsReport), NurbsError> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        if patches.is_empty() {
            return Err(NurbsError::NoPatch);
        }
        for (index, patch) in patches.iter().enumerate() {
            patch.check(index)?;
        }
        budget::check(patches)?;
        let coordinates = patches.iter().flat_map(|patch| &patch.points).flat_map(|point| &point[..3]);
        let extent_m = coordinates.fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
        let mut nurbs = Self {
            patches: Vec::new(),
            elements: Vec::new(),
            controls: Vec::new(),
            poles: Vec::new(),
            cells: Vec::new(),
            nodes: Vec::new(),
            sides: Sides::Sheet,
            extent_m,
            slack_m: SLACK * extent_m,
            identity: NEXT.fetch_add(1, Ordering::Relaxed),
        };
        for (source, patch) in patches.iter().enumerate() {
            nurbs.add(patch, source);
        }
        let without_area = nurbs.without_area(patches.len());
        if without_area.len() == patches.len() {
            return Err(NurbsError::NoArea { patches: patches.len() });
        }
        if !without_area.is_empty() {
            nurbs.patches.clear();
            nurbs.elements.clear();
            nurbs.controls.clear();
            let rest =
                patches.iter().enumerate().filter(|(source, _)| without_area.binary_search(source).is_err());
            rest.for_each(|(source, patch)| nurbs.add(patch, source));
        }
        let joined = seams::join(&mut nurbs)?;
        let mut turned = 0;
        if joined.is_closed && joined.is_orientable {
            nurbs.sides = Sides::Solid;
            turned = nurbs.turn_outward(&joined.component);
        }
        poles::shape(&mut nurbs);
        nurbs.widen_slack();
        nurbs.group();
        tree::grow(&mut nurbs)?;
        let report = NurbsReport {
            turned,
            is_one_sided: !joined.is_orientable,
            without_area: without_area.len(),
            first_without_area: without_area.first().copied(),
            ..nurbs.report(patches.len())
        };
        Ok((nurbs, report))
    }

    /// Whether it has an inside.
    pub fn sides(&self) -> Sides {
        self.sides
    }

    /// The largest coordinate (m).
    pub fn extent_m(&self) -> f64 {
        self.extent_m
    }

    /// How many parts without inner corners it was cut into: numbers that [`Nurbs::at`] takes.
    pub fn parts(&self) -> usize {
        self.patches.len()
    }

    /// Point and outward unit normal at u, v (0 to 1) of a part.
    pub fn at(&self, part: usize, u: f64, v: f64) -> (Vector3<f64>, Vector3<f64>) {
        let foot = self.foot(part as u32, [u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)], 1.0);
        (foot.point_B(), foot.normal_B)
    }

    /// The same as a surface for a finger of this radius (m), 0 for a point.
    ///
    /// Asked again and again near the same place, it answers from there.
    pub fn surface(&self, radius_m: f64) -> impl crate::Surface + '_ {
        Walker::new(self, Vector3::zeros(), radius_m)
    }

    /// Adds the parts of one patch: it is cut where its knots allow a corner.
    fn add(&mut self, patch: &NurbsPatch, source: usize) {
        let elements = elements_of(patch);
        let [nu, _] = elements.counts;
        let cuts = [0, 1].map(|d| {
            let breaks = &elements.breaks[d];
            let inner = (1..breaks.len() - 1).filter(|&i| breaks[i].may_be_sharp);
            let mut cuts: Vec<usize> = inner.collect();
            cuts.insert(0, 0);
            cuts.push(breaks.len() - 1);
            cuts
        });
        for v in cuts[1].windows(2) {
            for u in cuts[0].windows(2) {
                let first_element = self.elements.len();
                for (i, j) in (v[0]..v[1]).flat_map(|j| (u[0]..u[1]).map(move |i| (i, j))) {
                    self.add_element(&elements.nets[i + j * nu], patch.degree);
                }
                let breaks = [(0, u), (1, v)].map(|(d, cut)| {
                    let at: Vec<f64> = (cut[0]..=cut[1]).map(|i| elements.breaks[d][i].at).collect();
                    let (first, last) = (at[0], at[at.len() - 1]);
                    let shares = at.iter().map(|x| (x - first) / (last - first));
                    shares.collect::<Box<[f64]>>()
                });
                let longest_step = [0, 1].map(|d| 1.0 / (breaks[d].len() - 1) as f64);
                self.patches.push(Patch {
                    degree: patch.degree,
                    breaks,
                    first_element,
                    is_turned: false,
                    group: 0,
                    edges: Default::default(),
                    corner_poles: Default::default(),
                    longest_step,
                    source,
                });
            }
        }
    }

    fn add_element(&mut self, net: &[Control], [p, q]: [usize; 2]) {
        let point = |k: usize| Vector3::new(net[k][0], net[k][1], net[k][2]) / net[k][3];
        let edges = [
            (0..=q).map(|j| j * (p + 1)).collect::<Vec<_>>(),
            (0..=q).map(|j| j * (p + 1) + p).collect(),
            (0..=p).collect(),
            (0..=p).map(|i| i + q * (p + 1)).collect(),
        ];
        let tiny = 1e-3 * seams::EQUAL * self.extent_m;
        let shrunk =
            edges.iter().find(|edge| edge.iter().all(|&k| (point(k) - point(edge[0])).amax() <= tiny));
        // Taken from there, what vanishes there does so to the last digit.
        let origin_B = shrunk.map_or_else(|| point(net.len() / 2), |edge| point(edge[0]));
        let first = self.controls.len();
        self.controls.extend(net.iter().enumerate().map(|(k, c)| {
            if shrunk.is_some_and(|edge| edge.contains(&k)) {
                return [0.0, 0.0, 0.0, c[3]];
            }
            let off = (point(k) - origin_B) * c[3];
            [off.x, off.y, off.z, c[3]]
        }));
        self.elements.push(Element { net: first, origin_B });
    }

    /// Turns closed parts whose volume is negative; how many those are.
    fn turn_outward(&mut self, component: &[usize]) -> usize {
        let count = component.iter().max().map_or(0, |most| most + 1);
        let mut volume = vec![0.0; count];
        for (patch, &of) in component.iter().enumerate() {
            let sign = if self.patches[patch].is_turned { -1.0 } else { 1.0 };
            volume[of] += sign * self.volume_under(patch as u32);
        }
        for (patch, &of) in component.iter().enumerate() {
            self.patches[patch].is_turned ^= volume[of] < 0.0;
        }
        // What its author would have to turn: parts whose first patch points inward.
        let first = |of: usize| component.iter().position(|&c| c == of);
        (0..count).filter(|&of| first(of).is_some_and(|patch| self.patches[patch].is_turned)).count()
    }

    /// Three times the volume between a patch and B's origin, by Gauss's rule in every element.
    fn volume_under(&self, patch: u32) -> f64 {
        let breaks = &self.patches[patch as usize].breaks;
        let places = |d: usize| {
            breaks[d].windows(2).flat_map(|ends| {
                GAUSS.map(|(x, w)| (ends[0] + (ends[1] - ends[0]) * x, w * (ends[1] - ends[0])))
            })
        };
        places(1)
            .flat_map(|v| places(0).map(move |u| (u, v)))
            .map(|((u, a), (v, b))| {
                let here = self.local(patch, [u, v]);
                a * b * here.point_B.dot(&here.du.cross(&here.dv))
            })
            .sum()
    }

    /// Which of the given patches are nowhere wider than what edges that have shrunk to a point may be, ascending.
    fn without_area(&self, given: usize) -> Vec<usize> {
        let mut has_area = vec![false; given];
        for (patch, of) in self.patches.iter().enumerate() {
            has_area[of.source] = has_area[of.source] || self.has_area(patch as u32);
        }
        (0..given).filter(|&source| !has_area[source]).collect()
    }

    /// By the elements' derivatives, each over the length of its element.
    fn has_area(&self, patch: u32) -> bool {
        let breaks = &self.patches[patch as usize].breaks;
        let places = |d: usize| {
            breaks[d].windows(2).flat_map(|ends| {
                let length = ends[1] - ends[0];
                GAUSS.map(|(x, _)| (ends[0] + length * x, length))
            })
        };
        let tiny_m = 1e-3 * seams::EQUAL * self.extent_m;
        places(1).flat_map(|v| places(0).map(move |u| (u, v))).any(|((u, du), (v, dv))| {
            let here = self.local(patch, [u, v]);
            let (along_u, along_v) = (here.du * du, here.dv * dv);
            along_u.cross(&along_v).norm() > tiny_m * along_u.norm().max(along_v.norm())
        })
    }

    /// Edges that meet within a tolerance leave gaps as wide: a path must not slip through.
    fn widen_slack(&mut self) {
        let mut gap_m = 0.0f64;
        for patch in 0..self.patches.len() as u32 {
            for edge in 0..4u8 {
                for link in &self.patches[patch as usize].edges[usize::from(edge)].links {
                    for k in 0..=16 {
                        let x = link.along[0] + (link.along[1] - link.along[0]) * f64::from(k) / 16.0;
                        let here = self.foot(patch, seams::on_edge(edge, x), 1.0);
                        gap_m = gap_m.max((self.across(&here, link, x).point_B() - here.point_B()).norm());
                    }
                }
            }
        }
        self.slack_m = self.slack_m.max(2.0 * gap_m);
    }

    fn group(&mut self) {
        for first in 0..self.patches.len() {
            self.patches[first].group = u32::MAX;
        }
        let mut count = 0;
        for first in 0..self.patches.len() {
            if self.patches[first].group != u32::MAX {
                continue;
            }
            self.patches[first].group = count;
            let mut waiting = vec![first];
            while let Some(patch) = waiting.pop() {
                let links = self.patches[patch].edges.iter().flat_map(|edge| &edge.links);
                let smooth: Vec<usize> = links.filter(|l| l.is_smooth).map(|l| l.patch as usize).collect();
                for other in smooth {
                    if self.patches[other].group == u32::MAX {
                        self.patches[other].group = count;
                        waiting.push(other);
                    }
                }
            }
            count += 1;
        }
    }

    fn report(&self, patches: usize) -> NurbsReport {
        let edges = || self.patches.iter().flat_map(|patch| &patch.edges);
        let links = || edges().flat_map(|edge| &edge.links);
        let is_open = |edge: &&Edge| {
            edge.pole.is_none()
                && edge.links.iter().map(|l| l.along[1] - l.along[0]).sum::<f64>() < 1.0 - 1e-4
        };
        NurbsReport {
            patches,
            elements: self.elements.len(),
            cells: self.cells.len(),
            seams: links().count() / 2,
            creases: links().filter(|link| !link.is_smooth).count() / 2,
            rims: edges().filter(is_open).count(),
            poles: self.poles.len(),
            ..NurbsReport::default()
        }
    }
}

/// Share of the extent that roundings add up to.
const SLACK: f64 = 1e-13;
/// Gauss's places and weights on 0 to 1: exact for degree 9.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_095),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_095),
];
