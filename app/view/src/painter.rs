//! Draws a moment of a stage.

use crate::crowd::Crowd;
use crate::eyes::{Eyes, Look};
use crate::lamp::Lamp;
use crate::moment::Moment;
use crate::overlay::Overlay;
use crate::stage::{Stage, Thing};
use crate::triangles::Triangles;
use nalgebra::{Isometry3, UnitQuaternion};
use three_d::{
    AmbientLight, ClearState, Context, CpuMaterial, CpuMesh, DirectionalLight, Indices, Light, Mat4,
    PhysicalMaterial, Positions, RenderTarget, Srgba, Viewport, WriteMask, vec2, vec3,
};
use world::{LightKind, SceneCamera, SceneLight};

/// Of the shadows' picture, along each side.
const SHADOW_SIDE: u32 = 2048;
/// What is behind everything: red, green, blue.
const BACKGROUND: [f32; 3] = [0.86, 0.89, 0.93];
/// What things that fingers touch become like: red, green, blue; and how much.
const TOUCHED: [f64; 3] = [1.0, 0.95, 0.5];
const TOUCHED_SHARE: f64 = 0.3;
/// And things that touch each other.
const COLLIDING: [f64; 3] = [0.9, 0.3, 0.75];
const COLLIDING_SHARE: f64 = 0.25;
/// And the thing that people have chosen.
const CHOSEN: [f64; 3] = [0.45, 0.1, 1.0];
const CHOSEN_SHARE: f64 = 0.6;

/// What draws: everything of a stage that lies in the graphics memory.
pub struct Painter {
    context: Context,
    things: Crowd,
    rims: Crowd,
    /// Whether the lights' shadows are those of where things are now.
    is_cast: bool,
    /// The sum of what all lights shed everywhere: shaders take one.
    everywhere: AmbientLight,
    lights: Vec<Shining>,
    overlay: Overlay,
    /// Whether hands, forces, contacts and the rims of meshes are drawn.
    pub with_overlay: bool,
    /// Whether things change their colour while fingers touch them or they touch each other.
    pub with_highlight: bool,
    /// Whether there are shadows.
    pub with_shadows: bool,
    /// The entity that people have chosen, which is marked.
    pub chosen: Option<usize>,
    /// How the sun is turned from where the scene has it.
    pub sun: UnitQuaternion<f64>,
    /// How it was when shadows were cast.
    cast_sun: UnitQuaternion<f64>,
}

enum Shining {
    Sun { light: DirectionalLight, direction: nalgebra::Vector3<f64>, casts_shadow: bool },
    Lamp { light: Lamp, casts_shadow: bool },
}

impl Painter {
    /// Brings a stage into a context.
    pub fn new(context: &Context, stage: &Stage) -> Self {
        Self {
            context: context.clone(),
            things: Crowd::new(context, &stage.things),
            rims: Crowd::new(context, &stage.rims),
            is_cast: false,
            everywhere: AmbientLight::new(context, 1.0, colour_of(everywhere(&stage.lights))),
            lights: stage.lights.iter().filter_map(|light| shining(context, light)).collect(),
            overlay: Overlay::new(context, &stage.radii_m),
            with_overlay: true,
            with_highlight: true,
            with_shadows: true,
            chosen: None,
            sun: UnitQuaternion::identity(),
            cast_sun: UnitQuaternion::identity(),
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
        let space = moment.seen_space();
        let marks = Marks { contacts: self.with_overlay && self.with_highlight, chosen: self.chosen };
        let is_moved = self.things.place(|thing| look_of(thing, moment, space, &marks));
        self.is_cast &= !is_moved;
        self.rims.place(|thing| look_of(thing, moment, space, &Marks { contacts: false, chosen: None }));
        self.overlay.place(moment);
    }

    fn draw_look(&mut self, look: &Look, target: &RenderTarget<'_>, part: Viewport) {
        self.things.mask(look.channels);
        let own = self.lights.iter().map(Shining::light);
        let lights: Vec<&dyn Light> = [&self.everywhere as &dyn Light].into_iter().chain(own).collect();
        target.render_partially(part.into(), &look.eye, self.things.objects(), &lights);
        if self.with_overlay {
            self.rims.mask(look.channels);
            target.render_partially(part.into(), &look.eye, self.rims.objects(), &lights);
        }
        // What things hide first: what is not hidden would hide it.
        for is_hidden in [true, false].into_iter().filter(|_| self.with_overlay) {
            self.overlay.show(look.channels, is_hidden);
            target.render_partially(part.into(), &look.eye, self.overlay.objects(), &lights);
        }
    }

    /// While nothing moves, shadows stay.
    fn cast_shadows(&mut self) {
        if self.is_cast && self.with_shadows && self.cast_sun == self.sun {
            return;
        }
        (self.is_cast, self.cast_sun) = (self.with_shadows, self.sun);
        let casting = self.things.casting();
        for light in &mut self.lights {
            match light {
                Shining::Sun { light, direction, casts_shadow } => {
                    light.direction = vector(&(self.sun * *direction));
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

/// What is marked by colours.
struct Marks {
    /// What is touched, and what collides.
    contacts: bool,
    chosen: Option<usize>,
}

/// Where a thing is and which colour it has there; `None`: it is in another space than is seen.
fn look_of(thing: &Thing, moment: &Moment, space: u32, marks: &Marks) -> Option<(Mat4, [f64; 4])> {
    if thing.space != space {
        return None;
    }
    let pose = moment.poses.get(thing.entity).copied().unwrap_or_default();
    Some((matrix(&(pose * thing.pose)), marked(thing, moment, marks)))
}

fn marked(thing: &Thing, moment: &Moment, marks: &Marks) -> [f64; 4] {
    let mut colour = thing.colour;
    if marks.chosen == Some(thing.entity) {
        colour = mixed(colour, CHOSEN, CHOSEN_SHARE);
    }
    if marks.contacts && moment.colliding.binary_search(&thing.entity).is_ok() {
        colour = mixed(colour, COLLIDING, COLLIDING_SHARE);
    }
    if marks.contacts && moment.fingers.iter().any(|finger| finger.entity == Some(thing.entity)) {
        colour = mixed(colour, TOUCHED, TOUCHED_SHARE);
    }
    colour
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
            direction: *direction,
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

/// With so much of what marks things (Melder 8.3.1.2).
fn mixed([r, g, b, opacity]: [f64; 4], mark: [f64; 3], share: f64) -> [f64; 4] {
    let mixed = |own: f64, mark: f64| (1.0 - share) * own + share * mark;
    [mixed(r, mark[0]), mixed(g, mark[1]), mixed(b, mark[2]), opacity]
}

pub(crate) fn bytes(colour: [f64; 4]) -> Srgba {
    colour.map(|share| (255.0 * share).round() as u8).into()
}

pub(crate) fn material(context: &Context, colour: [f64; 4], is_clear: bool) -> PhysicalMaterial {
    let made = CpuMaterial { albedo: bytes(colour), roughness: 0.7, metallic: 0.0, ..CpuMaterial::default() };
    if is_clear {
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
        uvs: (!triangles.uv.is_empty())
            .then(|| triangles.uv.iter().map(|[u, v]| vec2(*u as f32, *v as f32)).collect()),
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
