//! A picture as text for Mermaid.

use super::marks::{Level, Marks};
use super::{Graph, Kind};

/// A text as Mermaid reads it between quotation marks: what could mean something is written by its number.
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
    let several = graph.hosts.len() > 1 || graph.hosts.iter().any(|h| h.name != "localhost");
    let indent = if several { "  " } else { "" };
    for (number, host) in graph.hosts.iter().enumerate() {
        if several {
            let label = format!("host {} ({})", host.name, host.address);
            let mark = marks.host(&host.name);
            let label = mark.map_or(label.clone(), |m| format!("{label} {}", m.text()));
            out += &format!("  subgraph h{number}[{}]\n", quoted(&label));
        }
        inside(graph, &marks, None, number, indent, &mut out);
        if several {
            out += "  end\n";
        }
    }
    let mut styles = String::new();
    for (number, connection) in graph.connections.iter().enumerate() {
        let name = match connection.from.slot == connection.to.slot {
            true => connection.from.slot.clone(),
            false => format!("{} → {}", connection.from.slot, connection.to.slot),
        };
        let mut label = format!("{name}\n{}", connection.middleware);
        if let Some(mark) = marks.connection(number) {
            label += &format!("\n{}", mark.text());
            let colour = match mark.level {
                Level::Error => "#b00020",
                Level::Warning => "#c25b00",
            };
            styles += &format!("  linkStyle {number} stroke:{colour},stroke-width:3px\n");
        }
        // Calls are dotted lines, data whole ones.
        let arrow = match connection.kind {
            Kind::Call => "-.->",
            Kind::Topic => "-->",
        };
        out += &format!(
            "  c{} {arrow}|{}| c{}\n",
            connection.from.at.0,
            quoted(&label),
            connection.to.at.0
        );
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
        if let Some(kind) = component.component.as_ref().filter(|k| **k != label) {
            label += &format!("\n{kind}");
        }
        if let Some(mark) = &mark {
            label += &format!("\n{}", mark.text());
        }
        let class = mark.map_or("", |m| class(m.level));
        *out += &format!("{indent}  c{at}[{}]{class}\n", quoted(&label));
    }
    for (number, inner) in graph.groups.iter().enumerate() {
        let start = format!("{}.", inner.name);
        let mut members = graph.components.iter();
        let here = members.any(|c| c.host == *on && c.name.starts_with(&start));
        if inner.parent.as_deref() != group || !here {
            continue;
        }
        let name = Graph::own_name(&inner.name);
        let mark = marks.group(&inner.name);
        let label = mark.map_or(name.to_owned(), |m| format!("{name} {}", m.text()));
        *out += &format!("{indent}  subgraph h{host}g{number}[{}]\n", quoted(&label));
        inside(
            graph,
            marks,
            Some(&inner.name),
            host,
            &format!("{indent}  "),
            out,
        );
        *out += &format!("{indent}  end\n");
    }
}
