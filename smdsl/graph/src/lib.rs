//! Draws a state machine: states in states, transitions as lines, active states marked.
//!
//! A state is a box with its name, and a row for each of its transitions, where the line begins. A
//! state with substates is a frame; the box inside with its name is where lines to and from the
//! whole state end. So no label lies on a line.
//!
#![doc = include_str!("example.md")]

mod boxes;
mod svg;

use boxes::Boxes;
use rc_graph_layout::Point;
use rc_smdsl::StateMachine;
use std::collections::BTreeSet;

/// A drawing that is a part of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Drawing {
    /// Its width.
    pub width: i32,
    /// Its height.
    pub height: i32,
    elements: String,
}

impl Drawing {
    /// The elements of SVG, with the upper left corner at this place.
    pub fn at(&self, place: Point) -> String {
        rc_drawing::at(place, &self.elements)
    }
}

/// Draws a machine. States with these paths (`driving.forward`), and those that contain them, are
/// marked as active.
pub fn draw(machine: &StateMachine, active: &BTreeSet<String>) -> Drawing {
    let boxes = Boxes::new(machine);
    let nets: Vec<_> = boxes.lines.iter().map(|line| line.net.clone()).collect();
    let layout = rc_graph_layout::layout(&boxes.nodes, &nets);
    let elements = svg::elements(
        machine,
        &boxes,
        &layout,
        &boxes::with_parents(machine, active),
    );
    Drawing {
        width: layout.width,
        height: layout.height,
        elements,
    }
}

/// The picture of a machine as a document of SVG, which ends with a line feed.
pub fn document(machine: &StateMachine) -> String {
    let drawing = draw(machine, &BTreeSet::new());
    let size = Point::new(drawing.width, drawing.height);
    let title = format!("The state machine {}", machine.name.text);
    rc_drawing::document(&title, size, &drawing.elements)
}

#[cfg(test)]
mod tests;
