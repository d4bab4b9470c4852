//! Draws a moment of a stage.

use crate::crowd::Crowd;
use crate::eyes::{Eyes, Look};
use crate::lamp::Lamp;
use crate::moment::Moment;
use crate::overlay::Overlay;
use crate::stage::{Stage, Thing};
use crate::triangles::Triangles;
use nalgebra::Isometry3;
use three_d::{
    AmbientLight, ClearState, Context, CpuMaterial, CpuMesh, DirectionalLight, Indices, Light, Mat4,
    PhysicalMaterial, Positions, RenderTarget, Srgba, Viewport, WriteMask, vec3,
};
use world::{LightKind, SceneCamera, SceneLight};

/// Of the shadows' picture, along each side.
const SHADOW_SIDE: u32 = 2048;
/// What is behind everything: red, green, blue.
const BACKGROUND: [f32; 3] = [0.86, 0.89, 0.93];
/// What things that are touched become like: red, green, blue; and how much.
const MARK: [f64; 3] = [1.0, 0.95, 0.5];
const MARKED: f64 = 0.3;

/// What draws: everything of a stage that lies in the graphics memory.
pub struct Painter {
    context: Context,
    things: Crowd,
    /// Whether the lights' shadows are those of where things are now.
    is_cast: bool,
    /// The sum of what all lights shed everywhere: shaders take one.
    everywhere: AmbientLight,
    lights: Vec<Shining>,
    overlay: Overlay,
    /// Whether hands, forces and contacts are drawn.
    pub with_overlay: bool,
    /// Whether things change their colour while they are touched.
    pub with_highlight: bool,
    /// Whether there are shadows.
    pub with_shadows: bool,
}

enum Shining {
    Sun { light: DirectionalLight, casts_shadow: bool },
    Lamp { light: Lamp, casts_shadow: bool },
}

impl Painter {
    /// Brings a stage into a context.
    pub fn new(context: &Context, stage: &Stage) -> Self {
        Self {
            context: context.clone(),
            things: Crowd::new(context, stage),
            is_cast: false,
            everywhere: AmbientLight::new(context, 1.0, colour_of(everywhere(&stage.lights))),
            lights: stage.lights.iter().filter_map(|light| shining(context, light)).collect(),
            overlay: Overlay::new(context, &stage.radii_m),
            with_overlay: true,
            with_highlight: true,
            with_shadows: true,
        }
    }

    /// Draws into a target what eyes at a camera see.
    pub fn draw(&mut self, moment: &Moment, camera: &SceneCamera, eyes: &Eyes, target: &RenderTarget<'_>) {
        let whole = Viewport::new_at_origo(target.width(), target.height());
        self.draw_within(moment, camera, eyes, target, whole);
    }

    /// The same into a part of a target; the rest of it stays as it is.
    pub fn draw_within(
        &mut self,
        moment: &Moment,
        camera: &SceneCamera,
        eyes: &Eyes,
        target: &RenderTarget<'_>,
        part: Viewport,
    ) {
        self.place(moment);
        self.cast_shadows();
        let [r, g, b] = BACKGROUND;
        target.clear_partially(part.into(), ClearState::color_and_depth(r, g, b, 1.0, 1.0));
        for look in eyes.looks(camera, part) {
            target.clear_partially(part.into(), ClearState::depth(1.0));
            self.draw_look(&look, target, part);
        }
    }

    fn place(&mut self, moment: &Moment) {
        let (space, marks) = (moment.seen_space(), self.with_overlay && self.with_highlight);
        let is_moved = self.things.place(|thing| look_of(thing, moment, space, marks));
        self.is_cast &= !is_moved;
        self.overlay.place(moment);
    }

    fn draw_look(&mut self, look: &Look, target: &RenderTarget<'_>, part: Viewport) {
        self.things.mask(look.channels);
        let own = self.lights.iter().map(Shining::light);
        let lights: Vec<&dyn Light> = [&self.everywhere as &dyn Light].into_iter().chain(own).collect();
        target.render_partially(part.into(), &look.eye, self.things.objects(), &lights);
        // What things hide first: what is not hidden would hide it.
        for is_hidden in [true, false].into_iter().filter(|_| self.with_overlay) {
            self.overlay.show(look.channels, is_hidden);
            target.render_partially(part.into(), &look.eye, self.overlay.objects(), &lights);
        }
    }

    /// While nothing moves, shadows stay.
    fn cast_shadows(&mut self) {
        if self.is_cast && self.with_shadows {
            return;
        }
        self.is_cast = self.with_shadows;
        let casting = self.things.casting();
        for light in &mut self.lights {
            match light {
                Shining::Sun { light, casts_shadow } => {
                    let is_cast = self.with_shadows && *casts_shadow && !casting.is_empty();
                    let casting = casting.iter().copied();
                    if !is_cast || light.generate_shadow_map(SHADOW_SIDE, casting).is_err() {
                        light.clear_shadow_map();
                    }
                }
                Shining::Lamp { light, casts_shadow: true } if self.with_shadows => light.cast(&casting),
                Shining::Lamp { light, .. } => light.cast_none(),
            }
        }
    }

    /// The context that it draws in.
    pub fn context(&self) -> &Context {
        &self.context
    }
}

/// Where a thing is and which colour it has there; `None`: it is in another space than is seen.
fn look_of(thing: &Thing, moment: &Moment, space: u32, marks: bool) -> Option<(Mat4, [f64; 4])> {
    let pose = moment.poses.get(thing.entity).copied().unwrap_or_default();
    let is_touched = || moment.fingers.iter().any(|finger| finger.entity == Some(thing.entity));
    let colour = if marks && is_touched() { touched(thing.colour) } else { thing.colour };
    (thing.space == space).then(|| (matrix(&(pose * thing.pose)), colour))
}

impl Shining {
    fn light(&self) -> &dyn Light {
        match self {
            Self::Sun { light, .. } => light,
            Self::Lamp { light, .. } => light,
        }
    }
}

fn everywhere(lights: &[SceneLight]) -> [f64; 3] {
    std::array::from_fn(|colour| lights.iter().map(|light| light.ambient[colour]).sum::<f64>().min(1.0))
}

/// `None`: it only shines everywhere.
fn shining(context: &Context, light: &SceneLight) -> Option<Shining> {
    let colour = colour_of(light.diffuse);
    Some(match light.kind {
        LightKind::Ambient => return None,
        LightKind::Directional { direction } => Shining::Sun {
            light: DirectionalLight::new(context, BRIGHT, colour, vector(&direction)),
            casts_shadow: light.casts_shadow,
        },
        LightKind::Point { position_m, attenuation } => {
            let lamp =
                Lamp::new(context, BRIGHT, colour, vector(&position_m.coords), vector(&attenuation.into()));
            Shining::Lamp { light: lamp, casts_shadow: light.casts_shadow }
        }
    })
}

/// What three-d's model of a surface divides by and scenes do not.
const BRIGHT: f32 = std::f32::consts::PI;

/// Shares of white light are of its power; a colour's bytes are of what it looks like.
fn colour_of(shares: [f64; 3]) -> Srgba {
    let [r, g, b] = shares.map(|share| {
        let seen = if share <= 0.003_130_8 { 12.92 * share } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 };
        (255.0 * seen).round() as u8
    });
    Srgba::new(r, g, b, 255)
}

/// Mixed with what marks things that are touched (Melder 8.3.1.2).
fn touched([r, g, b, opacity]: [f64; 4]) -> [f64; 4] {
    let mixed = |own: f64, mark: f64| (1.0 - MARKED) * own + MARKED * mark;
    let [mark_r, mark_g, mark_b] = MARK;
    [mixed(r, mark_r), mixed(g, mark_g), mixed(b, mark_b), opacity]
}

pub(crate) fn bytes(colour: [f64; 4]) -> Srgba {
    colour.map(|share| (255.0 * share).round() as u8).into()
}

pub(crate) fn material(context: &Context, colour: [f64; 4]) -> PhysicalMaterial {
    let made = CpuMaterial { albedo: bytes(colour), roughness: 0.7, metallic: 0.0, ..CpuMaterial::default() };
    if colour[3] < 1.0 {
        PhysicalMaterial::new_transparent(context, &made)
    } else {
        PhysicalMaterial::new_opaque(context, &made)
    }
}

/// Lets only these of red, green and blue be drawn.
pub(crate) fn mask(material: &mut PhysicalMaterial, [red, green, blue]: [bool; 3]) {
    let write_mask = &mut material.render_states.write_mask;
    *write_mask = WriteMask { red, green, blue, ..*write_mask };
}

pub(crate) fn mesh_of(triangles: &Triangles) -> CpuMesh {
    CpuMesh {
        positions: Positions::F32(triangles.places.iter().map(|place| vector(&place.coords)).collect()),
        normals: Some(triangles.normals.iter().map(vector).collect()),
        indices: Indices::U32(triangles.corners.as_flattened().to_vec()),
        ..CpuMesh::default()
    }
}

pub(crate) fn vector(v: &nalgebra::Vector3<f64>) -> three_d::Vec3 {
    vec3(v.x as f32, v.y as f32, v.z as f32)
}

pub(crate) fn matrix(pose: &Isometry3<f64>) -> Mat4 {
    let entries: [[f32; 4]; 4] = pose.to_homogeneous().cast::<f32>().into();
    entries.into()
}
