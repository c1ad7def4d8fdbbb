//! Handlers that a component's `src/` lacks, printed as in a new worker.
//!
//! This module only reads: rcgen writes the user's files once and never again. It does not see
//! implementations in functions or from macros.

mod fits;
mod source;

use crate::project::Project;
use crate::purpose::{Purpose, of_state};
use crate::rust::component::Component;
use crate::rust::machine::TRAIT;
use crate::rust::print::Printer;
use crate::rust::worker::{self, WORKER};
use crate::rust::worker_traits::WorkerTrait;
use crate::templates::TemplateError;
use crate::{dependencies, rust, view};
use fits::Types;
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use serde_json::{Value, json};
use source::{Block, Code, Method};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};

/// Why the handlers are unknown.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The system could not read the user's files.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A fault of this program.
    #[error(transparent)]
    Template(#[from] TemplateError),
}

/// The missing handlers.
pub struct Missing {
    view: view::Component,
    worker: String,
    pieces: Vec<Piece>,
    /// The `src/` of a component that is not a library yet.
    no_library: Option<PathBuf>,
    /// The functions of states that the worker may have and has not: documentation and signature.
    hooks: Vec<(String, String)>,
    /// The manifest, and the lines of dependencies that it lacks.
    manifest: PathBuf,
    dependencies: Vec<String>,
}

/// The text to paste at one place.
struct Piece {
    /// The file.
    path: PathBuf,
    /// The `impl` that it belongs into, else the code near the place of a new one.
    span: Span,
    /// The line of this `impl`; none if the whole `impl` is missing.
    line: Option<usize>,
    /// The index of the trait among those of the component.
    of: usize,
    /// The indices of its operations.
    operations: Vec<usize>,
    /// Names that it mentions and the file does not import.
    uses: Vec<String>,
}

/// Compares the handlers that a component needs with those in `folder`/src. If a finding is an
/// error, there is no answer.
pub fn of(
    project: &Project,
    folder: &Path,
    sources: &mut SourceMap,
) -> Result<(Option<Missing>, Diagnostics), Error> {
    // No handler depends on the middleware.
    let (view, mut found) = view::component::of(project, Middleware::DEFAULT);
    rust::context_names::check(&project.component, &mut found);
    rust::check(&project.component.library, &mut found);
    let src = folder.join("src");
    if !src.is_dir() {
        let message = format!("there is no {} yet", src.display());
        let help = format!(
            "`rcgen {}` writes it, with all handlers",
            project.path.display()
        );
        let span = project.component.name.span;
        found.push(Diagnostic::error("no-worker", span, message).help(help));
    }
    if found.has_errors() {
        return Ok((None, found));
    }
    let (lacking, _) = dependencies::compare(&project.component, folder);
    let component = rust::component::of(&view);
    let krate = format!("{}_generated", component.package);
    let code = source::read(&src, &krate, sources, &mut found)?;
    if found.has_errors() {
        return Ok((None, found));
    }
    let worker = worker(&code);
    let nowhere = (
        src.join("specific_worker.rs"),
        project.component.name.span,
        None,
    );
    let home = code
        .blocks
        .iter()
        .find(|b| b.name == "Worker" && b.worker == worker);
    let home = home.map_or(nowhere, |block| {
        let path = sources.path(block.span.source).to_path_buf();
        (path, block.span, Some(block.scope))
    });
    let mut pieces = Vec::new();
    let lets_values_serve = |of: &WorkerTrait| {
        let mut blocks = code.blocks.iter().filter(|b| b.worker == worker);
        blocks.any(|b| is_served_by(of, &b.name) && is_marked_for(b, of))
    };
    let implemented = component.implemented.iter().enumerate();
    for (index, of) in implemented.filter(|(_, of)| !lets_values_serve(of)) {
        let blocks: Vec<&Block> = blocks(&code, &worker, of).collect();
        let there = |method: &str| {
            let mut methods = blocks.iter().flat_map(|b| &b.methods);
            methods.any(|m| m.name == method)
        };
        let all = of.operations.iter().enumerate();
        let operations: Vec<usize> = all
            .filter(|(_, o)| !there(&o.method))
            .map(|(at, _)| at)
            .collect();
        let block = blocks.first();
        if operations.is_empty() && block.is_some() {
            continue;
        }
        let (path, span, scope) = match block {
            Some(block) => (
                sources.path(block.span.source).to_path_buf(),
                block.span,
                Some(block.scope),
            ),
            None => home.clone(),
        };
        let mut names: BTreeSet<&str> = BTreeSet::new();
        for operation in &operations {
            names.insert("Context");
            let mentioned = &of.operations[*operation].mentioned;
            names.extend(mentioned.iter().map(String::as_str));
        }
        if block.is_none() {
            names.insert(&of.name);
        }
        names.retain(|name| scope.is_none_or(|scope| !code.scopes[scope].has(name)));
        pieces.push(Piece {
            line: block.map(|b| sources.position(b.span.source, b.span.start).line),
            uses: names.into_iter().map(str::to_owned).collect(),
            path,
            span,
            of: index,
            operations,
        });
    }
    misfits(&component, &view, &code, &worker, &pieces, &mut found);
    let hooks = hooks(&view, &code, &worker);
    let missing = Missing {
        view,
        worker,
        pieces,
        hooks,
        no_library: Some(src).filter(|src| !src.join("lib.rs").exists()),
        manifest: folder.join("Cargo.toml"),
        dependencies: lacking.into_iter().map(dependencies::line).collect(),
    };
    Ok((Some(missing), found))
}

/// Missing parts of a worker, in any language.
pub struct Lacking {
    /// The text to paste; empty if nothing is missing.
    pub text: String,
    /// The functions that it may have and has not, as comments.
    pub hooks: String,
    /// The number of handlers that the component needs.
    pub total: usize,
}

/// Compares the worker in a folder with the description, which has no answer if a finding is an
/// error.
pub type Compare =
    fn(&Project, &Path, &mut SourceMap) -> Result<(Option<Lacking>, Diagnostics), Error>;

/// Finds the missing parts of a worker in Rust.
///
/// # Errors
/// As [`of`].
pub(crate) fn lacking(
    project: &Project,
    folder: &Path,
    sources: &mut SourceMap,
) -> Result<(Option<Lacking>, Diagnostics), Error> {
    let (missing, found) = of(project, folder, sources)?;
    let Some(missing) = missing else {
        return Ok((None, found));
    };
    let text = if missing.is_empty() {
        String::new()
    } else {
        missing.text()?
    };
    let lacking = Lacking {
        text,
        hooks: missing.hooks(),
        total: missing.total(),
    };
    Ok((Some(lacking), found))
}

/// The `impl`s and functions of a worker in Rust, each with the location of its name, in the order of
/// the text.
///
/// # Errors
/// The system does not give a file.
pub(crate) fn handlers(
    project: &Project,
    src: &Path,
    sources: &mut SourceMap,
) -> io::Result<Vec<(Purpose, Span)>> {
    let (view, _) = view::component::of(project, Middleware::DEFAULT);
    let component = rust::component::of(&view);
    let krate = format!("{}_generated", component.package);
    let code = source::read(src, &krate, sources, &mut Diagnostics::new())?;
    let worker = worker(&code);
    let mut pieces = Vec::new();
    for of in &component.implemented {
        let Some(slot) = of.slot.as_ref().map(|served| served.index) else {
            continue;
        };
        for block in blocks(&code, &worker, of).filter(|block| is_marked_for(block, of)) {
            pieces.push((Purpose::Slot(slot), block.span));
            for method in &block.methods {
                let mut operations = of.operations.iter();
                let at = operations.position(|one| one.method == method.name);
                let purpose = at.map(|at| Purpose::Operation(slot, at));
                pieces.extend(purpose.map(|purpose| (purpose, method.span)));
            }
        }
    }
    let states = view.machine.iter().flat_map(|machine| &machine.states);
    let hooks: BTreeMap<String, &str> = states
        .flat_map(|state| {
            let kinds = of_state(state).map(|(kind, _)| rust::state_names::hook(kind, &state.name));
            kinds.map(|hook| (hook, state.name.as_str()))
        })
        .collect();
    let machines = code.blocks.iter();
    let machines = machines.filter(|block| block.name == TRAIT && block.worker == worker);
    for method in machines.flat_map(|block| &block.methods) {
        let state = hooks.get(&method.name);
        pieces.extend(state.map(|state| (Purpose::State((*state).to_owned()), method.span)));
    }
    pieces.sort_by_key(|(_, span)| *span);
    Ok(pieces)
}

/// The name of the type that the component runs. Tests may have workers of their own.
fn worker(code: &Code) -> String {
    let mut workers = code.blocks.iter().filter(|b| b.name == "Worker");
    let usual = |b: &Block| b.worker == WORKER;
    match workers.next() {
        Some(first) if !usual(first) && !workers.any(usual) => first.worker.clone(),
        _ => WORKER.to_owned(),
    }
}

/// Whether an implementation of an interface is that of this slot: the second argument of the trait
/// is the marker that distinguishes the slot from an earlier one with its interface.
fn is_marked_for(block: &Block, of: &WorkerTrait) -> bool {
    let marker = of.slot.as_ref().map_or("", |served| &served.marker);
    match block.arguments.get(1) {
        None => marker.is_empty(),
        Some(argument) => argument.as_ref().is_none_or(|name| *name == marker),
    }
}

/// Whether a worker lets a value serve a slot by implementing the trait `name`.
fn is_served_by(of: &WorkerTrait, name: &str) -> bool {
    let mut served = of.slot.iter();
    served.any(|served| served.serving == name)
}

/// The blocks that implement a trait. There are two if a `cfg` chooses between them.
fn blocks<'a>(
    code: &'a Code,
    worker: &'a str,
    of: &'a WorkerTrait,
) -> impl Iterator<Item = &'a Block> {
    code.blocks
        .iter()
        .filter(move |b| b.name == of.name && b.worker == worker)
}

/// Reports handlers that no longer fit.
fn misfits(
    component: &Component,
    view: &view::Component,
    code: &Code,
    worker: &str,
    pieces: &[Piece],
    found: &mut Diagnostics,
) {
    let types = Types::of(view, code);
    let hooks = component.machine.iter().flat_map(|machine| &machine.states);
    let hooks: Vec<&str> = hooks
        .flat_map(|state| [&state.entry, &state.exit, &state.during])
        .map(String::as_str)
        .collect();
    for (index, of) in component.implemented.iter().enumerate() {
        let missing = pieces.iter().filter(|p| p.of == index);
        let missing: Vec<&str> = missing
            .flat_map(|p| &p.operations)
            .map(|o| of.operations[*o].method.as_str())
            .collect();
        for method in blocks(code, worker, of).flat_map(|b| &b.methods) {
            let mut all = of.operations.iter().chain(&of.optional);
            let operation = all.find(|o| o.method == method.name);
            if let Some(operation) = operation {
                signature(of, &operation.user_signature, method, &types, found);
                continue;
            }
            let of_states = of.name == TRAIT;
            if of_states && hooks.contains(&method.name.as_str()) {
                continue;
            }
            let message = format!(
                "`{}` does not declare `{}` any more: error E0407 of rustc",
                of.name, method.name
            );
            let hooks = hooks.iter().filter(|_| of_states);
            let optional = of.optional.iter().map(|o| o.method.as_str());
            let known = missing.iter().chain(hooks).copied().chain(optional);
            let near = rc_diagnostics::nearest(&method.name, known);
            let help = near.map_or("remove it".to_owned(), |near| {
                format!("remove it, or is it `{near}` now?")
            });
            found.push(Diagnostic::note("stale-handler", method.span, message).help(help));
        }
    }
    contexts(component, code, worker, found);
    for block in code.blocks.iter().filter(|b| b.generated) {
        let name = &block.name;
        let mut needed = component.implemented.iter();
        let is_needed = needed.any(|of| of.name == *name || is_served_by(of, name));
        if name != "Worker" && !is_needed {
            let message = format!("no slot `{name}` receives anything any more");
            found.push(
                Diagnostic::note("stale-handler", block.span, message)
                    .help("remove this `impl`, and the trait where it is imported"),
            );
        }
    }
}

/// Reports each `impl` that does not name the context of its worker.
fn contexts(component: &Component, code: &Code, worker: &str, found: &mut Diagnostics) {
    let slots = component.implemented.iter().filter(|of| of.slot.is_some());
    let slots = slots.map(|of| (of.name.as_str(), of.generics.as_str()));
    let all: Vec<(&str, &str)> = slots.chain([("Worker", "<Context>")]).collect();
    for block in &code.blocks {
        let needed = all.iter().find(|(name, _)| *name == block.name);
        let Some((name, generics)) = needed else {
            continue;
        };
        let is_ours = block.generated || block.worker == worker;
        if !is_ours || block.arguments.len() == generics.split(',').count() {
            continue;
        }
        let message = format!("`{name}` needs the types `{generics}`: error E0107 of rustc");
        let help = format!("write `impl {name}{generics} for {}`", block.worker);
        found.push(Diagnostic::warning("handler-context", block.span, message).help(help));
    }
}

fn signature(
    of: &WorkerTrait,
    needed: &str,
    method: &Method,
    types: &Types,
    found: &mut Diagnostics,
) {
    if types.fit(needed, &method.signature) {
        return;
    }
    let message = format!(
        "`{}` is declared by `{}` with another signature",
        method.name, of.name
    );
    found.push(
        Diagnostic::warning("handler-signature", method.span, message)
            .help(format!("needed now: `{needed}`")),
    );
}

/// The functions of states that the worker does not have: their documentation and their signatures.
fn hooks(view: &view::Component, code: &Code, worker: &str) -> Vec<(String, String)> {
    let blocks = code.blocks.iter();
    let blocks = blocks.filter(|b| b.name == TRAIT && b.worker == worker);
    let methods = blocks.flat_map(|b| &b.methods).map(|m| m.name.as_str());
    let there: BTreeSet<&str> = methods.collect();
    let states = view.machine.iter().flat_map(|machine| &machine.states);
    let all = states.flat_map(|state| {
        let hooks = of_state(state).into_iter();
        hooks.map(|(kind, doc)| (doc, rust::state_names::hook(kind, &state.name)))
    });
    all.filter(|(_, name)| !there.contains(name.as_str()))
        .map(|(doc, name)| {
            let signature =
                format!("fn {name}(&mut self, ctx: &mut Context) -> Result<(), WorkerError>");
            (doc, signature)
        })
        .collect()
}

/// Compares the types that the traits of the worker are given with those that they need.
pub fn old_contexts(project: &Project, sources: &mut SourceMap) -> Result<Diagnostics, Error> {
    let mut found = Diagnostics::new();
    let src = project.folder().join("src");
    if !src.is_dir() {
        return Ok(found);
    }
    let (view, _) = view::component::of(project, Middleware::DEFAULT);
    let component = rust::component::of(&view);
    let krate = format!("{}_generated", component.package);
    // `of`, and the compiler, report text that is not Rust.
    let code = source::read(&src, &krate, sources, &mut Diagnostics::new())?;
    contexts(&component, &code, &worker(&code), &mut found);
    Ok(found)
}

/// Warns of functions of the worker for states that are never active.
pub fn unreachable(project: &Project, sources: &mut SourceMap) -> Result<Diagnostics, Error> {
    let mut found = Diagnostics::new();
    let src = project.folder().join("src");
    let Some(machine) = project.state_machine.as_ref().filter(|_| src.is_dir()) else {
        return Ok(found);
    };
    if machine.unreachable().next().is_none() {
        return Ok(found);
    }
    let krate = format!(
        "{}_generated",
        rust::names::package(&project.component.name.text)
    );
    // `stubs`, and the compiler, report text that is not Rust.
    let code = source::read(&src, &krate, sources, &mut Diagnostics::new())?;
    for state in machine.unreachable() {
        let during = rust::state_names::hook("during", &state.name.text);
        let blocks = code.blocks.iter().filter(|block| block.name == TRAIT);
        for method in blocks
            .flat_map(|block| &block.methods)
            .filter(|m| m.name == during)
        {
            let name = &state.name.text;
            let message = format!("`{during}` never runs: no transition enters `{name}`");
            found.push(
                Diagnostic::warning("unreachable-during", method.span, message)
                    .label(state.name.span, "this state")
                    .help("add a transition to it, or remove the function"),
            );
        }
    }
    Ok(found)
}

impl Missing {
    /// The number of handlers that the component needs.
    pub fn total(&self) -> usize {
        let slots = self.view.slots.iter().filter(|s| s.receives);
        let interfaces = slots.filter_map(|slot| self.view.interface(slot));
        let handlers: usize = interfaces.map(|i| i.operations.len()).sum();
        let machine = self.view.machine.as_ref();
        handlers + machine.map_or(0, |machine| machine.guards.len() + machine.actions.len())
    }

    /// The number of handlers that are missing.
    pub fn count(&self) -> usize {
        // An `impl` without operations is missing as a whole.
        let pieces = self.pieces.iter();
        pieces.map(|piece| piece.operations.len().max(1)).sum()
    }

    /// Whether no handler is missing.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty() && self.no_library.is_none() && self.dependencies.is_empty()
    }

    /// The text to paste, each piece below a comment with its place.
    pub fn text(&self) -> Result<String, Error> {
        let component = rust::component::of(&self.view);
        let mut files: Vec<Value> = Vec::new();
        let mut paths: Vec<&Path> = self.pieces.iter().map(|p| p.path.as_path()).collect();
        paths.sort_unstable();
        paths.dedup();
        for path in paths {
            let pieces: Vec<&Piece> = self.pieces.iter().filter(|p| p.path == path).collect();
            let mut uses: Vec<String> = pieces.iter().flat_map(|p| p.uses.clone()).collect();
            uses.sort_by(|a, b| worker::order(a, b));
            uses.dedup();
            let use_line = if uses.is_empty() {
                String::new()
            } else {
                worker::imports(&format!("{}_generated", component.package), &uses)
            };
            let blocks = pieces.iter().filter_map(|piece| {
                let line = piece.line?;
                let of = &component.implemented[piece.of];
                let operations = piece.operations.iter().map(|at| &of.operations[*at]);
                let operations: Vec<_> = operations.collect();
                Some(json!({ "line": line, "trait": of, "operations": operations }))
            });
            let blocks: Vec<Value> = blocks.collect();
            let traits = pieces.iter().filter(|p| p.line.is_none());
            let traits = traits.map(|p| &component.implemented[p.of]);
            let traits: Vec<&WorkerTrait> = traits.collect();
            files.push(json!({
                "path": path.display().to_string(),
                "use_line": use_line,
                "blocks": blocks,
                "traits": traits,
            }));
        }
        let library = self.no_library.as_ref().map(|src| {
            let path = |file: &str| src.join(file).display().to_string();
            json!({ "lib": path("lib.rs"), "main": path("main.rs") })
        });
        let mut printer = Printer::new(&component)?;
        let manifest = (!self.dependencies.is_empty()).then(
            || json!({ "path": self.manifest.display().to_string(), "lines": self.dependencies }),
        );
        let (library, manifest) = (library.as_ref(), manifest.as_ref());
        Ok(printer.stubs(&files, library, manifest, &self.worker)?)
    }

    /// The functions of states that the worker may have, as comments with the imports that they
    /// need. Empty if there is no machine, or if the worker has all of them.
    pub fn hooks(&self) -> String {
        if self.hooks.is_empty() {
            return String::new();
        }
        let package = rust::names::package(&self.view.name);
        let mut out = format!(
            "// Of `impl {TRAIT} for {}`, each as you need it:\n\
             // use {package}_generated::machine::{{MachineEvent, MachineState}};\n\
             // use {package}_generated::{{Context, WorkerError}};\n",
            self.worker
        );
        for (doc, signature) in &self.hooks {
            out.push_str(&format!("//\n// /// {doc}\n// {signature}\n"));
        }
        out
    }

    /// One note for each slot that lacks handlers.
    pub fn notes(&self, project: &Project) -> Diagnostics {
        let mut found = Diagnostics::new();
        let component = rust::component::of(&self.view);
        for piece in &self.pieces {
            let of = &component.implemented[piece.of];
            let methods = piece.operations.iter().map(|at| &of.operations[*at]);
            let methods: Vec<String> = methods.map(|o| format!("`{}`", o.method)).collect();
            let message = match piece.line {
                Some(_) => format!(
                    "`{}` lacks the handlers of `{}`: {}",
                    self.worker,
                    of.name,
                    methods.join(", ")
                ),
                None => format!("`{}` lacks `impl {}`", self.worker, of.name),
            };
            let help = format!("`rcgen stubs {}` prints them", project.path.display());
            found.push(Diagnostic::note("missing-handlers", piece.span, message).help(help));
        }
        found
    }
}
