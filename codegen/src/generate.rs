//! From a view to files.

use crate::files::{Files, GENERATED, Owner};
use crate::layout;
use crate::project::Project;
use crate::view::{self, View};
use rc_cdsl::model::Backend;
use rc_diagnostics::Diagnostics;
use std::path::Path;
use tera::{Context, Tera};

const TEMPLATES: [(&str, &str); 21] = [
    ("cargo.toml", include_str!("../templates/cargo.toml.tera")),
    ("lib.rs", include_str!("../templates/lib.rs.tera")),
    ("backend.rs", include_str!("../templates/backend.rs.tera")),
    (
        "description.rs",
        include_str!("../templates/description.rs.tera"),
    ),
    (
        "types_mod.rs",
        include_str!("../templates/types_mod.rs.tera"),
    ),
    ("types.rs", include_str!("../templates/types.rs.tera")),
    (
        "interfaces_mod.rs",
        include_str!("../templates/interfaces_mod.rs.tera"),
    ),
    (
        "interface.rs",
        include_str!("../templates/interface.rs.tera"),
    ),
    (
        "slots_mod.rs",
        include_str!("../templates/slots_mod.rs.tera"),
    ),
    ("slot.rs", include_str!("../templates/slot.rs.tera")),
    ("context.rs", include_str!("../templates/context.rs.tera")),
    ("adapter.rs", include_str!("../templates/adapter.rs.tera")),
    (
        "parameters.rs",
        include_str!("../templates/parameters.rs.tera"),
    ),
    (
        "parameters.md",
        include_str!("../templates/parameters.md.tera"),
    ),
    (
        "user_cargo.toml",
        include_str!("../templates/user_cargo.toml.tera"),
    ),
    ("user_lib.rs", include_str!("../templates/user_lib.rs.tera")),
    (
        "user_main.rs",
        include_str!("../templates/user_main.rs.tera"),
    ),
    (
        "user_worker.rs",
        include_str!("../templates/user_worker.rs.tera"),
    ),
    (
        "user_impl.rs",
        include_str!("../templates/user_impl.rs.tera"),
    ),
    (
        "user_handler.rs",
        include_str!("../templates/user_handler.rs.tera"),
    ),
    ("stubs.rs", include_str!("../templates/stubs.rs.tera")),
];

/// A template that does not fit the view: a fault of this program, never of its input.
#[derive(Debug, thiserror::Error)]
#[error("rcgen's own templates failed, please report it: {0}")]
pub struct TemplateError(String);

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

/// All files of a component. They may be written only where no diagnostic is an error.
pub fn generate(
    project: &Project,
    middleware: Backend,
) -> Result<(Files, Diagnostics), TemplateError> {
    let (view, found) = view::of(project, middleware);
    if found.has_errors() {
        return Ok((Files::default(), found));
    }
    let mut printer = Printer::new(&view)?;
    let mut files = Files::default();
    printer.generic(&mut files)?;
    printer.specific(project, &mut files)?;
    Ok((files, found))
}

/// Prints a view.
pub(crate) struct Printer<'a> {
    tera: Tera,
    view: &'a View,
    /// The view as templates see it; it is large, and made once.
    context: Context,
}

impl<'a> Printer<'a> {
    pub(crate) fn new(view: &'a View) -> Result<Self, TemplateError> {
        let mut tera = Tera::default();
        tera.autoescape_on(Vec::new());
        // Some are parts of others: no file's last line feed is one of its text.
        tera.add_raw_templates(TEMPLATES.map(|(name, text)| (name, text.trim_end())))?;
        let context = Context::from_serialize(view)?;
        Ok(Self {
            tera,
            view,
            context,
        })
    }

    /// The text of one template; `more` is what the view does not hold.
    pub(crate) fn print(
        &mut self,
        template: &str,
        more: &[(&str, serde_json::Value)],
    ) -> Result<String, TemplateError> {
        for (name, value) in more {
            self.context.insert(*name, value);
        }
        let text = self.tera.render(template, &self.context)?;
        for (name, _) in more {
            self.context.remove(name);
        }
        Ok(format!("{}\n", text.trim_end()))
    }

    fn generic(&mut self, files: &mut Files) -> Result<(), TemplateError> {
        let base = Path::new(GENERATED);
        let src = base.join("src");
        let mut add =
            |path: std::path::PathBuf, text: String| files.add(path, Owner::Generic, text);
        let view = self.view;
        add(base.join("Cargo.toml"), self.print("cargo.toml", &[])?);
        add(src.join("lib.rs"), self.print("lib.rs", &[])?);
        for name in ["backend.rs", "description.rs"] {
            add(src.join(name), self.print(name, &[])?);
        }
        let ends = view.slots.iter().any(|s| s.sends);
        add(
            src.join("context.rs"),
            self.print("context.rs", &[("has_ends", ends.into())])?,
        );
        let serves = |role: &str| view.slots.iter().any(|s| s.receives && s.role == role);
        let implements = serves("Implements");
        let subscribes = serves("SubscribesTo");
        add(
            src.join("adapter.rs"),
            self.print(
                "adapter.rs",
                &[
                    ("subscribes", subscribes.into()),
                    ("implements", implements.into()),
                ],
            )?,
        );
        if view.parameters.is_some() {
            add(src.join("parameters.rs"), self.print("parameters.rs", &[])?);
            add(
                base.join("parameters.md"),
                self.print("parameters.md", &[])?,
            );
        }
        add(base.join("config.schema.json"), view.schema.clone());
        let modules = view.modules.iter();
        let parts = modules.map(|m| {
            let exports = !m.types.is_empty() || !m.consts.is_empty();
            (m.module.as_str(), exports.then_some("*"))
        });
        add(
            src.join("types.rs"),
            self.print("types_mod.rs", &folder(parts.collect()))?,
        );
        for module in &view.modules {
            let value = serde_json::to_value(module).map_err(|e| TemplateError(e.to_string()))?;
            add(
                src.join("types").join(format!("{}.rs", module.module)),
                self.print("types.rs", &[("module", value)])?,
            );
        }
        let interfaces = view.interfaces.iter();
        let parts = interfaces.map(|i| (i.module.as_str(), i.exports.then_some("*")));
        add(
            src.join("interfaces.rs"),
            self.print("interfaces_mod.rs", &folder(parts.collect()))?,
        );
        for interface in &view.interfaces {
            let value =
                serde_json::to_value(interface).map_err(|e| TemplateError(e.to_string()))?;
            let text = self.print("interface.rs", &[("interface", value)])?;
            add(
                src.join("interfaces")
                    .join(format!("{}.rs", interface.module)),
                text,
            );
        }
        let slots = view.slots.iter().filter(|s| s.receives);
        let parts: Vec<_> = slots
            .map(|s| (s.module.as_str(), Some(s.type_name.as_str())))
            .collect();
        if !parts.is_empty() {
            add(
                src.join("slots.rs"),
                self.print("slots_mod.rs", &folder(parts))?,
            );
        }
        for slot in view.slots.iter().filter(|s| s.receives) {
            let value = serde_json::to_value(slot).map_err(|e| TemplateError(e.to_string()))?;
            add(
                src.join("slots").join(format!("{}.rs", slot.module)),
                self.print("slot.rs", &[("slot", value)])?,
            );
        }
        Ok(())
    }

    fn specific(&mut self, project: &Project, files: &mut Files) -> Result<(), TemplateError> {
        let package = &self.view.package;
        let imports = layout::imports(&format!("{package}_generated"), &self.view.imports);
        files.add(
            "Cargo.toml",
            Owner::Specific,
            self.print("user_cargo.toml", &[])?,
        );
        files.add(
            "src/lib.rs",
            Owner::Specific,
            self.print("user_lib.rs", &[])?,
        );
        files.add(
            "src/main.rs",
            Owner::Specific,
            self.print("user_main.rs", &[])?,
        );
        let worker = self.print("user_worker.rs", &[("use_line", imports.into())])?;
        files.add("src/specific_worker.rs", Owner::Specific, worker);
        let config = rc_configuration::template(
            &self.view.name,
            project.component.period,
            project.parameters.as_ref(),
        );
        files.add("etc/config.toml", Owner::Specific, config);
        Ok(())
    }
}

/// What the file of a folder of modules lists: the modules, and what each of them exports. rustfmt does not sort
/// both by the same rule.
fn folder(mut modules: Vec<(&str, Option<&str>)>) -> [(&'static str, serde_json::Value); 2] {
    modules.sort_unstable();
    let parts: Vec<&str> = modules.iter().map(|(module, _)| *module).collect();
    modules.sort_by(|a, b| layout::order(a.0, b.0));
    let exports = modules
        .iter()
        .filter_map(|(module, name)| Some(format!("{module}::{}", name.as_ref()?)));
    let exports: Vec<String> = exports.collect();
    [("parts", parts.into()), ("exports", exports.into())]
}
