//! Checks the configurations of components. Their middleware settings take precedence over those of
//! the network.

use rc_cdsl::model::{Middleware, Role, Slot};
use rc_codegen::Project;
use rc_codegen::configuration::unknown_slots;
use rc_codegen::paths::normal;
use rc_configuration::{Binding, Settings, Values};
use rc_ddsl::model::{Deployment, Instance, Setting};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_vocabulary::{Value, qos, ros};
use std::collections::{BTreeMap, HashMap};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

/// The configuration of an instance, if it has one.
pub(crate) fn config(instance: &Instance, project: Option<&Project>) -> Option<PathBuf> {
    if let Some(config) = &instance.config {
        return Some(normal(&instance.folder.join(&config.text)));
    }
    let is_made = instance.adaptor.is_some() || instance.proxy.is_some();
    let project = project.filter(|_| !is_made);
    Some(project?.code().join("etc/config.toml")).filter(|path| path.exists())
}

/// The checked configuration of an instance, as far as it has no errors.
#[derive(Clone, Debug, Default)]
pub(crate) struct Configured {
    pub(crate) settings: Settings,
    pub(crate) bindings: BTreeMap<String, Binding>,
    /// The values of the parameters. `None` after an error.
    pub(crate) values: Option<Values>,
    /// The period of `compute()`, if it differs from that of the component.
    pub(crate) period: Option<Duration>,
}

/// Checks the configurations of all instances.
pub(crate) fn configurations(
    deployment: &Deployment,
    projects: &[Option<Rc<Project>>],
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> Vec<Configured> {
    // A configuration that several instances share is read and reported once.
    let mut checked: HashMap<(PathBuf, u64), Configured> = HashMap::new();
    let mut configured = |instance: &Instance, project: &Project| {
        let place = instance
            .config
            .as_ref()
            .map_or(instance.name.span, |c| c.span);
        let Some(path) = config(instance, Some(project)) else {
            let missing = match rc_configuration::defaults(project.parameters.as_ref()) {
                Ok(defaults) => {
                    return Configured {
                        values: Some(defaults.parameters),
                        ..Configured::default()
                    };
                }
                Err(missing) => missing,
            };
            let message = format!(
                "`{}` has no configuration, and these parameters have no default: {}",
                instance.path,
                missing.join(", ")
            );
            let expected = project.code().join("etc/config.toml");
            let help = format!("write {}", expected.display());
            found.push(Diagnostic::error("missing-configuration", place, message).help(help));
            return Configured::default();
        };
        let key = (path, project.hash);
        if let Some(known) = checked.get(&key) {
            return known.clone();
        }
        let configured = match rc_files::read(&key.0) {
            Ok(text) => {
                let source = sources.add(&key.0, text);
                let mode = std::fs::metadata(&key.0).map_or(0, |file| file.mode());
                configuration(sources, source, mode, project, found)
            }
            Err(error) => {
                let message = format!(
                    "the configuration {} cannot be read: {error}",
                    key.0.display()
                );
                found.push(Diagnostic::error("missing-configuration", place, message));
                Configured::default()
            }
        };
        checked.insert(key, configured.clone());
        configured
    };
    let instances = deployment.instances.iter().zip(projects);
    instances
        .map(|(instance, project)| {
            let project = project.as_ref();
            project.map_or_else(Configured::default, |project| configured(instance, project))
        })
        .collect()
}

/// Replaces settings of the network by those of configurations. Returns the settings that
/// configurations leave to the network.
pub(crate) fn settings(
    deployment: &mut Deployment,
    configured: &[Configured],
) -> Vec<Vec<Setting>> {
    let instances = deployment.instances.iter_mut().zip(configured);
    instances
        .map(|(instance, configured)| {
            let own = Middleware::in_files().flat_map(|middleware| {
                let keys = configured.settings.get(middleware.word());
                keys.into_iter().flatten().filter_map(move |(key, set)| {
                    Some(Setting {
                        middleware,
                        key: middleware.key(key)?.name,
                        value: set.value.clone(),
                        span: set.span,
                    })
                })
            });
            let own: Vec<Setting> = own.collect();
            let settings = &mut instance.settings;
            settings.retain(|s| {
                let mut own = own.iter();
                !own.any(|o| (o.middleware, o.key) == (s.middleware, s.key))
            });
            let handed = settings.clone();
            settings.extend(own);
            handed
        })
        .collect()
}

/// Checks one configuration against the component's parameters and slots.
fn configuration(
    sources: &SourceMap,
    source: SourceId,
    mode: u32,
    project: &Project,
    found: &mut Diagnostics,
) -> Configured {
    let (configuration, more) =
        rc_configuration::check(sources, source, project.parameters.as_ref());
    let is_right = !more.has_errors();
    found.extend(more);
    rc_configuration::check_readable(&configuration, mode, found);
    found.extend(unknown_slots(&configuration, &project.component));
    rules(&configuration.middleware, project, found);
    Configured {
        settings: configuration.middleware,
        bindings: configuration.bindings,
        values: is_right.then_some(configuration.parameters),
        period: configuration.period,
    }
}

/// Finds rules for ROS 2 that match no slot or topic of the component.
fn rules(settings: &Settings, project: &Project, found: &mut Diagnostics) {
    let component = &project.component;
    let slots = |is_meant: fn(&Slot) -> bool| {
        let slots = component.slots.iter().filter(move |slot| is_meant(slot));
        let slots = slots.map(|slot| {
            let interface = component.library.interface(slot.interface);
            let operations = interface.operations.iter().map(|o| o.name.text.as_str());
            (slot.path(), operations.collect())
        });
        slots.collect::<Vec<(String, Vec<&str>)>>()
    };
    let (all, mut topics) = (slots(|_| true), slots(is_topic));
    // A rule for an array is one for all of its members.
    let arrays = topics.iter().filter_map(|(slot, topics)| {
        let (array, _) = slot.split_once('/')?;
        Some((array.to_owned(), topics.clone()))
    });
    let arrays: Vec<_> = arrays.collect();
    topics.extend(arrays);
    let (all, topics) = (named(&all), named(&topics));
    let set = |key: &str| settings.get("ros2").and_then(|keys| keys.get(key));
    let mut tell = |span: Span, key: &str, missed: String, hint: String| {
        let message = format!("`{key}`: {} has no {missed}", component.name.text);
        found.push(Diagnostic::error("unknown-slot", span, message).help(hint));
    };
    if let Some(set) = set("remap")
        && let Value::Remappings(rules) = &set.value
    {
        for rule in rules {
            if let Some(hint) = ros::unknown_target_help(&rule.from, &all) {
                tell(set.span, "remap", format!("`{}`", rule.from), hint);
            }
        }
    }
    if let Some(set) = set("qos")
        && let Value::Qos(rules) = &set.value
    {
        for rule in rules {
            if let Some(hint) = qos::unknown_topic_help(&rule.target, &topics) {
                tell(set.span, "qos", format!("topic `{}`", rule.target), hint);
            }
        }
    }
}

/// Slots with their operations, as the rules of `rc_vocabulary` take them.
fn named<'a>(slots: &'a [(String, Vec<&'a str>)]) -> Vec<(&'a str, Vec<&'a str>)> {
    let slots = slots.iter();
    slots
        .map(|(slot, of)| (slot.as_str(), of.clone()))
        .collect()
}

fn is_topic(slot: &Slot) -> bool {
    matches!(slot.role, Role::Publishes | Role::SubscribesTo)
}
