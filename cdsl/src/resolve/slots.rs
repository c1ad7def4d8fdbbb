//! The slots of a component: their interfaces, middlewares and clauses.

use crate::ast::{self, SlotDecl};
use crate::model::{Middleware, Role, Slot};
use crate::resolver::Resolver;
use crate::slot_names::SlotNames;
use rc_diagnostics::{Diagnostic, Span};
use rc_idsl::model::{InterfaceId, Operation, Pattern};
use rc_syntax::Name;
use std::collections::HashMap;

/// The number of unknown interfaces for which the import folders are searched.
const MAX_IMPORT_LOOKUPS: usize = 100;

impl Resolver<'_> {
    pub(super) fn slots(&mut self, declared: &[ast::Communication]) -> Vec<Slot> {
        let mut slots: Vec<Slot> = Vec::new();
        let mut names = SlotNames::default();
        let mut seen = HashMap::new();
        for communication in declared {
            let Some(role) = Role::from_file(&communication.keyword.text) else {
                continue;
            };
            self.check_unique(
                &mut seen,
                &Name::new(role.word(), communication.keyword.span),
                "communication clause",
            );
            for decl in &communication.slots {
                let Some(interface) = self.interface(&decl.interface) else {
                    continue;
                };
                self.check_patterns(role, interface, decl);
                let name = names.name(decl);
                if let Some(first) = names.taken.get(&name.to_ascii_lowercase()) {
                    let message = format!("duplicate slot `{name}`");
                    let help = format!("rename one of them: `{} as other`", decl.interface.text);
                    let diagnostic =
                        Diagnostic::error("duplicate-slot", decl.span, message).help(help);
                    self.found
                        .push(diagnostic.label(*first, "first declared here"));
                    continue;
                }
                names.taken.insert(name.to_ascii_lowercase(), decl.span);
                let backend = decl.backend.as_ref().and_then(|b| self.backend(b));
                let settings = self.qos(role, interface, &decl.qos);
                self.check_array(role, decl);
                let optional = self.optional(role, decl);
                let available = self.available(role, decl);
                slots.push(Slot {
                    name,
                    role,
                    interface,
                    is_array: decl.array.is_some(),
                    backend,
                    optional,
                    qos: settings.qos,
                    in_place: settings.in_place,
                    asynchronous: settings.asynchronous,
                    available,
                    of_world: false,
                    span: decl.span,
                    interface_span: decl.interface.span,
                    name_span: decl.name.as_ref().map(|name| name.span),
                });
            }
        }
        slots
    }

    /// Reports settings that a slot array cannot have: the worker asks for its newest sample, or sets
    /// its last value.
    fn check_array(&mut self, role: Role, decl: &SlotDecl) {
        if decl.array.is_none() || !matches!(role, Role::SubscribesTo | Role::Implements) {
            return;
        }
        let settings = decl.qos.iter().map(|setting| &setting.name);
        let wrong = settings.filter(|name| matches!(name.text.as_str(), "fresh" | "serve"));
        for name in wrong {
            let message = format!("a slot array cannot have `{}`", name.text);
            let error = Diagnostic::error("bad-qos", name.span, message);
            self.found
                .push(error.help("remove it, or declare slots of their own"));
        }
    }

    /// Whether a slot is optional. Reports `optional` at a slot that offers its interface.
    fn optional(&mut self, role: Role, decl: &SlotDecl) -> bool {
        let Some(word) = &decl.optional else {
            return false;
        };
        let consumes = matches!(role, Role::Requires | Role::SubscribesTo);
        if !consumes {
            let message = format!(
                "a slot that {} its interface is always optional",
                role.word()
            );
            let error = Diagnostic::error("optional-provider", word.span, message);
            self.found.push(error.help(
                "remove `optional`: it is for slots that require or subscribe, whose peer may be missing",
            ));
        }
        consumes
    }

    /// The states of `available`. Reports it at a slot that serves no calls.
    fn available(&mut self, role: Role, decl: &SlotDecl) -> Vec<Name> {
        let states = self.names(&decl.available, "state");
        let Some((word, _)) = decl.available.first() else {
            return states;
        };
        if role == Role::Implements {
            return states;
        }
        let message = format!("`{}` has no setting `{}`", role.word(), word.text);
        let help = "`available` belongs to a slot under `implements`, whose calls it refuses in \
                    other states";
        self.found
            .push(Diagnostic::error("unknown-qos", word.span, message).help(help));
        Vec::new()
    }

    /// The names of clauses such as `external go, stop;`. Reports a second clause, and a second
    /// name.
    pub(super) fn names(&mut self, clauses: &[(Name, Vec<Name>)], what: &str) -> Vec<Name> {
        let (mut keywords, mut seen) = (HashMap::new(), HashMap::new());
        for (keyword, names) in clauses {
            self.check_unique(&mut keywords, keyword, "clause");
            for name in names {
                self.check_unique(&mut seen, name, what);
            }
        }
        let names = clauses.iter().flat_map(|(_, names)| names);
        names.cloned().collect()
    }

    /// Reports states of slots in a component without a state machine.
    pub(super) fn check_no_states(&mut self, slots: &[Slot], clauses: &HashMap<String, Span>) {
        // A clause that could not be parsed is not missing.
        let skipped = self.found.iter().any(|d| d.code == "syntax-error");
        if skipped || clauses.contains_key("statemachine") {
            return;
        }
        for slot in slots {
            let Some(state) = slot.available.first() else {
                continue;
            };
            let message = format!(
                "`{}` is a state, but the component has no state machine",
                state.text
            );
            let help = "add `statemachine \"FILE.smdsl\";`, or remove `available`";
            self.found
                .push(Diagnostic::error("no-state-machine", state.span, message).help(help));
        }
    }

    fn interface(&mut self, name: &Name) -> Option<InterfaceId> {
        let is_known = self.interfaces.contains_key(&name.text);
        let is_reported = !is_known && self.is_of_failed_import(&name.text);
        let named = self
            .interfaces
            .get(&name.text)
            .map_or(&[][..], Vec::as_slice);
        match named {
            [] if is_reported => {}
            [] => {
                let message = format!("unknown interface `{}`", name.text);
                let diagnostic = Diagnostic::error("unknown-interface", name.span, message);
                let known = self.interfaces.keys().map(String::as_str);
                let near = rc_diagnostics::nearest(&name.text, known);
                let import = format!("`import \"{}.idsl\";`", name.text);
                self.import_lookups += 1;
                let diagnostic = if self.import_lookups > MAX_IMPORT_LOOKUPS {
                    diagnostic
                } else if (self.import_exists)(&name.text) {
                    let diagnostic = diagnostic.help(format!("add {import}"));
                    let file = format!("{}.idsl", name.text);
                    // An imported file without the interface is not imported again.
                    if self.imported.contains(&name.text) {
                        diagnostic
                    } else {
                        let (place, new) = (self.import_edit)(&file);
                        diagnostic.addition(place, new)
                    }
                } else if near.is_some() {
                    diagnostic.did_you_mean(&name.text, near)
                } else {
                    let help = format!("import the file that declares it; {import} finds no file");
                    diagnostic.help(help)
                };
                self.found.push(diagnostic);
            }
            [_] => {}
            [first, second, ..] => {
                let taken = self.library.interface_path(*first);
                let message = format!(
                    "ambiguous interface `{}`: using `{taken}`, which is imported first",
                    name.text
                );
                let (first, second) = (
                    self.library.interface(*first),
                    self.library.interface(*second),
                );
                self.found.push(
                    Diagnostic::warning("ambiguous-interface", name.span, message)
                        .label(first.name.span, "used")
                        .label(second.name.span, "not used"),
                );
            }
        }
        named.first().copied()
    }

    /// Whether the interface is most likely declared in a file whose import failed, which is
    /// reported already: its name is that of the file or similar, or no other file can be meant.
    fn is_of_failed_import(&mut self, name: &str) -> bool {
        let mut failed = self.failed_imports.iter();
        if self.failed_imports.is_empty() || failed.any(|file| file.eq_ignore_ascii_case(name)) {
            return !self.failed_imports.is_empty();
        }
        let failed = self.failed_imports.iter().map(String::as_str);
        if rc_diagnostics::nearest(name, failed).is_some() {
            return true;
        }
        let known = self.interfaces.keys().map(String::as_str);
        if rc_diagnostics::nearest(name, known).is_some() {
            return false;
        }
        self.import_lookups += 1;
        self.import_lookups > MAX_IMPORT_LOOKUPS || !(self.import_exists)(name)
    }

    /// Reports operations whose pattern is not valid in the role of the slot.
    fn check_patterns(&mut self, role: Role, interface: InterfaceId, decl: &SlotDecl) {
        let interface = self.library.interface(interface);
        if interface.operations.is_empty() {
            let message = format!("interface `{}` has no operations", interface.name.text);
            let diagnostic = Diagnostic::warning("empty-interface", decl.interface.span, message);
            self.found
                .push(diagnostic.label(interface.name.span, "declared here"));
        }
        let wrong = |operation: &Operation| match operation.explicit_pattern {
            Some(pattern) if role.is_topic() != (pattern == Pattern::Publish) => {
                Some(format!("is a `{}`", pattern.word()))
            }
            None if role.is_topic() => match (&operation.result, operation.outputs.first()) {
                (Some(_), _) => Some("returns a value".to_owned()),
                (None, Some(out)) => Some(format!("has `out {}`", out.name.text)),
                _ if !operation.throws.is_empty() => Some("throws".to_owned()),
                _ => None,
            },
            _ => None,
        };
        let mut all = interface.operations.iter();
        let mut wrong = all.by_ref().filter_map(|o| Some((o, wrong(o)?)));
        let Some((operation, why)) = wrong.next() else {
            return;
        };
        let others = match wrong.count() {
            0 => String::new(),
            1 => "; another operation does not fit, either".to_owned(),
            more => format!("; {more} other operations do not fit, either"),
        };
        let message = format!(
            "`{}` cannot be used under `{}`: operation `{}` {why}{others}",
            interface.name.text,
            role.word(),
            operation.name.text
        );
        let name = &interface.name.text;
        let topics = format!("{name}Pub");
        let calls = match role {
            Role::Publishes => "implements",
            Role::Implements | Role::Requires | Role::SubscribesTo => "requires",
        };
        let help = if !role.is_topic() {
            "use the interface under `publishes` or `subscribesTo`".to_owned()
        } else if self.interfaces.contains_key(&topics) || (self.import_exists)(&topics) {
            format!("use the topics of `{topics}`, or use `{name}` under `{calls}`")
        } else {
            format!(
                "topics are one-way: use `{name}` under `{calls}`, or move its topics into an interface `{topics}`"
            )
        };
        let diagnostic =
            Diagnostic::error("wrong-pattern", decl.interface.span, message).help(help);
        self.found
            .push(diagnostic.label(operation.name.span, "declared here"));
    }

    fn backend(&mut self, name: &Name) -> Option<Middleware> {
        // RoboComp's files select Ice, which has no equivalent here.
        if name.text.eq_ignore_ascii_case("ice") {
            return None;
        }
        let found = Middleware::from_file(&name.text);
        if found.is_none() {
            let message = format!("unknown middleware `{}`", name.text);
            let words = Middleware::in_files().map(Middleware::word);
            self.found.push(
                Diagnostic::error("unknown-middleware", name.span, message)
                    .suggest(&name.text, words),
            );
        }
        found
    }
}
