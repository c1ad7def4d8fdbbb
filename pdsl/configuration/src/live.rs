//! The parameters of a running component, and changes of them.

use crate::block::{Block, Content, Origin};
use crate::change::{ParamChange, shown};
use crate::document::{self, Locator};
use crate::edit::{Edit, edits};
use crate::model::{Kind, Parameter, Parameters, Range, Type, Value};
use crate::parameters::Reader;
use crate::path::{Target, resolve};
use crate::rules;
use crate::untyped_value::UntypedValue;
use crate::values::{PathFolders, Values, path_from};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_vocabulary::ParameterStatus;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::Path;

/// One parameter of a running component.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveParameter {
    /// The status as tools get it.
    pub status: ParameterStatus,
    /// The type, and whether the value is an array; `None` for a group or a list.
    pub ty: Option<(Type, bool)>,
    /// The allowed range.
    pub range: Option<Range>,
}

/// The values of a running component, those of its next start, and those of its file.
pub struct LiveParameters {
    pub(crate) model: Parameters,
    running: Block,
    /// The values of the next start. Pending changes of `restart` parameters are included.
    pub(crate) next: Block,
    /// The values of the file, as far as the component knows.
    pub(crate) saved: Block,
}

/// Changes that passed the check. [`LiveParameters::apply`] makes them effective.
pub struct CheckedChanges {
    running: Block,
    next: Block,
    /// The changes that take effect at once.
    pub changes: Vec<ParamChange>,
    /// The changes that take effect at the next start.
    pub pending: Vec<ParamChange>,
}

impl CheckedChanges {
    /// All values of the running component after the changes.
    pub fn values(&self) -> Values {
        self.running.values()
    }
}

impl LiveParameters {
    /// The parameters of a component that starts with `values` of a checked configuration.
    pub fn new(model: Parameters, values: &Values) -> Self {
        let at = Locator::nowhere().start();
        let running = Block::of(&model.parameters, values, "", at);
        Self {
            next: running.clone(),
            saved: running.clone(),
            running,
            model,
        }
    }

    /// The values of the running component.
    pub fn values(&self) -> Values {
        self.running.values()
    }

    /// Checks all changes, each a path and a value, together. The values of the running component
    /// and those of its next start must then be a configuration that the `.pdsl` accepts. Reports
    /// all errors at once; their spans have no source. A value that stays the same is not a
    /// change.
    pub fn check<'c>(
        &self,
        changes: impl IntoIterator<Item = (&'c str, &'c Json)>,
    ) -> Result<CheckedChanges, Diagnostics> {
        let changes = changes.into_iter();
        let at = Locator::nowhere().start();
        self.check_changes(changes.map(|(path, value)| (path, value, at)), false)
    }

    /// As [`LiveParameters::check`], for a component that has not started: each change takes
    /// effect at once.
    pub fn check_start<'c>(
        &self,
        changes: impl IntoIterator<Item = (&'c str, &'c Json)>,
    ) -> Result<CheckedChanges, Diagnostics> {
        let at = Locator::nowhere().start();
        let changes = changes.into_iter();
        self.check_overrides(changes.map(|(path, value)| (path, value, at)))
    }

    /// As [`LiveParameters::check_start`], for values of a file: each finding has the location of
    /// its value.
    pub fn check_overrides<'c>(
        &self,
        changes: impl IntoIterator<Item = (&'c str, &'c Json, Span)>,
    ) -> Result<CheckedChanges, Diagnostics> {
        self.check_changes(changes, true)
    }

    /// The value of `given` for the parameter at `path`. Relative paths start at `folder`. Fails if
    /// there is no such parameter.
    pub fn given(
        &self,
        path: &str,
        given: &UntypedValue,
        folder: &Path,
    ) -> Result<Json, Diagnostic> {
        let at = Locator::nowhere().start();
        let target = resolve(path, &self.model.parameters, &self.next, at)?;
        Ok(match &target.parameter.kind {
            Kind::Scalar { ty, array } => {
                let value = given.json(*ty, array.is_some() && target.element.is_none());
                let is_path = *ty == Type::Path && target.parameter.choices.is_empty();
                if is_path {
                    absolute(value, folder)
                } else {
                    value
                }
            }
            Kind::Group(_) | Kind::List { .. } => given.value.clone(),
        })
    }

    fn check_changes<'c>(
        &self,
        changes: impl IntoIterator<Item = (&'c str, &'c Json, Span)>,
        starts: bool,
    ) -> Result<CheckedChanges, Diagnostics> {
        let mut found = Diagnostics::new();
        let mut wanted: Vec<(Target<'_>, Option<Value>, Span)> = Vec::new();
        for (path, value, at) in changes {
            match self.check_change(path, value, at, starts, &mut found) {
                Some((target, _)) if wanted.iter().any(|(other, ..)| other.overlaps(&target)) => {
                    let message = format!("`{}` is changed twice", target.path);
                    let diagnostic = Diagnostic::error("repeated-change", at, message);
                    found.push(diagnostic.help("give each parameter one value"));
                    wanted.push((target, None, at));
                }
                other => wanted.extend(other.map(|(target, value)| (target, value, at))),
            }
        }
        let mut accepted = CheckedChanges {
            running: self.running.clone(),
            next: self.next.clone(),
            changes: Vec::new(),
            pending: Vec::new(),
        };
        for (target, new, at) in wanted {
            let Some(new) = new else {
                // Rules that refer to it are not evaluated.
                for block in [&mut accepted.running, &mut accepted.next] {
                    if let Some(field) = target.field_mut(block) {
                        field.faulty = true;
                    }
                }
                continue;
            };
            let restart = target.parameter.restart && !starts;
            let (old, list) = if restart {
                (target.value(&self.next), &mut accepted.pending)
            } else {
                (target.value(&self.running), &mut accepted.changes)
            };
            let Some(old) = old.filter(|old| **old != new) else {
                continue;
            };
            list.push(ParamChange {
                path: target.path.clone(),
                old: old.clone(),
                new: new.clone(),
                secret: target.parameter.secret,
            });
            if !restart {
                set_value(&target, &mut accepted.running, &new, at);
            }
            set_value(&target, &mut accepted.next, &new, at);
        }
        let now = rules::violations(&self.model.rules, &accepted.running);
        for (_, violation) in now {
            found.push(violation.diagnostic());
        }
        // These values differ only in changes that wait for the next start.
        let later = (!starts).then(|| rules::violations(&self.model.rules, &accepted.next));
        for (_, mut violation) in later.into_iter().flatten() {
            violation.explanation.push_str(", at the next start");
            found.push(violation.diagnostic());
        }
        if found.has_errors() {
            return Err(found);
        }
        for block in [&mut accepted.running, &mut accepted.next] {
            mark_existing(block);
        }
        Ok(accepted)
    }

    /// Checks one change by itself. Returns its target and its value, or no value if that is
    /// invalid.
    fn check_change<'m>(
        &'m self,
        path: &str,
        value: &Json,
        at: Span,
        starts: bool,
        found: &mut Diagnostics,
    ) -> Option<(Target<'m>, Option<Value>)> {
        let locator = Locator::nowhere();
        let target = resolve(path, &self.model.parameters, &self.next, at);
        let target = target.map_err(|diagnostic| found.push(diagnostic)).ok()?;
        let (parameter, path) = (target.parameter, target.path.as_str());
        let Kind::Scalar { ty, array } = &parameter.kind else {
            let message = format!("`{path}` cannot be changed as a whole");
            let diagnostic = Diagnostic::error("wrong-type", at, message);
            let (element, members) = match &parameter.kind {
                Kind::List { parameters, .. } if !path.ends_with(']') => ("[0]", parameters),
                Kind::List { parameters, .. } | Kind::Group(parameters) => ("", parameters),
                Kind::Scalar { .. } => return None,
            };
            let within = format!("{path}{element}.");
            found.push(match members.first() {
                Some(first) => {
                    let example = format!("{within}{}", first.name);
                    diagnostic.help(format!("name a parameter in it, as in `{example}`"))
                }
                None => diagnostic.help("there are no parameters in it"),
            });
            return None;
        };
        if !parameter.editable && !parameter.restart && !starts {
            let message = format!("`{path}` is fixed when the component starts");
            let diagnostic = Diagnostic::error("fixed-parameter", at, message);
            found.push(diagnostic.help(format!(
                "change it in the configuration file and restart the component, or mark it `T` or `restart` in the .pdsl of `{}` and generate again",
                self.model.name
            )));
            return Some((target, None));
        }
        let Some(item) = document::from_json(value, ty.is_number()) else {
            let message = format!("`{path}` cannot be null");
            let diagnostic = Diagnostic::error("wrong-type", at, message);
            found.push(diagnostic.help(format!("allowed is {}", parameter.allowed())));
            return Some((target, None));
        };
        let mut errors = Diagnostics::new();
        let mut reader = Reader {
            locator,
            given: &BTreeMap::new(),
            found: &mut errors,
            missing: Vec::new(),
            secrets: Vec::new(),
            has_secrets: false,
            with_sample_elements: false,
        };
        let new = if let (Some(_), Some(_)) = (array, target.element) {
            reader.scalar(parameter, *ty, &item, path, at)
        } else {
            let mut field = target.field(&self.next)?.clone();
            field.at = at;
            reader.read_given(parameter, &item, &mut field);
            match field.content {
                Some(Content::Value(value)) => Some(value),
                _ => None,
            }
        };
        let fits = !errors.has_errors();
        found.extend(errors);
        Some((target, new.filter(|_| fits)))
    }

    /// All values of the running component after the changes, for its worker: with absolute paths.
    pub fn worker_values(&self, accepted: &CheckedChanges, folders: &PathFolders) -> Values {
        let values = accepted.running.values();
        values.with_paths_from(folders, &self.model.parameters)
    }

    /// Makes checked changes effective. No other changes may be applied between check and apply.
    pub fn apply(&mut self, accepted: CheckedChanges) {
        self.running = accepted.running;
        self.next = accepted.next;
    }

    /// The values of the next start that differ from the file, as far as the component knows.
    pub fn unsaved(&self) -> Vec<ParamChange> {
        self.edits().into_iter().map(|edit| edit.change).collect()
    }

    pub(crate) fn edits(&self) -> Vec<Edit<'_>> {
        edits(&self.model.parameters, &self.saved, &self.next)
    }

    /// All parameters, in the order of the model.
    pub fn all(&self) -> Vec<LiveParameter> {
        let mut all = Vec::new();
        collect(&self.model.parameters, &self.running, &self.next, &mut all);
        let unsaved = self.unsaved();
        for LiveParameter { status, .. } in &mut all {
            status.unsaved = unsaved.iter().any(|change| change.path == status.path);
        }
        all
    }

    /// The parameters that `paths` name, including the members of groups and lists; all
    /// parameters if there are no paths.
    pub fn list(&self, paths: &[&str]) -> Result<Vec<ParameterStatus>, Diagnostics> {
        let all = self.all().into_iter().map(|parameter| parameter.status);
        let all: Vec<ParameterStatus> = all.collect();
        if paths.is_empty() {
            return Ok(all);
        }
        let (mut chosen, mut found) = (Vec::new(), Diagnostics::new());
        for path in paths {
            let target = resolve(
                path,
                &self.model.parameters,
                &self.running,
                Locator::nowhere().start(),
            );
            let target = match target {
                Ok(target) => target,
                Err(diagnostic) => {
                    found.push(diagnostic);
                    continue;
                }
            };
            if let (Some(value), Some(_)) = (target.value(&self.running), target.element) {
                let next = target.value(&self.next);
                let mut status = parameter(target.parameter, &target.path, value, next).status;
                status.default = None;
                status.unsaved = target.value(&self.saved) != target.value(&self.next);
                chosen.push(status);
                continue;
            }
            let path = &target.path;
            let within = |status: &&ParameterStatus| match status.path.strip_prefix(path) {
                Some(rest) => rest.is_empty() || rest.starts_with(['.', '[']),
                None => false,
            };
            chosen.extend(all.iter().filter(within).cloned());
        }
        if found.is_empty() {
            Ok(chosen)
        } else {
            Err(found)
        }
    }
}

fn collect(parameters: &[Parameter], running: &Block, next: &Block, all: &mut Vec<LiveParameter>) {
    let fields = running.fields.iter().zip(&next.fields);
    for (parameter, (field, next)) in parameters.iter().zip(fields) {
        match (&parameter.kind, &field.content, &next.content) {
            (Kind::Group(members), Some(Content::Group(a)), Some(Content::Group(b))) => {
                collect(members, a, b, all);
            }
            (Kind::List { parameters, .. }, Some(Content::List(a)), Some(Content::List(b))) => {
                for (a, b) in a.iter().zip(b) {
                    collect(parameters, a, b, all);
                }
            }
            (_, Some(Content::Value(value)), next) => {
                let next = match next {
                    Some(Content::Value(next)) => Some(next),
                    _ => None,
                };
                all.push(self::parameter(parameter, &field.path, value, next));
            }
            _ => {}
        }
    }
}

fn parameter(
    parameter: &Parameter,
    path: &str,
    value: &Value,
    next: Option<&Value>,
) -> LiveParameter {
    let show = |value: &Value| shown(value, parameter.secret);
    let status = ParameterStatus {
        path: path.to_owned(),
        value: show(value),
        pending: next.filter(|next| *next != value).map(show),
        unsaved: false,
        default: parameter.default.as_ref().map(show),
        allowed: parameter.summary(),
        unit: parameter.unit.clone(),
        editable: parameter.editable,
        restart: parameter.restart,
        secret: parameter.secret,
        doc: parameter.doc.clone(),
    };
    LiveParameter {
        status,
        ty: match &parameter.kind {
            Kind::Scalar { ty, array } => Some((*ty, array.is_some())),
            Kind::Group(_) | Kind::List { .. } => None,
        },
        range: parameter.range.clone(),
    }
}

/// A path, or an array of paths, from `folder` on.
fn absolute(value: Json, folder: &Path) -> Json {
    match value {
        Json::String(path) => path_from(folder, &path).into(),
        Json::Array(paths) => paths.into_iter().map(|p| absolute(p, folder)).collect(),
        other => other,
    }
}

/// Sets a value.
fn set_value(target: &Target<'_>, root: &mut Block, new: &Value, at: Span) {
    let Some(field) = target.field_mut(root) else {
        return;
    };
    field.origin = Origin::UntypedValue;
    field.at = at;
    match (&mut field.content, target.element) {
        (Some(Content::Value(Value::Array(values))), Some(at)) => {
            if let Some(value) = values.get_mut(at) {
                value.clone_from(new);
            }
        }
        (content, _) => *content = Some(Content::Value(new.clone())),
    }
}

/// Marks all values as existing ones.
fn mark_existing(block: &mut Block) {
    for field in &mut block.fields {
        field.origin = Origin::Existing;
        match &mut field.content {
            Some(Content::Group(block)) => mark_existing(block),
            Some(Content::List(blocks)) => blocks.iter_mut().for_each(mark_existing),
            Some(Content::Value(_)) | None => {}
        }
    }
}
