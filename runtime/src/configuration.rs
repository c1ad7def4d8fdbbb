//! The configuration of a component: its file, and what the command line changes.

use crate::arguments::{self, Arguments};
use crate::description::Description;
use crate::error::{StartError, refused};
use crate::log::print_error;
use crate::ros_arguments::given::RosArguments;
use crate::ros_arguments::{self, Override, RosOverrides};
use rc_configuration::model::Parameters;
use rc_configuration::{Configuration, LiveParameters, UntypedValue};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_middleware::{Address, Settings};
use std::collections::{BTreeMap, BTreeSet};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The configuration of a component at its start.
pub(crate) struct LoadedConfiguration {
    /// The model of the parameters; none if the component has none.
    pub(crate) parameters: Option<Parameters>,
    pub(crate) configuration: Configuration,
    /// The absolute path of the file.
    pub(crate) file: Option<PathBuf>,
    /// Values from the command line of ROS 2.
    pub(crate) ros: RosOverrides,
}

/// Reads and checks the configuration. Parameters of the command line replace those of the file.
pub(crate) fn load(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let mut loaded = read(description, arguments)?;
    if loaded.ros.parameters.is_empty() && arguments.parameters.is_empty() {
        return Ok(loaded);
    }
    let name = description.name;
    let wrong = |from: &str, found: &Diagnostics| {
        let reason = refused(found).message;
        StartError::Configuration(format!("{name}: error: {from}: {reason}\n"))
    };
    let is_optional = loaded.ros.parameters.iter().all(|one| one.is_optional);
    let model = match &loaded.parameters {
        Some(model) => model.clone(),
        None if is_optional && arguments.parameters.is_empty() => return Ok(loaded),
        None => {
            let message = format!("{name} has no parameters, and the command line sets one");
            return Err(StartError::Usage(message));
        }
    };
    let live = LiveParameters::new(model, &loaded.configuration.parameters);
    let (mut given, mut sources) = (Vec::new(), BTreeSet::new());
    let set = arguments.parameters.iter().map(|(path, text)| Override {
        name: path.clone(),
        value: UntypedValue::of_text(text),
        from: "command line".to_owned(),
        is_optional: false,
    });
    let set: Vec<_> = set.collect();
    for one in set.iter().chain(&loaded.ros.parameters) {
        match live.given(&one.name, &one.value) {
            Ok(value) => {
                given.push((one.name.as_str(), value));
                sources.insert(one.from.as_str());
            }
            Err(unknown) if one.is_optional => {
                let help = unknown
                    .help
                    .map_or(String::new(), |help| format!("; {help}"));
                let ignored = format!("{}: {}{help}", one.from, unknown.message);
                loaded.ros.ignored.push(ignored);
            }
            Err(unknown) => {
                let mut found = Diagnostics::new();
                found.push(unknown);
                return Err(wrong(&one.from, &found));
            }
        }
    }
    let given = given.iter().map(|(path, value)| (*path, value));
    let accepted = live.check_start(given).map_err(|found| {
        let sources: Vec<&str> = sources.into_iter().collect();
        wrong(&sources.join(", "), &found)
    })?;
    loaded.configuration.parameters = accepted.values();
    Ok(loaded)
}

/// The settings of a configuration.
pub(crate) fn configured(configuration: &Configuration) -> Settings {
    let mut settings = Settings::default();
    for (middleware, keys) in &configuration.middleware {
        for (key, set) in keys {
            settings.set(middleware, key, set.value.clone());
        }
    }
    settings
}

/// Applies the arguments of ROS 2, for which the configuration may set names.
fn ros_overrides(
    arguments: &Arguments,
    configuration: &Configuration,
) -> Result<RosOverrides, StartError> {
    if arguments.ros == RosArguments::default() {
        return Ok(RosOverrides::default());
    }
    ros_arguments::resolve(arguments, &configured(configuration)).map_err(StartError::Configuration)
}

fn read(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let parameters = match description
        .parameters
        .map(Parameters::from_json)
        .transpose()
    {
        Ok(parameters) => parameters,
        Err(error) => {
            let message = format!("the generated parameters cannot be read: {error}");
            return Err(StartError::System(message));
        }
    };
    let values = |ros: &RosOverrides| -> BTreeMap<String, UntypedValue> {
        let given = ros.parameters.iter();
        given
            .map(|one| (one.name.clone(), one.value.clone()))
            .collect()
    };
    let Some(path) = config_file(description, arguments) else {
        let ros = ros_overrides(arguments, &Configuration::default())?;
        let configuration =
            rc_configuration::defaults_with(parameters.as_ref(), &values(&ros)).map_err(|missing| {
            StartError::Configuration(format!(
                "{}: error: there is no configuration file, and these parameters have no default: {}; name one with --config\n",
                description.name,
                missing.join(", ")
            ))
        })?;
        return Ok(LoadedConfiguration {
            parameters,
            configuration,
            file: None,
            ros,
        });
    };
    let text = rc_files::read(&path).map_err(|e| {
        StartError::Configuration(format!(
            "{}: error: {} cannot be read: {e}\n",
            description.name,
            path.display()
        ))
    })?;
    let mut sources = SourceMap::new();
    let source = sources.add(&path, text);
    // Without the parameters, which the arguments may set.
    let (first, _) = rc_configuration::check(&sources, source, None);
    let ros = ros_overrides(arguments, &first)?;
    let (configuration, mut found) =
        rc_configuration::check_with(&sources, source, parameters.as_ref(), &values(&ros));
    let mode = std::fs::metadata(&path).map_or(0, |file| file.mode());
    rc_configuration::check_readable(&configuration, mode, &mut found);
    if found.has_errors() {
        return Err(StartError::Configuration(render(
            &sources,
            &found,
            Format::Human,
        )));
    }
    warn(&sources, &found);
    // The worker may change its working directory.
    let file = std::path::absolute(&path).unwrap_or(path);
    Ok(LoadedConfiguration {
        parameters,
        configuration,
        file: Some(file),
        ros,
    })
}

fn warn(sources: &SourceMap, found: &Diagnostics) {
    if !found.is_empty() {
        print_error(&render(sources, found, Format::Human));
    }
}

fn config_file(description: &Description, arguments: &Arguments) -> Option<PathBuf> {
    if arguments.config.is_some() {
        return arguments.config.clone();
    }
    let here = PathBuf::from("etc/config.toml");
    let built = Path::new(description.folder).join("etc/config.toml");
    // The current folder may be that of another component.
    let is_ours = Path::new(&format!("{}.cdsl", description.name)).exists();
    [here]
        .into_iter()
        .filter(|_| is_ours)
        .chain([built])
        .find(|path| path.exists())
}

/// The addresses that the command line gives to slots, else those that the configuration gives.
pub(crate) fn bindings(
    description: &Description,
    arguments: &Arguments,
    configuration: &Configuration,
) -> Result<BTreeMap<String, Address>, StartError> {
    let mut all = BTreeMap::new();
    for (slot, binding) in &configuration.bindings {
        let wrong = |reason: String| {
            let name = description.name;
            StartError::Configuration(format!("{name}: error: [bindings]: {reason}\n"))
        };
        let slot = arguments::check_slot(description, slot).map_err(wrong)?;
        all.insert(slot, Address::parse(&binding.address).map_err(wrong)?);
    }
    all.extend(arguments.bindings.clone());
    Ok(all)
}
