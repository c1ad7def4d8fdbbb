//! Pages about a component in Markdown, for people: its operations and its parameters.

use crate::templates::{self, TemplateError};
use crate::view::library::{Interface, Operation};
use crate::view::members::Member;
use crate::view::parameters::{Parameter, Parameters, Rule, ValueKind};
use crate::view::types::{Named, Type};
use crate::view::world::{AnyWorld, World, Written};
use crate::view::{Component, Slot};
use rc_vocabulary::{Role, duration};
use serde::Serialize;
use std::sync::OnceLock;
use std::time::Duration;
use tera::{Context, Tera};

/// The templates of the pages.
const TEMPLATES: &[(&str, &str)] = templates::templates!["markdown":
    "operations.md",
    "parameters.md",
    "datasheet.md",
];

static TERA: OnceLock<Result<Tera, TemplateError>> = OnceLock::new();

/// The pages of a component, with their names.
pub(crate) fn pages(component: &Component) -> Result<Vec<(&'static str, String)>, TemplateError> {
    let tera = TERA.get_or_init(|| templates::tera(TEMPLATES));
    let tera = tera.as_ref().map_err(Clone::clone)?;
    let mut context = Context::new();
    context.insert("file", &component.file);
    context.insert("name", &component.name);
    context.insert("slots", &slots(component));
    let world = component.world.as_ref().map(world_page);
    let any_world = component.any_world.as_ref().map(any_world_page);
    context.insert("world", &world.or(any_world));
    context.insert("collects", &collects(component));
    context.insert("reactions", &reactions(component));
    let mut pages = vec![("operations.md", print(tera, "operations.md", &context)?)];
    if let Some(parameters) = &component.parameters {
        context.insert("sections", &sections(parameters));
        pages.push(("parameters.md", print(tera, "parameters.md", &context)?));
    }
    Ok(pages)
}

/// All that the descriptions of a component say, on one page: what it is, its operations, what its
/// values mean, its parameters, its states, and what it needs.
pub(crate) fn datasheet(component: &Component, language: &str) -> Result<String, TemplateError> {
    let tera = TERA.get_or_init(|| templates::tera(TEMPLATES));
    let tera = tera.as_ref().map_err(Clone::clone)?;
    let mut context = Context::new();
    context.insert("name", &component.name);
    context.insert("doc", &component.doc);
    context.insert("facts", &properties(component, language));
    let pages = pages(component)?;
    let page = |wanted: &str| {
        let found = pages.iter().find(|(name, _)| *name == wanted);
        found.map(|(_, text)| section(text))
    };
    context.insert("operations", &page("operations.md"));
    context.insert("parameters", &page("parameters.md"));
    context.insert("meanings", &meanings(component));
    context.insert("machine", &component.machine);
    let needs = component.dependencies.iter().map(|needed| {
        let version = needed.version.iter().map(|version| format!(" {version}"));
        let path = needed.path.iter().map(|path| format!(" in {}", code(path)));
        let about: String = version.chain(path).collect();
        format!("{}{about}", code(&needed.package))
    });
    context.insert("needs", &needs.collect::<Vec<_>>());
    print(tera, "datasheet.md", &context)
}

/// A page as a section of another one: without its head, and with smaller headings.
fn section(page: &str) -> String {
    let body = page.lines().skip_while(|line| !line.starts_with("## "));
    let lines = body.map(|line| {
        if line.starts_with("## ") {
            format!("#{line}")
        } else {
            line.to_owned()
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Properties of the component: a name and a value in each row.
fn properties(component: &Component, language: &str) -> Vec<[String; 2]> {
    let yes = |is: bool| is.then(|| "yes".to_owned());
    let words = |all: Vec<&str>| all.join(", ");
    let period = Duration::new(component.period.seconds, component.period.nanoseconds);
    let rows = [
        ("language", Some(language.to_owned())),
        ("period", Some(duration::text_of(period))),
        (
            "middleware",
            Some(words(
                component.middlewares.iter().map(|one| one.word()).collect(),
            )),
        ),
        ("life cycle", yes(component.managed)),
        ("advances the time", yes(component.simulates_time)),
        (
            "window",
            yes(component.viewer || component.window.is_some()),
        ),
        ("descriptions", Some(code(&component.hash))),
    ];
    let rows = rows
        .into_iter()
        .filter_map(|(name, value)| Some([name.to_owned(), value?]));
    rows.collect()
}

/// A row for each data prototype.
fn meanings(component: &Component) -> Vec<[String; 5]> {
    let prototypes = component.prototypes.prototypes.iter();
    let rows = prototypes.map(|prototype| {
        let frames = prototype.frames.iter();
        let frames: Vec<String> = frames
            .map(|(role, frame)| format!("{role} {frame}"))
            .collect();
        let body = prototype.body.iter().map(|body| format!("body {body}"));
        let axes = prototype.axes.iter().cloned().chain(body);
        [
            code(&prototype.name),
            prototype.interface_type().map_or_else(String::new, code),
            cell(&prototype.semantic),
            cell(&axes.collect::<Vec<_>>().join(", ")),
            cell(&frames.join(", ")),
        ]
    });
    rows.collect()
}

fn print(tera: &Tera, template: &str, context: &Context) -> Result<String, TemplateError> {
    let text = tera.render(template, context)?;
    Ok(format!("{}\n", text.trim_end()))
}

/// The component's access to the world that it shares.
#[derive(Debug, Serialize)]
struct WorldPage {
    name: String,
    /// What the graph is.
    graph: String,
    writes: String,
    reads: String,
}

fn world_page(world: &World) -> WorldPage {
    let World { writes, reads, .. } = world;
    let graph = format!("A graph of the domain {}", code(&world.domain));
    access_page(
        code(&world.name),
        graph,
        (writes.as_deref(), reads.as_deref()),
    )
}

fn any_world_page(world: &AnyWorld) -> WorldPage {
    let AnyWorld { writes, reads, .. } = world;
    // A slot has its name.
    let name = "The world of the network".to_owned();
    let graph = "A graph of any domain".to_owned();
    access_page(name, graph, (writes.as_deref(), reads.as_deref()))
}

fn access_page(
    name: String,
    graph: String,
    (writes, reads): (Option<&[Written]>, Option<&[String]>),
) -> WorldPage {
    let listed = |names: Option<Vec<String>>| match names {
        None => "everything".to_owned(),
        Some(names) if names.is_empty() => "nothing".to_owned(),
        Some(names) => names.join(", "),
    };
    let written = |write: &Written| {
        let path = match &write.attribute {
            Some(attribute) => format!("{}.{attribute}", write.kind),
            None => write.kind.clone(),
        };
        let stream = match write.stream_ns {
            None => String::new(),
            Some(0) => " as a stream".to_owned(),
            Some(ns) => format!(" as a stream, at most each {}", duration::text(ns)),
        };
        let shared = if write.shared { " (others, too)" } else { "" };
        format!("{}{stream}{shared}", code(&path))
    };
    WorldPage {
        name,
        graph,
        writes: listed(writes.map(|all| all.iter().map(written).collect())),
        reads: listed(reads.map(|all| all.iter().map(|kind| code(kind)).collect())),
    }
}

/// The operations of one slot.
#[derive(Debug, Serialize)]
struct SlotPage<'a> {
    name: String,
    role: &'a str,
    interface: String,
    doc: &'a [String],
    /// The states in which its requests are served.
    available: Vec<String>,
    operations: Vec<OperationRow<'a>>,
}

#[derive(Debug, Serialize)]
struct OperationRow<'a> {
    signature: String,
    doc: &'a [String],
    facts: Vec<String>,
}

fn slots(component: &Component) -> Vec<SlotPage<'_>> {
    // For a world, the page describes the component's access to it.
    let slots = component.slots.iter().filter(|slot| !slot.of_world);
    let slots = slots.filter_map(|slot| Some((slot, component.interface(slot)?)));
    slots
        .map(|(slot, interface)| slot_page(slot, interface))
        .collect()
}

fn slot_page<'a>(slot: &'a Slot, interface: &'a Interface) -> SlotPage<'a> {
    // The providers document their own operations.
    let offers = matches!(slot.role, Role::Implements | Role::Publishes);
    let operations = interface.operations.iter().map(|operation| OperationRow {
        signature: code(&signature(operation)),
        doc: if offers { &operation.doc } else { &[] },
        facts: if offers { facts(operation) } else { Vec::new() },
    });
    SlotPage {
        name: code(&slot.name),
        role: slot.role.word(),
        interface: code(&format!("{}::{}", interface.module, interface.name)),
        doc: if offers { &interface.doc } else { &[] },
        available: slot.available.iter().map(|state| code(state)).collect(),
        operations: operations.collect(),
    }
}

/// Collections of samples, a line for each handler.
fn collects(component: &Component) -> Vec<String> {
    let all = component.collects.iter();
    all.map(|collect| {
        let topics = collect.topics.iter().map(|topic| code(&topic.topic));
        let topics = topics.collect::<Vec<_>>().join(", ");
        let within = Duration::new(collect.within.seconds, collect.within.nanoseconds);
        let within = if within.is_zero() {
            "of equal times".to_owned()
        } else {
            format!("within {}", duration::text_of(within))
        };
        format!("{}: {topics} {within}", code(&collect.name))
    })
    .collect()
}

/// The reactions, a line for each cause.
fn reactions(component: &Component) -> Vec<String> {
    let all = component.reactions.iter().flatten();
    all.map(|reaction| {
        let effects = reaction.effects.iter().map(|effect| code(effect));
        let effects = effects.collect::<Vec<_>>().join(", ");
        let leads = if effects.is_empty() {
            String::new()
        } else {
            format!(" leads to {effects}")
        };
        let budget = reaction.budget.map_or_else(String::new, |budget| {
            let time = Duration::new(budget.seconds, budget.nanoseconds);
            format!(", in at most {}", duration::text_of(time))
        });
        format!("{}{leads}{budget}", code(&reaction.cause))
    })
    .collect()
}

/// `scan(near: Beam, out far: Beam) -> sequence of Beam`
fn signature(operation: &Operation) -> String {
    let parameter = |out: &str, member: &Member| {
        let optional = if member.optional { "optional " } else { "" };
        format!("{out}{}: {optional}{}", member.name, words(&member.ty))
    };
    let inputs = operation.inputs.iter().map(|m| parameter("", m));
    let outputs = operation.outputs.iter().map(|m| parameter("out ", m));
    let parameters: Vec<String> = inputs.chain(outputs).collect();
    let result = operation.result.as_ref();
    let result = result.map_or(String::new(), |ty| format!(" -> {}", words(ty)));
    format!("{}({}){result}", operation.name, parameters.join(", "))
}

/// Facts about an operation that its signature does not show.
fn facts(operation: &Operation) -> Vec<String> {
    let mut facts = Vec::new();
    for member in operation.inputs.iter().chain(&operation.outputs) {
        let unit = member.unit.iter().map(|unit| format!("in {unit}"));
        let meaning = member
            .meaning
            .iter()
            .map(|name| format!("means {}", code(name)));
        let about: Vec<String> = unit.chain(member.range.clone()).chain(meaning).collect();
        if !about.is_empty() {
            facts.push(format!(
                "{}: {}",
                code(&member.name),
                line(&about.join(", "))
            ));
        }
    }
    let throws: Vec<String> = operation
        .throws
        .iter()
        .map(|t| code(&words(&t.ty)))
        .collect();
    if !throws.is_empty() {
        facts.push(format!("throws {}", throws.join(", ")));
    }
    facts
}

/// A type in words.
fn words(ty: &Type) -> String {
    let at_most = |bound: &Option<u32>| bound.map_or(String::new(), |b| format!(" of at most {b}"));
    match ty {
        Type::Primitive(name) => name.word().to_owned(),
        Type::Text { bound: None } => "string".to_owned(),
        Type::Text { bound: Some(bound) } => format!("string of at most {bound} bytes"),
        Type::Sequence { element, bound } => {
            format!("sequence{} of {}", at_most(bound), words(element))
        }
        Type::Array { element, length } => format!("array of {length} {}", words(element)),
        Type::Dictionary { key, value } => {
            format!("dictionary from {} to {}", words(key), words(value))
        }
        Type::Named(Named { name, .. }) => name.clone(),
    }
}

/// The parameters of one table of a configuration.
#[derive(Debug, Serialize)]
struct Section<'a> {
    /// The head of the table.
    heading: String,
    doc: &'a [String],
    /// The kind of the table; empty if it has no rows.
    about: String,
    rows: Vec<Row>,
    rules: Vec<String>,
}

/// One value. Texts are as a cell of a table needs them.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    ty: String,
    allowed: String,
    unit: String,
    default: String,
    change: String,
    doc: String,
}

/// A section for `[parameters]`, for every group and for every list, in the order of the text.
fn sections(parameters: &Parameters) -> Vec<Section<'_>> {
    let mut sections = Vec::new();
    let top = Section {
        heading: code("[parameters]"),
        doc: &parameters.doc,
        about: String::new(),
        rows: Vec::new(),
        rules: Vec::new(),
    };
    let (members, rules) = (&parameters.members, &parameters.rules);
    add(top, members, rules, &mut Vec::new(), &mut sections);
    sections
}

/// The section of a table, then those of the tables in it.
fn add<'a>(
    mut section: Section<'a>,
    parameters: &'a [Parameter],
    rules: &[Rule],
    scope: &mut Vec<&'a str>,
    out: &mut Vec<Section<'a>>,
) {
    section.rows = parameters.iter().filter_map(row).collect();
    let own = rules.iter().filter(|rule| rule.scope == *scope);
    section.rules = own
        .map(|rule| format!("{}: {}", code(&rule.text), line(&rule.message)))
        .collect();
    out.push(section);
    for parameter in parameters {
        scope.push(&parameter.name);
        let path = format!("parameters.{}", scope.join("."));
        let (heading, about) = match (parameter.kind, &parameter.length) {
            (ValueKind::List, Some(length)) => (
                format!("[[{path}]]"),
                format!("A list, {length}; each has a head of its own."),
            ),
            (ValueKind::Values(_) | ValueKind::Group | ValueKind::List, _) => {
                (format!("[{path}]"), String::new())
            }
        };
        if parameter.kind.has_members() {
            let section = Section {
                heading: code(&heading),
                doc: &parameter.doc,
                about,
                rows: Vec::new(),
                rules: Vec::new(),
            };
            add(section, &parameter.members, rules, scope, out);
        }
        scope.pop();
    }
}

fn row(parameter: &Parameter) -> Option<Row> {
    let ty = match (parameter.kind, &parameter.length) {
        (ValueKind::Group | ValueKind::List, _) => return None,
        (ValueKind::Values(ty), None) => ty.word().to_owned(),
        (ValueKind::Values(ty), Some(length)) => format!("array of {}, {length}", ty.word()),
    };
    let choices = parameter.choices.iter().map(|value| cell(&code(value)));
    let choices: Vec<String> = choices.collect();
    let range = parameter.range.as_deref().unwrap_or_default();
    let default = match &parameter.default {
        _ if parameter.required => "must be set".to_owned(),
        None => "not shown".to_owned(),
        Some(default) => cell(&code(default)),
    };
    let secret = if parameter.secret { "; secret" } else { "" };
    Some(Row {
        name: code(&parameter.name),
        ty,
        allowed: if choices.is_empty() {
            cell(range)
        } else {
            choices.join(", ")
        },
        unit: cell(parameter.unit.as_deref().unwrap_or_default()),
        default,
        change: parameter.change.unwrap_or("fixed at the start").to_owned() + secret,
        doc: cell(&parameter.doc.join(" ")),
    })
}

/// Text that is shown as it is, whatever ticks are in it.
fn code(text: &str) -> String {
    let text = line(text);
    if text.contains('`') {
        format!("`` {text} ``")
    } else {
        format!("`{text}`")
    }
}

/// On one line.
fn line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

/// As a cell of a table, in code, too.
fn cell(text: &str) -> String {
    line(text).replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_escape_bars_backquotes_and_line_feeds() {
        assert_eq!(cell(&code("a|b")), "`a\\|b`");
        assert_eq!(code("tick ` tick"), "`` tick ` tick ``");
        assert_eq!(cell("two\nlines"), "two lines");
    }
}
