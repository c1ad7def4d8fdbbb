//! What streams of a world need of the links of hosts.

use crate::world::Member;
use graph_exchange::Document;
use graph_language::Schema;
use graph_language::model::{Attribute, Kind};
use rc_cdsl::model::Write;
use rc_ddsl::link::text;
use rc_ddsl::model::{Deployment, Host};
use rc_diagnostics::{Diagnostic, Diagnostics};
use std::time::Duration;

/// The bytes of a value beside its name and its content, in a message.
const EACH: usize = 64;

/// The bits a second of a stream, and the time between two of its values.
#[derive(Clone, Copy)]
struct Stream<'a> {
    write: &'a Write,
    bits: f64,
    each: Duration,
}

/// The bits a second of all streams, and the one that needs most of them.
struct Load<'a> {
    bits: f64,
    greatest: Option<Stream<'a>>,
}

/// Warns of links of hosts over which the streams of a world need more than they have. The rates are
/// those that components send at most, by an element of each type at least.
pub(crate) fn check(
    deployment: &Deployment,
    members: &[Member<'_>],
    schema: &Schema,
    start: Option<&Document>,
    found: &mut Diagnostics,
) {
    for host in &deployment.hosts {
        let Some((written, capacity)) = &host.link else {
            continue;
        };
        let is_here = |member: &&Member<'_>| match deployment.remote_host(member.instance) {
            Some(own) => own.is_same(host),
            None => host.is_local(),
        };
        let (here, there): (Vec<_>, Vec<_>) = members.iter().partition(is_here);
        if here.is_empty() || there.is_empty() {
            continue;
        }
        // Each direction has the capacity.
        for (from, verb) in [(&here, "sends"), (&there, "gets")] {
            let load = load(from, schema, start);
            if load.bits <= *capacity {
                continue;
            }
            found.push(overload(host, written.span, verb, *capacity, &load));
        }
    }
}

fn overload(
    host: &Host,
    span: rc_diagnostics::Span,
    verb: &str,
    capacity: f64,
    load: &Load<'_>,
) -> Diagnostic {
    let message = format!(
        "`{}` {verb} streams of the world of up to {}, and its link has {}",
        host.name.text,
        text(load.bits),
        text(capacity)
    );
    let warning = Diagnostic::warning("link-overload", span, message);
    let Some(greatest) = load.greatest else {
        return warning;
    };
    let enough = greatest
        .each
        .mul_f64((load.bits / capacity).clamp(1.0, 1e6));
    // Times are written in whole milliseconds.
    let enough = rc_vocabulary::duration::text_of(Duration::from_millis(
        u64::try_from(enough.as_millis())
            .unwrap_or(u64::MAX)
            .saturating_add(1),
    ));
    let write = greatest.write;
    warning
        .label(write.span(), format!("{} of it", text(greatest.bits)))
        .help(format!(
            "send them less often, such as `{} stream {enough}`",
            write.path()
        ))
}

fn load<'a>(from: &[&Member<'a>], schema: &Schema, start: Option<&Document>) -> Load<'a> {
    let mut load = Load {
        bits: 0.0,
        greatest: None,
    };
    for member in from {
        let writes = member.clause.access.as_ref();
        for write in writes.into_iter().flat_map(|access| &access.writes) {
            let Some(stream) = stream(write, member.period, schema, start) else {
                continue;
            };
            load.bits += stream.bits;
            if load.greatest.is_none_or(|most| most.bits < stream.bits) {
                load.greatest = Some(stream);
            }
        }
    }
    load
}

/// What a stream needs. One without a least time has a value in each period.
fn stream<'a>(
    write: &'a Write,
    period: Duration,
    schema: &Schema,
    start: Option<&Document>,
) -> Option<Stream<'a>> {
    let (least, name) = (write.stream?, write.attribute.as_ref()?);
    let kind = &write.kind.text;
    let attribute = schema.attributes(kind)?;
    let attribute = attribute.iter().find(|own| own.name == name.text)?;
    let each = if least.is_zero() { period } else { least };
    if each.is_zero() {
        return None;
    }
    let is_one = |own: &str| schema.is_a(own, kind);
    let count = start.map_or(0, |start| {
        let nodes = start.nodes.iter().filter(|node| is_one(&node.kind)).count();
        nodes + start.edges.iter().filter(|edge| is_one(&edge.kind)).count()
    });
    let bytes = EACH + name.text.len() + least_bytes(attribute);
    let bits = (count.max(1) * bytes * 8) as f64 / each.as_secs_f64();
    Some(Stream { write, bits, each })
}

/// How many bytes a value has at least.
fn least_bytes(attribute: &Attribute) -> usize {
    match &attribute.kind {
        Kind::Bool | Kind::Int | Kind::Float | Kind::Topic(_) => 8,
        Kind::Ints(count) | Kind::Floats(count) => count.unwrap_or(0) * 8,
        Kind::Block(block) if !block.is_sequence => block.numbers.len() * 8,
        Kind::Block(_) | Kind::Text | Kind::Bytes | Kind::Enum(_) | Kind::Texts => 0,
    }
}

#[cfg(test)]
mod tests {
    use crate::load::{Overrides, load};
    use rc_codegen::FileLoader;
    use rc_diagnostics::{Format, SourceMap, render};

    /// The findings in a network whose tracker writes a stream with this clause over a link of 300 kbit/s.
    fn found(stream: &str) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("a file");
        };
        let entity = "entity person { name string key; skeleton float[96] optional; };";
        write("home.gdsl", &format!("Domain home {{ {entity} }};"));
        let component = |name: &str, access: &str| {
            let world = format!("world \"home.gdsl\" as g {{ {access} }};");
            let text = format!(
                "Component {name} {{ Communications {{}}; language rust; period 10ms; {world} }};"
            );
            write(&format!("{name}.cdsl"), &text);
        };
        component(
            "tracker",
            &format!("writes person, person.skeleton {stream};"),
        );
        component("planner", "reads person;");
        let network = "Deployment n { World g { schema \"home.gdsl\"; }; \
            Host head { address \"10.0.0.3\"; link \"300 kbit/s\"; }; \
            Component tracker { cdsl \"tracker.cdsl\"; host head; }; \
            Component planner { cdsl \"planner.cdsl\"; }; };";
        write("n.ddsl", network);
        let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
        let path = folder.path().join("n.ddsl");
        let loaded = load(&path, &Overrides::default(), &mut sources, &loader);
        let (_, found) = loaded.expect("a file");
        render(&sources, &found, Format::Human)
    }

    /// Without a least time, the stream has a value in each period.
    #[test]
    fn the_proposed_time_of_a_stream_is_enough() {
        for stream in ["stream", "stream 10ms"] {
            let text = found(stream);
            assert!(text.contains("up to 672 kbit/s"), "{text}");
            assert!(text.contains("`person.skeleton stream 23ms`"), "{text}");
        }
        let text = found("stream 23ms");
        assert!(!text.contains("link-overload"), "{text}");
    }
}
