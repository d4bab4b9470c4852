//! Lights that shine from a place, and the shadows behind what they shine on.
//!
//! Model: six pictures of depths from the lamp's place, one for each side of a cube around it. A place of a surface is lit as
//! far as the depth in its direction is its own. It is asked for a little above the surface, so that none shades itself:
//! by a few of the cube's texels, which are the larger the farther away it is.

use three_d::{
    Camera, ClearState, Context, CubeMapSide, DepthMaterial, DepthTextureCubeMap, Geometry, Light, LightId,
    Program, RenderStates, Srgba, Vec3, Viewport, Wrapping, WriteMask, degrees,
};

/// Of each of the six pictures, along each side.
const SIDE: u32 = 1024;
/// The nearest that casts a shadow, as a share of the farthest.
const NEAREST: f32 = 1e-3;
/// How many texels above a surface its light is asked for.
const TEXELS_ABOVE: f32 = 3.0;
/// Of its own: the library's begin at 0x80.
const LIT: LightId = LightId(0x10);
const SHADED: LightId = LightId(0x11);

/// A light that shines from a place.
pub(crate) struct Lamp {
    context: Context,
    /// Red, green, blue; linear, with the brightness in it.
    colour: Vec3,
    place: Vec3,
    /// `1 / (a + b d + c d^2)` is left at the distance d.
    attenuation: Vec3,
    depths: Option<DepthTextureCubeMap>,
    is_shading: bool,
    nearest: f32,
    farthest: f32,
}

impl Lamp {
    pub(crate) fn new(
        context: &Context,
        brightness: f32,
        colour: Srgba,
        place: Vec3,
        attenuation: Vec3,
    ) -> Self {
        Self {
            context: context.clone(),
            colour: colour.to_linear_srgb().truncate() * brightness,
            place,
            attenuation,
            depths: None,
            is_shading: false,
            nearest: 0.0,
            farthest: 0.0,
        }
    }

    /// Light goes through everything.
    pub(crate) fn cast_none(&mut self) {
        self.is_shading = false;
    }

    /// These cast shadows.
    pub(crate) fn cast(&mut self, casting: &[&dyn Geometry]) {
        let reach = |mesh: &&dyn Geometry| mesh.aabb().distance_max(self.place);
        self.farthest = casting.iter().map(reach).fold(0.0, f32::max);
        self.nearest = NEAREST * self.farthest;
        self.is_shading = self.farthest > 0.0;
        if !self.is_shading {
            return;
        }
        let edge = Wrapping::ClampToEdge;
        let made = || DepthTextureCubeMap::new::<f32>(&self.context, SIDE, SIDE, edge, edge, edge);
        let depths = self.depths.get_or_insert_with(made);
        let states = RenderStates { write_mask: WriteMask::DEPTH, ..RenderStates::default() };
        let material = DepthMaterial { render_states: states, ..DepthMaterial::default() };
        for side in CubeMapSide::iter() {
            let (whole, to) = (Viewport::new_at_origo(SIDE, SIDE), self.place + side.direction());
            let camera = Camera::new_perspective(
                whole,
                self.place,
                to,
                side.up(),
                degrees(90.0),
                self.nearest,
                self.farthest,
            );
            let target = depths.as_depth_target(side);
            target.clear(ClearState::depth(1.0)).render_with_material(&material, &camera, casting, &[]);
        }
    }
}

impl Light for Lamp {
    fn shader_source(&self, i: u32) -> String {
        let shadow = if self.is_shading { SHADOW } else { NO_SHADOW };
        // Names end in the light's number.
        LIGHT.replace("SHADOW", shadow).replace('@', &i.to_string())
    }

    fn use_uniforms(&self, program: &Program, i: u32) {
        program.use_uniform(&format!("lamp_colour_{i}"), self.colour);
        program.use_uniform(&format!("lamp_place_{i}"), self.place);
        program.use_uniform(&format!("lamp_attenuation_{i}"), self.attenuation);
        if let Some(depths) = self.depths.as_ref().filter(|_| self.is_shading) {
            program.use_depth_texture_cube(&format!("lamp_depths_{i}"), depths);
            let asked = Vec3::new(self.nearest, self.farthest, TEXELS_ABOVE * 2.0 / SIDE as f32);
            program.use_uniform(&format!("lamp_asked_{i}"), asked);
        }
    }

    fn id(&self) -> LightId {
        if self.is_shading { SHADED } else { LIT }
    }
}

const LIGHT: &str = "
uniform vec3 lamp_colour_@;
uniform vec3 lamp_place_@;
uniform vec3 lamp_attenuation_@;
SHADOW
vec3 calculate_lighting@(vec3 surface_color, vec3 position, vec3 normal, vec3 view_direction,
        float metallic, float roughness, float occlusion) {
    vec3 way = lamp_place_@ - position;
    float d = length(way);
    vec3 left = lamp_colour_@ / dot(lamp_attenuation_@, vec3(1.0, d, d * d));
    vec3 lit = calculate_light(left, way / d, surface_color, view_direction, normal, metallic, roughness);
    return share_@(position, normal) * lit;
}
";

const NO_SHADOW: &str = "float share_@(vec3 position, vec3 normal) { return 1.0; }";

/// What arrives of the light: the mean of four places around the one asked for, a texel apart.
const SHADOW: &str = "
uniform samplerCube lamp_depths_@;
uniform vec3 lamp_asked_@;
float share_@(vec3 position, vec3 normal) {
    vec3 from = position - lamp_place_@;
    float facing = dot(normal, from) < 0.0 ? 1.0 : -1.0;
    vec3 above = from + facing * normal * lamp_asked_@.z * length(from);
    vec3 size = abs(above);
    // As far along the cube's axis as a depth is told.
    float own = max(size.x, max(size.y, size.z));
    vec3 across = normalize(cross(above, size.x < own ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
    vec3 along = normalize(cross(above, across));
    float step = own * lamp_asked_@.z / 6.0;
    float near = lamp_asked_@.x;
    float far = lamp_asked_@.y;
    float share = 0.0;
    for (int k = 0; k < 4; k++) {
        vec3 aside = step * ((k < 2 ? 1.0 : -1.0) * across + (k % 2 == 0 ? 1.0 : -1.0) * along);
        float depth = texture(lamp_depths_@, above + aside).x;
        float met = near * far / (far - depth * (far - near));
        share += depth >= 1.0 || met >= own * (1.0 - lamp_asked_@.z / 3.0) ? 0.25 : 0.0;
    }
    return share;
}
";
