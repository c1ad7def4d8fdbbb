//! Prints the Python of a component.

use super::{component, handlers, layout};
use crate::cpp::print::FORM;
use crate::description::Guest;
use crate::files::{Files, GENERATED, Owner};
use crate::templates::{self, TemplateError, templates};
use crate::view;
use crate::{description, note, parallel};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tera::{Context, Tera};

/// A template, read when it is needed for the first time.
struct Template {
    text: &'static [(&'static str, &'static str)],
    tera: OnceLock<Result<Tera, TemplateError>>,
}

impl Template {
    const fn new(text: &'static [(&'static str, &'static str)]) -> Self {
        Self {
            text,
            tera: OnceLock::new(),
        }
    }
}

static TEMPLATES: [Template; 16] = [
    Template::new(templates!["python": "module.py"]),
    Template::new(templates!["python": "interface.py"]),
    Template::new(templates!["python": "init.py"]),
    Template::new(templates!["python": "folder.py"]),
    Template::new(templates!["python": "main.py"]),
    Template::new(templates!["python": "context.py"]),
    Template::new(templates!["python": "worker.py"]),
    Template::new(templates!["python": "parameters.py"]),
    Template::new(templates!["python": "machine.py"]),
    Template::new(templates!["python": "world.py"]),
    Template::new(templates!["python": "testing.py"]),
    Template::new(templates!["python": "pyproject.toml"]),
    Template::new(templates!["python": "gitignore"]),
    Template::new(templates!["python": "user_worker.py"]),
    Template::new(templates!["python": "user_test.py"]),
    Template::new(templates!["cpp": "user_form.ui"]),
];

/// The test that a new component begins with.
pub(crate) const FIRST_TEST: &str = "tests/test_worker.py";

fn print(name: &str, context: &Context) -> Result<String, TemplateError> {
    let mut all = TEMPLATES.iter();
    let template = all.find(|template| template.text[0].0 == name);
    let template = template.ok_or_else(|| TemplateError::new(format!("no template `{name}`")))?;
    let tera = template.tera.get_or_init(|| templates::tera(template.text));
    let text = tera.as_ref().map_err(Clone::clone)?.render(name, context)?;
    Ok(format!("{}\n", text.trim()))
}

/// One file.
struct Job<'a> {
    path: PathBuf,
    owner: Owner,
    template: &'static str,
    /// The part of the component that the file is about; else all of it.
    context: Option<&'a Context>,
}

/// The files of the component's folder. `dependencies` are requirements of the worker.
pub(crate) fn files(
    view: &view::Component,
    dependencies: &[String],
    files: &mut Files,
) -> Result<(), TemplateError> {
    let component = &component::of(view);
    let mut all = Context::from_serialize(component)?;
    all.insert("dependencies", dependencies);
    let (major, minor) = rc_cdsl::model::OLDEST_PYTHON;
    let oldest = view.python.as_ref().map(|python| python.oldest.clone());
    all.insert(
        "oldest_python",
        &oldest.unwrap_or_else(|| format!("{major}.{minor}")),
    );
    let package = Path::new(GENERATED).join(&component.package);
    let part = |key: &'static str, value: Context| (key, value);
    let mut parts = Vec::new();
    for module in &component.types {
        let mut context = Context::new();
        context.insert("file", component.file);
        context.insert("module", module);
        parts.push((
            package.join("types").join(format!("{}.py", module.stem)),
            part("module.py", context),
        ));
    }
    for file in &component.interfaces {
        let mut context = Context::new();
        context.insert("file", component.file);
        context.insert("interface", file);
        let path = package.join("interfaces").join(format!("{}.py", file.stem));
        parts.push((path, part("interface.py", context)));
    }
    for (folder, doc, stems) in [
        (
            "types",
            "The types of the imported modules.",
            component.type_stems(),
        ),
        (
            "interfaces",
            "The interfaces of the slots.",
            component.interface_stems(),
        ),
    ] {
        if !stems.is_empty() {
            let mut context = Context::new();
            context.insert("file", component.file);
            context.insert("doc", doc);
            let names: Vec<String> = stems.iter().map(|stem| (*stem).to_owned()).collect();
            context.insert("import", &layout::import(".", &names));
            context.insert("stems", &stems);
            parts.push((
                package.join(folder).join("__init__.py"),
                part("folder.py", context),
            ));
        }
    }
    let mut jobs: Vec<Job> = parts
        .iter()
        .map(|(path, (template, context))| Job {
            path: path.clone(),
            owner: Owner::Generic,
            template,
            context: Some(context),
        })
        .collect();
    let mut add = |path: PathBuf, owner, template| {
        jobs.push(Job {
            path,
            owner,
            template,
            context: None,
        });
    };
    for (path, template, there) in [
        ("__init__.py", "init.py", true),
        ("__main__.py", "main.py", true),
        ("context.py", "context.py", true),
        ("worker.py", "worker.py", true),
        (
            "parameters.py",
            "parameters.py",
            component.parameters.is_some(),
        ),
        ("machine.py", "machine.py", component.machine.is_some()),
        ("world.py", "world.py", component.world.is_some()),
        ("testing.py", "testing.py", true),
    ] {
        if there {
            add(package.join(path), Owner::Generic, template);
        }
    }
    for (path, template) in [
        ("pyproject.toml", "pyproject.toml"),
        (".gitignore", "gitignore"),
        ("src/specific_worker.py", "user_worker.py"),
        (FIRST_TEST, "user_test.py"),
    ] {
        add(path.into(), Owner::Specific, template);
    }
    if view.window.is_some() {
        add(FORM.into(), Owner::Specific, "user_form.ui");
    }
    let texts = parallel::map(&mut jobs, |job| {
        print(job.template, job.context.unwrap_or(&all))
    });
    for (job, text) in jobs.into_iter().zip(texts) {
        files.add(job.path, job.owner, text?);
    }
    let header = format!(
        "# Generated by rcgen from {}; rewritten at every generation.\n",
        component.file
    );
    for robot in &component.kinematics {
        let path = package
            .join("kinematics")
            .join(format!("{}.py", robot.field));
        // Ruff's rules are about lines that people write.
        files.add(
            path,
            Owner::Generic,
            format!("{header}# ruff: noqa\n{}", robot.text),
        );
    }
    if !component.kinematics.is_empty() {
        let text = format!("{header}\"\"\"The solvers of robots.\"\"\"\n");
        let path = package.join("kinematics").join("__init__.py");
        files.add(path, Owner::Generic, text);
    }
    files.add(package.join("py.typed"), Owner::Generic, String::new());
    let description = description::of(
        view,
        &Guest {
            collected: super::handlers::collection,
            in_place: true,
            handler: handlers::name,
        },
    );
    let description = description.map_err(|error| TemplateError::new(error.to_string()))?;
    files.add(package.join(note::DESCRIPTION), Owner::Generic, description);
    Ok(())
}
