//! Loads the imported interfaces and builds the model of a component.

use crate::ast::{self, Clause, SlotDecl};
use crate::model::{
    Component, DEFAULT_PERIOD, Dependency, Language, Middleware, Role, Slot, StateMachine,
};
use crate::parse::{parse, unknown_language};
use crate::resolver::Resolver;
use crate::slot_names::SlotNames;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_idsl::Session;
use rc_idsl::model::{InterfaceId, Library, ModuleId, Operation, Pattern};
use rc_syntax::{Literal, LiteralKind, Loader, Name};
use std::collections::{HashMap, HashSet};
use std::time::Duration;

/// Loads a `.cdsl` text with its imports.
///
/// Returns no component if the text cannot be parsed at all. Use the component only if no
/// diagnostic is an error.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Option<Component>, Diagnostics) {
    let (file, mut found) = parse(sources, source);
    let path = sources.path(source).to_path_buf();
    let mut session = Session::new(sources, loader);
    let mut imports: Vec<(ModuleId, Span)> = Vec::new();
    let mut failed_imports = Vec::new();
    for import in &file.imports {
        match session.import(&path, &import.text, import.span) {
            Some(module) if imports.iter().any(|(m, _)| *m == module) => {}
            Some(module) => imports.push((module, import.span)),
            None => failed_imports.push(stem(&import.text).to_owned()),
        }
    }
    found.extend(session.found);
    let library = session.library;
    let component = file.component.map(|tree| {
        let mut resolver = Resolver {
            interfaces: interfaces_by_name(&library, &imports),
            library,
            imports,
            failed_imports,
            import_exists: &|name| loader.find(&path, name, "idsl").is_ok(),
            import_lookups: 0,
            found: &mut found,
        };
        resolver.component(&tree)
    });
    (component, found)
}

const KNOWN_WIDGETS: [&str; 3] = ["QWidget", "QDialog", "QMainWindow"];
/// The option that shows the tree of the component in a window.
const VIEWER: &str = "InnerModelViewer";
/// The option that gives slot arrays the devices of a scene.
const SCENE_SLOTS: &str = "InnerModelSlots";
const KNOWN_OPTIONS: [&str; 4] = ["dsr", "agmagent", VIEWER, SCENE_SLOTS];

/// The file name of an import, without its extension.
fn stem(import: &str) -> &str {
    let base = import.rsplit(['/', '\\']).next().unwrap_or(import);
    base.strip_suffix(".idsl").unwrap_or(base)
}

/// All imported interfaces by name.
fn interfaces_by_name(
    library: &Library,
    imports: &[(ModuleId, Span)],
) -> HashMap<String, Vec<InterfaceId>> {
    let mut interfaces: HashMap<String, Vec<InterfaceId>> = HashMap::new();
    let modules = imports.iter().flat_map(|(m, _)| library.reachable(*m));
    for id in modules.flat_map(|m| &library.module(m).interfaces) {
        let name = library.interface(*id).name.text.clone();
        let named = interfaces.entry(name).or_default();
        if !named.contains(id) {
            named.push(*id);
        }
    }
    interfaces
}

/// The life cycle that a component may have.
const MANAGED: &str = "managed";

/// The number of unknown interfaces for which the import folders are searched.
const MAX_IMPORT_LOOKUPS: usize = 100;

impl Resolver<'_> {
    fn component(&mut self, tree: &ast::Component) -> Component {
        let (mut language, mut parameters, mut dependencies) = (None, None, Vec::new());
        let (mut state_machine, mut simulates_time, mut managed) = (None, false, false);
        let (mut viewer, mut scene_slots, mut python) = (None, None, None);
        let (mut slots, mut period, mut communications) = (Vec::new(), DEFAULT_PERIOD, false);
        let mut seen: HashMap<String, Span> = HashMap::new();
        for (word, clause) in &tree.clauses {
            self.check_unique(&mut seen, word, "clause");
            match clause {
                Clause::Communications(all) => {
                    communications = true;
                    slots = self.slots(all);
                }
                Clause::Language(name) => language = Some(self.language(name)),
                Clause::Gui(kind, widget) => self.gui(word, kind, widget.as_ref()),
                Clause::Options(names) => (viewer, scene_slots) = self.options(word, names),
                Clause::StateMachine(file, visual, external) => {
                    state_machine = Some(StateMachine {
                        file: file.clone(),
                        visual: *visual,
                        external: self.names(external, "event"),
                    });
                }
                Clause::Parameters(file) => parameters = Some(file.clone()),
                Clause::Dependencies(all) => {
                    dependencies = all.iter().map(|one| self.dependency(one)).collect();
                }
                Clause::Python(version, venv) => python = Some((word, version, *venv)),
                Clause::SimulatesTime => simulates_time = true,
                Clause::Lifecycle(kind) if kind.text.eq_ignore_ascii_case(MANAGED) => {
                    managed = true;
                }
                Clause::Lifecycle(kind) => {
                    let message = format!("unknown life cycle `{}`", kind.text);
                    let error = Diagnostic::error("unknown-lifecycle", kind.span, message);
                    self.found.push(error.suggest(&kind.text, [MANAGED]));
                }
                Clause::Period(literal) => {
                    if let Some(ns) = literal.as_nanoseconds().filter(|ns| *ns >= 100_000) {
                        period = Duration::from_nanos(ns);
                    } else {
                        let message = "expected a duration of at least 100us, such as `50ms`";
                        self.found
                            .push(Diagnostic::error("bad-period", literal.span, message));
                    }
                }
            }
        }
        if state_machine.is_none() {
            self.check_no_states(&slots, &seen);
        }
        // A clause that could not be parsed is not missing.
        let skipped = self.found.iter().any(|d| {
            d.span.source == tree.name.span.source
                && matches!(
                    d.code,
                    "syntax-error" | "unknown-clause" | "unknown-language"
                )
        });
        for (missing, help) in [
            (
                !communications,
                "add `Communications { };` with the interfaces of the component",
            ),
            (language.is_none(), "add `language rust;`"),
        ] {
            if missing && !skipped {
                let what = if help.contains("language") {
                    "language"
                } else {
                    "Communications"
                };
                let message = format!("component `{}` has no `{what}` clause", tree.name.text);
                self.found
                    .push(Diagnostic::error("missing-clause", tree.name.span, message).help(help));
            }
        }
        // After an error, an unused import may be the intended one.
        if !self.found.has_errors() {
            self.unused_imports(&slots);
        }
        let python = python
            .and_then(|(word, version, venv)| self.python(word, version, venv, language.as_ref()));
        Component {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            language: language.unwrap_or_else(|| Name::new("rust", tree.name.span)),
            slots,
            parameters,
            state_machine,
            dependencies,
            python,
            period,
            simulates_time,
            managed,
            viewer,
            scene_slots,
            library: std::mem::take(&mut self.library),
        }
    }

    fn warn_not_generated(&mut self, word: &Name, what: &str) {
        let message = format!("{what} has no effect yet: it is only checked");
        self.found
            .push(Diagnostic::warning("not-generated-yet", word.span, message));
    }

    fn language(&mut self, name: &Name) -> Name {
        let mut known = Language::WORDS.into_iter();
        if !known.any(|(word, _)| word.eq_ignore_ascii_case(&name.text)) {
            self.found.push(unknown_language(name));
        }
        Name::new(name.text.to_lowercase(), name.span)
    }

    fn dependency(&mut self, tree: &ast::Dependency) -> Dependency {
        const FIELDS: [&str; 4] = ["version", "path", "features", "default_features"];
        let mut out = Dependency {
            package: tree.package.clone(),
            version: None,
            path: None,
            features: Vec::new(),
            default_features: true,
        };
        match &tree.short {
            Some(path) if path.text.starts_with(['.', '/']) => out.path = Some(path.clone()),
            version => out.version.clone_from(version),
        }
        let text = |literal: &Literal| match &literal.kind {
            LiteralKind::String(text) => Some(Name::new(text.as_str(), literal.span)),
            _ => None,
        };
        let mut seen = HashMap::new();
        for (name, values) in &tree.fields {
            self.check_unique(&mut seen, name, "field");
            let texts: Option<Vec<Name>> = values.iter().map(text).collect();
            let expected = match (name.text.as_str(), values.as_slice(), texts.as_deref()) {
                ("version", _, Some([version])) => {
                    out.version = Some(version.clone());
                    continue;
                }
                ("path", _, Some([path])) => {
                    out.path = Some(path.clone());
                    continue;
                }
                ("features", _, Some(features)) => {
                    out.features = features.to_vec();
                    continue;
                }
                ("default_features", [value], _) if matches!(value.kind, LiteralKind::Bool(_)) => {
                    out.default_features = value.kind != LiteralKind::Bool(false);
                    continue;
                }
                ("default_features", ..) => "`true` or `false`",
                ("features", ..) => "names of features, such as `features \"derive\", \"rc\"`",
                ("version" | "path", ..) => "one string",
                _ => {
                    let message = format!("unknown field `{}` of a dependency", name.text);
                    let error = Diagnostic::error("bad-dependency", name.span, message);
                    self.found.push(error.suggest(&name.text, FIELDS));
                    continue;
                }
            };
            let message = format!("`{}` takes {expected}", name.text);
            self.found
                .push(Diagnostic::error("bad-dependency", name.span, message));
        }
        if out.version.is_none() && out.path.is_none() {
            let name = &tree.package;
            let message = format!("`{}` has no version and no path", name.text);
            let help = format!(
                "write `{} \"1\";` or `{} {{ version \"1\"; }};`",
                name.text, name.text
            );
            self.found
                .push(Diagnostic::error("bad-dependency", name.span, message).help(help));
        }
        out
    }

    fn gui(&mut self, word: &Name, kind: &Name, widget: Option<&Name>) {
        if !["qt", "egui"].contains(&kind.text.to_lowercase().as_str()) {
            let message = format!("unknown GUI toolkit `{}`", kind.text);
            self.found.push(
                Diagnostic::error("unknown-gui", kind.span, message)
                    .suggest(&kind.text, ["Qt", "egui"]),
            );
        }
        if let Some(widget) = widget.filter(|w| {
            !KNOWN_WIDGETS
                .iter()
                .any(|known| known.eq_ignore_ascii_case(&w.text))
        }) {
            let message = format!("unknown widget `{}`", widget.text);
            self.found.push(
                Diagnostic::error("unknown-widget", widget.span, message)
                    .suggest(&widget.text, KNOWN_WIDGETS),
            );
        }
        self.warn_not_generated(word, "`gui`");
    }

    /// Where the options `InnerModelViewer` and `InnerModelSlots` stand. The other ones have no
    /// effect yet.
    fn options(&mut self, word: &Name, names: &[Name]) -> (Option<Span>, Option<Span>) {
        for name in names.iter().filter(|n| {
            !KNOWN_OPTIONS
                .iter()
                .any(|o| o.eq_ignore_ascii_case(&n.text))
        }) {
            let message = format!("unknown option `{}`", name.text);
            self.found.push(
                Diagnostic::error("unknown-option", name.span, message)
                    .suggest(&name.text, KNOWN_OPTIONS),
            );
        }
        let place = |option: &str| {
            let mut named = names.iter();
            let named = named.find(|name| name.text.eq_ignore_ascii_case(option));
            named.map(|name| name.span)
        };
        let (viewer, scene_slots) = (place(VIEWER), place(SCENE_SLOTS));
        let has_effect = |name: &Name| [viewer, scene_slots].contains(&Some(name.span));
        if !names.iter().all(has_effect) {
            self.warn_not_generated(word, "`options`");
        }
        (viewer, scene_slots)
    }

    fn slots(&mut self, declared: &[ast::Communication]) -> Vec<Slot> {
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
                let (qos, in_place) = self.qos(role, interface, &decl.qos);
                let optional = self.optional(role, decl);
                let available = self.available(role, decl);
                slots.push(Slot {
                    name,
                    role,
                    interface,
                    is_array: decl.array.is_some(),
                    backend,
                    optional,
                    qos,
                    in_place,
                    available,
                    span: decl.span,
                });
            }
        }
        slots
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
    fn names(&mut self, clauses: &[(Name, Vec<Name>)], what: &str) -> Vec<Name> {
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
    fn check_no_states(&mut self, slots: &[Slot], clauses: &HashMap<String, Span>) {
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
                    diagnostic.help(format!("add {import}"))
                } else if near.is_some() {
                    diagnostic.did_you_mean(near)
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
            1 => ", and so is another operation".to_owned(),
            more => format!(", and so are {more} other operations"),
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
            _ => "requires",
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

    /// Reports unused imports. An import is used if a slot's interface depends on its file, or if
    /// its file imports a slot's interface.
    fn unused_imports(&mut self, slots: &[Slot]) {
        let modules = slots
            .iter()
            .map(|s| self.library.interface(s.interface).module);
        let used: HashSet<ModuleId> = modules.collect();
        let reachable = used.iter().flat_map(|m| self.library.reachable(*m));
        let reachable: HashSet<ModuleId> = reachable.collect();
        for (module, span) in &self.imports {
            let reached = self.library.reachable(*module);
            if !reachable.contains(module)
                && !reached.iter().any(|m| used.contains(m))
                && !self.library.module(*module).interfaces.is_empty()
            {
                let message = format!(
                    "unused import of `{}`",
                    self.library.module(*module).name.text
                );
                self.found
                    .push(Diagnostic::warning("unused-import", *span, message));
            }
        }
    }
}
