//! From the thesis' objects to a scene of ours, as TOML text.

use super::ThesisError;
use super::list::ObjectKind;
use super::object::ObjectFile;
use super::words::{Toml, number, numbers, string};
use crate::names::MAX_NAME_BYTES;
use std::collections::BTreeSet;

/// A scene on the way.
#[derive(Debug)]
pub struct Conversion {
    toml: Toml,
    told: Vec<String>,
    names: BTreeSet<String>,
    fingers: usize,
    /// Written before the names of mesh files.
    meshes: String,
}

/// A scene of ours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Converted {
    /// The text of the file.
    pub toml: String,
    /// What has no counterpart, and what was decided; it stands in the text as well.
    pub told: Vec<String>,
}

impl Conversion {
    /// Of a scene called so; `meshes` is written before the names of mesh files, such as `../meshes/`.
    pub fn new(name: &str, meshes: &str) -> Self {
        let mut toml = Toml::default();
        toml.key("name", &string(name));
        Self { toml, told: Vec::new(), names: BTreeSet::new(), fingers: 0, meshes: meshes.into() }
    }

    /// Only some entities, for another scene to include.
    pub fn of_part(meshes: &str) -> Self {
        Self { toml: Toml::default(), ..Self::new("", meshes) }
    }

    /// Adds an object. `parts` are those of a mixed environment.
    ///
    /// # Errors
    /// A value that is none.
    pub fn add(
        &mut self,
        kind: ObjectKind,
        object: &ObjectFile,
        parts: &[ObjectFile],
    ) -> Result<(), ThesisError> {
        self.toml.line("");
        let name = self.name_of(object);
        object.text("Type");
        match kind {
            ObjectKind::GameObject => self.game_object(&name, object)?,
            ObjectKind::Environment => self.environment(&name, object)?,
            ObjectKind::EnvironmentMixed if parts.is_empty() => self.environment(&name, object)?,
            ObjectKind::EnvironmentMixed => self.mixed(&name, object, parts)?,
            ObjectKind::Light => self.light(&name, object)?,
            ObjectKind::Camera => self.camera(&name, object)?,
            ObjectKind::Phantom => self.phantom(&name, object)?,
        }
        self.tell_rest(object);
        Ok(())
    }

    /// The text. A scene has a finger; one that had none gets a point.
    pub fn finish(mut self, is_scene: bool) -> Converted {
        if is_scene && self.fingers == 0 {
            self.toml.line("\n[[finger]]");
            self.tell("no Phantom in the list: a finger was added, since a scene needs one");
        }
        Converted { toml: self.toml.0.trim_start().to_owned(), told: self.told }
    }

    fn game_object(&mut self, name: &str, object: &ObjectFile) -> Result<(), ThesisError> {
        self.toml.line("[[entity]]");
        self.toml.key("name", &string(name));
        self.shape_and_looks(object)?;
        self.pose(object)?;
        self.motion(object)?;
        self.surface(object)
    }

    /// Fixed; the thesis does not say what a mass would mean.
    fn environment(&mut self, name: &str, object: &ObjectFile) -> Result<(), ThesisError> {
        let mesh = object.text("HapticMesh").or_else(|| object.text("Mesh"));
        self.toml.line("[[environment]]");
        self.toml.key("name", &string(name));
        match mesh {
            Some(mesh) => {
                self.toml.key("kind", "\"mesh\"");
                let file = self.mesh_file(mesh);
                self.toml.key("file", &string(&file));
                if let Some(scale) = object.positive("Scale")? {
                    self.toml.number("scale", scale);
                }
                self.look(object, mesh)?;
            }
            None => {
                self.toml.key("kind", "\"mixed\"");
                self.toml.line("[[environment.part]]");
                self.toml.key("name", "\"whole\"");
                self.shape_and_looks(object)?;
            }
        }
        self.pose(object)?;
        self.surface(object)
    }

    fn mixed(&mut self, name: &str, object: &ObjectFile, parts: &[ObjectFile]) -> Result<(), ThesisError> {
        object.parts();
        self.toml.line("[[environment]]");
        self.toml.key("name", &string(name));
        self.toml.key("kind", "\"mixed\"");
        self.pose(object)?;
        self.surface(object)?;
        for part in parts {
            self.toml.line("[[environment.part]]");
            let name = self.name_of(part);
            part.text("Type");
            self.toml.key("name", &string(&name));
            self.shape_and_looks(part)?;
            self.pose(part)?;
            self.surface(part)?;
            self.tell_rest(part);
        }
        Ok(())
    }

    fn light(&mut self, name: &str, object: &ObjectFile) -> Result<(), ThesisError> {
        self.toml.line("[[light]]");
        self.toml.key("name", &string(name));
        let kind = object.text("LightType").unwrap_or("directional").to_ascii_lowercase();
        let is_ambient = match kind.as_str() {
            "directional" => false,
            "ambient" => true,
            _ => return Err(object.refused("LightType", "directional or ambient")),
        };
        self.toml.key("kind", &string(&kind));
        let colours = if is_ambient { &["Ambient"][..] } else { &["Diffuse", "Specular", "Ambient"] };
        if !is_ambient {
            let direction = object.numbers::<3>("Direction")?;
            if direction.is_none() {
                self.tell_of(object, "no Direction: the light comes from above");
            }
            self.toml.numbers("direction", &direction.unwrap_or([0.0, -1.0, 0.0]));
        }
        // Light from far away or from everywhere is as strong at every distance.
        if object.numbers::<3>("Attenuation")?.is_some_and(|[_, b, c]| [b, c] != [0.0; 2]) {
            self.tell_of(object, "Attenuation is left out: neither kind of light fades with the distance");
        }
        for colour in colours {
            if let Some(shares) = object.numbers::<3>(colour)? {
                self.toml.numbers(&colour.to_ascii_lowercase(), &shares);
            }
        }
        if !is_ambient && let Some(casts) = object.truth("CastShadow")? {
            self.toml.key("casts_shadow", &casts.to_string());
        }
        Ok(())
    }

    fn camera(&mut self, name: &str, object: &ObjectFile) -> Result<(), ThesisError> {
        self.toml.line("[[camera]]");
        self.toml.key("name", &string(name));
        self.pose(object)?;
        for (theirs, ours) in
            [("FieldOfView", "field_of_view_deg"), ("NearPlane", "near_m"), ("FarPlane", "far_m")]
        {
            if let Some(value) = object.positive(theirs)? {
                self.toml.number(ours, value);
            }
        }
        Ok(())
    }

    /// Where the hardware stands is a matter of the layout, and which device is the master (or parent) of the others.
    fn phantom(&mut self, name: &str, object: &ObjectFile) -> Result<(), ThesisError> {
        self.fingers += 1;
        self.toml.line("[[finger]]");
        self.toml.key("name", &string(name));
        let place = object.numbers::<3>("Position")?;
        if place.is_some() || object.orientation()?.is_some() {
            let (place, turn) = (place.unwrap_or_default(), object.orientation()?.unwrap_or_default());
            let [x, y, z, w] = turn.coords.into();
            let (place, turn) = (numbers(&place), numbers(&[w, x, y, z]));
            let device = format!("[[device]] position_m = {place}, orientation_wxyz = {turn}");
            self.tell_of(object, &format!("where the device stands goes into a layout: {device}"));
        }
        if object.truth("Master")? == Some(true) {
            let device = self.fingers - 1;
            self.tell_of(
                object,
                &format!("that others are placed relative to it goes into a layout: master = {device}"),
            );
        }
        object.text("Parent");
        Ok(())
    }

    /// What is felt and what is seen.
    fn shape_and_looks(&mut self, object: &ObjectFile) -> Result<(), ThesisError> {
        let (seen, felt) = (object.text("Mesh"), object.text("HapticMesh"));
        let Some(mesh) = felt.or(seen) else {
            let shape = self.parametric(object)?;
            self.toml.key("shape", &shape);
            return self.look(object, "");
        };
        if let Some(ending) = unreadable(mesh) {
            self.tell_of(
                object,
                &format!("{mesh} has to be saved as OBJ or STL: nothing here reads {ending}"),
            );
        }
        let shape = self.mesh_shape(object, mesh)?;
        self.toml.key("shape", &shape);
        self.look(object, mesh)
    }

    /// A colour, and a mesh of its own if it is another than the one that is felt.
    fn look(&mut self, object: &ObjectFile, felt: &str) -> Result<(), ThesisError> {
        let mut looks = Vec::new();
        if let Some(mesh) = object.text("Mesh").filter(|mesh| *mesh != felt) {
            looks.push(format!("shape = {}", self.mesh_shape(object, mesh)?));
        }
        if let Some(list) = object.text("Colour") {
            let shares = match list.split(',').count() {
                3 => object.numbers::<3>("Colour")?.map(Vec::from),
                _ => object.numbers::<4>("Colour")?.map(Vec::from),
            };
            looks.push(format!("colour = {}", numbers(&shares.unwrap_or_default())));
        }
        if !looks.is_empty() {
            self.toml.key("visual", &format!("{{ {} }}", looks.join(", ")));
        }
        Ok(())
    }

    fn mesh_shape(&self, object: &ObjectFile, mesh: &str) -> Result<String, ThesisError> {
        let scale = object.positive("Scale")?.filter(|scale| *scale != 1.0);
        let scale = scale.map_or_else(String::new, |scale| format!(", scale = {}", number(scale)));
        Ok(format!("{{ kind = \"mesh\", file = {}{scale} }}", string(&self.mesh_file(mesh))))
    }

    fn mesh_file(&self, mesh: &str) -> String {
        format!("{}{}", self.meshes, mesh.replace('\\', "/"))
    }

    /// What the thesis makes without a file (7.2.3.2, figures 7.4 and 7.5).
    fn parametric(&self, object: &ObjectFile) -> Result<String, ThesisError> {
        const ALLOWED: &str = "Cube, Cylinder, Plane, Sphere, Torus; or a Mesh or HapticMesh";
        let size = |key: &'static str| -> Result<String, ThesisError> {
            let size = object.positive(key)?.ok_or_else(|| object.missing(key, "a number above 0 (m)"))?;
            Ok(number(size))
        };
        let shape = object.text("Shape").ok_or_else(|| object.missing("Shape", ALLOWED))?;
        let mut shape = match shape.to_ascii_lowercase().as_str() {
            "cube" | "box" => {
                let size = object.numbers::<3>("Size")?;
                let size = size.ok_or_else(|| object.missing("Size", "3 numbers above 0 (m)"))?;
                format!("kind = \"box\", size_m = {}", numbers(&size))
            }
            "cylinder" => {
                format!("kind = \"cylinder\", radius_m = {}, length_m = {}", size("Radius")?, size("Length")?)
            }
            "sphere" => format!("kind = \"sphere\", radius_m = {}", size("Radius")?),
            "torus" => format!(
                "kind = \"torus\", ring_radius_m = {}, tube_radius_m = {}",
                size("RingRadius")?,
                size("TubeRadius")?
            ),
            "plane" => {
                let normal = object.numbers::<3>("Normal")?.unwrap_or([0.0, 1.0, 0.0]);
                format!("kind = \"plane\", normal = {}, offset_m = 0.0", numbers(&normal))
            }
            _ => return Err(object.refused("Shape", ALLOWED)),
        };
        if let Some(scale) = object.positive("Scale")?.filter(|scale| *scale != 1.0) {
            shape.push_str(&format!(", scale = {}", number(scale)));
        }
        Ok(format!("{{ {shape} }}"))
    }

    fn pose(&mut self, object: &ObjectFile) -> Result<(), ThesisError> {
        if let Some(position) = object.numbers::<3>("Position")? {
            self.toml.numbers("position_m", &position);
        }
        if let Some(turn) = object.orientation()?.filter(|turn| turn.angle() != 0.0) {
            let [x, y, z, w] = turn.coords.into();
            self.toml.numbers("orientation_wxyz", &[w, x, y, z]);
        }
        Ok(())
    }

    fn motion(&mut self, object: &ObjectFile) -> Result<(), ThesisError> {
        let Some(mass) = object.positive("Mass")? else { return Ok(()) };
        self.toml.number("mass_kg", mass);
        let moments =
            [object.positive("InertiaX")?, object.positive("InertiaY")?, object.positive("InertiaZ")?];
        match moments {
            [Some(x), Some(y), Some(z)] if x + y >= z && y + z >= x && z + x >= y => {
                self.toml.numbers("inertia_kg_m2", &[x, y, z]);
            }
            [None, None, None] => {}
            [Some(_), Some(_), Some(_)] => {
                self.tell_of(
                    object,
                    "no body has such moments (one is more than the other two): that of the shape is taken",
                );
            }
            _ => self
                .tell_of(object, "a moment of inertia is missing: that of the shape and the mass is taken"),
        }
        for (theirs, ours) in [
            ("CentreOfMass", "centre_of_mass_m"),
            ("Velocity", "velocity_m_s"),
            ("AngularVelocity", "angular_velocity_rad_s"),
        ] {
            if let Some(numbers) = object.numbers::<3>(theirs)? {
                self.toml.numbers(ours, &numbers);
            }
        }
        if object.truth("NoRotate")? == Some(true) {
            self.toml.key("rotation_locked", "true");
        }
        Ok(())
    }

    fn surface(&mut self, object: &ObjectFile) -> Result<(), ThesisError> {
        if let Some(stiffness) = object.positive("Stiffness")? {
            self.toml.number("stiffness_n_per_m", stiffness);
        }
        if let Some(damping) = object.number("Damping")? {
            self.toml.number("damping_n_s_per_m", damping);
        }
        if let (Some(mu_s), Some(mu_d)) =
            (object.number("StaticFriction")?, object.number("DynamicFriction")?)
        {
            let friction =
                format!("{{ model = \"stiction\", mu_s = {}, mu_d = {} }}", number(mu_s), number(mu_d));
            self.toml.key("friction", &friction);
        }
        if object.truth("Inputtable")? == Some(true) {
            self.tell_of(
                object,
                "Inputtable: at the window keys move whatever is chosen there, and orders move it; nothing has to be said \
                 for that",
            );
        }
        Ok(())
    }

    fn tell_rest(&mut self, object: &ObjectFile) {
        let rest: Vec<_> = object.rest().collect();
        for (line, words) in rest {
            self.tell(&format!("{}:{line}: {words} has no counterpart", object.file().display()));
        }
    }

    fn tell_of(&mut self, object: &ObjectFile, what: &str) {
        self.tell(&format!("{}: {what}", object.file().display()));
    }

    /// Beside where it belongs, and once more at the end.
    fn tell(&mut self, what: &str) {
        self.toml.comment(what);
        self.told.push(what.into());
    }

    /// One that nothing else is called by, of the characters that a name may have.
    fn name_of(&mut self, object: &ObjectFile) -> String {
        let stem = object.file().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let wanted = object.text("Name").filter(|name| !name.is_empty()).unwrap_or(&stem);
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let plain: String = wanted.chars().map(|c| if is_plain(c) { c } else { '_' }).collect();
        let plain: String = plain.chars().take(MAX_NAME_BYTES - 5).collect();
        let numbered = (2..).map(|number| format!("{plain}_{number}"));
        let name = std::iter::once(plain.clone()).chain(numbered).find(|name| !self.names.contains(name));
        let name = name.unwrap_or(plain);
        self.names.insert(name.clone());
        name
    }
}

/// The ending of a format of the thesis that is not read here.
fn unreadable(mesh: &str) -> Option<&str> {
    let (_, ending) = mesh.rsplit_once('.')?;
    ["ase", "max"].iter().any(|known| ending.eq_ignore_ascii_case(known)).then_some(ending)
}
