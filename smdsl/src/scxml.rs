//! SCXML: the part of W3C's State Chart XML 1.0 (<https://www.w3.org/TR/scxml/>) that the model can hold. Any other
//! element or attribute is an error at its place.

mod xml;

use crate::builder::{MachineBuilder, empty_region};
use crate::check::MAX_NESTING;
use crate::model::{Action, Region, StateId, StateKind, StateMachine, Transition};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Name;
use roxmltree::Node;
use std::collections::HashMap;
use xml::XmlSource;

const NAMESPACE: &str = "http://www.w3.org/2005/07/scxml";

/// An element: its name, the elements that it may stand in, its attributes.
type Element = (
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
);

const STATE_PARENTS: &[&str] = &["scxml", "state", "parallel"];
const WITH_ENTRY_AND_EXIT: &[&str] = &["state", "parallel", "final"];
const WITH_ACTIONS: &[&str] = &["onentry", "onexit", "transition"];
/// `final` and `initial` in a `parallel`, and a `transition` of a `final`, are told in the words of SMDSL.
const ELEMENTS: [Element; 11] = [
    ("scxml", &[], &["name", "version", "initial"]),
    ("state", STATE_PARENTS, &["id", "initial"]),
    ("parallel", STATE_PARENTS, &["id", "initial"]),
    ("final", STATE_PARENTS, &["id"]),
    ("history", &["state", "parallel"], &["id", "type"]),
    ("initial", &["state", "parallel"], &[]),
    ("onentry", WITH_ENTRY_AND_EXIT, &[]),
    ("onexit", WITH_ENTRY_AND_EXIT, &[]),
    (
        "transition",
        &["state", "parallel", "final", "initial", "history"],
        &["event", "cond", "target"],
    ),
    ("raise", WITH_ACTIONS, &["event"]),
    ("log", WITH_ACTIONS, &["label", "expr"]),
];

/// Reads, resolves and checks one SCXML text. There is a machine unless the text is not SCXML at all.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let text = XmlSource {
        source,
        text: sources.text(source),
    };
    let mut found = Diagnostics::new();
    let document = match text.parse() {
        Ok(document) => document,
        Err(problem) => {
            found.push(problem);
            return (None, found);
        }
    };
    let root = document.root_element();
    if root.tag_name().name() != "scxml" {
        let message = format!("expected `scxml`, found `{}`", root.tag_name().name());
        found.push(Diagnostic::error("syntax-error", text.tag(root), message));
        return (None, found);
    }
    let stem = sources.path(source).file_stem().unwrap_or_default();
    let name = text
        .attribute(root, "name")
        .unwrap_or_else(|| Name::new(stem.to_string_lossy(), text.tag(root)));
    let mut reader = ScxmlReader {
        text,
        builder: MachineBuilder::new(name, Vec::new(), true, found),
        initials: Vec::new(),
        transitions: Vec::new(),
    };
    reader.accept(root, None);
    let top = reader.region(root, None, 1);
    reader.builder.machine.top = top.unwrap_or(empty_region(reader.text.tag(root)));
    if reader.builder.machine.top.states.is_empty() {
        let message = "the machine has no states";
        reader
            .builder
            .error("no-states", reader.text.tag(root), message);
    }
    reader.resolve();
    let (machine, found) = reader.builder.finish();
    (Some(machine), found)
}

/// What was read, with names that may be declared later in the text.
struct ScxmlReader<'a> {
    text: XmlSource<'a>,
    builder: MachineBuilder,
    initials: Vec<Initial>,
    transitions: Vec<UnresolvedTransition>,
}

/// What the text says is entered with a state, or with the machine.
struct Initial {
    of: Option<StateId>,
    targets: Vec<Name>,
    actions: Vec<Action>,
    span: Span,
}

/// A transition, and where it leads.
struct UnresolvedTransition {
    targets: Vec<Name>,
    transition: Transition,
}

impl ScxmlReader<'_> {
    /// Whether an element may stand where it does; what may not is reported, and left out with all that is in it.
    fn accept(&mut self, node: Node<'_, '_>, parent: Option<&str>) -> bool {
        let name = node.tag_name().name();
        let tag = self.text.tag(node);
        let own = node.tag_name().namespace().is_none_or(|n| n == NAMESPACE);
        let known = ELEMENTS
            .iter()
            .find(|(element, ..)| own && *element == name);
        let Some((_, parents, attributes)) = known else {
            let written = self.text.slice(tag);
            self.unsupported(tag, &format!("the element `{written}`"));
            return false;
        };
        if !parent.is_none_or(|parent| parents.contains(&parent)) {
            let message = format!("`{name}` cannot stand in `{}`", parent.unwrap_or_default());
            self.builder.error("misplaced-element", tag, message);
            return false;
        }
        for attribute in node.attributes() {
            if attribute.namespace().is_some() || !attributes.contains(&attribute.name()) {
                let span = self.text.attribute_name(&attribute);
                let written = self.text.slice(span);
                self.unsupported(span, &format!("the attribute `{written}` of `{name}`"));
            }
        }
        for text in node.children().filter(Node::is_text) {
            if let Some(span) = self.text.words(text) {
                self.unsupported(span, &format!("text in `{name}`"));
            }
        }
        true
    }

    fn unsupported(&mut self, span: Span, what: &str) {
        let message = format!("{what} is not in the part of SCXML that is supported");
        self.builder.error("scxml-not-supported", span, message);
    }

    fn missing(&mut self, span: Span, message: &str) {
        self.builder.error("missing-attribute", span, message);
    }

    /// The elements in `node` that may be there.
    fn children<'n, 'i>(&mut self, node: Node<'n, 'i>) -> Vec<(&'n str, Node<'n, 'i>)> {
        let parent = node.tag_name().name();
        node.children()
            .filter(Node::is_element)
            .filter(|child| self.accept(*child, Some(parent)))
            .map(|child| (child.tag_name().name(), child))
            .collect()
    }

    /// All that is directly in the machine or in a state; none where there are no states in it.
    fn region(&mut self, node: Node<'_, '_>, of: Option<StateId>, depth: usize) -> Option<Region> {
        let mut region = empty_region(self.text.tag(node));
        region.parallel = node.tag_name().name() == "parallel";
        let mut initials: Vec<Initial> = Vec::new();
        let attribute = self.text.attribute(node, "initial");
        initials.extend(attribute.map(|attribute| Initial {
            of,
            targets: self.names(&attribute, "state"),
            actions: Vec::new(),
            span: attribute.span,
        }));
        for (name, child) in self.children(node) {
            let tag = self.text.tag(child);
            match name {
                "state" | "parallel" | "final" | "history" if depth > MAX_NESTING => {
                    let message = format!("states nest deeper than {MAX_NESTING} levels here");
                    self.builder.error("nested-too-deep", tag, message);
                }
                "state" | "parallel" => {
                    let id = self.declare(child, StateKind::Plain, of);
                    region.states.push(id);
                    let own = self.region(child, Some(id), depth + 1);
                    self.builder.machine.states[id.0].region = own;
                }
                "final" => {
                    if region.parallel {
                        self.reject_in_parallel(tag, "end", region.span);
                    }
                    let id = self.declare(child, StateKind::End, of);
                    region.states.push(id);
                    self.region(child, Some(id), depth + 1);
                }
                "history" => {
                    let id = self.history(child, of);
                    region.states.push(id);
                }
                "initial" => {
                    let default = self.default_transition(child);
                    initials.extend(default.map(|(targets, actions)| Initial {
                        of,
                        targets,
                        actions,
                        span: tag,
                    }));
                }
                "transition" => {
                    if let Some(source) = of {
                        self.transition(child, source);
                    }
                }
                _ => {
                    let actions = self.actions(child);
                    if let Some(of) = of {
                        let state = &mut self.builder.machine.states[of.0];
                        let list = if name == "onentry" {
                            &mut state.on_entry
                        } else {
                            &mut state.on_exit
                        };
                        list.extend(actions);
                    }
                }
            }
        }
        if region.parallel && region.states.is_empty() {
            let message = "a `parallel` without states";
            self.builder.error("no-states", region.span, message);
        }
        if region.parallel {
            for initial in initials {
                self.reject_in_parallel(initial.span, "initial", region.span);
            }
        } else {
            self.initial(&mut region, initials);
        }
        (!region.states.is_empty()).then_some(region)
    }

    /// What is entered with a state: what the text says once its names are known, otherwise the first state in it.
    fn initial(&mut self, region: &mut Region, declared: Vec<Initial>) {
        let machine = &self.builder.machine;
        let mut declared = declared.into_iter();
        let Some(initial) = declared.next() else {
            let history =
                |id: &StateId| matches!(machine.state(*id).kind, StateKind::History { .. });
            let first = region.states.iter().find(|id| !history(id));
            region.initial.extend(first);
            if first.is_none() && !region.states.is_empty() {
                let message = "there is no state to enter first here, only a history";
                self.builder.error("no-initial-state", region.span, message);
            }
            return;
        };
        for other in declared {
            let message = "what is entered first is said twice";
            self.builder.found.push(
                Diagnostic::error("second-initial-state", other.span, message)
                    .label(initial.span, "the first one"),
            );
        }
        self.initials.push(initial);
    }

    fn declare(&mut self, node: Node<'_, '_>, kind: StateKind, parent: Option<StateId>) -> StateId {
        let tag = self.text.tag(node);
        let name = self.text.attribute(node, "id");
        match &name {
            None => {
                let what = node.tag_name().name();
                let message = format!("`{what}` needs an `id`: code is generated by this name");
                self.missing(tag, &message);
            }
            Some(id) if id.text.is_empty() || id.text.contains(char::is_whitespace) => {
                let message = "an id is a name without spaces";
                self.builder.error("bad-attribute", id.span, message);
            }
            Some(_) => {}
        }
        let name = name.unwrap_or_else(|| Name::new("", tag));
        let id = self.builder.declare(name, Vec::new(), kind);
        self.builder.machine.states[id.0].parent = parent;
        id
    }

    fn history(&mut self, node: Node<'_, '_>, parent: Option<StateId>) -> StateId {
        let kind = self.text.attribute(node, "type");
        let deep = kind.as_ref().is_some_and(|kind| kind.text == "deep");
        if let Some(kind) = kind.filter(|kind| !deep && kind.text != "shallow") {
            let message = format!("`{}` is not a type of history", kind.text);
            self.builder.found.push(
                Diagnostic::error("bad-attribute", kind.span, message)
                    .suggest(&kind.text, ["shallow", "deep"]),
            );
        }
        let id = self.declare(node, StateKind::History { deep }, parent);
        if let Some((targets, actions)) = self.default_transition(node) {
            let span = self.text.tag(node);
            self.add_transition(id, targets, Vec::new(), None, actions, span);
        }
        id
    }

    /// Targets and actions of the one transition that `initial` and `history` have.
    fn default_transition(&mut self, node: Node<'_, '_>) -> Option<(Vec<Name>, Vec<Action>)> {
        let children = self.children(node);
        let (tag, name) = (self.text.tag(node), node.tag_name().name());
        let Some(((_, first), others)) = children.split_first() else {
            let message = format!("`{name}` needs a `transition` with a `target`");
            self.builder.error("missing-element", tag, message);
            return None;
        };
        for (_, other) in others {
            let message = format!("`transition` is repeated; it stands once in `{name}`");
            self.builder.found.push(
                Diagnostic::error("repeated-clause", self.text.tag(*other), message)
                    .label(self.text.tag(*first), "the first one"),
            );
        }
        for attribute in ["event", "cond"] {
            if let Some(value) = self.text.attribute(*first, attribute) {
                let message =
                    format!("the transition of `{name}` has no `{attribute}`: it is always taken");
                self.builder.error("bad-attribute", value.span, message);
            }
        }
        let actions = self.actions(*first);
        let Some(target) = self.text.attribute(*first, "target") else {
            let message = format!("the transition of `{name}` needs a `target`");
            self.missing(self.text.tag(*first), &message);
            return None;
        };
        Some((self.names(&target, "state"), actions))
    }

    fn transition(&mut self, node: Node<'_, '_>, source: StateId) {
        let tag = self.text.tag(node);
        let event = self.text.attribute(node, "event");
        let cond = self.text.attribute(node, "cond");
        let target = self.text.attribute(node, "target");
        if event.is_none() && cond.is_none() && target.is_none() {
            self.missing(tag, "a transition needs an `event`, a `cond` or a `target`");
        }
        let events = event
            .map(|event| self.names(&event, "event"))
            .unwrap_or_default();
        let targets = target
            .map(|target| self.names(&target, "state"))
            .unwrap_or_default();
        let actions = self.actions(node);
        self.add_transition(source, targets, events, cond, actions, tag);
    }

    fn add_transition(
        &mut self,
        source: StateId,
        targets: Vec<Name>,
        events: Vec<Name>,
        cond: Option<Name>,
        actions: Vec<Action>,
        span: Span,
    ) {
        let transition = Transition {
            source,
            targets: Vec::new(),
            events,
            cond,
            actions,
            doc: Vec::new(),
            span,
        };
        self.transitions.push(UnresolvedTransition {
            targets,
            transition,
        });
    }

    /// The names of states or events in a value; there is at least one.
    fn names(&mut self, value: &Name, of: &str) -> Vec<Name> {
        let names = self.text.tokens(value);
        if names.is_empty() {
            let message = format!("no {of} is named here");
            self.builder.error("bad-attribute", value.span, message);
        }
        names
    }

    fn actions(&mut self, node: Node<'_, '_>) -> Vec<Action> {
        let mut actions = Vec::new();
        for (name, child) in self.children(node) {
            self.children(child);
            if name == "log" {
                actions.push(Action::Log {
                    label: self.text.attribute(child, "label"),
                    expr: self.text.attribute(child, "expr"),
                });
            } else if let Some(event) = self.text.attribute(child, "event") {
                self.names(&event, "event");
                actions.push(Action::Raise(event));
            } else {
                self.missing(self.text.tag(child), "`raise` needs an `event`");
            }
        }
        actions
    }

    fn reject_in_parallel(&mut self, span: Span, what: &str, parallel: Span) {
        let message = format!("a parallel state has no {what} state");
        self.builder.found.push(
            Diagnostic::error("not-in-parallel", span, message)
                .label(parallel, "parallel because of this"),
        );
    }

    /// Everything is declared: names become states.
    fn resolve(&mut self) {
        for mut unresolved in std::mem::take(&mut self.transitions) {
            let targets = self.find_all(&unresolved.targets);
            let source = self.builder.machine.state(unresolved.transition.source);
            if let (StateKind::History { .. }, Some(of)) = (source.kind, source.parent) {
                self.check_inside(of, &targets, unresolved.transition.span);
            }
            unresolved.transition.targets = targets;
            self.builder.machine.transitions.push(unresolved.transition);
        }
        for initial in std::mem::take(&mut self.initials) {
            let targets = self.find_all(&initial.targets);
            let region = match initial.of {
                None => Some(&mut self.builder.machine.top),
                Some(of) => self.builder.machine.states[of.0].region.as_mut(),
            };
            if let Some(region) = region {
                region.initial.clone_from(&targets);
                region.actions = initial.actions;
            }
            if let Some(of) = initial.of {
                self.check_inside(of, &targets, initial.span);
            }
        }
    }

    /// The states of these names.
    fn find_all(&mut self, names: &[Name]) -> Vec<StateId> {
        let found: Vec<(StateId, Span)> = names
            .iter()
            .filter_map(|name| Some((self.builder.find(name)?, name.span)))
            .collect();
        if found.len() > 1 {
            self.check_together(&found);
        }
        found.into_iter().map(|(id, _)| id).collect()
    }

    /// States that are entered together are in different parts of parallel states.
    fn check_together(&mut self, targets: &[(StateId, Span)]) {
        // By which of its states each state on the way up is entered, and where that was said.
        let mut entered_through: HashMap<Option<StateId>, (StateId, Span)> = HashMap::new();
        for (target, span) in targets {
            let mut way = Some(*target);
            while let Some(id) = way {
                let machine = &self.builder.machine;
                let parent = machine.state(id).parent;
                let region = parent.and_then(|parent| machine.state(parent).region.as_ref());
                let (other, place) = *entered_through.entry(parent).or_insert((id, *span));
                if other != id && !region.is_some_and(|region| region.parallel) {
                    let name = &machine.state(*target).name.text;
                    let message = format!("`{name}` cannot be entered together with another state");
                    let help = "only states in different parts of a `parallel` are active together";
                    self.builder.found.push(
                        Diagnostic::error("conflicting-targets", *span, message)
                            .label(place, "the other one")
                            .help(help),
                    );
                    break;
                }
                way = parent;
            }
        }
    }

    fn check_inside(&mut self, of: StateId, targets: &[StateId], span: Span) {
        for target in targets {
            let machine = &self.builder.machine;
            let mut up = machine.state(*target).parent;
            while up.is_some_and(|id| id != of) {
                up = up.and_then(|id| machine.state(id).parent);
            }
            if up.is_none() {
                let (inner, outer) = (machine.state(*target), machine.state(of));
                let message = format!("`{}` is not inside `{}`", inner.name.text, outer.name.text);
                let diagnostic = Diagnostic::error("not-inside", span, message)
                    .label(inner.name.span, "declared here");
                self.builder.found.push(diagnostic);
            }
        }
    }
}
