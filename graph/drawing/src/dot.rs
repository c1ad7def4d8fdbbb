//! A picture as text for Graphviz.

use crate::{Box, Picture};

impl Picture {
    /// Text for Graphviz, which ends with a line feed.
    pub fn dot(&self) -> String {
        let mut out = format!("digraph {} {{\n", quoted(&self.title));
        out += "  rankdir=LR;\n  fontname=\"sans-serif\";\n";
        out += "  node [shape=box, style=rounded, fontname=\"sans-serif\"];\n";
        out += "  edge [fontname=\"sans-serif\", fontsize=10];\n";
        for (at, node) in self.boxes.iter().enumerate() {
            let tooltip = quoted(&node.tooltip.join("\n"));
            out += &format!(
                "  n{at} [label={}, tooltip={tooltip}];\n",
                quoted(&label(node))
            );
        }
        for (at, node) in self.boxes.iter().enumerate() {
            for row in &node.rows {
                let look = if row.is_parent {
                    ", arrowhead=empty, style=dashed"
                } else {
                    ""
                };
                for (to, title) in &row.ends {
                    let (text, title) = (quoted(&row.text), quoted(title));
                    out += &format!("  n{at} -> n{to} [label={text}, tooltip={title}{look}];\n");
                }
            }
        }
        out + "}\n"
    }
}

/// Name, type, and the rows at which no line begins.
fn label(node: &Box) -> String {
    let rows = node.rows.iter().filter(|row| row.ends.is_empty());
    let rows: String = rows.map(|row| format!("\n{}", row.text)).collect();
    format!("{}\n{}{rows}", node.name, node.kind)
}

/// A text, quoted for Graphviz.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
