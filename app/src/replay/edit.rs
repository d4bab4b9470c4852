//! Changes to a scene's text before it is played: `--change KEY=VALUE`, `--friction NAME=MODEL,...`.
//!
//! Model: a key is a way through the document, `entity.table.stiffness_n_per_m`; in a list of tables the next word is a
//! name, the default name (`e0`, `f0`) or the place in the list. What a value may be is for the reader of scenes to say.

use rt_core::plain_text::listed;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, TableLike, Value};

/// A change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Edit {
    key: String,
    value: String,
}

impl Edit {
    /// Of `KEY=VALUE`.
    pub(super) fn set(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
                Ok(Self { key: key.trim().into(), value: value.trim().into() })
            }
            _ => Err("allowed: KEY=VALUE, as in entity.table.stiffness_n_per_m=500".into()),
        }
    }

    /// Of `NAME=MODEL,KEY=VALUE,...` or `NAME={ model = ... }`.
    pub(super) fn friction(text: &str) -> Result<Self, String> {
        let malformed =
            || "allowed: NAME=MODEL,KEY=VALUE,..., as in table=stiction,mu_s=0.7,mu_d=0.3".to_owned();
        let (name, law) = text.split_once('=').ok_or_else(malformed)?;
        let key = format!("entity.{}.friction", name.trim());
        if law.trim().starts_with('{') {
            return Ok(Self { key, value: law.trim().into() });
        }
        let mut words = law.split(',').map(str::trim);
        let model =
            words.next().filter(|model| !model.is_empty() && !model.contains('=')).ok_or_else(malformed)?;
        let more: Vec<&str> = words.collect();
        if more.iter().any(|word| !word.contains('=')) {
            return Err(malformed());
        }
        let more: String = more.iter().map(|word| format!(", {word}")).collect();
        Ok(Self { key, value: format!("{{ model = \"{model}\"{more} }}") })
    }

    /// Makes it.
    ///
    /// # Errors
    /// If there is no such place in the document.
    pub(super) fn apply(&self, document: &mut DocumentMut) -> Result<(), String> {
        let mut words = self.key.split('.');
        let last = words.next_back().unwrap_or_default();
        let table = descend(document.as_table_mut(), words)?;
        // A bare word is a text: `algorithm=classic` needs no quotes within quotes.
        let value = self.value.parse::<Value>().unwrap_or_else(|_| Value::from(self.value.as_str()));
        table.insert(last, Item::Value(value));
        Ok(())
    }
}

impl std::fmt::Display for Edit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} = {}", self.key, self.value)
    }
}

fn descend<'t, 'w>(
    table: &'t mut dyn TableLike,
    mut words: impl Iterator<Item = &'w str>,
) -> Result<&'t mut dyn TableLike, String> {
    let Some(word) = words.next() else { return Ok(table) };
    match table.entry(word).or_insert_with(|| Item::Table(Table::new())) {
        Item::ArrayOfTables(list) => {
            let member =
                words.next().ok_or_else(|| format!("{word} is a list: say which, as in {word}.NAME.KEY"))?;
            descend(choose(list, word, member)?, words)
        }
        item => {
            let inner = item.as_table_like_mut();
            descend(inner.ok_or_else(|| format!("{word} is no table in this scene"))?, words)
        }
    }
}

fn choose<'t>(list: &'t mut ArrayOfTables, word: &str, member: &str) -> Result<&'t mut Table, String> {
    let default = |index: usize| format!("{}{index}", &word[..1]);
    let name = |(index, table): (usize, &Table)| {
        table.get("name").and_then(Item::as_str).map_or_else(|| default(index), str::to_owned)
    };
    let names: Vec<String> = list.iter().enumerate().map(name).collect();
    let place = names.iter().position(|name| name == member).or_else(|| member.parse().ok());
    place.and_then(|place| list.get_mut(place)).ok_or_else(|| {
        let known = listed(names.iter().map(String::as_str));
        format!("no {word} {member:?} in this scene; there are: {known}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n[[entity]]\nname = \"table\"\n\
        friction = { model = \"none\" }\n[[entity]]\nmass_kg = 0.1\n";

    fn edited(edit: Result<Edit, String>) -> Result<String, String> {
        let mut document: DocumentMut = SCENE.parse().expect("TOML");
        edit?.apply(&mut document)?;
        Ok(document.to_string())
    }

    #[test]
    fn members_of_lists_are_found_by_name_default_name_and_place() {
        for key in ["entity.e1", "entity.1"] {
            let text = edited(Edit::set(&format!("{key}.mass_kg=0.2"))).expect("edited");
            assert!(text.contains("mass_kg = 0.2") && !text.contains("0.1"), "{text}");
        }
        let text = edited(Edit::set("entity.table.friction.model=coulomb")).expect("edited");
        assert!(text.contains("model = \"coulomb\""), "{text}");
        let text = edited(Edit::set("integrator=rk4")).expect("edited");
        assert!(text.contains("\nintegrator = \"rk4\""), "{text}");
        let text = edited(Edit::set("entity.e1.magnetism.force_n=1")).expect("edited");
        assert!(text.contains("[entity.magnetism]\nforce_n = 1"), "{text}");
    }

    #[test]
    fn friction_is_said_in_a_word_or_as_the_scene_does() {
        let short = edited(Edit::friction("table=stiction,mu_s=0.7,mu_d=0.3")).expect("edited");
        let long =
            edited(Edit::friction("table={ model = \"stiction\", mu_s=0.7, mu_d=0.3 }")).expect("edited");
        assert!(short.contains("friction = { model = \"stiction\", mu_s=0.7, mu_d=0.3 }"), "{short}");
        assert_eq!(short, long);
    }

    #[test]
    fn what_is_not_there_is_told_with_what_is() {
        let said = edited(Edit::friction("tabel=none")).expect_err("no such entity");
        assert_eq!(said, "no entity \"tabel\" in this scene; there are: table, e1");
        let said = edited(Edit::set("gravity_m_s2.x=1")).expect_err("an array");
        assert_eq!(said, "gravity_m_s2 is no table in this scene");
        assert!(edited(Edit::set("gravity")).is_err() && edited(Edit::friction("table=mu=3")).is_err());
    }
}
