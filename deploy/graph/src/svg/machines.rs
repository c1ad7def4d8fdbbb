//! The state machines of the components of a running network, below the network.

use super::NAME;
use crate::model::Graph;
use rc_drawing::{text, width};
use rc_graph_layout::Point;
use rc_state_graph::Drawing;

/// Above each machine, and the line with its name.
const SPACE: i32 = 18;
const HEADING: i32 = 24;

/// The machines, each with its component.
pub(super) struct Machines<'a> {
    pub(super) width: i32,
    pub(super) height: i32,
    all: Vec<(&'a str, Drawing)>,
}

impl<'a> Machines<'a> {
    pub(super) fn new(graph: &'a Graph) -> Self {
        let mut machines = Self {
            width: 0,
            height: 0,
            all: Vec::new(),
        };
        for component in &graph.components {
            let (Some(machine), Some(live)) = (&component.machine, &component.live) else {
                continue;
            };
            let active = live.states.iter().cloned().collect();
            let drawing = rc_state_graph::draw(machine, &active);
            let heading = width(&component.name, NAME, true);
            machines.width = machines.width.max(drawing.width).max(heading);
            machines.height += SPACE + HEADING + drawing.height;
            machines.all.push((&component.name, drawing));
        }
        machines
    }

    /// Draws them from this place downwards.
    pub(super) fn draw(&self, x: i32, mut y: i32) -> String {
        let mut out = String::new();
        for (name, drawing) in &self.all {
            let attributes = format!(" font-size=\"{NAME}\" font-weight=\"bold\"");
            out += &text(x, y + SPACE + 12, &attributes, name);
            out += &drawing.at(Point::new(x, y + SPACE + HEADING));
            y += SPACE + HEADING + drawing.height;
        }
        out
    }
}
