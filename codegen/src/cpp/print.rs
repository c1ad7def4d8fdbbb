//! Prints the C++ of a component.

use super::{component, names};
use crate::description::{self, Guest};
use crate::files::{Files, GENERATED, Owner};
use crate::templates::{self, TemplateError, templates};
use crate::view;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tera::{Context, Tera};

static TEMPLATES: &[(&str, &str)] = templates![
    "cpp": "module.h", "parameters.h", "machine.h", "genericworker.h", "description.h", "testing.h", "patterns.h",
    "main.cpp", "component.cmake", "cmakelists.txt", "gitignore", "user_worker.h", "user_worker.cpp", "user_test.cpp",
];

/// The first test of a new component.
pub(crate) const FIRST_TEST: &str = "tests/worker_test.cpp";

fn print(name: &str, context: &Context) -> Result<String, TemplateError> {
    static TERA: OnceLock<Result<Tera, TemplateError>> = OnceLock::new();
    let tera = TERA.get_or_init(|| templates::tera(TEMPLATES));
    let text = tera.as_ref().map_err(Clone::clone)?.render(name, context)?;
    let mut out = String::new();
    for line in text.trim().lines().map(str::trim_end) {
        out.push_str(line);
        // A backslash at its end would continue a comment.
        if line.ends_with('\\') && line.trim_start().starts_with("//") {
            out.push('.');
        }
        out.push('\n');
    }
    Ok(out)
}

/// The files of the component's folder.
pub(crate) fn files(view: &view::Component, files: &mut Files) -> Result<(), TemplateError> {
    let component = &component::of(view);
    let mut all = Context::from_serialize(component)?;
    let guest = Guest {
        collected: names::own,
        in_place: true,
        handler: names::handler,
    };
    let description = description::of(view, &guest);
    let description = description.map_err(|error| TemplateError::new(error.to_string()))?;
    // In JSON, a round bracket may be written as an escape; this one would end the raw string.
    let description = description.replace(")rc_json\"", "\\u0029rc_json\"");
    all.insert("description", description.trim_end());
    let generated = |name: &str| Path::new(GENERATED).join(name);
    let mut add = |path: PathBuf, owner, template: &str, context: &Context| {
        files.add(path, owner, print(template, context)?);
        Ok::<(), TemplateError>(())
    };
    for header in &component.headers {
        let mut context = all.clone();
        context.insert("header", header);
        let path = generated("interfaces").join(format!("{}.h", header.name));
        add(path, Owner::Generic, "module.h", &context)?;
    }
    if component.parameters.is_some() {
        add(
            generated("parameters.h"),
            Owner::Generic,
            "parameters.h",
            &all,
        )?;
    }
    if component.machine.is_some() {
        add(generated("machine.h"), Owner::Generic, "machine.h", &all)?;
    }
    if !component.patterns.is_empty() {
        add(generated("patterns.h"), Owner::Generic, "patterns.h", &all)?;
    }
    for name in [
        "genericworker.h",
        "description.h",
        "testing.h",
        "main.cpp",
        "component.cmake",
    ] {
        add(generated(name), Owner::Generic, name, &all)?;
    }
    for (path, template) in [
        ("CMakeLists.txt", "cmakelists.txt"),
        (".gitignore", "gitignore"),
        ("src/specificworker.h", "user_worker.h"),
        ("src/specificworker.cpp", "user_worker.cpp"),
        (FIRST_TEST, "user_test.cpp"),
    ] {
        add(path.into(), Owner::Specific, template, &all)?;
    }
    Ok(())
}
