//! The differences between the languages of workers.

use crate::files::Files;
use crate::project::Project;
use crate::purpose::Purpose;
use crate::rust::print::Printer;
use crate::stubs::{Compare, Lacking};
use crate::templates::TemplateError;
use crate::{cpp, dependencies, python, requirements, rust, stubs, view};
use rc_cdsl::Component;
use rc_diagnostics::{Diagnostics, SourceMap, Span};
use rc_vocabulary::{Language, Middleware};
use std::io;
use std::path::Path;

/// The functions of one language.
pub(crate) struct Generator {
    /// Checks the name of a new component. The error is the reason against it.
    pub(crate) name: fn(&str) -> Result<(), &'static str>,
    /// Checks the names of a component that is generated.
    pub(crate) names: fn(&Component, &mut Diagnostics),
    /// Prints a component. The text is the path from its folder `generated` to the crate of
    /// interfaces.
    pub(crate) print:
        fn(&view::Component, &Component, &str, &mut Files) -> Result<(), TemplateError>,
    /// The file of the first test of a component, which is not written once there is a worker.
    pub(crate) first_test: &'static str,
    /// Compares a component that is generated into a folder with the existing one.
    pub(crate) compare: fn(&Project, Middleware, &Path, &mut Diagnostics) -> io::Result<()>,
    /// Compares the worker that is there with the description.
    pub(crate) worker: fn(&Project, &mut SourceMap, &mut Diagnostics) -> io::Result<()>,
    /// How the writer of a worker learns which handlers it lacks.
    pub(crate) stubs: Compare,
    /// The pieces of the worker in a folder, each with the location of its name, in the order of the
    /// text.
    pub(crate) handlers: fn(&Project, &Path, &mut SourceMap) -> io::Result<Vec<(Purpose, Span)>>,
}

static RUST: Generator = Generator {
    name: rust::names::component,
    names: rust::context_names::check,
    print: |view, component, interfaces, files| {
        let lines = component.dependencies.iter().map(dependencies::line);
        let view = rust::component::of(view);
        Printer::new(&view)?.files(interfaces, &lines.collect::<Vec<_>>(), files)
    },
    first_test: rust::print::FIRST_TEST,
    compare: |project, _, folder, found| {
        found.extend(dependencies::compare(&project.component, folder).1);
        Ok(())
    },
    worker: |project, sources, found| {
        found.extend(dependencies::compare(&project.component, project.folder()).1);
        let unreachable = stubs::unreachable(project, sources);
        found.extend(unreachable.map_err(io::Error::other)?);
        let contexts = stubs::old_contexts(project, sources);
        found.extend(contexts.map_err(io::Error::other)?);
        Ok(())
    },
    stubs: stubs::lacking,
    handlers: stubs::handlers,
};

static PYTHON: Generator = Generator {
    name: python::names::component,
    names: |component, found| {
        python::check(&component.library, found);
        python::checks::check(component, found);
    },
    print: |view, component, _, files| {
        let lines = component.dependencies.iter().map(requirements::line);
        python::print::files(view, &lines.collect::<Vec<_>>(), files)
    },
    first_test: python::print::FIRST_TEST,
    compare: |project, middleware, folder, found| {
        found.extend(requirements::compare(&project.component, folder).1);
        if found.has_errors() {
            return Ok(());
        }
        let (view, _) = view::component::of(project, middleware);
        python::reply_order::check(project, &view, folder, found)
    },
    worker: |project, sources, found| {
        found.extend(requirements::compare(&project.component, project.code()).1);
        python::stubs::check(project, sources, found)
    },
    stubs: |project, folder, sources| {
        let (missing, found) = python::stubs::of(project, folder, sources)?;
        let lacking = missing.map(|missing| Lacking {
            text: missing.text(),
            hooks: missing.hooks(),
            total: missing.total(),
        });
        Ok((lacking, found))
    },
    handlers: python::places::of,
};

static CPP: Generator = Generator {
    name: cpp::names::component,
    names: cpp::check,
    print: |view, _, _, files| cpp::print::files(view, files),
    first_test: cpp::print::FIRST_TEST,
    compare: |_, _, _, _| Ok(()),
    worker: |_, _, _| Ok(()),
    stubs: |project, folder, sources| Ok(cpp::stubs::of(project, folder, sources)?),
    handlers: |_, _, _| Ok(Vec::new()),
};

/// The functions of a language.
pub(crate) fn of(language: Language) -> &'static Generator {
    match language {
        Language::Rust => &RUST,
        Language::Python => &PYTHON,
        Language::Cpp => &CPP,
    }
}
