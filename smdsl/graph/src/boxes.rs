//! States as boxes: their sizes, their rows, and the lines between them.

use rc_drawing::width;
use rc_graph_layout::{Net, Node, Port, Shape};
use rc_smdsl::StateMachine;
use rc_smdsl::model::{Action, Region, StateId, StateKind, Transition};
use std::collections::BTreeSet;

/// Font sizes of names and of rows.
pub(crate) const NAME: f64 = 12.0;
pub(crate) const SMALL: f64 = 10.0;
/// The height of the line with the name, and of a row.
pub(crate) const HEAD: i32 = 23;
pub(crate) const ROW: i32 = 16;
/// Between a text and the edge of its box.
pub(crate) const SIDE: i32 = 9;
/// The edge of the dot from which the initial state is entered.
pub(crate) const DOT: i32 = 10;
/// The most characters of a row.
const LONGEST: usize = 60;

/// Content of a box.
pub(crate) enum Content {
    /// The frame of a state with substates.
    Frame(StateId),
    /// A state, or the name of a state with substates.
    State(StateId),
    /// The dot from which the initial states of a region are entered.
    Start,
}

/// A line between boxes.
pub(crate) struct Line {
    pub(crate) net: Net,
    /// In words.
    pub(crate) title: String,
    /// Whether it leads to initial states.
    pub(crate) is_initial: bool,
}

/// The boxes of a machine.
pub(crate) struct Boxes {
    pub(crate) nodes: Vec<Node>,
    /// One for each node.
    pub(crate) contents: Vec<Content>,
    pub(crate) lines: Vec<Line>,
    /// The box of each state at which lines end.
    places: Vec<usize>,
}

/// The rows of a state: first those where a line begins, each with its transition.
pub(crate) fn rows(machine: &StateMachine, state: StateId) -> Vec<(String, Option<&Transition>)> {
    let of = machine.transitions.iter().filter(|t| t.source == state);
    let (leaving, staying): (Vec<_>, Vec<_>) =
        of.partition(|t| t.targets.iter().any(|target| *target != state));
    let leaving = leaving.into_iter().map(|t| (label(machine, t), Some(t)));
    let staying = staying.into_iter().map(|t| {
        let sign = if t.targets.is_empty() { "" } else { "↺ " };
        (format!("{sign}{}", label(machine, t)), None)
    });
    leaving.chain(staying).collect()
}

/// `event [condition] / actions`, shortened.
fn label(machine: &StateMachine, transition: &Transition) -> String {
    let events: Vec<&str> = transition.events.iter().map(|e| e.text.as_str()).collect();
    let mut text = events.join(" ");
    if let Some(condition) = &transition.cond {
        let space = if text.is_empty() { "" } else { " " };
        text += &format!("{space}[{}]", condition.text());
    }
    let actions: Vec<String> = transition.actions.iter().map(action).collect();
    if !actions.is_empty() {
        let space = if text.is_empty() { "" } else { " " };
        text += &format!("{space}/ {}", actions.join(", "));
    }
    let is_history = matches!(
        machine.state(transition.source).kind,
        StateKind::History { .. }
    );
    if text.is_empty() {
        let what = if is_history {
            "the first time"
        } else {
            "at once"
        };
        what.clone_into(&mut text);
    }
    if text.chars().count() > LONGEST {
        text = text.chars().take(LONGEST - 1).chain(['…']).collect();
    }
    text
}

fn action(action: &Action) -> String {
    match action {
        Action::Raise(event) => format!("raise {}", event.text),
        Action::Send { event, delay, .. } if delay.is_zero() => format!("send {}", event.text),
        Action::Send { event, delay, .. } => format!("send {} in {delay:?}", event.text),
        Action::Cancel(id) => format!("cancel {}", id.text),
        Action::Call(function) => format!("{}()", function.text),
        Action::Log { .. } => "log".to_owned(),
    }
}

/// Text of the line with the name.
pub(crate) fn name(machine: &StateMachine, state: StateId) -> String {
    let it = machine.state(state);
    match it.kind {
        StateKind::History { deep: false } => "H".to_owned(),
        StateKind::History { deep: true } => "H*".to_owned(),
        StateKind::Plain | StateKind::End => it.name.text.clone(),
    }
}

/// A state, and those that contain it, from the inside out.
fn with_ancestors(machine: &StateMachine, id: StateId) -> impl Iterator<Item = StateId> + '_ {
    std::iter::successors(Some(id), |id| machine.state(*id).parent)
}

/// The names of the states with these paths, and of all that contain them.
pub(crate) fn with_parents(machine: &StateMachine, active: &BTreeSet<String>) -> BTreeSet<String> {
    let name = |id: StateId| machine.state(id).name.text.as_str();
    let path = |id: StateId| {
        let mut names: Vec<&str> = with_ancestors(machine, id).map(name).collect();
        names.reverse();
        names.join(".")
    };
    let lit = machine.ids().filter(|id| active.contains(&path(*id)));
    let lit = lit.flat_map(|id| with_ancestors(machine, id));
    lit.map(|id| name(id).to_owned()).collect()
}

impl Boxes {
    pub(crate) fn new(machine: &StateMachine) -> Self {
        let mut boxes = Self {
            nodes: Vec::new(),
            contents: Vec::new(),
            lines: Vec::new(),
            places: vec![0; machine.states.len()],
        };
        let start = boxes.start(None);
        boxes.region(machine, &machine.top, None);
        boxes.initial(machine, &machine.top, start, 0);
        for id in machine.ids() {
            boxes.transitions(machine, id);
        }
        boxes
    }

    fn add(&mut self, parent: Option<usize>, content: Content, shape: Shape) -> usize {
        self.nodes.push(Node { parent, shape });
        self.contents.push(content);
        self.nodes.len() - 1
    }

    fn start(&mut self, parent: Option<usize>) -> usize {
        let shape = Shape::Leaf {
            width: DOT,
            height: DOT,
            left: Vec::new(),
            right: vec![DOT / 2],
        };
        self.add(parent, Content::Start, shape)
    }

    fn region(&mut self, machine: &StateMachine, region: &Region, parent: Option<usize>) {
        for id in &region.states {
            self.state(machine, *id, parent);
        }
    }

    fn state(&mut self, machine: &StateMachine, id: StateId, parent: Option<usize>) {
        let region = machine.state(id).region.as_ref();
        let Some(region) = region else {
            self.places[index(machine, id)] = self.leaf(machine, id, parent);
            return;
        };
        let shape = Shape::Cluster {
            width: 0,
            header: 8,
        };
        let frame = self.add(parent, Content::Frame(id), shape);
        let title = self.leaf(machine, id, Some(frame));
        self.places[index(machine, id)] = title;
        let start = (!region.parallel).then(|| self.start(Some(frame)));
        self.region(machine, region, Some(frame));
        if let Some(start) = start {
            self.initial(machine, region, start, 0);
        }
    }

    fn leaf(&mut self, machine: &StateMachine, id: StateId, parent: Option<usize>) -> usize {
        let rows = rows(machine, id);
        let leaving = rows.iter().filter(|(_, line)| line.is_some()).count() as i32;
        let widest = rows.iter().map(|(text, _)| width(text, SMALL, false)).max();
        let named = width(&name(machine, id), NAME, true);
        let rows = rows.len() as i32;
        let shape = Shape::Leaf {
            width: (named.max(widest.unwrap_or(0)) + 2 * SIDE).max(50),
            height: HEAD + if rows > 0 { rows * ROW + 5 } else { 0 },
            left: vec![HEAD / 2],
            right: (0..leaving).map(|row| HEAD + row * ROW + ROW / 2).collect(),
        };
        self.add(parent, Content::State(id), shape)
    }

    /// The line from a dot to the initial states of a region.
    fn initial(&mut self, machine: &StateMachine, region: &Region, start: usize, port: usize) {
        let to: Vec<Port> = region
            .initial
            .iter()
            .map(|id| self.end(machine, *id))
            .collect();
        if to.is_empty() {
            return;
        }
        let names: Vec<&str> = region
            .initial
            .iter()
            .map(|id| machine.state(*id).name.text.as_str())
            .collect();
        self.lines.push(Line {
            net: Net {
                from: Port { node: start, port },
                to,
            },
            title: format!("initially {}", names.join(", ")),
            is_initial: true,
        });
    }

    fn transitions(&mut self, machine: &StateMachine, id: StateId) {
        let node = self.places[index(machine, id)];
        let rows = rows(machine, id);
        let leaving = rows
            .iter()
            .filter_map(|(text, line)| Some((text, (*line)?)));
        for (port, (text, transition)) in leaving.enumerate() {
            let others = transition.targets.iter().filter(|target| **target != id);
            let names: Vec<&str> = others
                .clone()
                .map(|id| machine.state(*id).name.text.as_str())
                .collect();
            let source = &machine.state(id).name.text;
            let title = format!("{source} => {}: {text}", names.join(", "));
            let to = others.map(|target| self.end(machine, *target)).collect();
            self.lines.push(Line {
                net: Net {
                    from: Port { node, port },
                    to,
                },
                title,
                is_initial: false,
            });
        }
    }

    fn end(&self, machine: &StateMachine, id: StateId) -> Port {
        let node = self.places[index(machine, id)];
        Port { node, port: 0 }
    }
}

/// The index of a state.
fn index(machine: &StateMachine, id: StateId) -> usize {
    machine.ids().position(|other| other == id).unwrap_or(0)
}
