//! A place on the surface, with what the surface is like there.

use nalgebra::Vector3;

use super::Nurbs;
use super::local::{Local, local};
use crate::surface::direction_or_up;

/// A point of a patch, its derivatives and the normal towards the finger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Foot {
    pub(super) patch: u32,
    /// u and v, from 0 to 1.
    pub(super) at: [f64; 2],
    /// Which side is felt: -1 is the back of a sheet.
    pub(super) side: f64,
    pub(super) local: Local,
    pub(super) normal_B: Vector3<f64>,
    /// How far it has been moved since the surface was last looked at, as a share of an element.
    pub(super) blur: f64,
}

impl Foot {
    pub(super) fn point_B(&self) -> Vector3<f64> {
        self.local.point_B
    }
}

impl Nurbs {
    /// The foot at `at` of a patch.
    #[inline]
    pub(super) fn foot(&self, patch: u32, at: [f64; 2], side: f64) -> Foot {
        self.foot_of_local(patch, at, side, self.local(patch, at))
    }

    #[inline(always)]
    pub(super) fn foot_of_local(&self, patch: u32, at: [f64; 2], side: f64, local: Local) -> Foot {
        let is_turned = self.patches[patch as usize].is_turned;
        let outward = if is_turned { -side } else { side };
        let normal_B = self.natural_normal(patch, at, &local) * outward;
        Foot { patch, at, side, local, normal_B, blur: 0.0 }
    }

    #[inline(always)]
    pub(super) fn local(&self, patch: u32, at: [f64; 2]) -> Local {
        let patch = &self.patches[patch as usize];
        let (i, s, width_u) = locate(&patch.breaks[0], at[0]);
        let (j, t, width_v) = locate(&patch.breaks[1], at[1]);
        let element = &self.elements[patch.first_element + i + j * (patch.breaks[0].len() - 1)];
        let size = (patch.degree[0] + 1) * (patch.degree[1] + 1);
        let net = &self.controls[element.net..element.net + size];
        local(net, patch.degree, &element.origin_B, [s, t], [width_u, width_v])
    }

    /// Whether the same polynomial holds at both places.
    #[inline]
    pub(super) fn is_in_one_element(&self, patch: u32, a: &[f64; 2], b: &[f64; 2]) -> bool {
        let breaks = &self.patches[patch as usize].breaks;
        (0..2).all(|d| locate(&breaks[d], a[d]).0 == locate(&breaks[d], b[d]).0)
    }

    /// Along `S_u x S_v`; where an edge has shrunk to a point, what that tends to.
    #[inline(always)]
    fn natural_normal(&self, patch: u32, at: [f64; 2], here: &Local) -> Vector3<f64> {
        let (uu, vv) = (here.du.norm_squared(), here.dv.norm_squared());
        let across = here.du.cross(&here.dv);
        let square = across.norm_squared();
        let shrunk = SHRUNK * SHRUNK;
        if square > shrunk * uu * vv && uu > shrunk * vv && vv > shrunk * uu {
            return across / square.sqrt();
        }
        self.normal_of_a_pole(patch, at, here)
    }

    /// Away from the vanishing edge `S_u = v S_uv` to first order.
    #[cold]
    fn normal_of_a_pole(&self, patch: u32, at: [f64; 2], here: &Local) -> Vector3<f64> {
        let (uu, vv) = (here.du.norm_squared(), here.dv.norm_squared());
        let inward = |x: f64| if x < 0.5 { 1.0 } else { -1.0 };
        let across = if uu < vv {
            here.duv.cross(&here.dv) * inward(at[1])
        } else {
            here.du.cross(&here.duv) * inward(at[0])
        };
        let size = here.duv.norm_squared() * uu.max(vv);
        if across.norm_squared() > SHRUNK * SHRUNK * size && size > 0.0 {
            return across.normalize();
        }
        // Both derivatives vanish, or agree: a little further in they do not.
        let aside = at.map(|x| x + (0.5 - x) * ASIDE);
        let there = self.local(patch, aside);
        direction_or_up(&there.du.cross(&there.dv))
    }
}

/// Which span `x` lies in, how far (0 to 1), and the span's width.
#[inline(always)]
fn locate(breaks: &[f64], x: f64) -> (usize, f64, f64) {
    if breaks.len() == 2 {
        return (0, x, 1.0);
    }
    let last = breaks.len() - 2;
    // By now most are uniform: guess, then look.
    let mut i = ((x * (last + 1) as f64) as usize).min(last);
    while i > 0 && x < breaks[i] {
        i -= 1;
    }
    while i < last && x >= breaks[i + 1] {
        i += 1;
    }
    let width = breaks[i + 1] - breaks[i];
    (i, (x - breaks[i]) / width, width)
}

/// A derivative this much shorter than the other has vanished.
const SHRUNK: f64 = 1e-13;
/// A share of the way to the middle.
const ASIDE: f64 = 1e-6;
