//! A picture as text for Mermaid.

use crate::marks::{Level, Mark, Marks, marked};
use crate::model::{Graph, chain_colour, host_title, label};
use crate::outline::{Step, outline};
use rc_deploy_network::topology::Kind;

/// A text for Mermaid, between quotation marks. Special characters are numeric entities.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            c if c.is_alphanumeric() || " .,:_-()/→'=+;?!".contains(c) => out.push(c),
            '\n' => out.push_str("<br/>"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out += &format!("#{};", u32::from(c)),
        }
    }
    out.push('"');
    out
}

fn class(level: Level) -> &'static str {
    match level {
        Level::Error => ":::error",
        Level::Warning => ":::warning",
    }
}

pub(super) fn draw(graph: &Graph) -> String {
    let marks = Marks::new(graph);
    let mut out = String::from("flowchart LR\n");
    let mut indent = String::from("  ");
    for step in outline(graph) {
        out += &boxed(graph, &marks, step, &mut indent);
    }
    let mut styles = String::new();
    for (number, connection) in graph.connections.iter().enumerate() {
        let mut text = label(connection);
        if let Some(mark) = marks.connection(number) {
            text += &format!("\n{}", mark.text());
            let colour = match mark.level {
                Level::Error => "#b00020",
                Level::Warning => "#c25b00",
            };
            styles += &format!("  linkStyle {number} stroke:{colour},stroke-width:3px\n");
        } else if let Some(colour) = chain_colour(graph, connection) {
            styles += &format!("  linkStyle {number} stroke:{colour},stroke-width:3px\n");
        }
        // Calls are dotted lines, topics solid lines.
        let arrow = match connection.kind {
            Kind::Call => "-.->",
            Kind::Topic => "-->",
        };
        out += &format!(
            "  c{} {arrow}|{}| c{}\n",
            connection.from.at.0,
            quoted(&text),
            connection.to.at.0
        );
    }
    if graph.components.iter().any(|c| c.external) {
        out += "  classDef external stroke-dasharray:4 3\n";
    }
    if !marks.listed.is_empty() {
        out += "  subgraph findings\n";
        for ((level, _), number) in marks.listed.iter().zip(1..) {
            let line = quoted(&marks.line(number));
            out += &format!("    f{number}[{line}]{}\n", class(*level));
        }
        out += "  end\n";
        out += "  classDef error stroke:#b00020,color:#b00020,stroke-width:3px\n";
        out += "  classDef warning stroke:#c25b00,color:#c25b00,stroke-width:3px\n";
    }
    out + &styles
}

/// The beginning or the end of a box.
fn boxed(graph: &Graph, marks: &Marks<'_>, step: Step, indent: &mut String) -> String {
    let outer = indent.clone();
    let mut cluster = |name: String, label: &str, mark: Option<&Mark>| {
        indent.push_str("  ");
        format!("{outer}subgraph {name}[{}]\n", quoted(&marked(label, mark)))
    };
    match step {
        Step::Host(at) => {
            let host = &graph.hosts[at];
            cluster(format!("h{at}"), &host_title(host), marks.host(&host.name))
        }
        Step::Group(at, host) => {
            let group = &graph.groups[at];
            let name = Graph::own_name(&group.name);
            cluster(format!("h{host}g{at}"), name, marks.group(&group.name))
        }
        Step::Component(at) => {
            let component = &graph.components[at];
            let mark = marks.component_with_slots(&component.name, at, component.slots.len());
            let mut label = Graph::own_name(&component.name).to_owned();
            label.extend(component.kind().map(|kind| format!("\n{kind}")));
            label.extend(mark.as_ref().map(|mark| format!("\n{}", mark.text())));
            let class = mark.map_or("", |m| class(m.level));
            let class = if component.external {
                ":::external"
            } else {
                class
            };
            format!("{outer}c{at}[{}]{class}\n", quoted(&label))
        }
        Step::End => {
            indent.truncate(indent.len() - 2);
            format!("{indent}end\n")
        }
    }
}
