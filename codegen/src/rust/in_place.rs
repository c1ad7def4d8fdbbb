//! Names and types of Rust for structures in shared memory.

use super::checks::{self, Place, READS, ValuePlace};
use super::names::{self, IN_PLACE};
use super::types;
use crate::collisions::{self, bare};
use crate::view::documentation;
use crate::view::in_place::{Item, Part, Structure};
use serde::Serialize;
use std::collections::BTreeSet;

/// A structure, as `templates/rust/in_place.tera` prints it.
#[derive(Debug, Serialize)]
pub(crate) struct InPlaceType {
    name: String,
    /// The type that owns its values.
    value: String,
    number: bool,
    fields: Vec<Field>,
    /// The names of its parts, and those that have functions.
    parts: Vec<String>,
    accessors: Vec<PartView>,
    /// Whether it consists of its members alone.
    plain: bool,
    /// The statements that give it its default, that set it to `value`, that return its value, and
    /// that check it.
    reset: Vec<String>,
    assign: Vec<String>,
    read: Vec<String>,
    check: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Field {
    name: String,
    ty: String,
    /// The documentation, of a public member.
    doc: Vec<String>,
    visibility: &'static str,
}

#[derive(Debug, Serialize)]
struct PartView {
    /// `number`, `value`, `text` or `sequence`.
    kind: &'static str,
    /// The type and the member, as messages name them.
    what: String,
    name: String,
    /// The functions that set a text, lend a sequence for writing, and resize it.
    set: String,
    write: String,
    resize: String,
    /// The field with the length; empty where there is none.
    length: String,
    /// The type of an element.
    item: String,
    /// Whether there is a length, with functions for it.
    #[serde(skip)]
    counted: bool,
    #[serde(skip)]
    is_number: bool,
    #[serde(skip)]
    optional: bool,
    has_lengths: bool,
    #[serde(skip)]
    default: String,
    /// The statements that give it its default, and that set it to a member of `value`.
    #[serde(skip)]
    reset: Vec<String>,
    #[serde(skip)]
    assign: Vec<String>,
    /// The expression for its value.
    #[serde(skip)]
    read: String,
    doc: Vec<String>,
}

/// The traits and functions that structures use.
const IN_PLACE_MODULE: &str = "rc_middleware::in_place";

impl PartView {
    /// Writes the statements of a part whose functions have their names. `has_members` says whether
    /// it is a member of `value`, and not all of it.
    fn write_statements(&mut self, has_members: bool) {
        let (name, length) = (&self.name, &self.length);
        let place = format!("self.{name}");
        self.reset = match self.kind {
            "text" | "sequence" => vec![format!("self.{length} = 0")],
            "number" => vec![format!("{place} = {}", self.default)],
            _ if self.default.is_empty() => {
                vec![format!("{IN_PLACE_MODULE}::InPlace::reset(&mut {place})")]
            }
            _ => vec![format!("{place}.put({})", self.default)],
        };
        if self.kind == "text" && !self.default.is_empty() {
            let (what, text) = (&self.what, &self.default);
            self.reset.push(format!(
                "let _ = {IN_PLACE_MODULE}::set_text(\"{what}\", &mut {place}, &mut self.{length}, {text})"
            ));
        }
        let source = match (has_members, self.optional) {
            (true, false) => format!("value.{name}"),
            (true, true) => format!("value.{name}.as_slice()"),
            (false, _) => "value".to_owned(),
        };
        let reference = match (has_members, self.optional) {
            (true, false) => format!("&{source}"),
            _ => source.clone(),
        };
        self.assign = match self.kind {
            "number" => vec![format!("{place} = {source}")],
            "value" => vec![format!(
                "{IN_PLACE_MODULE}::InPlace::set(&mut {place}, {reference})?"
            )],
            "text" => vec![format!("self.{}({reference})?", self.set)],
            _ => vec![
                format!("let items = self.{}({source}.len())?", self.resize),
                if self.is_number {
                    format!("items.copy_from_slice({reference})")
                } else {
                    format!("{IN_PLACE_MODULE}::set_all(items, {reference})?")
                },
            ],
        };
        self.read = match self.kind {
            "number" => place,
            "value" => format!("{IN_PLACE_MODULE}::InPlace::value(&{place})?"),
            "text" => format!("{place}()?.to_owned()"),
            _ if self.optional && self.is_number => format!("{place}().first().copied()"),
            _ if self.optional => format!("{IN_PLACE_MODULE}::first({place}())?"),
            _ if self.is_number => format!("{place}().to_vec()"),
            _ => format!("{IN_PLACE_MODULE}::values({place}())?"),
        };
    }
}

/// The name of a structure from the name of its type in Rust.
pub(crate) fn path(ty: &str) -> String {
    format!("{}{IN_PLACE}", bare(ty))
}

/// The structures of a type of the module `home`.
pub(super) fn of(home: &str, structures: &[Structure]) -> Vec<InPlaceType> {
    structures.iter().map(|s| place(home, s)).collect()
}

/// The name of a structure: `ScanInPlace`; of the elements of its member `rows`,
/// `ScanInPlaceRowsItem`; of their elements, `ScanInPlaceRowsItem2`. No type of the IDSL and no
/// other structure of a module has it.
pub(super) fn structure_name(steps: &[String]) -> String {
    let mut steps = steps.iter();
    let own = steps.next().map_or(String::new(), |name| names::ty(name));
    let nested = steps.next().map_or(String::new(), |member| {
        let depth = match steps.len() {
            0 => String::new(),
            deeper => (deeper + 1).to_string(),
        };
        format!("{}Item{depth}", names::camel(&names::snake(member)))
    });
    path(&own) + &nested
}

fn place(home: &str, of: &Structure) -> InPlaceType {
    let named = of.path.len() == 1;
    let owner = of
        .path
        .first()
        .map_or(String::new(), |name| names::ty(name));
    let mut taken: BTreeSet<String> = of.parts.iter().map(part_name).collect();
    let counted = of.parts.iter().filter(|part| part.room.is_some());
    let mut functions: BTreeSet<String> = counted.map(part_name).collect();
    let mut free = |wanted: String| collisions::free(wanted, &mut taken);
    let (mut fields, mut parts, mut gaps) = (Vec::new(), Vec::new(), 0);
    let mut gap =
        |bytes: usize, fields: &mut Vec<Field>, free: &mut dyn FnMut(String) -> String| {
            if bytes > 0 {
                let name = free(format!("_gap{gaps}"));
                gaps += 1;
                fields.push(Field {
                    name,
                    ty: format!("[u8; {bytes}]"),
                    visibility: "",
                    doc: Vec::new(),
                });
            }
        };
    for part in &of.parts {
        let name = part_name(part);
        let item = item(home, &part.item);
        let mut length = String::new();
        gap(part.gap, &mut fields, &mut free);
        if let Some(room) = &part.room {
            length = free(format!("{}_length", bare(&name)));
            fields.push(Field {
                name: length.clone(),
                ty: "u32".to_owned(),
                visibility: "",
                doc: Vec::new(),
            });
            gap(room.gap, &mut fields, &mut free);
            fields.push(Field {
                name: name.clone(),
                ty: format!("[{item}; {}]", room.bound),
                visibility: "",
                doc: Vec::new(),
            });
        } else {
            fields.push(Field {
                name: name.clone(),
                ty: item.clone(),
                visibility: "pub ",
                doc: part
                    .member
                    .as_ref()
                    .map_or_else(Vec::new, documentation::of_member),
            });
        }
        let mut part = part_view(home, &owner, &of.path, part, name, length, item);
        if part.counted {
            let of_part = bare(&part.name).to_owned();
            let mut function = |wanted: String| collisions::free(wanted, &mut functions);
            part.set = function(format!("set_{of_part}"));
            part.write = function(format!("{of_part}_mut"));
            part.resize = function(format!("resize_{of_part}"));
        }
        part.write_statements(named);
        parts.push(part);
    }
    gap(of.gap, &mut fields, &mut free);
    let value = types::owned(&of.value, &types::in_module(home));
    let is_zero = |part: &PartView| ["", "0", "0.0"].contains(&part.default.as_str());
    let check = check(of, &parts);
    let alone = |part: &PartView| !part.counted && !part.optional && is_zero(part);
    let statements = |of_part: fn(&PartView) -> &Vec<String>| {
        let statements = parts.iter().flat_map(of_part);
        statements
            .map(|statement| format!("{statement};"))
            .collect()
    };
    InPlaceType {
        name: structure_name(&of.path),
        plain: !of.number
            && check.is_empty()
            && named
            && value == owner
            && !parts.is_empty()
            && parts.iter().all(alone),
        number: of.number,
        reset: if of.number {
            vec![format!("self.put({value}::default());")]
        } else {
            statements(|part| &part.reset)
        },
        assign: match parts.as_slice() {
            _ if of.number => vec!["self.put(*value);".to_owned()],
            [] => vec!["let _ = value;".to_owned()],
            _ => statements(|part| &part.assign),
        },
        read: match parts.as_slice() {
            _ if of.number => vec!["self.get()".to_owned()],
            [part, ..] if !named => vec![match part.read.strip_suffix('?') {
                Some(result) => result.to_owned(),
                None => format!("Ok({})", part.read),
            }],
            parts => {
                let members = parts.iter().map(|p| format!("{}: {},", p.name, p.read));
                let begin = std::iter::once(format!("Ok({owner} {{"));
                let end = std::iter::once("})".to_owned());
                begin.chain(members).chain(end).collect()
            }
        },
        check,
        fields,
        parts: parts.iter().map(|part| part.name.clone()).collect(),
        accessors: parts.into_iter().filter(|part| part.counted).collect(),
        value,
    }
}

/// The statements that check a structure with these parts.
fn check(of: &Structure, parts: &[PartView]) -> Vec<String> {
    let mut statements = Vec::new();
    // The reader names the wrong member.
    if of.parts.iter().any(|part| !part.checks.is_empty()) {
        statements.push("let reader = rc_middleware::Reader::new(&[]);".to_owned());
    }
    for (
        of,
        PartView {
            what,
            name,
            kind,
            length,
            ..
        },
    ) in of.parts.iter().zip(parts)
    {
        let place = format!("self.{name}");
        if *kind != "number" && of.has_ranges {
            statements.push(if length.is_empty() {
                format!("{IN_PLACE_MODULE}::InPlace::check(&{place})?;")
            } else {
                format!("{place}().iter().try_for_each({IN_PLACE_MODULE}::InPlace::check)?;")
            });
        } else if *kind == "number" {
            let place = Place {
                what,
                name: &place,
                held: ValuePlace::Owned,
            };
            statements.push(checks::of(&of.checks, place, READS));
        } else {
            let first = format!("&{place}().first().copied()");
            statements.push(checks::of_present(&of.checks, &first, what, READS));
        }
    }
    statements.retain(|statement| !statement.is_empty());
    statements
}

fn part_name(part: &Part) -> String {
    match &part.member {
        Some(member) => names::snake(&member.name),
        None => "items".to_owned(),
    }
}

fn part_view(
    home: &str,
    owner: &str,
    steps: &[String],
    part: &Part,
    name: String,
    length: String,
    item: String,
) -> PartView {
    let is_number = matches!(part.item, Item::Number { .. });
    let member = part.member.as_ref();
    // The member that contains an unnamed structure identifies it.
    let step = member.map(|m| m.name.as_str());
    let step = step
        .or(steps.get(1).map(String::as_str))
        .unwrap_or_default();
    let default = member.and_then(|m| m.default.as_ref());
    PartView {
        kind: match (&part.item, &part.room) {
            (Item::Bytes, _) => "text",
            (_, Some(_)) => "sequence",
            (Item::Number { .. }, None) => "number",
            (_, None) => "value",
        },
        what: format!("{owner}.{step}"),
        set: String::new(),
        write: String::new(),
        resize: String::new(),
        reset: Vec::new(),
        assign: Vec::new(),
        read: String::new(),
        name,
        length,
        counted: part.room.is_some(),
        is_number,
        optional: member.is_some_and(|m| m.optional),
        has_lengths: part.has_lengths,
        default: match (default, &part.item) {
            (Some(value), Item::Bytes) => format!("{:?}", value.text),
            (Some(value), _) => types::value(value, &types::in_module(home)),
            (None, Item::Number { name }) if name.is_float() => "0.0".to_owned(),
            (None, Item::Number { .. }) => "0".to_owned(),
            (None, _) => String::new(),
        },
        item,
        doc: member.map_or_else(
            || vec!["The elements.".to_owned()],
            documentation::of_member,
        ),
    }
}

fn item(home: &str, of: &Item) -> String {
    match of {
        Item::Number { name } => name.rust().to_owned(),
        Item::Bool => "rc_middleware::in_place::Bool".to_owned(),
        Item::Bytes => "u8".to_owned(),
        Item::Array { element, length } => format!("[{}; {length}]", item(home, element)),
        Item::Named { module, name } => path(&types::in_module(home)(module, name)),
        Item::Unnamed { path } => structure_name(path),
    }
}
