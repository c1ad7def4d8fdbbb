//! Handlers that a worker in Python lacks, and those that do not fit.

use super::checks;
use super::component::{self, Component, WORKER, WORKER_MODULE};
use super::component_interpreter::{self, InPath, Next};
use super::handlers::Handler;
use super::source::{self, Class, Code, Method};
use super::{names, reply_order};
use crate::project::Project;
use crate::{purpose, requirements, view};
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceMap, Span};
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

/// The missing handlers.
pub struct Missing {
    /// The file of the worker, and the last line of its class.
    path: PathBuf,
    line: usize,
    place: Span,
    handlers: Vec<(String, String)>,
    /// The functions of states that the worker may have and has not: documentation and name.
    hooks: Vec<(String, String)>,
    package: String,
    /// The manifest, and the requirements that it lacks.
    manifest: PathBuf,
    requirements: Vec<String>,
    total: usize,
}

/// Compares the functions that a component needs with those in `folder`/src. If a finding is an
/// error, there may be no answer.
///
/// # Errors
/// The system does not give a file.
pub fn of(
    project: &Project,
    folder: &Path,
    sources: &mut SourceMap,
) -> io::Result<(Option<Missing>, Diagnostics)> {
    let (view, mut found) = view::component::of(project, Middleware::DEFAULT);
    super::check(&project.component.library, &mut found);
    checks::check(&project.component, &mut found);
    if !folder.join("src").is_dir() {
        let message = format!("there is no {} yet", folder.join("src").display());
        let help = format!(
            "`rcgen {}` writes it, with all handlers",
            project.path.display()
        );
        let place = project.component.name.span;
        found.push(Diagnostic::error("no-worker", place, message).help(help));
    }
    if found.has_errors() {
        return Ok((None, found));
    }
    reply_order::check(project, &view, folder, &mut found)?;
    let missing = compare(project, folder, &view, true, sources, &mut found)?;
    let mut all = Diagnostics::new();
    for mut finding in found {
        // Missing functions can be printed nevertheless.
        if finding.code == "handler-signature" {
            finding.severity = Severity::Warning;
        }
        all.push(finding);
    }
    Ok((missing, all))
}

/// Faults of the worker of a component and of its interpreter, for `rcgen check`.
pub(crate) fn check(
    project: &Project,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<()> {
    let folder = project.code();
    let (view, more) = view::component::of(project, Middleware::DEFAULT);
    if more.has_errors() || !folder.join("src").is_dir() {
        return Ok(());
    }
    reply_order::check(project, &view, folder, found)?;
    let missing = compare(project, folder, &view, false, sources, found)?;
    found.extend(
        missing
            .map(|missing| missing.errors(project))
            .unwrap_or_default(),
    );
    if !found.iter().any(|finding| finding.code == "no-python") {
        let place = project.component.name.span;
        let fault =
            component_interpreter::check(project, place, Next::Starts, &mut InPath::default());
        found.extend(fault.map(|mut fault| {
            // The component may be for another machine.
            fault.severity = Severity::Warning;
            fault
        }));
    }
    Ok(())
}

fn compare(
    project: &Project,
    folder: &Path,
    view: &view::Component,
    needed: bool,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<Option<Missing>> {
    let component = &component::of(view);
    let machine = view.machine.as_ref();
    let place = project.component.name.span;
    let src = folder.join("src");
    let code = source::read(&src, place, needed, sources, found)?;
    let Some(code) = code.filter(|_| !found.iter().any(|d| d.code == "python-syntax")) else {
        return Ok(None);
    };
    hidden(&code, &crate::paths::normal(&src), sources, found);
    let line = code.line_of(WORKER);
    let Some(worker) = line.first() else {
        let file = src.join(format!("{WORKER_MODULE}.py"));
        let message = format!("{} has no class `{WORKER}`", file.display());
        let help = format!("write `class {WORKER}(Worker):`, with the handlers in it");
        found.push(Diagnostic::error("no-worker", place, message).help(help));
        return Ok(None);
    };
    let required = component.required();
    let names: Vec<&str> = required.iter().map(|h| h.name.as_str()).collect();
    // A base from elsewhere may have any function.
    let is_open = code.has_strangers(WORKER);
    let mut handlers = Vec::new();
    for handler in &required {
        let mut all = line.iter().flat_map(|class| class.methods());
        match all.find(|method| method.name == handler.name) {
            Some(method) => signature(handler, method, &code, component, sources, found),
            None if is_open || line.iter().any(|class| class.sets(&handler.name)) => {}
            None => handlers.push((handler.name.clone(), handler.signature.clone())),
        }
    }
    for hook in component.hooks() {
        let mut all = line.iter().flat_map(|class| class.methods());
        if let Some(method) = all.find(|method| method.name == hook.name) {
            signature(&hook, method, &code, component, sources, found);
        }
    }
    let there = |name: &str| {
        let mut all = line.iter().flat_map(|class| class.methods());
        all.any(|method| method.name == name) || line.iter().any(|class| class.sets(name))
    };
    let hooks = machine.map_or(Vec::new(), |machine| hooks(machine, &there));
    stale(component, &line, &names, &handlers, &code, sources, found);
    let (lacking, _) = requirements::compare(&project.component, folder);
    Ok(Some(Missing {
        path: code.path(worker).to_path_buf(),
        line: worker.end,
        place: code.place_of_class(worker, sources),
        handlers,
        hooks,
        package: component.package.clone(),
        manifest: folder.join("pyproject.toml"),
        requirements: lacking.into_iter().map(requirements::line).collect(),
        total: required.len(),
    }))
}

/// Warns of files in `src` that hide modules of Python from the worker and from its imports.
fn hidden(code: &Code, src: &Path, sources: &SourceMap, found: &mut Diagnostics) {
    for (path, source) in code.files() {
        let Ok(inside) = path.strip_prefix(src) else {
            continue;
        };
        // A module, or the file that makes a folder a package. Others are inside of packages.
        let name = match inside.parent() {
            Some(parent) if parent == Path::new("") => inside.file_stem(),
            Some(parent) if inside.ends_with("__init__.py") && parent.iter().count() == 1 => {
                parent.file_name()
            }
            _ => None,
        };
        let name = name.and_then(OsStr::to_str).unwrap_or_default();
        if !names::hides_module(name) {
            continue;
        }
        let message = format!("this hides the module `{name}` of Python, also from its library");
        let first = sources.text(source).lines().next().map_or(0, str::len);
        let place = Span::new(source, 0, first);
        let warning = Diagnostic::warning("hidden-module", place, message);
        found.push(warning.help(format!("give it another name, as `my_{name}`")));
    }
}

/// Reports a function that cannot take the arguments of its calls, or says that it takes others.
fn signature(
    needed: &Handler,
    there: &Method,
    code: &Code,
    component: &Component,
    sources: &SourceMap,
    found: &mut Diagnostics,
) {
    if there.decorated {
        return;
    }
    let count = needed.parameters.len() + 1;
    let least = there.parameters.len() - there.defaults.min(there.parameters.len());
    let too_many = there.parameters.len() < count && !there.more;
    let problem = if there.coroutine {
        Some("is a coroutine, which is never awaited".to_owned())
    } else if least > count || too_many || there.keywords > 0 {
        let names = there.parameters.iter().map(|(name, _)| name.as_str());
        let names = names.collect::<Vec<_>>().join(", ");
        Some(format!("takes other arguments: ({names})"))
    } else {
        let own = there.parameters.iter().skip(1).map(|(_, ty)| ty.as_deref());
        let own = own.chain([there.returns.as_deref()]);
        let types = needed.types.iter().zip(own);
        let mut differing = types.filter_map(|(needed, own)| {
            let own = own.filter(|own| !component.may_mean(needed, own))?;
            Some(format!("has the type `{own}` where `{needed}` is needed"))
        });
        differing.next()
    };
    let Some(problem) = problem else { return };
    let message = format!("`{}` {problem}", there.name);
    let signature = one_line(&needed.signature);
    let place = code.place(there, sources);
    let error = Diagnostic::error("handler-signature", place, message);
    found.push(error.help(format!("needed now: `{signature}`")));
}

/// The functions of states that the worker does not have: their documentation and their names.
fn hooks(machine: &view::Machine, there: &dyn Fn(&str) -> bool) -> Vec<(String, String)> {
    let all = machine.states.iter().flat_map(|state| {
        let suffix = crate::description::state_suffix(&state.name);
        purpose::of_state(state).map(|(kind, doc)| (doc, format!("{kind}_{suffix}")))
    });
    all.filter(|(_, name)| !there(name)).collect()
}

/// A signature without its line breaks.
fn one_line(signature: &str) -> String {
    let words: Vec<&str> = signature.lines().map(str::trim).collect();
    let line = words
        .join(" ")
        .replace("( ", "(")
        .replace(",)", ")")
        .replace(", )", ")");
    line.trim_end_matches(':').to_owned()
}

/// Notes functions that look like handlers of a slot, and are none, and unused ones that look like
/// others that a worker may have.
fn stale(
    component: &Component,
    line: &[&Class],
    known: &[&str],
    missing: &[(String, String)],
    code: &Code,
    sources: &SourceMap,
    found: &mut Diagnostics,
) {
    let hooks = component.hooks();
    let methods = || line.iter().flat_map(|class| class.methods());
    let lacks = |name: &str| methods().all(|method| method.name != name);
    let lacking: Vec<&str> = hooks
        .iter()
        .map(|hook| hook.name.as_str())
        .filter(|name| lacks(name))
        .collect();
    for method in methods() {
        let name = &method.name;
        let is_known =
            known.contains(&name.as_str()) || hooks.iter().any(|hook| hook.name == *name);
        let looks = component
            .handler_prefixes()
            .any(|prefix| name.starts_with(&prefix));
        let missing = missing.iter().map(|(name, _)| name.as_str());
        let near = rc_diagnostics::nearest(name, missing.chain(lacking.iter().copied()));
        let is_own = || near.is_none() || is_used(name, code, sources);
        if is_known || !looks && is_own() {
            continue;
        }
        let message =
            format!("`{name}` serves nothing: no slot, state or world has a function of this name");
        let help = near.map_or("remove it, or give it another name".to_owned(), |near| {
            format!("is it `{near}` now?")
        });
        let place = code.place(method, sources);
        found.push(Diagnostic::note("stale-handler", place, message).help(help));
    }
}

/// Whether code of the worker names an attribute so: `restart` is no misspelled `restore` where something calls it.
fn is_used(name: &str, code: &Code, sources: &SourceMap) -> bool {
    let attribute = format!(".{name}");
    code.files().any(|(_, source)| {
        let text = sources.text(source);
        let mut found = text.match_indices(&attribute);
        found.any(|(at, found)| {
            let rest = &text[at + found.len()..];
            !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_')
        })
    })
}

impl Missing {
    /// The number of functions that the component needs.
    pub fn total(&self) -> usize {
        self.total
    }

    /// The text to paste, below a comment with its place; empty if nothing is missing.
    pub fn text(&self) -> String {
        let mut text = String::new();
        if !self.handlers.is_empty() {
            let (path, line) = (self.path.display(), self.line);
            text += &format!("# {path}:{line}: at the end of the class `{WORKER}`\n");
            for (_, signature) in &self.handlers {
                text += &format!("\n    {signature}\n        raise NotImplementedError\n");
            }
        }
        if !self.requirements.is_empty() {
            text += &format!("# {}: into `dependencies`\n", self.manifest.display());
            for requirement in &self.requirements {
                text += &format!("    {requirement},\n");
            }
        }
        text
    }

    /// The functions of states that the worker may have, as comments with the imports that they
    /// need. Empty if there is no machine, or if the worker has all of them.
    pub fn hooks(&self) -> String {
        if self.hooks.is_empty() {
            return String::new();
        }
        let package = &self.package;
        let mut out = format!(
            "# Of the class `{WORKER}`, each as you need it:\n\
             # from {package}.context import Context\n\
             # from {package}.machine import Event, State\n"
        );
        for (doc, name) in &self.hooks {
            let signature = format!("def {name}(self, ctx: Context) -> None:");
            out += &format!("#\n# {signature}\n#     \"\"\"{doc}\"\"\"\n");
        }
        out
    }

    fn errors(&self, project: &Project) -> Diagnostics {
        let mut found = Diagnostics::new();
        if !self.handlers.is_empty() {
            let names = self.handlers.iter().map(|(name, _)| format!("`{name}`"));
            let names = names.collect::<Vec<_>>().join(", ");
            let message = format!("`{WORKER}` lacks {names}");
            let help = format!(
                "`rcgen stubs {}` prints what is missing",
                project.path.display()
            );
            found.push(Diagnostic::error("missing-handlers", self.place, message).help(help));
        }
        found
    }
}
