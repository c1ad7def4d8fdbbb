//! SCXML: the subset of W3C's State Chart XML 1.0 (<https://www.w3.org/TR/scxml/>) that the model
//! represents. Every other element or attribute of SCXML is an error. Those of other namespaces are
//! ignored, with a note: editors store the places of states so.

mod actions;

use crate::builder::{MachineBuilder, empty_region};
use crate::check::MAX_NESTING;
use crate::model::{Action, Region, StateId, StateKind, StateMachine, Transition};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::Name;
use rc_xml::XmlSource;
use roxmltree::Node;
use std::collections::{HashMap, HashSet};

const NAMESPACE: &str = "http://www.w3.org/2005/07/scxml";

/// An element: its name, its valid parents, its attributes.
pub type Element = (
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
);

const STATE_PARENTS: &[&str] = &["scxml", "state", "parallel"];
const WITH_ENTRY_AND_EXIT: &[&str] = &["state", "parallel", "final"];
const WITH_ACTIONS: &[&str] = &["onentry", "onexit", "transition"];
/// The supported elements. `final` and `initial` in a `parallel`, and a `transition` in a `final`,
/// are accepted here, because the checks shared with SMDSL report them.
pub const ELEMENTS: [Element; 14] = [
    // Without data, the time of binding makes no difference.
    ("scxml", &[], &["name", "version", "initial", "binding"]),
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
        &["event", "cond", "target", "type"],
    ),
    ("raise", WITH_ACTIONS, &["event"]),
    ("send", WITH_ACTIONS, &["event", "target", "delay", "id"]),
    ("cancel", WITH_ACTIONS, &["sendid"]),
    ("script", WITH_ACTIONS, &[]),
    ("log", WITH_ACTIONS, &["label", "expr"]),
];

/// Loads and checks one SCXML text. Returns no machine if the text is not SCXML.
pub fn load(sources: &SourceMap, source: SourceId) -> (Option<StateMachine>, Diagnostics) {
    let text = XmlSource {
        source,
        text: sources.text(source),
        root: "scxml",
        not_supported: "scxml-not-supported",
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
        ignored: HashSet::new(),
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

/// Reads the elements. Names are resolved at the end, because states may be declared later.
struct ScxmlReader<'a> {
    text: XmlSource<'a>,
    builder: MachineBuilder,
    initials: Vec<Initial>,
    transitions: Vec<UnresolvedTransition>,
    /// The namespaces whose elements and attributes are ignored.
    ignored: HashSet<String>,
}

/// The declared initial states of a state or of the machine.
struct Initial {
    of: Option<StateId>,
    targets: Vec<Name>,
    actions: Vec<Action>,
    span: Span,
}

/// A transition with the names of its targets.
struct UnresolvedTransition {
    targets: Vec<Name>,
    /// The condition as written.
    cond: Option<Name>,
    transition: Transition,
}

impl ScxmlReader<'_> {
    /// Whether an element is valid in its parent. Reports an error if not; the caller skips it.
    fn accept(&mut self, node: Node<'_, '_>, parent: Option<&str>) -> bool {
        let name = node.tag_name().name();
        let tag = self.text.tag(node);
        let namespace = node.tag_name().namespace();
        let own = namespace.is_none_or(|n| n == NAMESPACE);
        if let (Some(namespace), false, Some(_)) = (namespace, own, parent) {
            self.ignore(namespace, tag);
            return false;
        }
        let known = ELEMENTS
            .iter()
            .find(|(element, ..)| own && *element == name);
        let Some((_, parents, attributes)) = known else {
            let written = self.text.slice(tag);
            self.unsupported(tag, &format!("the element `{written}`"));
            return false;
        };
        if !parent.is_none_or(|parent| parents.contains(&parent)) {
            let message = format!("`{name}` is not valid in `{}`", parent.unwrap_or_default());
            self.builder.error("misplaced-element", tag, message);
            return false;
        }
        for attribute in node.attributes() {
            let span = self.text.attribute_name(&attribute);
            if let Some(namespace) = attribute.namespace().filter(|n| *n != NAMESPACE) {
                self.ignore(namespace, span);
            } else if attribute.namespace().is_some() || !attributes.contains(&attribute.name()) {
                let written = self.text.slice(span);
                self.unsupported(span, &format!("the attribute `{written}` of `{name}`"));
            }
        }
        let texts = node
            .children()
            .filter(|child| child.is_text() && name != "script");
        for text in texts {
            if let Some(span) = self.text.words(text) {
                self.unsupported(span, &format!("text in `{name}`"));
            }
        }
        true
    }

    /// Notes once that what another namespace adds is ignored.
    fn ignore(&mut self, namespace: &str, span: Span) {
        if self.ignored.insert(namespace.to_owned()) {
            let message = format!("what the namespace `{namespace}` adds is ignored");
            let note = Diagnostic::note("foreign-namespace", span, message);
            self.builder.found.push(note);
        }
    }

    fn unsupported(&mut self, span: Span, what: &str) {
        let message = format!("{what} is not supported");
        self.builder.error("scxml-not-supported", span, message);
    }

    fn missing(&mut self, span: Span, message: &str) {
        self.builder.error("missing-attribute", span, message);
    }

    /// The valid child elements of `node`.
    fn children<'n, 'i>(&mut self, node: Node<'n, 'i>) -> Vec<(&'n str, Node<'n, 'i>)> {
        let parent = node.tag_name().name();
        node.children()
            .filter(Node::is_element)
            .filter(|child| self.accept(*child, Some(parent)))
            .map(|child| (child.tag_name().name(), child))
            .collect()
    }

    /// Reads the content of the machine or a state. Returns `None` if it contains no states.
    fn region(&mut self, node: Node<'_, '_>, of: Option<StateId>, depth: usize) -> Option<Region> {
        let mut region = empty_region(self.text.tag(node));
        region.parallel = node.tag_name().name() == "parallel";
        let mut initials: Vec<Initial> = Vec::new();
        let attribute = self.text.attribute(node, "initial");
        initials.extend(attribute.map(|attribute| Initial {
            of,
            targets: self.names(&attribute, "a state"),
            actions: Vec::new(),
            span: attribute.span,
        }));
        for (name, child) in self.children(node) {
            let tag = self.text.tag(child);
            match name {
                "state" | "parallel" | "final" | "history" if depth > MAX_NESTING => {
                    let message = format!("states are nested more than {MAX_NESTING} levels deep");
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
                        list.push(actions);
                    }
                }
            }
        }
        if region.parallel && region.states.is_empty() {
            let message = "`parallel` has no states";
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

    /// Sets the initial states: as declared, otherwise the first state.
    fn initial(&mut self, region: &mut Region, declared: Vec<Initial>) {
        let machine = &self.builder.machine;
        let mut declared = declared.into_iter();
        let Some(initial) = declared.next() else {
            let history =
                |id: &StateId| matches!(machine.state(*id).kind, StateKind::History { .. });
            let first = region.states.iter().find(|id| !history(id));
            region.initial.extend(first);
            if first.is_none() && !region.states.is_empty() {
                let message = "expected an initial state, found only a history state";
                self.builder.error("no-initial-state", region.span, message);
            }
            return;
        };
        for other in declared {
            let message = "duplicate initial state";
            self.builder.found.push(
                Diagnostic::error("second-initial-state", other.span, message)
                    .label(initial.span, "first declared here"),
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
                let message = format!("`{what}` has no attribute `id`");
                self.missing(tag, &message);
            }
            Some(id) if id.text.is_empty() || id.text.contains(char::is_whitespace) => {
                let message = "expected a name without spaces";
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
            let message = format!("unknown type of history `{}`", kind.text);
            self.builder.found.push(
                Diagnostic::error("bad-attribute", kind.span, message)
                    .suggest(&kind.text, ["shallow", "deep"]),
            );
        }
        let id = self.declare(node, StateKind::History { deep }, parent);
        if let Some((targets, actions)) = self.default_transition(node) {
            let span = self.text.tag(node);
            self.add_transition(
                targets,
                None,
                Transition {
                    actions,
                    ..transition(id, span)
                },
            );
        }
        id
    }

    /// The targets and actions of the only transition of an `initial` or a `history`.
    fn default_transition(&mut self, node: Node<'_, '_>) -> Option<(Vec<Name>, Vec<Action>)> {
        let children = self.children(node);
        let (tag, name) = (self.text.tag(node), node.tag_name().name());
        let Some(((_, first), others)) = children.split_first() else {
            let message = format!("`{name}` has no `transition` with a `target`");
            self.builder.error("missing-element", tag, message);
            return None;
        };
        for (_, other) in others {
            let message = format!("duplicate `transition` in `{name}`");
            self.builder.found.push(
                Diagnostic::error("repeated-clause", self.text.tag(*other), message)
                    .label(self.text.tag(*first), "first declared here"),
            );
        }
        for attribute in ["event", "cond"] {
            if let Some(value) = self.text.attribute(*first, attribute) {
                let message = format!(
                    "the transition of `{name}` cannot have `{attribute}`: it is always taken"
                );
                self.builder.error("bad-attribute", value.span, message);
            }
        }
        let actions = self.actions(*first);
        let Some(target) = self.text.attribute(*first, "target") else {
            let message = format!("the transition of `{name}` has no `target`");
            self.missing(self.text.tag(*first), &message);
            return None;
        };
        Some((self.names(&target, "a state"), actions))
    }

    fn transition(&mut self, node: Node<'_, '_>, source: StateId) {
        let tag = self.text.tag(node);
        let event = self.text.attribute(node, "event");
        let cond = self.text.attribute(node, "cond");
        let target = self.text.attribute(node, "target");
        if event.is_none() && cond.is_none() && target.is_none() {
            self.missing(tag, "`transition` has no `event`, `cond` or `target`");
        }
        let events = event
            .map(|event| self.names(&event, "an event"))
            .unwrap_or_default();
        let targets = target
            .map(|target| self.names(&target, "a state"))
            .unwrap_or_default();
        let internal = self.text.attribute(node, "type");
        let is_internal = internal
            .as_ref()
            .is_some_and(|kind| kind.text == "internal");
        if let Some(kind) = internal.filter(|kind| !is_internal && kind.text != "external") {
            let message = format!("unknown type of transition `{}`", kind.text);
            self.builder.found.push(
                Diagnostic::error("bad-attribute", kind.span, message)
                    .suggest(&kind.text, ["internal", "external"]),
            );
        }
        let actions = self.actions(node);
        let transition = Transition {
            events,
            internal: is_internal,
            actions,
            ..transition(source, tag)
        };
        self.add_transition(targets, cond, transition);
    }

    fn add_transition(&mut self, targets: Vec<Name>, cond: Option<Name>, transition: Transition) {
        self.transitions.push(UnresolvedTransition {
            targets,
            cond,
            transition,
        });
    }

    /// The names of states or events in a value. Reports an error if there is none.
    fn names(&mut self, value: &Name, of: &str) -> Vec<Name> {
        let names = self.text.tokens(value);
        if names.is_empty() {
            let message = format!("expected the name of {of}, found nothing");
            self.builder.error("bad-attribute", value.span, message);
        }
        names
    }

    fn reject_in_parallel(&mut self, span: Span, what: &str, parallel: Span) {
        let message = format!("a parallel state cannot have an {what} state");
        self.builder.found.push(
            Diagnostic::error("not-in-parallel", span, message)
                .label(parallel, "the parallel state"),
        );
    }

    /// Resolves the names of all targets.
    fn resolve(&mut self) {
        for mut unresolved in std::mem::take(&mut self.transitions) {
            let targets = self.find_all(&unresolved.targets);
            let source = self.builder.machine.state(unresolved.transition.source);
            if let (StateKind::History { .. }, Some(of)) = (source.kind, source.parent) {
                self.check_inside(of, &targets, unresolved.transition.span);
                self.reject_history(&targets, unresolved.transition.span);
            }
            unresolved.transition.targets = targets;
            unresolved.transition.cond = unresolved.cond.and_then(|cond| self.condition(cond));
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

    /// Reports history states as the default of another one, which might lead back to it.
    fn reject_history(&mut self, targets: &[StateId], span: Span) {
        let machine = &self.builder.machine;
        let mut kinds = targets.iter().map(|target| machine.state(*target).kind);
        if kinds.any(|kind| matches!(kind, StateKind::History { .. })) {
            let message = "the default of a history state cannot be another history state";
            self.builder.error("bad-attribute", span, message);
        }
    }

    /// Looks up states by name.
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

    /// Reports targets that cannot be active together: they are not in different regions of a
    /// parallel state.
    fn check_together(&mut self, targets: &[(StateId, Span)]) {
        // For each ancestor: the child through which it is entered, and the location of that
        // target.
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
                    let help = "choose states in different regions of a `parallel`";
                    self.builder.found.push(
                        Diagnostic::error("conflicting-targets", *span, message)
                            .label(place, "the other state")
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

/// A transition with nothing but its source.
fn transition(source: StateId, span: Span) -> Transition {
    Transition {
        source,
        targets: Vec::new(),
        events: Vec::new(),
        cond: None,
        internal: false,
        actions: Vec::new(),
        doc: Vec::new(),
        span,
    }
}
