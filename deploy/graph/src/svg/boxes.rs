//! Components, groups and hosts as boxes: sizes and contents.

use super::{INK, NAME, PORT, SMALL, emphasis, port, title};
use crate::marks::{Mark, Marks, marked};
use crate::model::{Component, Graph, Slot, host_title};
use crate::outline::{Step, outline};
use rc_deploy_network::topology::interface_name;
use rc_drawing::{rounded, text, width};
use rc_graph_layout::{Node, Port, Rect, Shape};
use std::collections::HashMap;

/// The height of a slot's line.
const ROW: i32 = 17;
/// The height of a cluster's header.
const HEADER: i32 = 30;
/// Between a name and the edge of its box.
const SIDE: i32 = 9;

/// The frame of a peer that is not part of the network.
const DASHED: &str = " stroke-dasharray=\"4 3\"";

/// The host or group of a cluster.
enum Cluster {
    Host(usize),
    Group(usize),
}

/// All boxes of a picture.
pub(super) struct Boxes {
    pub(super) nodes: Vec<Node>,
    clusters: Vec<(usize, Cluster)>,
    /// The box of each component.
    components: Vec<usize>,
    /// Where each slot is on its box.
    ports: HashMap<(usize, usize), Port>,
}

/// Whether this slot is on the right side: others connect to it.
fn provides(slot: &Slot) -> bool {
    slot.role.is_provided()
}

/// The label of a slot: with its interface, if that has another name, and whether it is optional.
fn slot_name(slot: &Slot) -> String {
    let optional = if slot.optional { " (optional)" } else { "" };
    match interface_name(&slot.interface) {
        same if same == slot.name => format!("{same}{optional}"),
        interface => format!("{}: {interface}{optional}", slot.name),
    }
}

fn head(component: &Component) -> i32 {
    if component.kind().is_some() { 36 } else { 23 }
}

impl Boxes {
    pub(super) fn new(graph: &Graph, marks: &Marks<'_>) -> Self {
        let mut boxes = Self {
            nodes: Vec::new(),
            clusters: Vec::new(),
            components: vec![0; graph.components.len()],
            ports: HashMap::new(),
        };
        let mut around: Vec<usize> = Vec::new();
        for step in outline(graph) {
            let parent = around.last().copied();
            let node = boxes.nodes.len();
            match step {
                Step::Host(at) => {
                    let host = &graph.hosts[at];
                    let name = marked(&host_title(host), marks.host(&host.name));
                    boxes.cluster(parent, Cluster::Host(at), &name);
                    around.push(node);
                }
                Step::Group(at, _) => {
                    let group = &graph.groups[at];
                    let name = marked(Graph::own_name(&group.name), marks.group(&group.name));
                    boxes.cluster(parent, Cluster::Group(at), &name);
                    around.push(node);
                }
                Step::Component(at) => {
                    boxes.component(at, &graph.components[at], parent, marks);
                }
                Step::End => drop(around.pop()),
            }
        }
        boxes
    }

    fn cluster(&mut self, parent: Option<usize>, cluster: Cluster, name: &str) {
        self.nodes.push(Node {
            parent,
            shape: Shape::Cluster {
                width: width(name, NAME, true) + 4 * SIDE,
                header: HEADER,
            },
        });
        self.clusters.push((self.nodes.len() - 1, cluster));
    }

    fn component(
        &mut self,
        at: usize,
        component: &Component,
        parent: Option<usize>,
        marks: &Marks<'_>,
    ) {
        let node = self.nodes.len();
        let top = head(component) + ROW / 2 + 3;
        let (mut left, mut right): (Vec<i32>, Vec<i32>) = (Vec::new(), Vec::new());
        let mut names = [Vec::new(), Vec::new()];
        for (number, slot) in component.slots.iter().enumerate() {
            let mark = marks.slot(at, number);
            let side = if provides(slot) {
                &mut right
            } else {
                &mut left
            };
            self.ports.insert((at, number), port(node, side.len()));
            side.push(top + ROW * side.len() as i32);
            let name = width(&marked(&slot_name(slot), mark), SMALL, mark.is_some());
            names[usize::from(provides(slot))].push(name);
        }
        let [ours, theirs] = names.map(|names| names.into_iter().max().unwrap_or(0));
        let mark = marks.component(&component.name);
        let name = marked(Graph::own_name(&component.name), mark);
        let kind = component
            .kind()
            .map_or(0, |kind| width(&kind, SMALL, false));
        let wide = (ours + theirs + 2 * SIDE + 14)
            .max(width(&name, NAME, true) + 2 * SIDE)
            .max(kind + 2 * SIDE)
            .max(70);
        let rows = left.len().max(right.len()) as i32;
        self.components[at] = node;
        self.nodes.push(Node {
            parent,
            shape: Shape::Leaf {
                width: wide,
                height: head(component) + if rows > 0 { rows * ROW + 6 } else { 0 },
                left,
                right,
            },
        });
    }

    /// Where a slot is on its box.
    pub(super) fn port(&self, slot: (usize, usize)) -> Option<Port> {
        self.ports.get(&slot).copied()
    }

    /// Draws hosts and groups.
    pub(super) fn clusters(&self, graph: &Graph, marks: &Marks<'_>, rects: &[Rect]) -> String {
        let mut out = String::new();
        for (node, cluster) in &self.clusters {
            let rect = &rects[*node];
            let (name, whole, mark, style) = match cluster {
                Cluster::Host(at) => {
                    let host = &graph.hosts[*at];
                    let mark = marks.host(&host.name);
                    let style = "fill=\"#ffffff\" stroke-width=\"1.6\"";
                    (host_title(host), host_title(host), mark, style)
                }
                Cluster::Group(at) => {
                    let group = &graph.groups[*at];
                    let mark = marks.group(&group.name);
                    let style = "fill=\"#000000\" fill-opacity=\"0.05\" stroke-width=\"1\"";
                    let name = Graph::own_name(&group.name).to_owned();
                    (name, format!("group {}", group.name), mark, style)
                }
            };
            let colour = mark.map_or("#666666", |m| m.level.colour());
            let attributes = format!("{style} stroke=\"{colour}\"");
            out += &format!("<g>{}\n", title(&whole, marks, mark));
            out += &rounded(rect, 10, &attributes);
            let emphasis = match mark {
                None => " font-weight=\"bold\" fill=\"#444444\"".to_owned(),
                mark => emphasis(mark),
            };
            let attributes = format!(" font-size=\"{NAME}\"{emphasis}");
            out += &text(
                rect.x + 2 * SIDE,
                rect.y + 19,
                &attributes,
                &marked(&name, mark),
            );
            out += "</g>\n";
        }
        out
    }

    /// Draws components with their slots.
    pub(super) fn components(&self, graph: &Graph, marks: &Marks<'_>, rects: &[Rect]) -> String {
        let mut out = String::new();
        for (at, component) in graph.components.iter().enumerate() {
            let rect = &rects[self.components[at]];
            let own = marks.component(&component.name);
            let all = marks.component_with_slots(&component.name, at, component.slots.len());
            let (colour, thick) = all
                .as_ref()
                .map_or((INK, "1.2"), |m| (m.level.colour(), "2.4"));
            let what = if component.external {
                format!("not part of the network, over {}", component.middleware)
            } else {
                format!(
                    "{}: {} on {}, over {}",
                    component.name,
                    component.component.as_deref().unwrap_or("unknown"),
                    component.host,
                    component.middleware
                )
            };
            out += &format!("<g>{}\n", title(&what, marks, all.as_ref()));
            let dashed = if component.external { DASHED } else { "" };
            let frame =
                format!("fill=\"#ffffff\" stroke=\"{colour}\" stroke-width=\"{thick}\"{dashed}");
            out += &rounded(rect, 4, &frame);
            let middle = rect.x + rect.width / 2;
            let bold = format!(" font-size=\"{NAME}\" font-weight=\"bold\" text-anchor=\"middle\"");
            let fill = own.map_or(String::new(), |m| format!(" fill=\"{}\"", m.level.colour()));
            let name = marked(Graph::own_name(&component.name), own);
            out += &text(middle, rect.y + 16, &(bold + &fill), &name);
            if let Some(kind) = component.kind() {
                let italic = " font-style=\"italic\" fill=\"#444444\" text-anchor=\"middle\"";
                out += &text(middle, rect.y + 29, italic, &kind);
            }
            if !component.slots.is_empty() {
                let y = rect.y + head(component);
                out += &format!(
                    "<path d=\"M{} {y}H{}\" stroke=\"{colour}\" stroke-width=\"0.8\"/>\n",
                    rect.x,
                    rect.x + rect.width
                );
            }
            for (number, slot) in component.slots.iter().enumerate() {
                out += &self.slot((at, number), slot, marks.slot(at, number), rect);
            }
            out += "</g>\n";
        }
        out
    }

    /// Draws a slot: a filled square if it provides, an empty one if it consumes.
    fn slot(&self, at: (usize, usize), slot: &Slot, mark: Option<&Mark>, rect: &Rect) -> String {
        let Some(port) = self.port(at) else {
            return String::new();
        };
        let Shape::Leaf { left, right, .. } = &self.nodes[port.node].shape else {
            return String::new();
        };
        let colour = mark.map_or(INK, |m| m.level.colour());
        let (x, y, fill, at, anchor) = if provides(slot) {
            let x = rect.x + rect.width;
            (
                x,
                right[port.port],
                colour,
                x - SIDE,
                " text-anchor=\"end\"",
            )
        } else {
            (rect.x, left[port.port], "#ffffff", rect.x + SIDE, "")
        };
        let y = rect.y + y;
        let square = format!(
            "<rect x=\"{}\" y=\"{}\" width=\"{2}\" height=\"{2}\" fill=\"{fill}\" stroke=\"{colour}\"/>\n",
            x - PORT,
            y - PORT,
            2 * PORT
        );
        let attributes = format!("{anchor}{}", emphasis(mark));
        square + &text(at, y + 4, &attributes, &marked(&slot_name(slot), mark))
    }
}
