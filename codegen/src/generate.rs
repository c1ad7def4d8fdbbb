//! From a view to files.

use crate::files::{Files, GENERATED, Owner};
use crate::project::Project;
use crate::rust;
use crate::templates::TemplateError;
use crate::{generator, markdown, parallel, view};
use rc_cdsl::model::Middleware;
use rc_configuration::Parameters;
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_idsl::Library;
use rc_vocabulary::{Language, Middlewares};
use std::io;
use std::path::Path;

/// One module of the crate `interfaces`.
#[derive(Clone, Debug)]
pub struct InterfaceModule {
    /// The name of the IDSL module.
    pub name: String,
    /// The name of the Rust module, which is the name of its file without the extension.
    pub stem: String,
    /// The text of this file. It depends on the IDSL modules that this one reaches by imports, and
    /// on nothing else.
    pub text: String,
}

/// The modules of the crate `interfaces` for a library. They may be written only if no diagnostic
/// is an error.
pub fn interfaces(library: &Library) -> Result<(Vec<InterfaceModule>, Diagnostics), TemplateError> {
    let mut found = Diagnostics::new();
    rust::check(library, &mut found);
    if found.has_errors() {
        return Ok((Vec::new(), found));
    }
    let modules = parallel::map(&mut view::library::of(library), |module| {
        let module = rust::library::module(module);
        Ok(InterfaceModule {
            name: module.name.to_owned(),
            text: rust::print::module(&module)?,
            stem: module.stem,
        })
    });
    let modules: Result<_, TemplateError> = modules.into_iter().collect();
    Ok((modules?, found))
}

/// The `src/lib.rs` of the crate `interfaces`, from the stems of its modules.
pub fn interfaces_root(stems: &[&str]) -> Result<String, TemplateError> {
    let mut stems = stems.to_vec();
    stems.sort_unstable();
    rust::print::root(&stems)
}

/// Checks what a component has in its language: names and features, and its worker against the
/// description.
///
/// # Errors
/// The system does not give a file of the worker.
pub fn check_worker(
    project: &Project,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<()> {
    // `generate` reports another language.
    let generator = generator::of(project.language().unwrap_or(Language::Rust));
    (generator.names)(&project.component, found);
    (generator.worker)(project, sources, found)
}

/// All files of a component. `interfaces` is the path from its folder `generated` to the crate
/// `interfaces`. The files may be written only if no diagnostic is an error, neither here nor of
/// [`interfaces`].
pub fn component(
    project: &Project,
    middleware: impl Into<Middlewares>,
    interfaces: &str,
) -> Result<(Files, Diagnostics), TemplateError> {
    add_component(project, middleware, interfaces, Files::default())
}

/// As [`component`], with `files` that know which files of the user stay.
pub(crate) fn add_component(
    project: &Project,
    middleware: impl Into<Middlewares>,
    interfaces: &str,
    mut files: Files,
) -> Result<(Files, Diagnostics), TemplateError> {
    let (view, mut found) = view::component::of(project, middleware);
    // For another language, the view has an error.
    let Some(generator) = project.language().map(generator::of) else {
        return Ok((Files::default(), found));
    };
    (generator.names)(&project.component, &mut found);
    if found.has_errors() {
        return Ok((Files::default(), found));
    }
    (generator.print)(&view, &project.component, interfaces, &mut files)?;
    let schema = Path::new(GENERATED).join("config.schema.json");
    files.add(schema, Owner::Generic, view.schema.clone());
    let configuration = rc_configuration::template(
        &project.component.name.text,
        project.component.period,
        project.parameters.as_ref(),
    );
    files.add("etc/config.toml", Owner::Specific, configuration);
    if project
        .parameters
        .as_ref()
        .is_some_and(Parameters::has_secrets)
    {
        files.hide("etc/config.toml");
    }
    for (name, text) in markdown::pages(&view)? {
        files.add(Path::new(GENERATED).join(name), Owner::Generic, text);
    }
    Ok((files, found))
}

/// The data sheet of a component in Markdown: all that its descriptions say, for people.
pub fn datasheet(
    project: &Project,
    middleware: Middleware,
) -> Result<(String, Diagnostics), TemplateError> {
    let (view, found) = view::component::of(project, middleware);
    let sheet = markdown::datasheet(&view, &project.component.language.text)?;
    Ok((sheet, found))
}

/// The view of a component as JSON: what every language of templates can print.
pub fn view(
    project: &Project,
    middleware: Middleware,
) -> Result<(String, Diagnostics), TemplateError> {
    let (view, found) = view::component::of(project, middleware);
    let json = serde_json::to_string_pretty(&view);
    let json = json.map_err(|error| TemplateError::new(error.to_string()))?;
    Ok((json + "\n", found))
}
