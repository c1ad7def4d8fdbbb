//! From a view to files.

use crate::files::{Files, GENERATED, Owner};
use crate::project::Project;
use crate::rust::{self, print::Printer};
use crate::{dependencies, markdown, parallel, view};
use rc_cdsl::model::Backend;
use rc_configuration::Parameters;
use rc_diagnostics::Diagnostics;
use rc_idsl::Library;
use std::path::Path;
use tera::Tera;

/// The templates of a folder: the name of each, and its text.
macro_rules! templates {
    ($folder:literal: $($name:literal = $file:literal,)*) => {
        &[$((
            $name,
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/templates/", $folder, "/", $file)),
        )),*]
    };
}

pub(crate) use templates;

/// A template that does not fit the view: a fault of this program, never of its input.
#[derive(Clone, Debug, thiserror::Error)]
#[error("rcgen's own templates failed, please report it: {0}")]
pub struct TemplateError(String);

impl TemplateError {
    pub(crate) fn new(message: String) -> Self {
        Self(message)
    }
}

impl From<tera::Error> for TemplateError {
    fn from(error: tera::Error) -> Self {
        let mut message = error.to_string();
        let mut source = std::error::Error::source(&error);
        while let Some(inner) = source {
            message = format!("{message}: {inner}");
            source = inner.source();
        }
        Self(message)
    }
}

/// Reads the templates of a language.
pub(crate) fn tera(templates: &[(&str, &str)]) -> Result<Tera, TemplateError> {
    let mut tera = Tera::default();
    tera.autoescape_on(Vec::<&str>::new());
    // Some are parts of others: no file's last line feed is one of its text.
    let templates = templates.iter();
    tera.add_raw_templates(templates.map(|(name, text)| (*name, text.trim_end())))?;
    Ok(tera)
}

/// One module of the crate `interfaces`.
#[derive(Clone, Debug)]
pub struct InterfaceModule {
    /// The name of the IDSL module.
    pub name: String,
    /// The name of the Rust module, which is the name of its file without the extension.
    pub stem: String,
    /// The text of this file. It depends on the IDSL modules that this one reaches by imports, and on nothing else.
    pub text: String,
}

/// The modules of the crate `interfaces` for a library. They may be written only if no diagnostic is an error.
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

/// All files of a component. `interfaces` is the path from its folder `generated` to the crate `interfaces`. The files may
/// be written only if no diagnostic is an error, neither here nor of [`interfaces`].
pub fn component(
    project: &Project,
    middleware: Backend,
    interfaces: &str,
) -> Result<(Files, Diagnostics), TemplateError> {
    let (view, mut found) = view::component::of(project, middleware);
    rust::component::check(&project.component, &mut found);
    if found.has_errors() {
        return Ok((Files::default(), found));
    }
    let mut files = Files::default();
    let component = rust::component::of(&view);
    let dependencies = project.component.dependencies.iter();
    let dependencies: Vec<String> = dependencies.map(dependencies::line).collect();
    Printer::new(&component)?.files(interfaces, &dependencies, &mut files)?;
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

/// The view of a component as JSON: what every language of templates can print.
pub fn view(
    project: &Project,
    middleware: Backend,
) -> Result<(String, Diagnostics), TemplateError> {
    let (view, found) = view::component::of(project, middleware);
    let json = serde_json::to_string_pretty(&view);
    let json = json.map_err(|error| TemplateError(error.to_string()))?;
    Ok((json + "\n", found))
}
