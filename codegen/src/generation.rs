//! One generation: components of one workspace, and the crate of interfaces that they share,
//! written together or not at all.

use crate::dependencies;
use crate::files::{self, Files, Step};
use crate::generate;
use crate::generator;
use crate::interface_crate::{Definitions, Error, InterfaceCrate};
use crate::load::FileLoader;
use crate::parallel;
use crate::project::Project;
use crate::rust::print::{self, FIRST_TEST};
use rc_cdsl::model::Middleware;
use rc_diagnostics::{Diagnostics, Severity, SourceMap};
use rc_syntax::Loader;
use std::io;
use std::path::{Path, PathBuf};

/// The files of a component, and what it takes from the crate of interfaces.
pub struct Component {
    /// The folder that it is generated into.
    pub folder: PathBuf,
    /// Whether it has a `src/lib.rs`, or gets one.
    pub is_library: bool,
    is_built_by_cargo: bool,
    files: Files,
    definitions: Definitions,
}

const LIBRARY: &str = "src/lib.rs";

/// Whether a component has a `src/main.rs` only. This file declares its modules; `rcgen stubs`
/// prints how they become a library.
fn lacks_library(folder: &Path) -> bool {
    folder.join("src/main.rs").exists() && !folder.join(LIBRARY).exists()
}

impl Component {
    /// Prints a project that has no errors. None if one of the findings is an error.
    pub fn of(
        project: &Project,
        folder: PathBuf,
        middleware: Middleware,
        interfaces: &InterfaceCrate,
    ) -> Result<(Option<Self>, Diagnostics), Error> {
        if !project.is_built_by_cargo() {
            return Self::alone(project, folder, middleware);
        }
        let dependency = interfaces.dependency(&folder)?;
        // Laying out code takes most of the time of a generation.
        let (printed, defined) = parallel::both(
            || generate::add_component(project, middleware, &dependency, Files::of(&folder)),
            || Definitions::of(&project.component.library, &project.origins),
        );
        let (mut files, mut found) = printed?;
        let is_library = !lacks_library(&folder);
        if !is_library {
            files.remove(Path::new(LIBRARY));
        }
        // A component with a worker has tests, or needs none.
        if folder.join("src").exists() {
            files.remove(Path::new(FIRST_TEST));
        }
        let (definitions, more) = defined?;
        found.extend(more);
        found.extend(dependencies::compare(&project.component, &folder).1);
        let component = Self {
            folder,
            is_built_by_cargo: true,
            is_library,
            files,
            definitions,
        };
        Ok((Some(component).filter(|_| !found.has_errors()), found))
    }

    /// Generates a component that has its types in a package of its own.
    fn alone(
        project: &Project,
        folder: PathBuf,
        middleware: Middleware,
    ) -> Result<(Option<Self>, Diagnostics), Error> {
        let (mut files, mut found) =
            generate::add_component(project, middleware, "", Files::of(&folder))?;
        if let Some(generator) = project.language().map(generator::of) {
            if folder.join("src").exists() {
                files.remove(Path::new(generator.first_test));
            }
            (generator.compare)(project, middleware, &folder, &mut found)?;
        }
        let component = Self {
            folder,
            is_built_by_cargo: false,
            is_library: true,
            files,
            definitions: Definitions::default(),
        };
        Ok((Some(component).filter(|_| !found.has_errors()), found))
    }
}

/// Reads what every generation needs, in the time in which descriptions are read.
pub fn prepare() {
    // The first user waits for it, so nothing else waits for the thread.
    drop(std::thread::spawn(print::prepare));
}

/// Files with their folder, and the component that they are.
pub struct Part {
    /// The folder.
    pub folder: PathBuf,
    /// The files, relative to the folder.
    pub files: Files,
    /// An index of the components; none for the shared part.
    pub component: Option<usize>,
}

/// The files of components of one workspace, and of the crate that they share with `own`, the
/// definitions in its folder. Other modules of the crate stay unless `exact`. None if a module has
/// two definitions.
///
/// Hold [`InterfaceCrate::lock`] from before this until the files are written.
pub fn parts(
    interfaces: &InterfaceCrate,
    components: &[Component],
    own: Vec<Definitions>,
    exact: bool,
    sources: &mut SourceMap,
    loader: &dyn Loader,
    found: &mut Diagnostics,
) -> Result<Option<Vec<Part>>, Error> {
    let of_components = components
        .iter()
        .map(|component| component.definitions.clone());
    let definitions = interfaces.definitions(own.into_iter().chain(of_components).collect());
    let mut parts = Vec::new();
    // Components with types of their own need no crate.
    if components.is_empty() || components.iter().any(|c| c.is_built_by_cargo) {
        let Some(shared) = interfaces.files(definitions, exact, sources, loader, found)? else {
            return Ok(None);
        };
        parts.push(Part {
            folder: interfaces.folder().to_path_buf(),
            files: shared,
            component: None,
        });
    }
    let no_packages = components.iter().filter(|c| !c.is_built_by_cargo);
    let no_packages: Vec<&Path> = no_packages.map(|c| c.folder.as_path()).collect();
    parts.extend(interfaces.manifest(&no_packages)?.map(|files| Part {
        folder: interfaces.root().to_path_buf(),
        files,
        component: None,
    }));
    parts.extend(components.iter().enumerate().map(|(at, component)| Part {
        folder: component.folder.clone(),
        files: component.files.clone(),
        component: Some(at),
    }));
    Ok(Some(parts))
}

/// Steps of writing, in the order of `parts`.
pub fn plan(parts: &[Part]) -> io::Result<Vec<Vec<Step>>> {
    parts
        .iter()
        .map(|part| part.files.plan(&part.folder))
        .collect()
}

/// Writes all parts or nothing.
pub fn write(parts: &[Part]) -> io::Result<Vec<Vec<Step>>> {
    let folders = parts
        .iter()
        .map(|part| (part.folder.as_path(), &part.files));
    files::write(&folders.collect::<Vec<_>>())
}

/// Adds what components use to the crate of interfaces, where something is missing, as generating
/// them would.
///
/// # Errors
/// A library has errors, or a module has another definition in the workspace: rcgen reports where.
pub fn add_interfaces(interfaces: &InterfaceCrate, projects: &[&Project]) -> Result<(), Error> {
    let mut all = Vec::new();
    let mut found = Diagnostics::new();
    for project in projects {
        let (definitions, more) = Definitions::of(&project.component.library, &project.origins)?;
        all.push(definitions);
        found.extend(more);
    }
    let _lock = interfaces.lock()?;
    let definitions = interfaces.definitions(all);
    let files = interfaces.files(
        definitions,
        false,
        &mut SourceMap::new(),
        &FileLoader::new(&[]),
        &mut found,
    )?;
    if let Some(error) = found.iter().find(|d| d.severity == Severity::Error) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, error.message.clone()).into());
    }
    let mut folders = vec![];
    let manifest = interfaces.manifest(&[])?;
    folders.extend(files.as_ref().map(|files| (interfaces.folder(), files)));
    folders.extend(manifest.as_ref().map(|files| (interfaces.root(), files)));
    files::write(&folders)?;
    Ok(())
}

/// Generates one component into `folder`, with the interfaces that it uses. Nothing is written if
/// one of the findings is an error.
pub fn generate(
    project: &Project,
    folder: PathBuf,
    middleware: Middleware,
    sources: &mut SourceMap,
) -> Result<Diagnostics, Error> {
    let interfaces = InterfaceCrate::of(&folder)?;
    let (component, mut found) = Component::of(project, folder, middleware, &interfaces)?;
    if let Some(component) = component {
        let _lock = interfaces.lock()?;
        if let Some(parts) = parts(
            &interfaces,
            &[component],
            Vec::new(),
            interfaces.workspace().is_none(),
            sources,
            &FileLoader::new(&[]),
            &mut found,
        )? {
            write(&parts)?;
        }
    }
    Ok(found)
}
