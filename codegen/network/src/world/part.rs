//! A component that knows a part of the schema of its network.

use crate::model::Network;
use graph_language::Schema;
use graph_language::model::{Attribute, Port};
use rc_cdsl::model::Access;
use rc_codegen::world::World;
use rc_diagnostics::{Diagnostic, SourceMap, Span};

/// The longest part of a text in one argument of a program: Linux takes 128 KiB.
const LONGEST_PART: usize = 120 * 1024;
/// The longest text: Linux takes 2 MiB of arguments, and systemd a line of 1 MiB.
const LONGEST: usize = 512 * 1024;

/// Why a component cannot share the world of a network.
pub(super) struct Misfit {
    message: String,
    help: String,
    /// The declaration of the component, and that of the network.
    own: Option<Span>,
    networks: Option<Span>,
}

impl Misfit {
    /// The finding about a component; `schema` is where it names its schema, `world` where the network
    /// names its own.
    pub(super) fn diagnostic(self, component: &str, schema: Span, world: Span) -> Diagnostic {
        let message = format!("the world of `{component}` does not fit: {}", self.message);
        let error = Diagnostic::error("world-schema", self.own.unwrap_or(schema), message);
        let networks = self.networks.unwrap_or(world);
        error
            .label(networks, "the schema of the network")
            .help(self.help)
    }
}

/// Why a component with a schema of its own cannot share the world of a network.
pub(super) fn misfit(
    network: &World,
    access: Option<&Access>,
    own: &World,
    sources: &SourceMap,
) -> Option<Misfit> {
    let place = |of: &World, what: &str| graph_language::place(sources, &of.sources, what);
    let all = network.schema.lacks(&own.schema);
    if let Some(first) = all.first() {
        let mut message = first.of_part();
        if all.len() > 1 {
            message += &format!("; {} more differ", all.len() - 1);
        }
        return Some(Misfit {
            message,
            help: "correct one of them, or remove it from the file of the component: it may declare a part of \
                   what the network declares"
                .to_owned(),
            own: place(own, &first.what),
            networks: place(network, &first.what),
        });
    }
    if let Some((kind, what, help)) = unknown(&network.schema, access, &own.schema) {
        return Some(Misfit {
            message: format!(
                "the component may add a `{kind}`, and does not declare `{what}`, which the network requires"
            ),
            help: match access {
                Some(_) => help,
                None => format!("{help}, or name what the component writes"),
            },
            own: place(own, kind),
            networks: place(network, &what),
        });
    }
    let length = differs(network, own).then(|| text(network).len())?;
    (length > LONGEST).then(|| Misfit {
        message: format!(
            "a schema of more than {LONGEST} bytes cannot be handed to a component with a part of it, and that of \
             the network has {length}"
        ),
        help: "give the component the file of the network".to_owned(),
        own: None,
        networks: None,
    })
}

/// What each element of a type has in the network, and what a component does not know which may add
/// such an element: the type, the attribute or the relation, and what helps.
fn unknown<'a>(
    network: &'a Schema,
    access: Option<&Access>,
    own: &'a Schema,
) -> Option<(&'a str, String, String)> {
    let adds = |kind: &str| {
        access.is_none_or(|access| {
            let mut writes = access.writes.iter();
            writes.any(|own| own.attribute.is_none() && network.is_a(kind, &own.kind.text))
        })
    };
    own.types().filter(|kind| adds(kind)).find_map(|kind| {
        let known = own.attributes(kind).unwrap_or_default();
        let is_known = |of: &Attribute| known.iter().any(|own| own.value_of() == of.value_of());
        let needs = |of: &&Attribute| of.value_of() == of.name && !of.optional && !is_known(of);
        if let Some(of) = network.attributes(kind)?.iter().find(needs) {
            let help = format!(
                "declare `{} {};` there, or make it `optional`",
                of.name,
                of.text()
            );
            return Some((kind, format!("{kind}.{}", of.name), help));
        }
        // An edge to which others refer needs none of them.
        let is_node = network.entity(kind).is_some();
        let ends_at = |port: &Port| is_node && port.min > 0 && network.is_a(kind, &port.entity);
        let mut relations = network.relations.iter();
        let of = relations
            .find(|of| own.relation(&of.name).is_none() && of.ports.iter().any(ends_at))?;
        Some((
            kind,
            of.name.clone(),
            format!("declare `relation {}` there", of.name),
        ))
    })
}

fn differs(network: &World, own: &World) -> bool {
    !network.schema.differences(&own.schema).is_empty()
}

/// The schema of the network as an option of a component has it.
fn text(network: &World) -> String {
    let files = network.files.iter().enumerate();
    let files = files.filter(|(at, file)| *at == 0 || !World::comes_with_framework(file));
    let files: Vec<_> = files.map(|(_, file)| file).collect();
    serde_json::to_string(&files).unwrap_or_default()
}

/// The files of the network's schema as values of options, for a component that has a part of it: all replicas of a world
/// have one schema.
pub(crate) fn handed(network: &Network, at: usize) -> Option<Vec<String>> {
    let own = network.projects[at].as_deref()?.world.as_ref()?;
    let world = network.world.as_ref()?;
    differs(world, own).then(|| parts(&text(world), LONGEST_PART))
}

/// Divides a text into parts of at most so many bytes, between two characters.
fn parts(text: &str, most: usize) -> Vec<String> {
    let (mut parts, mut rest) = (Vec::new(), text);
    while !rest.is_empty() {
        let (part, more) = rest.split_at(rest.floor_char_boundary(most));
        parts.push(part.to_owned());
        rest = more;
    }
    parts
}

#[cfg(test)]
mod tests;
