//! The configuration of a component: its file, and what the command line changes.

use crate::arguments::{self, Arguments};
use crate::description::Description;
use crate::error::{StartError, refused};
use crate::log::print_error;
use rc_configuration::model::Parameters;
use rc_configuration::{Configuration, LiveParameters};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_middleware::Address;
use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The configuration of a component at its start.
pub(crate) struct LoadedConfiguration {
    /// The model of the parameters; none if the component has none.
    pub(crate) parameters: Option<Parameters>,
    pub(crate) configuration: Configuration,
    /// The absolute path of the file.
    pub(crate) file: Option<PathBuf>,
}

/// Reads and checks the configuration. Parameters of the command line replace those of the file.
pub(crate) fn load(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let mut loaded = read(description, arguments)?;
    if arguments.parameters.is_empty() {
        return Ok(loaded);
    }
    let Some(model) = &loaded.parameters else {
        let name = description.name;
        let message = format!("{name} has no parameters, and the command line sets one");
        return Err(StartError::Usage(message));
    };
    let live = LiveParameters::new(model.clone(), &loaded.configuration.parameters);
    let given = arguments.parameters.iter();
    let given: Vec<(&str, serde_json::Value)> = given
        .map(|(path, text)| (path.as_str(), live.parse_text(path, text)))
        .collect();
    let given = given.iter().map(|(path, value)| (*path, value));
    let accepted = live.check_start(given).map_err(|found| {
        let (name, reason) = (description.name, refused(&found).message);
        StartError::Configuration(format!("{name}: error: command line: {reason}\n"))
    })?;
    loaded.configuration.parameters = accepted.values();
    Ok(loaded)
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
    let Some(path) = config_file(description, arguments) else {
        let configuration = rc_configuration::defaults(parameters.as_ref()).map_err(|missing| {
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
    let (configuration, mut found) = rc_configuration::check(&sources, source, parameters.as_ref());
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
