//! Every decision of a generation: names, types, lines, which file holds what. Templates print this.

mod checks;
mod exports;
mod in_place;
mod interfaces;
mod operation_names;
mod page;
mod parameters;
mod slots;
mod types;

use crate::dependencies;
use crate::layout;
use crate::names;
use crate::note::Note;
use crate::project::Project;
use crate::ros;
use rc_cdsl::model::{Backend, Role};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::Library;
use rc_idsl::model::{InterfaceId, ModuleId, Operation};
use serde::Serialize;

pub(crate) use checks::range_text;
pub use interfaces::Interface;
pub use page::Page;
pub use parameters::Parameters;
pub use slots::Slot;
pub use types::Module;

/// A component as its templates see it.
#[derive(Debug, Serialize)]
pub struct View {
    /// The name after `Component`.
    pub name: String,
    /// The name of the `.cdsl` file.
    pub file: String,
    /// The package of the user's crate.
    pub package: String,
    /// Documentation of the component, as `//!` lines.
    pub doc: Vec<String>,
    /// Sixteen hexadecimal digits.
    pub hash: String,
    /// The middleware of all slots that do not choose one.
    pub middleware: String,
    /// Every middleware that is used: its word and its crate.
    pub backends: Vec<BackendCrate>,
    /// The constant with their functions.
    pub connects: String,
    /// The array of the constants of the slots.
    pub slot_constants: String,
    /// The content of the byte string of the note.
    pub note: String,
    /// The default period, as the arguments of `Duration::new`.
    pub period: (u64, u32),
    /// The modules of types.
    pub modules: Vec<Module>,
    /// The interfaces that slots use.
    pub interfaces: Vec<Interface>,
    /// The slots.
    pub slots: Vec<Slot>,
    /// The slots with a trait of their own: implemented and subscribed ones, by name.
    pub traits: Vec<String>,
    /// The parameters.
    pub parameters: Option<Parameters>,
    /// The page about the parameters.
    pub page: Option<Page>,
    /// The JSON Schema of a configuration.
    pub schema: String,
    /// Crates of the user's code.
    pub dependencies: Vec<Dependency>,
    /// What `lib.rs` exports, in rustfmt's order.
    pub reexports: Vec<String>,
    /// Whether a name is exported more than once.
    pub repeats: bool,
    /// What the user's worker file begins with.
    pub imports: Vec<String>,
    /// The type that implements the handlers.
    pub worker: &'static str,
}

/// A middleware that a component uses.
#[derive(Debug, Serialize)]
pub struct BackendCrate {
    /// The word of command lines.
    pub word: String,
    /// Its package.
    pub package: String,
    /// Its crate.
    pub module: String,
}

/// A crate of the CDSL's `dependencies`.
#[derive(Debug, Serialize)]
pub struct Dependency {
    /// Its package.
    pub package: String,
    /// Its name in code.
    pub module: String,
    /// What stands after its name in the manifest.
    pub requirement: String,
}

/// The backends that components are generated for.
pub const BACKENDS: [Backend; 4] = [
    Backend::Iceoryx2,
    Backend::Dds,
    Backend::Ros2,
    Backend::Local,
];

/// What a new component's worker is called.
pub const WORKER: &str = "SpecificWorker";

/// The view of a project that has no errors, for a middleware.
pub fn of(project: &Project, middleware: Backend) -> (View, Diagnostics) {
    let mut found = Diagnostics::new();
    let component = &project.component;
    check_language(project, &mut found);
    let backends = backends(project, middleware, &mut found);
    let note = Note {
        component: component.name.text.clone(),
        model: format!("{:016x}", project.hash),
        middleware: middleware.word().to_owned(),
    };
    let exports = exports::Exports::of(component);
    let slots = slots::of(component, middleware, &exports, &mut found);
    let mut traits: Vec<String> = slots
        .iter()
        .filter(|s| s.receives)
        .map(|s| s.type_name.clone())
        .collect();
    traits.sort_by(|a, b| layout::order(a, b));
    let parameters = project.parameters.as_ref().map(parameters::of);
    let view = View {
        name: component.name.text.clone(),
        file: project
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        package: names::package(&component.name.text),
        doc: component.doc.clone(),
        hash: note.model.clone(),
        middleware: note.middleware.clone(),
        connects: layout::constant(
            "pub(crate) const BACKENDS: &[(&str, Connect)]",
            &backends
                .iter()
                .map(|b| format!("(\"{}\", {}::connect)", b.word, b.module))
                .collect::<Vec<_>>(),
        ),
        slot_constants: layout::array_in(
            4,
            &slots.iter().map(|s| s.constant.clone()).collect::<Vec<_>>(),
        ),
        backends,
        note: note.to_byte_string(),
        period: (component.period.as_secs(), component.period.subsec_nanos()),
        modules: types::of(component, &mut found),
        interfaces: interfaces::of(component, &mut found),
        imports: user_imports(&slots, &traits),
        worker: WORKER,
        reexports: reexports(component, &traits),
        repeats: exports.repeats(),
        slots,
        traits,
        page: project.parameters.as_ref().map(page::of),
        schema: schema(project),
        parameters,
        dependencies: component
            .dependencies
            .iter()
            .map(|(package, version)| Dependency {
                package: package.text.clone(),
                module: package.text.replace('-', "_"),
                requirement: dependencies::value(&version.text),
            })
            .collect(),
    };
    (view, found)
}

fn reexports(component: &rc_cdsl::Component, traits: &[String]) -> Vec<String> {
    let mut paths: Vec<String> = [
        "adapter::{Worker, embed, run}",
        "context::Context",
        "rc_runtime::middleware::{CallError, InPlace, SendError}",
        "rc_runtime::tracing",
        "rc_runtime::{Embedded, ParamChange, State, WorkerError}",
    ]
    .map(str::to_owned)
    .to_vec();
    let modules = &component.library.modules;
    let globs = [
        ("interfaces::*", !component.slots.is_empty()),
        ("parameters::Params", component.parameters.is_some()),
        (
            "types::*",
            modules
                .iter()
                .any(|m| !m.types.is_empty() || !m.consts.is_empty()),
        ),
    ];
    let globs = globs.iter().filter(|(_, there)| *there);
    paths.extend(globs.map(|(path, _)| (*path).to_owned()));
    let dependencies = component.dependencies.iter();
    let dependencies = dependencies.map(|(package, _)| package.text.replace('-', "_"));
    let dependencies: Vec<String> = dependencies.collect();
    // The user's choice of a version comes first.
    paths.retain(|path| {
        !dependencies
            .iter()
            .any(|d| path.ends_with(&format!("::{d}")))
    });
    paths.extend(dependencies);
    paths.extend(traits.iter().map(|name| format!("slots::{name}")));
    paths.sort_by(|a, b| layout::order(a, b));
    paths
}

fn schema(project: &Project) -> String {
    let component = &project.component;
    let library = &component.library;
    let slots = component.slots.iter().map(|slot| {
        let interface = library.interface(slot.interface);
        let module = &library.module(interface.module).name.text;
        let word = slot.role.word();
        let what = format!("{word} `{module}::{}`", interface.name.text);
        rc_configuration::Slot {
            name: &slot.name,
            what,
        }
    });
    rc_configuration::schema(
        &component.name.text,
        component.period,
        &slots.collect::<Vec<_>>(),
        project.parameters.as_ref(),
    )
}

fn check_language(project: &Project, found: &mut Diagnostics) {
    let language = &project.component.language;
    if language.text != "rust" {
        let message = format!("there are no templates for `{}` yet", language.text);
        let help = "generate Rust with `--language rust`; the file stays as it is";
        found.push(Diagnostic::error("no-templates", language.span, message).help(help));
    }
}

fn backends(project: &Project, middleware: Backend, found: &mut Diagnostics) -> Vec<BackendCrate> {
    let mut used = vec![middleware];
    let component = &project.component;
    for slot in &component.slots {
        let backend = slot.backend.unwrap_or(middleware);
        if !used.contains(&backend) {
            used.push(backend);
        }
    }
    // Of slots that say so themselves it is known since the component was read.
    if middleware == Backend::Ros2 {
        found.extend(ros::refused(&component.library));
    }
    used.iter()
        .map(|backend| BackendCrate {
            word: backend.word().to_owned(),
            package: format!("rc-{}", backend.word()),
            module: format!("rc_{}", backend.word()),
        })
        .collect()
}

/// What `specific_worker.rs` imports from the generated crate. Types come with it by name, so only the
/// traits and the types that its handlers mention are listed.
fn user_imports(slots: &[Slot], traits: &[String]) -> Vec<String> {
    let mut names: Vec<String> = vec![
        "Context".to_owned(),
        "Worker".to_owned(),
        "WorkerError".to_owned(),
    ];
    names.extend(traits.iter().cloned());
    names.extend(
        slots
            .iter()
            .filter(|s| s.receives)
            .flat_map(|s| &s.operations)
            .flat_map(|o| o.mentioned.clone()),
    );
    names.sort_by(|a, b| layout::order(a, b));
    names.dedup();
    names
}

/// Two names of the description that become one name of Rust.
fn collisions<'a>(
    names: impl Iterator<Item = (&'a rc_syntax::Name, String)>,
    what: &str,
    found: &mut Diagnostics,
) {
    let mut seen: Vec<(&rc_syntax::Name, String)> = Vec::new();
    for (name, rust) in names {
        if let Some((first, _)) = seen.iter().find(|(_, other)| *other == rust) {
            let message = format!(
                "{what} `{}` and `{}` are both `{rust}` in Rust",
                first.text, name.text
            );
            found.push(
                Diagnostic::error("name-collision", name.span, message)
                    .label(first.span, "the other one"),
            );
        }
        seen.push((name, rust));
    }
}

/// The file and module of an interface's code.
fn interface_module(library: &Library, id: InterfaceId) -> String {
    let interface = library.interface(id);
    let own = names::module(&interface.name.text);
    let same = library
        .interfaces
        .iter()
        .filter(|i| names::module(&i.name.text) == own)
        .count();
    if same > 1 {
        let module = &library.module(interface.module).name.text;
        format!("{}_{own}", names::snake(module))
    } else {
        own
    }
}

/// The file and module of a module's types.
fn type_module(library: &Library, id: ModuleId) -> String {
    let own = names::module(&library.module(id).name.text);
    // `module Laser { interface Laser { … }; };`: code that uses both has to tell them apart.
    let mut interfaces = library.interfaces.iter();
    if interfaces.any(|i| names::module(&i.name.text) == own) {
        own + "_types"
    } else {
        own
    }
}

/// The hash of a name in the envelope of calls: the first four bytes of its MD5 sum, little endian
/// (OMG DDS-RPC 1.0, 7.5.1.1.3).
pub(crate) fn rpc_hash(name: &str) -> i32 {
    use md5::{Digest, Md5};
    let digest = Md5::digest(name.as_bytes());
    let mut bytes = [0; 4];
    bytes.copy_from_slice(&digest[..4]);
    i32::from_le_bytes(bytes)
}

/// Whether an operation answers where its interface is used as `role`.
fn two_way(role: Role, operation: &Operation) -> bool {
    !role.is_topic() && operation.call_pattern() == rc_idsl::model::Pattern::Query
}

fn doc(lines: &[String], unit: Option<&String>, range: Option<&String>) -> Vec<String> {
    let mut lines = lines.to_vec();
    let facts: Vec<String> = unit
        .map(|u| format!("Unit: {u}."))
        .into_iter()
        .chain(range.map(|r| format!("Range: {r}.")))
        .collect();
    if !facts.is_empty() {
        if !lines.is_empty() {
            lines.push(String::new());
        }
        lines.push(facts.join(" "));
    }
    layout::doc(&lines)
}
