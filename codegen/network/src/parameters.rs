//! Values of parameters that the network or the command line sets, in place of those in
//! configurations. The checker of configurations judges them.

use crate::configuration::Configured;
use rc_codegen::Project;
use rc_configuration::{LiveParameters, Values};
use rc_ddsl::model::{Deployment, ParameterValue};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use rc_syntax::{Literal, LiteralKind};
use rc_vocabulary::duration;
use serde_json::Value as Json;
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// The parameters of an instance.
#[derive(Clone, Debug, Default)]
pub(crate) struct OverriddenParameters {
    /// The values that the network sets, by path.
    pub(crate) set: Vec<(String, Json)>,
    /// All values in effect. `None` after an error.
    pub(crate) values: Option<Values>,
}

impl OverriddenParameters {
    /// Whether the network sets a parameter, or an element of its array.
    pub(crate) fn is_set(&self, parameter: &str) -> bool {
        self.set.iter().any(|(name, _)| {
            let element = name.strip_prefix(parameter);
            element.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
        })
    }
}

/// A value of a command line, for an instance.
#[derive(Debug)]
pub(crate) struct ParameterOverride {
    instance: usize,
    path: String,
    text: String,
    span: Span,
}

/// The name of the command line in findings.
const SOURCE: &str = "--set";

/// Finds the instances of values `COMPONENT.PATH=VALUE`. Each one is a source of its own.
pub(crate) fn given(
    deployment: &Deployment,
    set: &[String],
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Vec<ParameterOverride> {
    let mut all: Vec<ParameterOverride> = Vec::new();
    for text in set {
        let source = sources.add(SOURCE, text.clone());
        let end = text.find('=').unwrap_or(text.len());
        let (target, value) = (&text[..end], text.get(end + 1..));
        let (Some(value), Some(_)) = (value, target.find('.')) else {
            let span = Span::new(source, 0, text.len());
            let message = format!("`{text}` is not a value of a parameter");
            let error = Diagnostic::error("bad-override", span, message);
            found.push(error.help("write `COMPONENT.PATH=VALUE`, as in `avoider.speed=300`"));
            continue;
        };
        // The proxy of a group has the name of the group, and comes before the components inside.
        let instances = deployment.instances.iter().enumerate();
        let instances = instances.filter_map(|(at, instance)| {
            let path = target.strip_prefix(instance.path.as_str())?;
            Some((at, path.strip_prefix('.')?))
        });
        let named = instances.min_by_key(|(_, path)| path.len());
        let Some((instance, path)) = named else {
            let name = target.split('.').next().unwrap_or(target);
            let span = Span::new(source, 0, name.len());
            let message = format!("unknown component `{name}`");
            let error = Diagnostic::error("unknown-instance", span, message);
            let known = deployment.instances.iter().map(|i| i.path.as_str());
            found.push(error.suggest(name, known));
            continue;
        };
        // The last value of a parameter counts, as in other options.
        all.retain(|g| (g.instance, g.path.as_str()) != (instance, path));
        all.push(ParameterOverride {
            instance,
            path: path.to_owned(),
            text: value.to_owned(),
            span: Span::new(source, end - path.len(), text.len()),
        });
    }
    all
}

/// Checks all values that the network and the command line set, together with the configurations.
pub(crate) fn overridden(
    deployment: &Deployment,
    projects: &[Option<Rc<Project>>],
    configured: &[Configured],
    given: Vec<ParameterOverride>,
    found: &mut Diagnostics,
) -> Vec<OverriddenParameters> {
    let mut given_for: Vec<Vec<ParameterOverride>> = Vec::new();
    given_for.resize_with(deployment.instances.len(), Vec::new);
    for value in given {
        given_for[value.instance].push(value);
    }
    let instances = deployment.instances.iter().zip(projects).zip(configured);
    instances
        .zip(given_for)
        .map(|(((instance, project), configured), given)| {
            let unchanged = OverriddenParameters {
                set: Vec::new(),
                values: configured.values.clone(),
            };
            let (Some(project), Some(values)) = (project, &configured.values) else {
                return unchanged;
            };
            let place = instance.parameters.first().map(|p| p.path.span);
            let Some(place) = place.or_else(|| given.first().map(|g| g.span)) else {
                return unchanged;
            };
            let Some(model) = &project.parameters else {
                let name = &project.component.name;
                let message = format!("`{}` has no parameters", name.text);
                let error = Diagnostic::error("unknown-parameter", place, message);
                let help = "add `parameters \"FILE.pdsl\";` to its .cdsl, or remove the value";
                found.push(error.label(name.span, "its component").help(help));
                return unchanged;
            };
            let live = LiveParameters::new(model.clone(), values);
            let file = instance.parameters.iter();
            let file = file.filter(|p| given.iter().all(|g| g.path != p.path.text));
            let file = file.map(|p| (p.path.text.clone(), json(&p.value), p.path.span));
            let line = given.iter().map(|g| {
                let given = rc_configuration::UntypedValue::of_text(&g.text);
                // Components start in the folder of the network, as paths of the .ddsl do.
                let folder = Path::new("");
                // An unknown path is found with the others below.
                let value = live.given(&g.path, &given, folder);
                let value = value.unwrap_or(given.value);
                (g.path.clone(), value, g.span)
            });
            let set: Vec<(String, Json, Span)> = file.chain(line).collect();
            let values = instance.parameters.iter();
            let values = values.filter_map(|p| match &p.value {
                ParameterValue::One(literal) => Some((p.path.span, literal.span)),
                ParameterValue::Array(_) => None,
            });
            check(&live, set, &values.collect(), found)
        })
        .collect()
}

/// Checks the values of one instance. `values` has the place of each value by that of its name.
fn check(
    live: &LiveParameters,
    set: Vec<(String, Json, Span)>,
    values: &BTreeMap<Span, Span>,
    found: &mut Diagnostics,
) -> OverriddenParameters {
    let (mut open, mut has_secrets) = (Vec::new(), false);
    for (path, value, span) in set {
        let status = live.list(&[path.as_str()]).unwrap_or_default();
        if status.iter().any(|status| status.secret) {
            has_secrets = true;
            let message = format!("`{path}` is secret: a network cannot set it");
            let error = Diagnostic::error("secret-override", span, message);
            found.push(error.help(
                "write it into the configuration of the component: every user of the machine can read command lines",
            ));
        } else {
            open.push((path, value, span));
        }
    }
    let changes = open
        .iter()
        .map(|(path, value, span)| (path.as_str(), value, *span));
    match live.check_overrides(changes) {
        Ok(_) if has_secrets => OverriddenParameters::default(),
        Ok(accepted) => OverriddenParameters {
            values: Some(accepted.values()),
            set: open
                .into_iter()
                .map(|(path, value, _)| (path, value))
                .collect(),
        },
        Err(errors) => {
            found.extend(errors.into_iter().map(|mut error| {
                // A near name replaces the name, each other fix the value.
                let place = values.get(&error.span).copied();
                let place = place.filter(|_| error.code != "unknown-parameter");
                if let Some(fix) = &mut error.fix {
                    fix.place = fix.place.or(place);
                }
                error
            }));
            OverriddenParameters::default()
        }
    }
}

fn json(value: &ParameterValue) -> Json {
    match value {
        ParameterValue::One(literal) => literal_json(literal),
        ParameterValue::Array(literals) => literals.iter().map(literal_json).collect(),
    }
}

/// A literal in the form of a configuration: durations are strings there.
fn literal_json(literal: &Literal) -> Json {
    match &literal.kind {
        LiteralKind::Int(value) => {
            serde_json::Number::from_i128(*value).map_or(Json::from(*value as f64), Json::Number)
        }
        LiteralKind::Float(value) => Json::from(*value),
        LiteralKind::Bool(value) => Json::from(*value),
        LiteralKind::Duration(nanoseconds) => Json::from(duration::text(*nanoseconds)),
        LiteralKind::String(text) | LiteralKind::Name(text) => Json::from(text.as_str()),
    }
}
