//! Processes of several components: for each, a program that links the libraries of its components.
//!
//! `TARGET/rc/process/NETWORK-PROCESS` is a workspace as that of variants, for one process: the crate
//! of the program, variants of those components that the network runs over another middleware, and
//! the member that chooses features. Other components are used in their place.

use crate::error::{Error, cannot, refused};
use crate::variant::{self, Staged, Staging};
use crate::workspaces::Workspaces;
use cargo_metadata::Dependency;
use rc_codegen::files::{Files, GENERATED, Owner};
use rc_codegen::{Project, names};
use rc_ddsl::model::Instance;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;
use rc_vocabulary::{Middleware, Middlewares};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use toml_edit::{DocumentMut, InlineTable, Item, Table, value};

/// The type that a component's library exports.
const WORKER: &str = "SpecificWorker";

/// The components of a process, by their packages, each with the middleware of its variant.
pub(crate) type Members<'n> = BTreeMap<String, (&'n Project, Option<Middlewares>)>;

/// The program of a process: `process-NETWORK-PROCESS`, and `-MIDDLEWARE` if the command line sets
/// that of all components. No component and no variant has such a name.
pub(crate) fn program(network: &str, process: &str, middleware: Option<Middleware>) -> String {
    let mut program = format!("process-{network}-{}", process.replace('.', "-"));
    if let Some(middleware) = middleware {
        program += "-";
        program += middleware.word();
    }
    program
}

/// The user's crate of a component.
struct Package {
    folder: PathBuf,
    manifest: DocumentMut,
}

impl Package {
    /// `None` before the first generation.
    fn of(project: &Project) -> Result<Option<Self>, Error> {
        let folder = project.code();
        if !folder.join(project.manifest()).exists() {
            return Ok(None);
        }
        let action = || format!("open {}", folder.display());
        let folder = folder.canonicalize().map_err(cannot(action()))?;
        let manifest = variant::read(&folder.join("Cargo.toml"))?;
        Ok(Some(Self { folder, manifest }))
    }

    fn has_library(&self) -> bool {
        self.manifest.contains_key("lib") || self.folder.join("src/lib.rs").exists()
    }

    /// The name in a table of the manifest.
    fn text(&self, table: &str) -> Option<&str> {
        self.manifest.get(table)?.get("name")?.as_str()
    }

    /// The name of the package for cargo.
    fn name(&self) -> &str {
        self.text("package").unwrap_or_default()
    }

    /// The name of the library in code.
    fn library(&self) -> String {
        let name = self.text("lib").unwrap_or(self.name());
        name.replace('-', "_")
    }
}

/// Makes or renews the crate of the program `program`, in the workspace `root`, which is built into
/// `target` and whose members have these dependencies.
pub(crate) fn stage(
    root: &Path,
    target: &Path,
    program: &str,
    members: &Members<'_>,
    dependencies: &[Dependency],
) -> Result<Staged, Error> {
    let name = program.strip_prefix("process-").unwrap_or(program);
    let staging = Staging::begin(root, target.join("rc/process").join(name))?;
    let variants = members.iter().filter_map(|(package, (project, variant))| {
        variant.map(|middleware| (package.as_str(), *project, middleware))
    });
    let variants: Vec<_> = variants.collect();
    staging.variants(&variants)?;
    let mut all: Vec<String> = variants
        .iter()
        .map(|(package, ..)| (*package).to_owned())
        .collect();
    let mut linked = Table::new();
    let mut runtime = InlineTable::new();
    runtime.insert("workspace", true.into());
    linked.insert("rc-runtime", value(runtime));
    let mut types = String::new();
    for (package, (project, variant)) in members {
        let user = Package::of(project)?;
        let user = user.filter(Package::has_library).ok_or_else(|| {
            Error::Workspace(format!(
                "{package} has no library; {}",
                how_to_have_one(project)
            ))
        })?;
        let folder = match variant {
            None => user.folder.clone(),
            Some(_) => staging.folder().join(package),
        };
        let (library, generated) = (user.library(), format!("{package}_generated"));
        for (name, key, path) in [
            (user.name(), library.as_str(), folder.clone()),
            (&generated, &generated, folder.join(GENERATED)),
        ] {
            let mut dependency = InlineTable::new();
            if name != key {
                dependency.insert("package", name.into());
            }
            dependency.insert("path", path.to_string_lossy().as_ref().into());
            linked.insert(key, value(dependency));
        }
        types +=
            &format!("    ComponentType::new::<{library}::{WORKER}, {generated}::Context>(),\n");
    }
    let package = [("name", program), ("version", "0.0.0"), ("edition", "2024")];
    let mut manifest = DocumentMut::new();
    manifest["package"] = Item::Table(Table::from_iter(package));
    manifest["package"]["publish"] = value(false);
    manifest["dependencies"] = Item::Table(linked);
    let mut files = Files::default();
    let path = Path::new(program);
    files.add(
        path.join("Cargo.toml"),
        Owner::Generic,
        manifest.to_string(),
    );
    files.add(
        path.join("src/main.rs"),
        Owner::Generic,
        format!(
            "//! Written by rcdeploy: runs components on threads of one process.\n\n\
             use rc_runtime::ComponentType;\n\n\
             static COMPONENTS: &[ComponentType] = &[\n{types}];\n\n\
             fn main() -> std::process::ExitCode {{\n    rc_runtime::run_components(COMPONENTS)\n}}\n"
        ),
    );
    all.push(program.to_owned());
    staging.finish(files, all, dependencies)
}

fn how_to_have_one(project: &Project) -> String {
    let package = names::package(&project.component.name.text);
    format!(
        "move its worker into src/lib.rs, `mod specific_worker; pub use specific_worker::{WORKER};`, and let src/main.rs \
         call `{package}_generated::run::<{package}::{WORKER}>()`"
    )
}

/// A component of a process, for the checks.
pub(crate) struct Member<'n> {
    pub(crate) instance: &'n Instance,
    pub(crate) process: &'n Name,
    pub(crate) project: &'n Project,
    pub(crate) needed: Middlewares,
    pub(crate) variant: Option<Middlewares>,
}

/// Checks that the components of a process can be linked into one program.
pub(crate) fn check(members: &[Member<'_>], found: &mut Diagnostics) {
    check_libraries(members, found);
    check_workspace(members, found);
    check_middlewares(members, found);
}

fn check_libraries(members: &[Member<'_>], found: &mut Diagnostics) {
    for member in members {
        // An unreadable manifest is reported where it is needed, and so is a component without
        // code.
        if let Ok(Some(package)) = Package::of(member.project)
            && !package.has_library()
        {
            let (name, process) = (&member.instance.path, &member.process.text);
            let message = format!(
                "`{name}` cannot be a thread of the process `{process}`: its crate has no library"
            );
            let error = Diagnostic::error("process-without-library", member.process.span, message);
            found.push(error.help(how_to_have_one(member.project)));
        }
    }
}

fn check_workspace(members: &[Member<'_>], found: &mut Diagnostics) {
    let root = |member: &Member<'_>| Workspaces::root(member.project.code()).ok().flatten();
    let Some((first, of_first)) = members.first().and_then(|one| Some((one, root(one)?))) else {
        return;
    };
    for member in &members[1..] {
        let Some(other) = root(member).filter(|root| *root != of_first) else {
            continue;
        };
        let message = format!(
            "the components of the process `{}` are of two cargo workspaces: `{}` of {}, `{}` of {}",
            member.process.text,
            first.instance.path,
            of_first.display(),
            member.instance.path,
            other.display()
        );
        let error = Diagnostic::error("process-workspaces", member.process.span, message);
        found.push(
            error
                .label(first.process.span, "the first one")
                .help("let one of them have a process of its own, or move its folder into the workspace of the others"),
        );
    }
}

fn check_middlewares(members: &[Member<'_>], found: &mut Diagnostics) {
    for (at, member) in members.iter().enumerate() {
        let mut before = members[..at].iter();
        let other = before
            .find(|one| one.project.path == member.project.path && one.variant != member.variant);
        let Some(other) = other else { continue };
        let message = format!(
            "the process `{}` has the component `{}` for two middlewares: {} for `{}`, {} for `{}`",
            member.process.text,
            member.project.component.name.text,
            other.needed,
            other.instance.path,
            member.needed,
            member.instance.path
        );
        let error = Diagnostic::error("process-middlewares", member.process.span, message);
        found.push(
            error
                .label(other.process.span, "also in this process")
                .help("let one of them have a process of its own, or give both one `middleware`"),
        );
    }
}

/// The workspace that the components of a process belong to.
pub(crate) fn root(members: &Members<'_>) -> Result<PathBuf, Error> {
    let mut roots = members.values().map(|(project, _)| {
        let root = Workspaces::root(project.code()).map_err(refused("prepare the build"))?;
        root.ok_or_else(|| {
            let path = project.path.display();
            Error::Workspace(format!("{path} is in no cargo workspace"))
        })
    });
    let first = roots.next().unwrap_or_else(|| {
        let error = io::Error::from(io::ErrorKind::NotFound);
        Err(error).map_err(cannot("find the components of a process"))
    })?;
    for other in roots {
        if other? != first {
            let message = "components of one process are of two cargo workspaces";
            return Err(Error::Workspace(message.to_owned()));
        }
    }
    Ok(first)
}

#[cfg(test)]
mod tests;
