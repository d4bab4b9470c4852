//! Positions and indices out of a glTF file's buffers.

use super::buffers::Buffers;
use super::document::{Accessor, Document, Sparse};
use super::{missing, wrong};
use crate::model::ModelError;
use nalgebra::{Matrix4, SVector, Vector2, Vector3};

pub(super) struct Accessors<'d> {
    document: &'d Document,
    buffers: &'d Buffers<'d>,
    /// Number of elements that may still be read, and of primitives that may still be asked for.
    left: usize,
    most: usize,
}

impl<'d> Accessors<'d> {
    pub(super) fn new(document: &'d Document, buffers: &'d Buffers<'d>, most: usize) -> Self {
        Self { document, buffers, left: most, most }
    }

    pub(super) fn positions(
        &mut self,
        index: usize,
        primitive: &str,
    ) -> Result<Vec<Vector3<f64>>, ModelError> {
        self.vectors(index, &format!("{primitive}.attributes.POSITION"), "positions")
    }

    /// Texture coordinates, in pictures from the upper left corner.
    pub(super) fn uv(&mut self, index: usize, primitive: &str) -> Result<Vec<Vector2<f64>>, ModelError> {
        self.vectors(index, &format!("{primitive}.attributes.TEXCOORD"), "texture coordinates")
    }

    /// One for each joint of a skin.
    pub(super) fn matrices(&mut self, index: usize, skin: &str) -> Result<Vec<Matrix4<f64>>, ModelError> {
        let user = format!("{skin}.inverseBindMatrices");
        let columns = self.of_kind::<16>("MAT4", index, &user, "inverse bind matrices")?;
        Ok(columns.iter().map(|columns| Matrix4::from_column_slice(columns.as_slice())).collect())
    }

    pub(super) fn vectors<const N: usize>(
        &mut self,
        index: usize,
        user: &str,
        what: &str,
    ) -> Result<Vec<SVector<f64, N>>, ModelError> {
        self.of_kind(&format!("VEC{N}"), index, user, what)
    }

    fn of_kind<const N: usize>(
        &mut self,
        allowed: &str,
        index: usize,
        user: &str,
        what: &str,
    ) -> Result<Vec<SVector<f64, N>>, ModelError> {
        let (place, accessor) = self.accessor(index, user)?;
        if accessor.kind != allowed {
            let whose = if N == 16 { "a skin" } else { "a primitive" };
            return Err(kind(&place, accessor, &format!("{allowed}, since {whose} has it for its {what}")));
        }
        let component = Component::of(accessor.component_type)
            .filter(|component| *component != Component::U32)
            .ok_or_else(|| {
                component_type(&place, accessor.component_type, &format!("5120 to 5123 or 5126 for {what}"))
            })?;
        let mut vectors = vec![SVector::<f64, N>::zeros(); self.take(accessor.count, &place)?];
        let read = |bytes: &[u8]| {
            SVector::from_fn(|axis, _| {
                component.value(&bytes[axis * component.bytes()..], accessor.normalized)
            })
        };
        let width = N * component.bytes();
        if let Some(view) = accessor.buffer_view {
            let elements = self.elements(view, accessor.byte_offset, accessor.count, width, &place)?;
            vectors.iter_mut().zip(elements).for_each(|(vector, bytes)| *vector = read(bytes));
        }
        if let Some(sparse) = &accessor.sparse {
            let (at, values) = self.sparse(sparse, width, accessor.count, &place)?;
            at.into_iter().zip(values).for_each(|(at, bytes)| vectors[at as usize] = read(bytes));
        }
        match vectors.iter().position(|vector| !vector.iter().all(|x| x.is_finite())) {
            Some(element) => {
                let at = vectors[element].as_slice();
                Err(wrong(place, format!("element {element} at {at:?}"), "finite numbers"))
            }
            None => Ok(vectors),
        }
    }

    /// Indices below a number of vertices.
    pub(super) fn indices(
        &mut self,
        index: usize,
        vertices: usize,
        primitive: &str,
    ) -> Result<Vec<u32>, ModelError> {
        let (place, accessor) = self.accessor(index, &format!("{primitive}.indices"))?;
        if accessor.kind != "SCALAR" {
            return Err(kind(&place, accessor, "SCALAR, since a primitive has it for its indices"));
        }
        let component = index_component(&place, accessor.component_type)?;
        let mut indices = vec![0; self.take(accessor.count, &place)?];
        if let Some(view) = accessor.buffer_view {
            let elements =
                self.elements(view, accessor.byte_offset, accessor.count, component.bytes(), &place)?;
            indices.iter_mut().zip(elements).for_each(|(index, bytes)| *index = component.index(bytes));
        }
        if let Some(sparse) = &accessor.sparse {
            let (at, values) = self.sparse(sparse, component.bytes(), accessor.count, &place)?;
            at.into_iter().zip(values).for_each(|(at, bytes)| indices[at as usize] = component.index(bytes));
        }
        match indices.iter().position(|&index| index as usize >= vertices) {
            Some(element) => {
                let found = format!("element {element} = {}", indices[element]);
                let allowed = format!("indices of the {vertices} vertices of {primitive}, from 0");
                Err(wrong(place, found, &allowed))
            }
            None => Ok(indices),
        }
    }

    /// Of each node, since a mesh of many primitives, which may have no vertex, may be that of many nodes.
    pub(super) fn count_primitive(&mut self, place: &str) -> Result<(), ModelError> {
        self.take(1, place).map(drop)
    }

    fn accessor(&self, index: usize, user: &str) -> Result<(String, &'d Accessor), ModelError> {
        let all = &self.document.accessors;
        let accessor = all.get(index).ok_or_else(|| missing(&format!("{user} = {index}"), all.len()))?;
        Ok((format!("accessors[{index}]"), accessor))
    }

    fn take(&mut self, count: usize, place: &str) -> Result<usize, ModelError> {
        match self.left.checked_sub(count) {
            Some(left) => {
                self.left = left;
                Ok(count)
            }
            None => {
                let found = format!(
                    "{count} elements, which makes more than {} vertices, indices and primitives in all",
                    self.most
                );
                Err(wrong(
                    place.into(),
                    found,
                    "at most so many in a file of this size; leave repeated parts out",
                ))
            }
        }
    }

    /// Elements that differ from the rest, by index, with their values.
    fn sparse(
        &mut self,
        sparse: &Sparse,
        width: usize,
        count: usize,
        place: &str,
    ) -> Result<(Vec<u32>, impl Iterator<Item = &'d [u8]>), ModelError> {
        let place = format!("{place}.sparse");
        self.take(sparse.count, &place)?;
        let component = index_component(&place, sparse.indices.component_type)?;
        let (Some(indices), Some(values)) = (sparse.indices.buffer_view, sparse.values.buffer_view) else {
            return Err(wrong(place, "no bufferView".into(), "one for the indices and one for the values"));
        };
        let at =
            self.elements(indices, sparse.indices.byte_offset, sparse.count, component.bytes(), &place)?;
        let at: Vec<u32> = at.map(|bytes| component.index(bytes)).collect();
        if let Some(beyond) = at.iter().find(|at| **at as usize >= count) {
            return Err(wrong(
                place,
                format!("index {beyond}"),
                &format!("indices of {count} elements, from 0"),
            ));
        }
        Ok((at, self.elements(values, sparse.values.byte_offset, sparse.count, width, &place)?))
    }

    /// The bytes of each element.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        width: usize,
        place: &str,
    ) -> Result<impl Iterator<Item = &'d [u8]> + use<'d>, ModelError> {
        let views = &self.document.buffer_views;
        let view_place = format!("bufferViews[{view}]");
        let stride = views.get(view).and_then(|view| view.byte_stride).unwrap_or(width);
        if view >= views.len() {
            return Err(missing(&format!("{place}.bufferView = {view}"), views.len()));
        }
        let bytes = self.buffers.of_view(self.document, view)?;
        if stride < width {
            return Err(wrong(view_place, format!("byteStride {stride}"), &format!("{width} or more")));
        }
        let end = count
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|way| way.checked_add(width)?.checked_add(offset));
        if count > 0 && end.is_none_or(|end| end > bytes.len()) {
            let found = format!("{count} elements of {width} bytes from byte {offset}, {stride} apart");
            return Err(wrong(
                place.into(),
                found,
                &format!("as many as {} bytes of {view_place} hold", bytes.len()),
            ));
        }
        Ok((0..count).map(move |element| &bytes[offset + element * stride..][..width]))
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn bits(self, bytes: &[u8]) -> u32 {
        bytes[..self.bytes()].iter().rev().fold(0, |bits, &byte| bits << 8 | u32::from(byte))
    }

    fn index(self, bytes: &[u8]) -> u32 {
        self.bits(bytes)
    }

    fn value(self, bytes: &[u8], normalized: bool) -> f64 {
        let bits = self.bits(bytes);
        let (value, largest) = match self {
            Self::F32 => return f64::from(f32::from_bits(bits)),
            Self::I8 => (f64::from(bits as u8 as i8), f64::from(i8::MAX)),
            Self::I16 => (f64::from(bits as u16 as i16), f64::from(i16::MAX)),
            Self::U8 => (f64::from(bits), f64::from(u8::MAX)),
            Self::U16 => (f64::from(bits), f64::from(u16::MAX)),
            Self::U32 => (f64::from(bits), f64::from(u32::MAX)),
        };
        if normalized { (value / largest).max(-1.0) } else { value }
    }
}

fn index_component(place: &str, code: u32) -> Result<Component, ModelError> {
    let component = Component::of(code)
        .filter(|component| matches!(component, Component::U8 | Component::U16 | Component::U32));
    component.ok_or_else(|| component_type(place, code, "5121, 5123 or 5125 for indices"))
}

fn component_type(place: &str, code: u32, allowed: &str) -> ModelError {
    wrong(format!("{place}.componentType"), code.to_string(), allowed)
}

fn kind(place: &str, accessor: &Accessor, allowed: &str) -> ModelError {
    let found: String = accessor.kind.escape_default().take(20).collect();
    wrong(format!("{place}.type"), format!("\"{found}\""), allowed)
}
