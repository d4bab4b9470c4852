//! What morph targets and skins make of a primitive's vertices, as the file has them at rest.
//!
//! Model: a morph target is added to the positions, times its weight: of the node, else of the mesh. A skin puts each vertex to
//! the mean, by its weights, of where its joints would put it; a joint does so by its own node and the inverse of where it was
//! bound. The node that shows a skinned mesh does not move it, as the format has it.
//! Frames: W is the scene's, J that of a joint, B that in which the mesh was bound to its joints.

use super::accessor::Accessors;
use super::document::{Document, Primitive};
use super::{linear, missing, wrong};
use crate::model::ModelError;
use nalgebra::{Matrix4, Vector3, Vector4};

/// Adds the morph targets, of which each weight is one's share.
pub(super) fn morph(
    accessors: &mut Accessors<'_>,
    primitive: &Primitive,
    weights: &[f64],
    positions: &mut [Vector3<f64>],
    place: &str,
) -> Result<(), ModelError> {
    for (number, (target, &weight)) in primitive.targets.iter().zip(weights).enumerate() {
        let Some(offsets) = target.position.filter(|_| weight != 0.0) else { continue };
        let place = format!("{place}.targets[{number}]");
        let offsets = accessors.vectors::<3>(offsets, &format!("{place}.POSITION"), "positions")?;
        check_count(&place, offsets.len(), positions.len())?;
        positions.iter_mut().zip(&offsets).for_each(|(position, offset)| *position += offset * weight);
    }
    Ok(())
}

/// Joints of a skin: where each puts what is bound to it.
#[derive(Default)]
pub(super) struct Skin {
    X_WB: Vec<Matrix4<f64>>,
}

impl Skin {
    /// The one of this number; `X_WN` are the places of the scene's nodes.
    pub(super) fn read(
        document: &Document,
        accessors: &mut Accessors<'_>,
        index: usize,
        X_WN: &[Option<Matrix4<f64>>],
        node: &str,
    ) -> Result<Self, ModelError> {
        let skins = &document.skins;
        let skin = skins.get(index).ok_or_else(|| missing(&format!("{node}.skin = {index}"), skins.len()))?;
        let place = format!("skins[{index}]");
        let bound = skin.inverse_bind_matrices;
        let X_JB = bound.map(|bound| accessors.matrices(bound, &place)).transpose()?;
        let X_JB = X_JB.unwrap_or_else(|| vec![Matrix4::identity(); skin.joints.len()]);
        if X_JB.len() < skin.joints.len() {
            let found = format!("{} inverseBindMatrices", X_JB.len());
            return Err(wrong(place, found, &format!("one for each of its {} joints", skin.joints.len())));
        }
        let X_WB = skin.joints.iter().zip(X_JB).map(|(&joint, X_JB)| {
            let X_WJ = X_WN.get(joint).copied().flatten();
            let found = || format!("joint {joint}, which the scene does not have");
            X_WJ.map(|X_WJ| X_WJ * X_JB).ok_or_else(|| wrong(place.clone(), found(), "nodes of the scene"))
        });
        Ok(Self { X_WB: X_WB.collect::<Result<_, _>>()? })
    }

    /// Puts the vertices of a primitive to where its joints have them; says whether that turns them inside out.
    pub(super) fn place(
        &self,
        accessors: &mut Accessors<'_>,
        primitive: &Primitive,
        positions: &mut [Vector3<f64>],
        place: &str,
    ) -> Result<bool, ModelError> {
        let attributes = &primitive.attributes;
        let sets = [(attributes.joints_0, attributes.weights_0), (attributes.joints_1, attributes.weights_1)];
        let mut X_WB = vec![(Matrix4::zeros(), 0.0); positions.len()];
        for (joints, weights) in sets.into_iter().filter_map(|(joints, weights)| joints.zip(weights)) {
            let user = |name: &str| format!("{place}.attributes.{name}");
            let joints = accessors.vectors::<4>(joints, &user("JOINTS"), "joints")?;
            let weights = accessors.vectors::<4>(weights, &user("WEIGHTS"), "weights")?;
            check_count(place, joints.len().min(weights.len()), positions.len())?;
            for (sum, (joints, weights)) in X_WB.iter_mut().zip(joints.iter().zip(&weights)) {
                self.add(sum, joints, weights, place)?;
            }
        }
        let mut is_turned = None;
        for (position, (X_WB, weight)) in
            positions.iter_mut().zip(X_WB).filter(|(_, (_, weight))| *weight > 0.0)
        {
            let X_WB = X_WB / weight;
            is_turned = is_turned.or(Some(linear(&X_WB).determinant() < 0.0));
            *position = X_WB.transform_point(&(*position).into()).coords;
        }
        Ok(is_turned.unwrap_or(false))
    }

    fn add(
        &self,
        (sum, total): &mut (Matrix4<f64>, f64),
        joints: &Vector4<f64>,
        weights: &Vector4<f64>,
        place: &str,
    ) -> Result<(), ModelError> {
        for (&joint, &weight) in joints.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            let X_WB = self.X_WB.get(joint as usize).ok_or_else(|| {
                let allowed = format!("joints of its skin, of which there are {}, from 0", self.X_WB.len());
                wrong(place.into(), format!("joint {joint}"), &allowed)
            })?;
            *sum += X_WB * weight;
            *total += weight;
        }
        Ok(())
    }
}

fn check_count(place: &str, found: usize, positions: usize) -> Result<(), ModelError> {
    if found == positions {
        return Ok(());
    }
    Err(wrong(
        place.into(),
        format!("{found} elements"),
        &format!("one for each of its {positions} positions"),
    ))
}
