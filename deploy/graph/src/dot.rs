//! A picture as text for Graphviz.

use crate::marks::{Level, Mark, Marks, marked};
use crate::model::{Graph, chain_colour, host_title, label, provider_and_consumer, sentence};
use crate::outline::{Step, outline};
use rc_deploy_network::topology::Kind;

/// A text, quoted for Graphviz.
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
    let mut indent = String::from("  ");
    for step in outline(graph) {
        out += &boxed(graph, &marks, step, &mut indent);
    }
    for (number, connection) in graph.connections.iter().enumerate() {
        let (provider, consumer) = provider_and_consumer(connection);
        let mark = marks.connection(number);
        let mut text = label(connection);
        let mut tooltip = sentence(connection);
        let mut more = String::new();
        // Providers are on the left. A call runs from right to left.
        if connection.kind == Kind::Call {
            more += ", dir=back, arrowtail=vee";
        }
        if let Some(mark) = mark {
            text += &format!("\n{}", mark.text());
            mark.numbers
                .iter()
                .for_each(|n| tooltip += &format!("\n{}", marks.line(*n)));
            let colour = colour(mark.level);
            more += &format!(", color={colour}, fontcolor={colour}, penwidth=2");
        } else if let Some(colour) = chain_colour(graph, connection) {
            more += &format!(", color=\"{colour}\", penwidth=2");
        }
        out += &format!(
            "  c{} -> c{} [label={}, tooltip={}{more}];\n",
            provider.0,
            consumer.0,
            quoted(&text),
            quoted(&tooltip)
        );
    }
    // Last, so that no cluster contains it.
    if !marks.listed.is_empty() {
        let lines = (1..=marks.listed.len()).map(|number| escaped(&marks.line(number)) + "\\l");
        let lines: String = lines.collect();
        out += &format!("  labelloc=b;\n  labeljust=l;\n  fontcolor=red3;\n  label=\"{lines}\";\n");
    }
    out + "}\n"
}

/// The beginning or the end of a box.
fn boxed(graph: &Graph, marks: &Marks<'_>, step: Step, indent: &mut String) -> String {
    let outer = indent.clone();
    let mut cluster = |name: String, label: &str, mark: Option<&Mark>| {
        indent.push_str("  ");
        let colour = mark.map(|m| format!("{indent}color={};\n", colour(m.level)));
        format!(
            "{outer}subgraph cluster_{name} {{\n{indent}label={};\n{}",
            quoted(&marked(label, mark)),
            colour.unwrap_or_default()
        )
    };
    match step {
        Step::Host(at) => {
            let host = &graph.hosts[at];
            cluster(
                format!("host{at}"),
                &host_title(host),
                marks.host(&host.name),
            )
        }
        Step::Group(at, host) => {
            let group = &graph.groups[at];
            let name = Graph::own_name(&group.name);
            cluster(
                format!("host{host}_group{at}"),
                name,
                marks.group(&group.name),
            )
        }
        Step::Component(at) => {
            let component = &graph.components[at];
            let mark = marks.component_with_slots(&component.name, at, component.slots.len());
            let mut label = Graph::own_name(&component.name).to_owned();
            let mut tooltip = component.name.clone();
            label.extend(component.kind().map(|kind| format!("\n{kind}")));
            let mut more = String::new();
            if let Some(mark) = mark {
                label += &format!("\n{}", mark.text());
                let lines = mark.numbers.iter().map(|n| format!("\n{}", marks.line(*n)));
                tooltip.extend(lines);
                let colour = colour(mark.level);
                more = format!(", color={colour}, fontcolor={colour}, penwidth=2");
            }
            if component.external {
                more += ", style=\"rounded,dashed\"";
            }
            format!(
                "{outer}c{at} [label={}, tooltip={}{more}];\n",
                quoted(&label),
                quoted(&tooltip)
            )
        }
        Step::End => {
            indent.truncate(indent.len() - 2);
            format!("{indent}}}\n")
        }
    }
}
