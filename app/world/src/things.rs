//! What stands in a scene's world, from all of its files: templates, entities, environments, lights, cameras.
//!
//! The scene's own come before included ones; default names go by the place in that list.

use crate::camera::SceneCamera;

use crate::entity::SceneEntity;
use crate::environment::SceneEnvironment;
use crate::error::SceneError;
use crate::finger::SceneFinger;
use crate::grid::MAX_ENTITIES;
use crate::light::SceneLight;
use crate::names::Names;
use crate::problems::Problems;
use crate::reader::Table;
use crate::templates::{SceneTemplate, Templates, listed};
use rt_core::plain_text::quoted;

/// All of it, as far as it could be read.
#[derive(Debug, Default)]
pub(crate) struct Things {
    pub(crate) entities: Vec<SceneEntity>,
    pub(crate) environments: Vec<SceneEnvironment>,
    pub(crate) lights: Vec<SceneLight>,
    pub(crate) cameras: Vec<SceneCamera>,
    pub(crate) templates: Vec<SceneTemplate>,
}

impl Things {
    pub(crate) fn read<'d>(files: &[Table<'d>], fingers: &[SceneFinger], problems: &mut Problems) -> Self {
        let mut templates = read_templates(files, problems);
        let mut things = Self::default();
        let mut names = Names::default();
        let entities = all(files, "entity", problems);
        things.read_entities(&entities, &mut templates, &mut names, problems);
        let environments = all(files, "environment", problems);
        things.read_environments(&environments, &mut names, problems);
        things.check_within(fingers, files, problems);
        things.check_hulls(problems);
        let (mut of_lights, mut of_cameras) = (Names::default(), Names::default());
        for (i, table) in all(files, "light", problems).iter().enumerate() {
            things.lights.extend(problems.keep(SceneLight::read(table, i, &mut of_lights)));
        }
        for (i, table) in all(files, "camera", problems).iter().enumerate() {
            things.cameras.extend(problems.keep(SceneCamera::read(table, i, &mut of_cameras)));
        }
        things.templates = templates.told();
        things
    }

    fn read_entities<'d>(
        &mut self,
        tables: &[Table<'d>],
        templates: &mut Templates<'d>,
        names: &mut Names<'d>,
        problems: &mut Problems,
    ) {
        for (i, table) in tables.iter().enumerate() {
            let Some(table) = problems.keep(templates.complete(table.clone())) else { continue };
            let read = SceneEntity::read_all(&table, i, names, problems);
            templates.used(&table, read.len());
            self.entities.extend(read);
            if self.entities.len() > MAX_ENTITIES {
                let (at, found) = (table.here(), self.entities.len());
                return problems.note(SceneError::TooMany { at, found, limit: MAX_ENTITIES });
            }
        }
    }

    fn read_environments<'d>(
        &mut self,
        tables: &[Table<'d>],
        names: &mut Names<'d>,
        problems: &mut Problems,
    ) {
        let mut own_names = Names::default();
        for (i, table) in tables.iter().enumerate() {
            let both = (&mut own_names, &mut *names);
            let read = SceneEnvironment::read(table, i, both, &mut self.entities, problems);
            if let Some(door) = read.as_ref().and_then(|environment| environment.door.as_ref())
                && !names.has(&door.of)
            {
                problems.note(no_such(table, &["door", "of"], &door.of, names.all()));
            }
            self.environments.extend(read);
        }
    }

    /// What is within an environment is behind its door.
    fn check_within(&self, fingers: &[SceneFinger], files: &[Table<'_>], problems: &mut Problems) {
        let scene = files.first().map(|table| table.document().file());
        let of_entities = self.entities.iter().map(|entity| (&*entity.file, entity.line, &entity.within));
        let of_fingers = fingers.iter().filter_map(|finger| Some((scene?, finger.line, &finger.within)));
        for (file, line, within) in of_entities.chain(of_fingers) {
            let Some(within) = within else { continue };
            let with_door = || self.environments.iter().filter(|environment| environment.door.is_some());
            if with_door().all(|environment| environment.name != *within) {
                let at = crate::Location { file: file.to_path_buf(), line, key: "within".into() };
                let found = format!("{}, which no [[environment]] with a door is called", quoted(within));
                let allowed = listed(with_door().map(|environment| environment.name.as_str()));
                problems.note(SceneError::NoSuchName { at: Box::new(at), found, allowed });
            }
        }
    }

    /// Nobody comes to a door that is behind itself.
    fn check_hulls(&self, problems: &mut Problems) {
        for environment in &self.environments {
            let of = environment.door.as_ref().map(|door| &door.of);
            let hull = self.entities.iter().find(|entity| Some(&entity.name) == of);
            let Some(hull) = hull.filter(|hull| hull.within.as_ref() == Some(&environment.name)) else {
                continue;
            };
            let at = crate::Location { file: hull.file.to_path_buf(), line: hull.line, key: "within".into() };
            let found = format!("{}, whose door this entity has", quoted(&environment.name));
            let allowed = "the world, or another environment".into();
            problems.note(SceneError::NoSuchName { at: Box::new(at), found, allowed });
        }
    }
}

fn read_templates<'d>(files: &[Table<'d>], problems: &mut Problems) -> Templates<'d> {
    let (mut templates, mut names) = (Templates::default(), Names::default());
    for table in all(files, "template", problems) {
        templates.add(table, &mut names, problems);
    }
    let complete: Vec<_> = templates.tables().map(|table| templates.complete(table.clone())).collect();
    for table in complete {
        if let Some(table) = problems.keep(table) {
            SceneEntity::check_template(&table, problems);
        }
    }
    templates
}

/// The tables of a list in all files.
fn all<'d>(files: &[Table<'d>], key: &str, problems: &mut Problems) -> Vec<Table<'d>> {
    files.iter().flat_map(|file| problems.keep(file.tables(key)).unwrap_or_default()).collect()
}

fn no_such<'n>(
    table: &Table<'_>,
    [outer, inner]: &[&str; 2],
    name: &str,
    names: impl Iterator<Item = &'n str>,
) -> SceneError {
    let place = table.get(outer).and_then(|value| value.table("").ok());
    let at = place.map_or_else(|| table.at(outer), |place| place.at(inner));
    let found = format!("{}, which no entity is called", quoted(name));
    SceneError::NoSuchName { at, found, allowed: listed(names) }
}
