//! Loads the imported interfaces and builds the model of a component.

mod collects;
mod reactions;
mod slots;
mod world;

use crate::ast::{self, Clause};
use crate::model::{Component, DEFAULT_PERIOD, Dependency, Language, Slot, StateMachine};
use crate::parse::{parse, unknown_language};
use crate::resolver::Resolver;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_idsl::Session;
use rc_idsl::model::{InterfaceId, Library, ModuleId};
use rc_syntax::{Literal, LiteralKind, Loader, Name, import_edit};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;
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
    let (mut file, mut found) = parse(sources, source);
    file.component.iter_mut().for_each(world::share_dsr);
    let path = sources.path(source).to_path_buf();
    let mut session = Session::new(sources, loader);
    let mut imports: Vec<(ModuleId, Span)> = Vec::new();
    let mut failed_imports = Vec::new();
    let mut prototype_imports = Vec::new();
    for import in &file.imports {
        let ending = Path::new(&import.text).extension();
        if ending.is_some_and(|ending| ending == "dproto") {
            prototype_imports.push(import.clone());
            continue;
        }
        match session.import(&path, &import.text, import.span) {
            Some(module) if imports.iter().any(|(m, _)| *m == module) => {}
            Some(module) => imports.push((module, import.span)),
            None => failed_imports.push(stem(&import.text).to_owned()),
        }
    }
    // Replicas of a world meet at the topics of an interface that comes with the tools.
    for world in file.component.iter().flat_map(shared) {
        let module = session.import(&path, world::FILE, world.span);
        let other = module.and_then(|module| world::other(world, &session.library, module));
        session.found.extend(other);
    }
    found.extend(session.found);
    let library = session.library;
    let component = file.component.map(|tree| {
        let mut resolver = Resolver {
            interfaces: interfaces_by_name(&library, &imports),
            library,
            imports,
            failed_imports,
            imported: file
                .imports
                .iter()
                .map(|one| stem(&one.text).to_owned())
                .collect(),
            import_exists: &|name| loader.find(&path, name, "idsl").is_ok(),
            import_lookups: 0,
            import_edit: &|file| {
                let (at, new) = import_edit(sources.text(source), file);
                (Span::new(source, at, at), new)
            },
            found: &mut found,
        };
        Component {
            prototype_imports,
            ..resolver.component(&tree)
        }
    });
    (component, found)
}

/// The clauses `world` of a component.
fn shared(tree: &ast::Component) -> impl Iterator<Item = &ast::World> {
    tree.clauses.iter().filter_map(|(_, clause)| match clause {
        Clause::World(world) => Some(world),
        _ => None,
    })
}

/// The option that shows the tree of the component in a window.
const VIEWER: &str = "InnerModelViewer";
/// The option that gives slot arrays the devices of a scene.
const SCENE_SLOTS: &str = "InnerModelSlots";
const KNOWN_OPTIONS: [&str; 4] = [world::DSR, "agmagent", VIEWER, SCENE_SLOTS];

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

impl Resolver<'_> {
    fn component(&mut self, tree: &ast::Component) -> Component {
        let (mut language, mut parameters, mut dependencies) = (None, None, Vec::new());
        let (mut state_machine, mut simulates_time, mut managed) = (None, false, false);
        let (mut viewer, mut scene_slots, mut python, mut gui) = (None, None, None, None);
        let (mut reactions, mut world, mut collects) = (None, None, Vec::new());
        let mut kinematics: Vec<(Name, Name)> = Vec::new();
        let (mut slots, mut period, mut communications) = (Vec::new(), DEFAULT_PERIOD, false);
        let mut seen: HashMap<String, Span> = HashMap::new();
        for (word, clause) in &tree.clauses {
            if !matches!(clause, Clause::Kinematics(..) | Clause::Collect(..)) {
                self.check_unique(&mut seen, word, "clause");
            }
            match clause {
                Clause::Communications(all) => {
                    communications = true;
                    slots = self.slots(all);
                }
                Clause::Language(name) => language = Some(self.language(name)),
                Clause::Gui(toolkit, widget) => gui = Some((word, toolkit, widget.as_ref())),
                Clause::Options(names) => {
                    let shares_dsr = world::can_share_dsr(tree);
                    (viewer, scene_slots) = self.options(word, names, shares_dsr);
                }
                Clause::StateMachine(file, visual, external) => {
                    state_machine = Some(StateMachine {
                        file: file.clone(),
                        visual: *visual,
                        external: self.names(external, "event"),
                    });
                }
                Clause::Parameters(file) => parameters = Some(file.clone()),
                Clause::Kinematics(file, name) => {
                    let mut known = kinematics.iter();
                    let same = known.find(|(_, other)| other.text.eq_ignore_ascii_case(&name.text));
                    if let Some((_, first)) = same {
                        let message = format!("two robots are called `{}`", name.text);
                        let error = Diagnostic::error("repeated-clause", name.span, message);
                        self.found.push(error.label(first.span, "first used here"));
                    } else {
                        kinematics.push((file.clone(), name.clone()));
                    }
                }
                Clause::World(tree) => world = Some(world::world(tree, self.found)),
                Clause::Dependencies(all) => {
                    dependencies = all.iter().map(|one| self.dependency(one)).collect();
                }
                Clause::Python(version, venv) => python = Some((word, version, *venv)),
                Clause::Collect(tree) => collects.push(tree),
                Clause::Reactions(all) => reactions = Some(all),
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
        if let Some(world) = &world {
            slots.extend(world::slots(world, &slots, &self.library, self.found));
        } else {
            world::undeclared(&slots, &self.library, language.as_ref(), self.found);
        }
        if state_machine.is_none() {
            self.check_no_states(&slots, &seen);
        }
        let collects = self.collects(&collects, &slots);
        let reactions = reactions.map(|all| self.reactions(all, &slots, &collects, period));
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
        let window = gui.and_then(|(word, toolkit, widget)| {
            crate::window::window(word, toolkit, widget, language.as_ref(), self.found)
        });
        let python = python.and_then(|(word, version, venv)| {
            crate::python::python(word, version, venv, language.as_ref(), self.found)
        });
        Component {
            name: tree.name.clone(),
            doc: tree.doc.clone(),
            language: language.unwrap_or_else(|| Name::new("rust", tree.name.span)),
            slots,
            parameters,
            kinematics,
            world,
            state_machine,
            dependencies,
            python,
            period,
            collects,
            reactions,
            simulates_time,
            managed,
            window,
            viewer,
            scene_slots,
            library: std::mem::take(&mut self.library),
            prototype_imports: Vec::new(),
            prototypes: Arc::default(),
        }
    }

    fn language(&mut self, name: &Name) -> Name {
        let mut known = Language::WORDS.into_iter();
        if !known.any(|(word, _)| word.eq_ignore_ascii_case(&name.text)) {
            self.found.push(unknown_language(name));
        }
        Name::new(name.text.to_lowercase(), name.span)
    }

    fn dependency(&mut self, tree: &ast::Dependency) -> Dependency {
        const FIELDS: [&str; 5] = [
            "version",
            "path",
            "features",
            "default_features",
            "components",
        ];
        let mut out = Dependency {
            package: tree.package.clone(),
            version: None,
            path: None,
            features: Vec::new(),
            default_features: true,
            components: Vec::new(),
        };
        match &tree.short {
            Some(path) if path.text.starts_with(['.', '/']) => out.path = Some(path.clone()),
            version => out.version.clone_from(version),
        }
        let text = |literal: &Literal| match &literal.kind {
            LiteralKind::String(text) => Some(Name::new(text.as_str(), literal.span)),
            LiteralKind::Int(_)
            | LiteralKind::Float(_)
            | LiteralKind::Bool(_)
            | LiteralKind::Duration(_)
            | LiteralKind::Name(_) => None,
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
                ("components", _, Some(components)) => {
                    out.components = components.to_vec();
                    continue;
                }
                ("default_features", [value], _) if matches!(value.kind, LiteralKind::Bool(_)) => {
                    out.default_features = value.kind != LiteralKind::Bool(false);
                    continue;
                }
                ("default_features", ..) => "`true` or `false`",
                ("features", ..) => "names of features, such as `features \"derive\", \"rc\"`",
                ("components", ..) => "names of components, such as `components \"core\"`",
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
        if out.version.is_none() && out.path.is_none() && out.components.is_empty() {
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

    /// Where the options `InnerModelViewer` and `InnerModelSlots` are written. Of the others, only
    /// `dsr` has an effect, in some languages.
    fn options(
        &mut self,
        word: &Name,
        names: &[Name],
        shares_dsr: bool,
    ) -> (Option<Span>, Option<Span>) {
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
        let is_dsr = |name: &Name| shares_dsr && name.text.eq_ignore_ascii_case(world::DSR);
        let has_effect =
            |name: &Name| [viewer, scene_slots].contains(&Some(name.span)) || is_dsr(name);
        if !names.iter().all(has_effect) {
            let message = "`options` has no effect yet: it is only checked";
            let warning = Diagnostic::warning("not-generated-yet", word.span, message);
            self.found.push(warning);
        }
        (viewer, scene_slots)
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
