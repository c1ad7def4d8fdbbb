//! A picture as text for Graphviz.

use super::marks::{Level, Marks};
use super::{Graph, Kind};

/// A text as Graphviz reads it.
fn quoted(text: &str) -> String {
    format!("\"{}\"", escaped(text))
}

fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

fn colour(level: Level) -> &'static str {
    match level {
        Level::Error => "red3",
        Level::Warning => "darkorange2",
    }
}

pub(super) fn draw(graph: &Graph) -> String {
    let marks = Marks::new(graph);
    let mut out = format!("digraph {} {{\n", quoted(&graph.network));
    out += "  rankdir=LR;\n  fontname=\"sans-serif\";\n";
    out += "  node [shape=box, style=rounded, fontname=\"sans-serif\"];\n";
    out += "  edge [fontname=\"sans-serif\", fontsize=10];\n";
    let several = graph.hosts.len() > 1 || graph.hosts.iter().any(|h| h.name != "localhost");
    let indent = if several { "  " } else { "" };
    for (number, host) in graph.hosts.iter().enumerate() {
        if several {
            let mark = marks.host(&host.name);
            let label = format!("host {} ({})", host.name, host.address);
            let label = mark.map_or(label.clone(), |m| format!("{label} {}", m.text()));
            out += &format!(
                "  subgraph cluster_host{number} {{\n    label={};\n",
                quoted(&label)
            );
            if let Some(mark) = mark {
                out += &format!("    color={};\n", colour(mark.level));
            }
        }
        inside(graph, &marks, None, number, indent, &mut out);
        if several {
            out += "  }\n";
        }
    }
    for (number, connection) in graph.connections.iter().enumerate() {
        let (provider, consumer) = connection.provider_and_consumer();
        let mark = marks.connection(number);
        let name = match connection.from.slot == connection.to.slot {
            true => connection.from.slot.clone(),
            false => format!("{} → {}", connection.from.slot, connection.to.slot),
        };
        let mut label = format!("{name}\n{}", connection.middleware);
        let mut tooltip = connection.in_words();
        let mut more = String::new();
        // Who provides stands on the left; a call runs against that.
        if connection.kind == Kind::Call {
            more += ", dir=back, arrowtail=vee";
        }
        if let Some(mark) = mark {
            label += &format!("\n{}", mark.text());
            mark.numbers
                .iter()
                .for_each(|n| tooltip += &format!("\n{}", marks.line(*n)));
            let colour = colour(mark.level);
            more += &format!(", color={colour}, fontcolor={colour}, penwidth=2");
        }
        out += &format!(
            "  c{} -> c{} [label={}, tooltip={}{more}];\n",
            provider.0,
            consumer.0,
            quoted(&label),
            quoted(&tooltip)
        );
    }
    // At the end, so that no cluster takes it over.
    if !marks.listed.is_empty() {
        let lines = (1..=marks.listed.len()).map(|number| escaped(&marks.line(number)) + "\\l");
        let lines: String = lines.collect();
        out += &format!("  labelloc=b;\n  labeljust=l;\n  fontcolor=red3;\n  label=\"{lines}\";\n");
    }
    out + "}\n"
}

/// What stands directly in a group, or in no group, on one host; then the groups inside it.
fn inside(
    graph: &Graph,
    marks: &Marks<'_>,
    group: Option<&str>,
    host: usize,
    indent: &str,
    out: &mut String,
) {
    let on = &graph.hosts[host].name;
    for (at, component) in graph.components.iter().enumerate() {
        if component.group.as_deref() != group || component.host != *on {
            continue;
        }
        let mark = marks.component_with_slots(&component.name, at, component.slots.len());
        let mut label = Graph::own_name(&component.name).to_owned();
        let mut tooltip = component.name.clone();
        if let Some(kind) = component.component.as_ref().filter(|k| **k != label) {
            label += &format!("\n{kind}");
        }
        let mut more = String::new();
        if let Some(mark) = mark {
            label += &format!("\n{}", mark.text());
            mark.numbers
                .iter()
                .for_each(|n| tooltip += &format!("\n{}", marks.line(*n)));
            let colour = colour(mark.level);
            more = format!(", color={colour}, fontcolor={colour}, penwidth=2");
        }
        *out += &format!(
            "{indent}  c{at} [label={}, tooltip={}{more}];\n",
            quoted(&label),
            quoted(&tooltip)
        );
    }
    for (number, inner) in graph.groups.iter().enumerate() {
        let start = format!("{}.", inner.name);
        let mut members = graph.components.iter();
        let here = members.any(|c| c.host == *on && c.name.starts_with(&start));
        if inner.parent.as_deref() != group || !here {
            continue;
        }
        let mark = marks.group(&inner.name);
        let name = Graph::own_name(&inner.name);
        let label = mark.map_or(name.to_owned(), |m| format!("{name} {}", m.text()));
        *out += &format!(
            "{indent}  subgraph cluster_host{host}_group{number} {{\n{indent}    label={};\n",
            quoted(&label)
        );
        if let Some(mark) = mark {
            *out += &format!("{indent}    color={};\n", colour(mark.level));
        }
        inside(
            graph,
            marks,
            Some(&inner.name),
            host,
            &format!("{indent}  "),
            out,
        );
        *out += &format!("{indent}  }}\n");
    }
}
