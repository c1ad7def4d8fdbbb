//! From the tree to the model: interfaces are loaded, slots get their names.

use crate::ast::{self, Clause, Setting, SlotDecl};
use crate::model::{Backend, Component, DEFAULT_PERIOD, Qos, Role, SPIN, Slot, StateMachine};
use crate::parse::parse;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span, duration_text};
use rc_idsl::Session;
use rc_idsl::model::{InterfaceId, Library, ModuleId, Operation};
use rc_syntax::{Literal, LiteralKind, Loader, Name};
use std::collections::{HashMap, HashSet};
use std::time::Duration;

/// Reads one `.cdsl` text and all that it imports. There is a component unless its text could not be read at
/// all; it may be used only where no diagnostic is an error.
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
const KNOWN_LANGUAGES: [&str; 4] = ["rust", "cpp", "cpp11", "python"];
/// The setting of a slot whose handlers take or make their value in shared memory.
const IN_PLACE: &str = "in_place";
const KNOWN_OPTIONS: [&str; 3] = ["dsr", "agmagent", "InnerModelViewer"];

/// The file's name in an import, without its ending.
fn stem(import: &str) -> &str {
    let base = import.rsplit(['/', '\\']).next().unwrap_or(import);
    base.strip_suffix(".idsl").unwrap_or(base)
}

/// All interfaces that the imports reach, by their names.
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

/// For so many unknown interfaces the folders are looked through.
const MAX_IMPORT_LOOKUPS: usize = 100;

/// A language that no component is written in.
pub(crate) fn unknown_language(name: &Name) -> Diagnostic {
    let message = format!("unknown language `{}`", name.text);
    Diagnostic::error("unknown-language", name.span, message).suggest(&name.text, KNOWN_LANGUAGES)
}

struct Resolver<'a> {
    interfaces: HashMap<String, Vec<InterfaceId>>,
    library: Library,
    imports: Vec<(ModuleId, Span)>,
    /// The names of the files that were to be imported and could not be.
    failed_imports: Vec<String>,
    /// Whether an import of this name would be found.
    import_exists: &'a dyn Fn(&str) -> bool,
    import_lookups: usize,
    found: &'a mut Diagnostics,
}

impl Resolver<'_> {
    fn component(&mut self, tree: &ast::Component) -> Component {
        let (mut language, mut parameters, mut dependencies) = (None, None, Vec::new());
        let mut state_machine = None;
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
                Clause::Options(names) => self.options(word, names),
                Clause::StateMachine(file, visual) => {
                    self.warn_not_generated(word, "`statemachine`");
                    state_machine = Some(StateMachine {
                        file: file.clone(),
                        visual: *visual,
                    });
                }
                Clause::Parameters(file) => parameters = Some(file.clone()),
                Clause::Dependencies(all) => dependencies.clone_from(all),
                Clause::Period(literal) => {
                    if let Some(ns) = literal.as_nanoseconds().filter(|ns| *ns >= 100_000) {
                        period = Duration::from_nanos(ns);
                    } else {
                        let message = "a period is a time of at least 100us, as in `50ms`";
                        self.found
                            .push(Diagnostic::error("bad-period", literal.span, message));
                    }
                }
            }
        }
        // A clause that is there, but could not be read, has been reported.
        let unread = self.found.iter().any(|d| {
            d.span.source == tree.name.span.source
                && matches!(
                    d.code,
                    "syntax-error" | "unknown-clause" | "unknown-language"
                )
        });
        for (missing, help) in [
            (
                !communications,
                "add `Communications { };`, with what the component implements, requires, publishes and subscribes to",
            ),
            (language.is_none(), "add `language rust;`"),
        ] {
            if missing && !unread {
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
        // Where something is wrong, what is unused may be what was meant.
        if !self.found.has_errors() {
            self.unused_imports(&slots);
        }
        Component {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            language: language.unwrap_or_else(|| Name::new("rust", tree.name.span)),
            slots,
            parameters,
            state_machine,
            dependencies,
            period,
            library: std::mem::take(&mut self.library),
        }
    }

    fn check_unique(&mut self, seen: &mut HashMap<String, Span>, word: &Name, what: &str) {
        if let Some(first) = seen.insert(word.text.to_lowercase(), word.span) {
            let message = format!("{what} `{}` is repeated; each stands once", word.text);
            self.found.push(
                Diagnostic::error("repeated-clause", word.span, message)
                    .label(first, "the first one"),
            );
        }
    }

    fn warn_not_generated(&mut self, word: &Name, what: &str) {
        let message = format!("{what} is read and checked, but nothing is generated for it yet");
        self.found
            .push(Diagnostic::warning("not-generated-yet", word.span, message));
    }

    fn language(&mut self, name: &Name) -> Name {
        if !KNOWN_LANGUAGES
            .iter()
            .any(|k| k.eq_ignore_ascii_case(&name.text))
        {
            self.found.push(unknown_language(name));
        }
        Name::new(name.text.to_lowercase(), name.span)
    }

    fn gui(&mut self, word: &Name, kind: &Name, widget: Option<&Name>) {
        if !["qt", "egui"].contains(&kind.text.to_lowercase().as_str()) {
            let message = format!("unknown gui `{}`", kind.text);
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

    fn options(&mut self, word: &Name, names: &[Name]) {
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
        self.warn_not_generated(word, "`options`");
    }

    fn slots(&mut self, declared: &[ast::Communication]) -> Vec<Slot> {
        let mut slots: Vec<Slot> = Vec::new();
        let mut names = SlotNames::default();
        let mut seen = HashMap::new();
        for communication in declared {
            let role = Role::WORDS
                .iter()
                .find(|(word, _)| word.eq_ignore_ascii_case(&communication.keyword.text));
            let Some((_, role)) = role else { continue };
            self.check_unique(
                &mut seen,
                &Name::new(role.word(), communication.keyword.span),
                "communication clause",
            );
            for decl in &communication.slots {
                let Some(interface) = self.interface(&decl.interface) else {
                    continue;
                };
                self.check_patterns(*role, interface, decl);
                let name = names.name(decl);
                if let Some(first) = names.taken.get(&name.to_ascii_lowercase()) {
                    let message = format!("slot `{name}` exists already");
                    let help = format!("name one of them: `{} as other`", decl.interface.text);
                    let diagnostic =
                        Diagnostic::error("duplicate-slot", decl.span, message).help(help);
                    self.found.push(diagnostic.label(*first, "the first one"));
                    continue;
                }
                names.taken.insert(name.to_ascii_lowercase(), decl.span);
                let backend = decl.backend.as_ref().and_then(|b| self.backend(b));
                let qos = self.qos(*role, interface, &decl.qos);
                slots.push(Slot {
                    name,
                    role: *role,
                    interface,
                    backend,
                    qos,
                    span: decl.span,
                });
            }
        }
        slots
    }

    fn interface(&mut self, name: &Name) -> Option<InterfaceId> {
        let named = self
            .interfaces
            .get(&name.text)
            .map_or(&[][..], Vec::as_slice);
        match named {
            // The import that would bring it has been reported; more about it would be noise.
            [] if self
                .failed_imports
                .iter()
                .any(|f| f.eq_ignore_ascii_case(&name.text)) => {}
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
                    diagnostic.help(format!("import it: {import}"))
                } else if near.is_some() {
                    diagnostic.did_you_mean(near)
                } else {
                    let help = format!("no imported file declares it, and {import} finds no file");
                    diagnostic.help(help)
                };
                self.found.push(diagnostic);
            }
            [_] => {}
            [first, second, ..] => {
                let taken = self.library.interface_path(*first);
                let message = format!(
                    "interface `{}` is in several modules; `{taken}` is taken, since it is imported first",
                    name.text
                );
                let (first, second) = (
                    self.library.interface(*first),
                    self.library.interface(*second),
                );
                self.found.push(
                    Diagnostic::warning("ambiguous-interface", name.span, message)
                        .label(first.name.span, "this one is taken")
                        .label(second.name.span, "this one is not"),
                );
            }
        }
        named.first().copied()
    }

    /// Every operation of an interface has a pattern that its use allows.
    fn check_patterns(&mut self, role: Role, interface: InterfaceId, decl: &SlotDecl) {
        let interface = self.library.interface(interface);
        if interface.operations.is_empty() {
            let message = format!("interface `{}` has no operations", interface.name.text);
            let diagnostic = Diagnostic::warning("empty-interface", decl.interface.span, message);
            self.found
                .push(diagnostic.label(interface.name.span, "declared here"));
        }
        let wrong = |operation: &Operation| match operation.explicit_pattern {
            Some(pattern) if !role.allows(pattern) => {
                Some(format!("is marked `{}`", pattern.word()))
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
            1 => ", and another one does not fit, either".to_owned(),
            more => format!(", and {more} others do not fit, either"),
        };
        let message = format!(
            "`{}` cannot be used under `{}`: its operation `{}` {why}{others}",
            interface.name.text,
            role.word(),
            operation.name.text
        );
        let help = if role.is_topic() {
            "a topic is one way: its operations are void, without `out` and `throws`"
        } else {
            "operations marked `publish` belong under `publishes` and `subscribesTo`"
        };
        let diagnostic =
            Diagnostic::error("wrong-pattern", decl.interface.span, message).help(help);
        self.found
            .push(diagnostic.label(operation.name.span, "declared here"));
    }

    fn backend(&mut self, name: &Name) -> Option<Backend> {
        // RoboComp's files choose Ice so; here that is no choice.
        if name.text.eq_ignore_ascii_case("ice") {
            return None;
        }
        let found = Backend::WORDS
            .iter()
            .find(|(word, _)| word.eq_ignore_ascii_case(&name.text));
        if found.is_none() {
            let message = format!("unknown middleware `{}`", name.text);
            let words = ["iceoryx2", "dds", "ros2"];
            self.found.push(
                Diagnostic::error("unknown-middleware", name.span, message)
                    .suggest(&name.text, words),
            );
        }
        found.map(|(_, backend)| *backend)
    }

    fn qos(&mut self, role: Role, interface: InterfaceId, settings: &[Setting]) -> Qos {
        const TOPIC: [&str; 8] = [
            "reliability",
            "depth",
            "durability",
            "deadline",
            "lifespan",
            "liveliness",
            "wake",
            IN_PLACE,
        ];
        const CALL: [&str; 3] = ["timeout", "wake", IN_PLACE];
        // Who sends or calls chooses at each call whether it does so in place; who publishes waits for nobody.
        let allowed = match role {
            Role::SubscribesTo => &TOPIC[..],
            Role::Publishes => &TOPIC[..6],
            Role::Implements => &CALL[..],
            Role::Requires => &CALL[..2],
        };
        let mut qos = Qos::default();
        let mut seen = HashMap::new();
        for Setting { name, value, spin } in settings {
            self.check_unique(&mut seen, name, "setting");
            if !allowed.contains(&name.text.as_str()) {
                let message = format!("`{}` is not a setting of `{}`", name.text, role.word());
                let diagnostic = Diagnostic::error("unknown-qos", name.span, message);
                self.found
                    .push(diagnostic.suggest(&name.text, allowed.iter().copied()));
                continue;
            }
            let word = match &value.kind {
                LiteralKind::Name(word) => word.as_str(),
                _ => "",
            };
            let wakes = name.text == "wake";
            let time = value
                .as_nanoseconds()
                .filter(|ns| *ns > 0)
                .map(Duration::from_nanos);
            let is_valid = match name.text.as_str() {
                _ if *spin != wakes => false,
                "wake" => assign(&mut qos.spin, time.filter(|time| SPIN.contains(time))),
                "reliability" => {
                    qos.reliable = parse_choice(word, "best_effort", "reliable");
                    qos.reliable.is_some()
                }
                "durability" => {
                    qos.transient_local = parse_choice(word, "volatile", "transient_local");
                    qos.transient_local.is_some()
                }
                "depth" => {
                    qos.depth = value
                        .as_i64()
                        .filter(|d| (1..=1000).contains(d))
                        .map(|d| d as u32);
                    qos.depth.is_some()
                }
                IN_PLACE => {
                    let choice = match value.kind {
                        LiteralKind::Bool(choice) => Some(choice),
                        _ => None,
                    };
                    qos.in_place = choice == Some(true);
                    if qos.in_place {
                        self.check_in_place(role, interface, value);
                    }
                    choice.is_some()
                }
                "timeout" => assign(&mut qos.timeout, time),
                "deadline" => assign(&mut qos.deadline, time),
                "lifespan" => assign(&mut qos.lifespan, time),
                _ => assign(&mut qos.liveliness, time),
            };
            if !is_valid {
                let allowed = match name.text.as_str() {
                    "reliability" => "`reliable` or `best_effort`",
                    "durability" => "`volatile` or `transient_local`",
                    "depth" => "a whole number from 1 to 1000",
                    "wake" => "`spin` and a time from 1us to 10ms",
                    IN_PLACE => "`true` or `false`",
                    _ => "a time such as `500ms`",
                };
                let written = match value.as_nanoseconds() {
                    Some(ns) if *spin => format!("`spin {}`", duration_text(ns)),
                    _ if *spin => format!("`spin` with {}", value.described()),
                    _ => value.described(),
                };
                let message = format!(
                    "{written} is not a value of `{}`; allowed is {allowed}",
                    name.text
                );
                self.found
                    .push(Diagnostic::error("bad-qos", value.span, message));
            }
        }
        qos
    }

    /// Whether the interface has an operation whose values can be in place.
    fn check_in_place(&mut self, role: Role, interface: InterfaceId, value: &Literal) {
        let interface = self.library.interface(interface);
        let mut operations = interface.operations.iter();
        let any = operations.any(|operation| {
            let in_place = match role {
                Role::SubscribesTo => operation.topic_in_place(&self.library),
                _ => operation.result_in_place(&self.library),
            };
            in_place.is_some()
        });
        if !any {
            let what = match role {
                Role::SubscribesTo => "parameter",
                _ => "result",
            };
            let message = format!(
                "no operation of `{}` has, as its only {what}, a plain structure with a bounded sequence",
                interface.name.text
            );
            let help = "plain are numbers, enums, structures of them, `string<N>`, `sequence<T, N>` and arrays";
            self.found
                .push(Diagnostic::error("bad-qos", value.span, message).help(help));
        }
    }

    /// An import is used where a slot's interface is in its file, or in a file that one of them imports.
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
                    "nothing of `{}` is used here",
                    self.library.module(*module).name.text
                );
                self.found
                    .push(Diagnostic::warning("unused-import", *span, message));
            }
        }
    }
}

fn assign(field: &mut Option<Duration>, value: Option<Duration>) -> bool {
    *field = value;
    value.is_some()
}

fn parse_choice(word: &str, no: &str, yes: &str) -> Option<bool> {
    if word == yes {
        Some(true)
    } else {
        (word == no).then_some(false)
    }
}

/// The names of slots, lower case, with their places. `as` names a slot; otherwise it is the interface's name, and
/// repetitions are numbered as RoboComp does.
#[derive(Default)]
struct SlotNames {
    taken: HashMap<String, Span>,
    /// The number to try next, by the interface.
    next: HashMap<String, usize>,
}

impl SlotNames {
    /// The name that a slot chose, or its interface's with the first number that is free.
    fn name(&mut self, decl: &SlotDecl) -> String {
        if let Some(name) = &decl.name {
            return name.text.clone();
        }
        let base = &decl.interface.text;
        let next = self.next.entry(base.to_ascii_lowercase()).or_default();
        loop {
            let name = match *next {
                0 => base.clone(),
                number => format!("{base}{number}"),
            };
            *next += 1;
            if !self.taken.contains_key(&name.to_ascii_lowercase()) {
                return name;
            }
        }
    }
}
