//! What tells a reader the shape of messages: descriptors, as `protoc --descriptor_set_out` would write them.
//!
//! Model: a set of files, each with a package and messages; a message has fields with a number, a name and a type. The
//! descriptors are Protocol Buffers themselves (`google/protobuf/descriptor.proto`), so [`Message`] writes them.

use super::wire::Message;

/// The messages of one package.
#[derive(Debug, Clone)]
pub(super) struct ProtoFile {
    /// What other files import it by.
    pub(super) name: &'static str,
    /// Its package.
    pub(super) package: &'static str,
    /// Files that it needs, which come before it.
    pub(super) imports: &'static [&'static str],
    /// Its messages.
    pub(super) messages: Vec<MessageType>,
}

/// One of them.
#[derive(Debug, Clone)]
pub(super) struct MessageType {
    /// Its name in the package.
    pub(super) name: String,
    /// Its fields.
    pub(super) fields: Vec<Field>,
}

/// A field of it.
#[derive(Debug, Clone)]
pub(super) struct Field {
    /// Its number.
    pub(super) number: u32,
    /// Its name.
    pub(super) name: String,
    /// Its type.
    pub(super) kind: Kind,
    /// Number of values that there may be.
    pub(super) label: Label,
}

/// Number of a field's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Label {
    /// One, which is zero or empty where nothing is written.
    One,
    /// One or none: what is not written is not there (`optional`).
    OneOrNone,
    /// Several (`repeated`).
    Several,
}

/// The type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// `double`
    Double,
    /// `int64`
    Int64,
    /// `uint64`
    Uint64,
    /// `int32`
    Int32,
    /// `bool`
    Bool,
    /// `string`
    Text,
    /// `fixed32`
    Fixed32,
    /// A message, by its full name with a leading dot.
    Message(&'static str),
}

impl Kind {
    /// Its number in `FieldDescriptorProto.Type`.
    fn number(self) -> u64 {
        match self {
            Self::Double => 1,
            Self::Int64 => 3,
            Self::Uint64 => 4,
            Self::Int32 => 5,
            Self::Fixed32 => 7,
            Self::Bool => 8,
            Self::Text => 9,
            Self::Message(_) => 11,
        }
    }
}

impl MessageType {
    /// A message with these fields, none repeated.
    pub(super) fn new(name: &str, fields: &[(u32, &str, Kind)]) -> Self {
        let field = |&(number, name, kind): &(u32, &str, Kind)| Field {
            number,
            name: name.into(),
            kind,
            label: Label::One,
        };
        Self { name: name.into(), fields: fields.iter().map(field).collect() }
    }

    /// True if names in JSON are not unique, which come without underscores where nothing else is said: readers refuse that.
    fn has_like_json_names(&self) -> bool {
        let mut taken = std::collections::HashSet::new();
        self.fields.iter().any(|field| !taken.insert(json_name(&field.name)))
    }

    /// With these as well, of which there may be several.
    pub(super) fn with_repeated(self, fields: &[(u32, &str, Kind)]) -> Self {
        self.with(Label::Several, fields)
    }

    /// With these as well, which may not be there.
    pub(super) fn with_optional(self, fields: &[(u32, &str, Kind)]) -> Self {
        self.with(Label::OneOrNone, fields)
    }

    fn with(mut self, label: Label, fields: &[(u32, &str, Kind)]) -> Self {
        let more = Self::new("", fields).fields;
        self.fields.extend(more.into_iter().map(|field| Field { label, ..field }));
        self
    }
}

/// A field's name in JSON, unless it has one of its own: what is behind an underscore is written large.
fn json_name(name: &str) -> String {
    let mut is_behind = false;
    let mut json = String::new();
    for letter in name.chars() {
        if letter != '_' {
            json.push(if is_behind { letter.to_ascii_uppercase() } else { letter });
        }
        is_behind = letter == '_';
    }
    json
}

/// A `FileDescriptorSet` of these files.
pub(super) fn descriptor_set(files: &[ProtoFile]) -> Vec<u8> {
    let mut set = Message::new();
    for file in files {
        set.message(1, |out| write_file(out, file));
    }
    set.bytes().to_vec()
}

fn write_file(out: &mut Message, file: &ProtoFile) {
    out.text(1, file.name).text(2, file.package);
    for import in file.imports {
        out.text(3, import);
    }
    for message in &file.messages {
        out.message(4, |out| {
            out.text(1, &message.name);
            let is_ambiguous = message.has_like_json_names();
            // A choice of one field is how proto3 says that it may not be there.
            let mut choices = 0;
            for field in &message.fields {
                let choice = (field.label == Label::OneOrNone).then_some(choices);
                choices += u64::from(choice.is_some());
                out.message(2, |out| write_field(out, field, is_ambiguous, choice));
            }
            for field in message.fields.iter().filter(|field| field.label == Label::OneOrNone) {
                out.message(8, |out| {
                    out.text(1, &format!("_{}", field.name));
                });
            }
        });
    }
    out.text(12, "proto3");
}

fn write_field(out: &mut Message, field: &Field, has_json_name: bool, choice: Option<u64>) {
    const OPTIONAL: u64 = 1;
    const REPEATED: u64 = 3;
    out.text(1, &field.name)
        .whole(3, u64::from(field.number))
        .whole(4, if field.label == Label::Several { REPEATED } else { OPTIONAL })
        .whole(5, field.kind.number());
    if let Kind::Message(name) = field.kind {
        out.text(6, name);
    }
    if let Some(choice) = choice {
        out.given(9, choice);
    }
    if has_json_name {
        out.text(10, &field.name);
    }
    if choice.is_some() {
        out.given(17, 1);
    }
}
