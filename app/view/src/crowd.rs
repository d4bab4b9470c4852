//! Things in the graphics memory: those that look alike are drawn together.
//!
//! Model: a call to the graphics takes as long as some thousand triangles. Opaque things of the same triangles are drawn by one
//! call, however many they are; what light goes through is drawn one by one, since it is sorted by how far away it is.

use crate::painter::{bytes, mask, material, mesh_of};
use crate::stage::Thing;
use crate::triangles::Triangles;
use std::sync::Arc;
use three_d::{
    Context, CpuTexture, Geometry, Gm, InstancedMesh, Instances, Mat4, Mesh, Object, PhysicalMaterial,
    Texture2DRef, TextureData, Wrapping,
};
use world::model::{Texture, Wrap};

/// All things of a stage.
pub(crate) struct Crowd {
    alike: Vec<Alike>,
    clear: Vec<Clear>,
}

/// Opaque things of the same triangles.
struct Alike {
    triangles: Arc<Triangles>,
    casts_shadow: bool,
    things: Vec<Thing>,
    shown: Instances,
    model: Gm<InstancedMesh, PhysicalMaterial>,
}

/// A thing that light goes through.
struct Clear {
    thing: Thing,
    is_seen: bool,
    at: Mat4,
    model: Gm<Mesh, PhysicalMaterial>,
}

impl Crowd {
    pub(crate) fn new(context: &Context, things: &[Thing]) -> Self {
        let (mut alike, mut clear) = (Vec::<Alike>::new(), Vec::new());
        let mut textures = Textures { context, made: Vec::new() };
        for thing in things {
            if thing.is_clear() {
                clear.push(Clear::new(context, thing, textures.of(thing)));
                continue;
            }
            let is_like = |known: &&mut Alike| {
                Arc::ptr_eq(&known.triangles, &thing.triangles) && known.casts_shadow == thing.casts_shadow
            };
            match alike.iter_mut().find(is_like) {
                Some(known) => known.things.push(thing.clone()),
                None => alike.push(Alike::new(context, thing, textures.of(thing))),
            }
        }
        Self { alike, clear }
    }

    /// Puts each thing of which `look` tells where it is and which colour it has there, and hides the others; says whether
    /// anything stands elsewhere than before.
    pub(crate) fn place(&mut self, look: impl Fn(&Thing) -> Option<(Mat4, [f64; 4])>) -> bool {
        let mut is_moved = false;
        for alike in &mut self.alike {
            is_moved |= alike.place(&look);
        }
        for clear in &mut self.clear {
            is_moved |= clear.place(look(&clear.thing));
        }
        is_moved
    }

    /// Lets only these of red, green and blue be drawn.
    pub(crate) fn mask(&mut self, channels: [bool; 3]) {
        self.alike.iter_mut().for_each(|alike| mask(&mut alike.model.material, channels));
        self.clear.iter_mut().for_each(|clear| mask(&mut clear.model.material, channels));
    }

    pub(crate) fn objects(&self) -> impl Iterator<Item = &dyn Object> {
        let alike =
            self.alike.iter().filter(|alike| alike.is_seen()).map(|alike| &alike.model as &dyn Object);
        let clear = self.clear.iter().filter(|clear| clear.is_seen);
        alike.chain(clear.map(|clear| &clear.model as &dyn Object))
    }

    /// Those that cast shadows.
    pub(crate) fn casting(&self) -> Vec<&dyn Geometry> {
        let alike = self.alike.iter().filter(|alike| alike.casts_shadow && alike.is_seen());
        let clear = self.clear.iter().filter(|clear| clear.thing.casts_shadow && clear.is_seen);
        let alike = alike.map(|alike| &alike.model.geometry as &dyn Geometry);
        alike.chain(clear.map(|clear| &clear.model.geometry as &dyn Geometry)).collect()
    }
}

/// Textures in the graphics memory: each is there once.
struct Textures<'c> {
    context: &'c Context,
    made: Vec<(Arc<Texture>, Texture2DRef)>,
}

impl Textures<'_> {
    fn of(&mut self, thing: &Thing) -> Option<Texture2DRef> {
        let texture = thing.texture.as_ref()?;
        if let Some((_, made)) = self.made.iter().find(|(of, _)| Arc::ptr_eq(of, texture)) {
            return Some(made.clone());
        }
        let [wrap_s, wrap_t] = texture.wraps.map(|wrap| match wrap {
            Wrap::Repeat => Wrapping::Repeat,
            Wrap::Mirror => Wrapping::MirroredRepeat,
            Wrap::Edge => Wrapping::ClampToEdge,
        });
        let mut texels = CpuTexture {
            data: TextureData::RgbaU8(texture.texels.clone()),
            width: texture.size[0],
            height: texture.size[1],
            wrap_s,
            wrap_t,
            ..CpuTexture::default()
        };
        // Light is computed with shares of its power.
        texels.data.to_linear_srgb();
        let made = Texture2DRef::from_cpu_texture(self.context, &texels);
        self.made.push((Arc::clone(texture), made.clone()));
        Some(made)
    }
}

impl Alike {
    fn new(context: &Context, first: &Thing, texture: Option<Texture2DRef>) -> Self {
        let shown = Instances { colors: Some(Vec::new()), ..Instances::default() };
        let mesh = InstancedMesh::new(context, &shown, &mesh_of(&first.triangles));
        Self {
            triangles: Arc::clone(&first.triangles),
            casts_shadow: first.casts_shadow,
            things: vec![first.clone()],
            shown,
            model: Gm::new(
                mesh,
                PhysicalMaterial { albedo_texture: texture, ..material(context, [1.0; 4], false) },
            ),
        }
    }

    fn place(&mut self, look: impl Fn(&Thing) -> Option<(Mat4, [f64; 4])>) -> bool {
        let seen = self.things.iter().filter_map(look).map(|(at, colour)| (at, bytes(colour)));
        let (transformations, colours): (Vec<_>, Vec<_>) = seen.unzip();
        let is_moved = transformations != self.shown.transformations;
        if is_moved || self.shown.colors.as_ref() != Some(&colours) {
            self.shown = Instances { transformations, colors: Some(colours), ..Instances::default() };
            self.model.set_instances(&self.shown);
        }
        is_moved
    }

    fn is_seen(&self) -> bool {
        !self.shown.transformations.is_empty()
    }
}

impl Clear {
    fn new(context: &Context, thing: &Thing, texture: Option<Texture2DRef>) -> Self {
        let mesh = Mesh::new(context, &mesh_of(&thing.triangles));
        let model = Gm::new(
            mesh,
            PhysicalMaterial { albedo_texture: texture, ..material(context, thing.colour, true) },
        );
        Self { thing: thing.clone(), is_seen: false, at: Mat4::from_scale(0.0), model }
    }

    fn place(&mut self, look: Option<(Mat4, [f64; 4])>) -> bool {
        let was_seen = std::mem::replace(&mut self.is_seen, look.is_some());
        let Some((at, colour)) = look else { return was_seen };
        self.model.material.albedo = bytes(colour);
        self.model.set_transformation(at);
        !was_seen || std::mem::replace(&mut self.at, at) != at
    }
}
