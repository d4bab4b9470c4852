//! Labels of a mesh's faces: which part of its file each of them is of.
//!
//! Memory: 2 bytes a face; meshes without labels keep none.

use super::{CloseHoles, CornerUv, Mesh, MeshError, MeshReport, TriangleSoup};

/// Data of a soup's faces beside their corners; each list is as long as there are faces.
#[derive(Debug, Clone, Copy, Default)]
pub struct FaceData<'a> {
    /// Texture coordinates.
    pub uv: Option<&'a [CornerUv]>,
    /// Labels; 0 stands for none.
    pub labels: Option<&'a [u16]>,
}

impl Mesh {
    /// As [`Self::build_closing`], of faces of which this is known. A lid over a hole has the label of a face beside it.
    ///
    /// # Errors
    /// As [`Self::build`]; coordinates that are not finite or too large, or lists of another length.
    pub fn build_with(
        soup: TriangleSoup,
        of_faces: FaceData<'_>,
        holes: CloseHoles,
    ) -> Result<(Self, MeshReport), MeshError> {
        let FaceData { uv, labels } = of_faces;
        let count = soup.faces.len();
        if let Some(labels) = labels.filter(|labels| labels.len() != count) {
            return Err(MeshError::LabelNumber { found: labels.len(), faces: count });
        }
        let mut own = Vec::with_capacity(if labels.is_some() { count } else { 0 });
        let tell = |origin: usize| own.extend(labels.map(|labels| labels[origin]));
        let (mut mesh, report) = match uv {
            Some(uv) => Self::build_with_uv_and_tell(soup, uv, holes, tell)?,
            None => {
                let mut tell = tell;
                Self::build_and_tell(soup, holes, |origin, _| tell(origin))?
            }
        };
        mesh.labels = labels.map(|_| own.into_boxed_slice());
        Ok((mesh, report))
    }

    /// The label of a face; 0 if it has none.
    #[inline]
    pub fn label(&self, face: u32) -> u16 {
        self.labels.as_ref().and_then(|labels| labels.get(face as usize)).copied().unwrap_or(0)
    }

    /// The labels of all faces, if it has any.
    pub fn labels(&self) -> Option<&[u16]> {
        self.labels.as_deref()
    }
}
