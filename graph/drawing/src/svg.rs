//! A picture as SVG.

use crate::{Box, MOST, Picture, TooLarge};
use rc_diagnostics::xml::escaped;
use rc_drawing::{INK, document, forks, head, path, rounded, text, width};
use rc_graph_layout::{Net, Node, Point, Port, Rect, Shape, layout};
use std::collections::BTreeSet;

/// Font sizes of names and of rows.
const NAME: f64 = 12.0;
const SMALL: f64 = 10.0;
/// The height of the lines with name and type, and of a row.
const HEAD: i32 = 36;
const ROW: i32 = 16;
/// Between a text and the edge of its box.
const SIDE: i32 = 9;

impl Picture {
    /// A document of SVG, which ends with a line feed.
    ///
    /// # Errors
    /// There are more than [`MOST`] boxes and lines.
    pub fn svg(&self) -> Result<String, TooLarge> {
        let rows = || self.boxes.iter().flat_map(|node| &node.rows);
        let count = self.boxes.len() + rows().map(|row| row.ends.len()).sum::<usize>();
        if count > MOST {
            return Err(TooLarge(count));
        }
        let nodes: Vec<Node> = self.boxes.iter().map(shape).collect();
        let (mut nets, mut lines) = (Vec::new(), Vec::new());
        for (node, of) in self.boxes.iter().enumerate() {
            let leaving = of.rows.iter().filter(|row| !row.ends.is_empty());
            for (port, row) in leaving.enumerate() {
                let to = row.ends.iter().map(|(node, _)| Port {
                    node: *node,
                    port: 0,
                });
                nets.push(Net {
                    from: Port { node, port },
                    to: to.collect(),
                });
                lines.push(row);
            }
        }
        let layout = layout(&nodes, &nets);
        let (mut drawn, mut heads) = (String::new(), BTreeSet::new());
        for (row, routes) in lines.iter().zip(&layout.routes) {
            let forks = forks(routes);
            let dashes = if row.is_parent {
                " stroke-dasharray=\"4 3\""
            } else {
                ""
            };
            for ((_, title), route) in row.ends.iter().zip(routes) {
                let path = path(route, &forks);
                drawn += &format!(
                    "<g>{}<path d=\"{path}\" fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.2\"{dashes}/></g>\n",
                    titled(title.lines())
                );
            }
            heads.extend(routes.iter().filter_map(|route| route.last().copied()));
        }
        drawn += &heads.into_iter().map(head).collect::<String>();
        for (node, rect) in self.boxes.iter().zip(&layout.boxes) {
            drawn += &element(node, rect);
        }
        let size = Point::new(layout.width, layout.height);
        Ok(document(&self.title, size, &drawn))
    }
}

fn titled<'t>(lines: impl Iterator<Item = &'t str>) -> String {
    let lines: Vec<String> = lines.map(escaped).collect();
    format!("<title>{}</title>", lines.join("\n"))
}

fn shape(node: &Box) -> Node {
    let widest = node.rows.iter().map(|row| width(&row.text, SMALL, false));
    let named = width(&node.name, NAME, true).max(width(&node.kind, SMALL, false));
    let leaving = node.rows.iter().filter(|row| !row.ends.is_empty()).count() as i32;
    let rows = node.rows.len() as i32;
    Node {
        parent: None,
        shape: Shape::Leaf {
            width: (named.max(widest.max().unwrap_or(0)) + 2 * SIDE).max(50),
            height: HEAD + if rows > 0 { rows * ROW + 5 } else { 0 },
            left: vec![HEAD / 2],
            right: (0..leaving).map(|row| HEAD + row * ROW + ROW / 2).collect(),
        },
    }
}

/// A box with its rows: those where lines begin are the first ones.
fn element(node: &Box, rect: &Rect) -> String {
    let mut out = format!("<g>{}\n", titled(node.tooltip.iter().map(String::as_str)));
    let look = format!("fill=\"#ffffff\" stroke=\"{INK}\" stroke-width=\"1.2\"");
    out += &rounded(rect, 6, &look);
    let middle = rect.x + rect.width / 2;
    let bold = format!(" font-size=\"{NAME}\" font-weight=\"bold\" text-anchor=\"middle\"");
    out += &text(middle, rect.y + 16, &bold, &node.name);
    let grey = " fill=\"#666666\" text-anchor=\"middle\"";
    out += &text(middle, rect.y + 29, grey, &node.kind);
    let (leaving, staying): (Vec<_>, Vec<_>) =
        node.rows.iter().partition(|row| !row.ends.is_empty());
    for (row, at) in leaving.into_iter().chain(staying).zip(0..) {
        let y = rect.y + HEAD + at * ROW + ROW / 2 + 4;
        let (x, anchor) = if row.ends.is_empty() {
            (rect.x + SIDE, "")
        } else {
            (rect.x + rect.width - SIDE, " text-anchor=\"end\"")
        };
        out += &text(x, y, anchor, &row.text);
    }
    out + "</g>\n"
}
