//! Force shading: a faceted surface that feels smooth (Melder ch. 4.2.6).
//!
//! Problem: where a god-object comes to another face of a mesh its normal leaps, and with it the force.
//!
//! Model: the god-object moves as ever. Where it is, a *shaded normal* is worked out, which changes continuously over
//! the surface, edges and vertices included; then the force, friction and all, is turned from the surface's normal to
//! the shaded one ([`ShadingForm`]). Two ways to shade: [`Shading::interpolated`] makes the whole surface feel round,
//! [`Shading::regions`] keeps faces flat and rounds them towards their edges. Edges sharper than the crease angle stay
//! as they are.
//!
//! What is turned from: on a face its normal; on an edge or a vertex, where the god-object's normal is no face's, that
//! normal. So a force without friction always points along the shaded normal, and changes no faster than that does over
//! the god-object's way, whichever feature it is on ([`at`](self) tells the cases). The back of a sheet is shaded as its
//! front, mirrored.
//!
//! A ball is shaded where it touches: at its foot on the mesh, not at its centre. Where it touches at several places, what
//! each of them does to the user is turned on its own, so that one that comes or goes changes nothing at that moment:
//! its load is zero then. Turned towards each other they would add up to more than the facets' force: then all are
//! made smaller by the same factor.
//!
//! Limits:
//! - The god-object itself leaps over convex edges: at depth d over an edge of angle a by d sin(a), since there the HIP
//!   has long been below the next face. Shading makes a leap of that way of what was a leap by the angle a: on a ball
//!   of radius r, d / r of it. The force follows as the finger goes ([`following`](self)).
//! - A turned force is not the gradient of anything: a finger that is led around a closed way takes or gives energy.
//!   Over a facet that is `s` lower than the round surface it stands for, `k d s` at the depth d; through a region of
//!   activation of a right-angled edge, 0.31 `k d l` on the way there and 0.29 of what is stored less on the way up.
//!   In rounds about a ball of 320, 1280, 20,480 triangles: up to 5.9, 1.4, 0.02 % of what the spring stores
//!   (`tests/all/shading_energy.rs`). Something passive has to watch over it.
//!
//! Frames and signs: object frame B; forces are on the user.
//! Invariants: size of the force and friction angle are kept ([`ShadingForm::Rotate`]); the force is turned by a right angle
//! at most; a shaded normal that is none leaves
//! the force as it was.
//! Cost: the god-object's face and three vertex normals; in a region of activation also the face across the edge.

mod at;
mod following;
mod form;
mod interpolated;
mod rectangular;
mod regions;

pub(crate) use following::Following;
pub use form::ShadingForm;
pub use rectangular::BoxRegions;
pub use regions::Regions;

use std::sync::Arc;

use nalgebra::Vector3;

use crate::algorithm::Touch;
use crate::cuboid::Cuboid;
use crate::error::ParameterError;
use crate::mesh::{Mesh, VertexNormals};
use crate::rolling::Share;
use crate::shape::{self, Shape};
use crate::shared::Shared;
use crate::surface::SurfacePoint;
use crate::touch_points::MAX_TOUCH_POINTS;

/// How the force of a contact is turned to make facets feel like a smooth surface.
///
/// Made for one mesh or box, and shared by all entities of that shape. On another shape it does nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Shading {
    /// As the facets are.
    #[default]
    None,
    /// Round all over: the normals of the vertices, interpolated (Melder eq. 4.25).
    Interpolated(Shared<VertexNormals>, ShadingForm),
    /// Flat but towards edges (Melder eq. 4.28-4.29).
    Regions(Shared<Regions>, ShadingForm),
    /// The same for a box.
    BoxRegions(BoxRegions, ShadingForm),
}

impl Shading {
    /// A mesh that feels round all over.
    ///
    /// Errors: a crease angle that is not between 0 and pi (rad).
    pub fn interpolated(
        mesh: &Mesh,
        crease_angle_rad: f64,
        form: ShadingForm,
    ) -> Result<Self, ParameterError> {
        Ok(Self::Interpolated(Arc::new(VertexNormals::of(mesh, crease_angle_rad)?).into(), form))
    }

    /// A mesh whose faces stay flat farther than `length_m` from their edges. On small triangles it is less: no more
    /// than the radius of the circle inside each.
    ///
    /// Errors: a crease angle that is not between 0 and pi (rad), a length that is not above 0.
    pub fn regions(
        mesh: &Mesh,
        length_m: f64,
        crease_angle_rad: f64,
        form: ShadingForm,
    ) -> Result<Self, ParameterError> {
        Ok(Self::Regions(Arc::new(Regions::of(mesh, length_m, crease_angle_rad)?).into(), form))
    }

    /// A box whose faces stay flat farther than `length_m` from their edges; never more than half its smallest size.
    ///
    /// Errors: a length that is not above 0.
    pub fn box_regions(cuboid: &Cuboid, length_m: f64, form: ShadingForm) -> Result<Self, ParameterError> {
        Ok(Self::BoxRegions(BoxRegions::of(cuboid, length_m)?, form))
    }

    /// The unit normal that is felt at a surface point instead of the one there.
    pub fn normal_at(&self, shape: &Shape, at: &SurfacePoint) -> Vector3<f64> {
        self.turned(shape, at, &at.normal_B, ShadingForm::Rotate)
    }

    /// How much memory is kept for it, whoever shares it.
    pub fn bytes(&self) -> usize {
        match self {
            Self::None | Self::BoxRegions(..) => 0,
            Self::Interpolated(normals, _) => normals.bytes(),
            Self::Regions(regions, _) => regions.bytes(),
        }
    }

    /// Turns the force of a contact, keeping its size.
    #[inline(always)]
    pub(crate) fn turn(&self, shape: &Shape, touch: &mut Touch) {
        if !matches!(self, Self::None) {
            // Copies: what is lent to a function that is not inlined has to live in memory, shaded or not.
            touch.force_on_user_B = self.turned_force(shape, touch.god_object, touch.force_on_user_B);
        }
    }

    /// As [`Self::turn`], of a ball that touches a mesh at these places.
    pub(crate) fn turn_shares(&self, shape: &Shape, shares: impl Iterator<Item = Share>, touch: &mut Touch) {
        if !matches!(self, Self::None) {
            touch.force_on_user_B =
                self.turned_shares(shape, shares).map(|share| share.force_on_user_B).sum();
        }
    }

    /// Shares of the places that a ball touches, turned.
    #[inline(never)]
    pub(crate) fn turned_shares(
        &self,
        shape: &Shape,
        shares: impl Iterator<Item = Share>,
    ) -> impl Iterator<Item = Share> {
        let mut turned = [const { None }; MAX_TOUCH_POINTS];
        let (mut plain_B, mut sum_B) = (Vector3::zeros(), Vector3::zeros());
        for (share, turned) in shares.zip(&mut turned) {
            let force_on_user_B = self.turned(shape, &share.at, &share.force_on_user_B, self.form());
            plain_B += share.force_on_user_B;
            sum_B += force_on_user_B;
            *turned = Some(Share { force_on_user_B, ..share });
        }
        let [plain_n, sum_n] = [plain_B, sum_B].map(|sum| sum.norm());
        let size = if sum_n > plain_n { plain_n / sum_n } else { 1.0 };
        turned
            .into_iter()
            .flatten()
            .map(move |share| Share { force_on_user_B: share.force_on_user_B * size, ..share })
    }

    #[inline(never)]
    fn turned_force(&self, shape: &Shape, at: SurfacePoint, force_B: Vector3<f64>) -> Vector3<f64> {
        self.turned(shape, &at, &force_B, self.form())
    }

    /// A vector at a surface point, turned; as it was where nothing is shaded.
    #[inline(always)]
    fn turned(
        &self,
        shape: &Shape,
        at: &SurfacePoint,
        v_B: &Vector3<f64>,
        form: ShadingForm,
    ) -> Vector3<f64> {
        match (self, shape) {
            (Self::Interpolated(normals, _), Shape::Mesh(mesh)) => {
                at::turned(&**normals, mesh, at, v_B, form)
            }
            (Self::Regions(regions, _), Shape::Mesh(mesh)) => at::turned(&**regions, mesh, at, v_B, form),
            (Self::BoxRegions(regions, _), Shape::Form(shape::Form::Cuboid(cuboid))) => {
                form.turned(v_B, &regions.turn(cuboid, at))
            }
            _ => *v_B,
        }
    }

    /// As printed it leaps.
    pub(crate) fn is_continuous(&self) -> bool {
        self.form() == ShadingForm::Rotate
    }

    fn form(&self) -> ShadingForm {
        match self {
            Self::None => ShadingForm::default(),
            Self::Interpolated(_, form) | Self::Regions(_, form) | Self::BoxRegions(_, form) => *form,
        }
    }
}
