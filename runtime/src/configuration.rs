//! The configuration of a component: its file, and the changes of the command line.

use crate::arguments::{self, Arguments};
use crate::description::Description;
use crate::error::{StartError, refused};
use crate::log::print_error;
use rc_configuration::model::Parameters;
use rc_configuration::{
    Configuration, LiveParameters, PathFolders, UntypedValue, Values, folder_of_paths,
};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_middleware::linked::{Overrides, ParameterOverride};
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
    /// Where relative paths of parameters start, however the component is started.
    pub(crate) folders: PathFolders,
    /// The changes by the arguments of nodes.
    pub(crate) node: Overrides,
}

impl LoadedConfiguration {
    /// The values that the worker gets.
    pub(crate) fn values(&self) -> Values {
        let values = &self.configuration.parameters;
        self.parameters
            .as_ref()
            .map_or_else(Values::default, |model| {
                values.with_paths_from(&self.folders, &model.parameters)
            })
    }
}

/// Reads and checks the configuration. Parameters of the command line replace those of the file.
pub(crate) fn load(
    description: &Description,
    arguments: &Arguments,
) -> Result<LoadedConfiguration, StartError> {
    let mut loaded = read(description, arguments)?;
    if loaded.node.parameters.is_empty() && arguments.parameters.is_empty() {
        return Ok(loaded);
    }
    let name = description.name;
    let wrong = |from: &str, found: &Diagnostics| {
        let reason = refused(found).message;
        StartError::Configuration(format!("{name}: error: {from}: {reason}\n"))
    };
    let is_optional = loaded.node.parameters.iter().all(|one| one.is_optional);
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
    let set = arguments.parameters.iter().map(|(path, text)| {
        let given = UntypedValue::of_text(text);
        ParameterOverride {
            name: path.clone(),
            text: given.text,
            value: given.value,
            from: "command line".to_owned(),
            is_optional: false,
        }
    });
    let set: Vec<_> = set.collect();
    // A path on a command line is one of its shell.
    let here = std::env::current_dir().unwrap_or_default();
    for one in set.iter().chain(&loaded.node.parameters) {
        match live.given(&one.name, &untyped(one), &here) {
            Ok(value) => {
                given.push((one.name.as_str(), value));
                sources.insert(one.from.as_str());
            }
            Err(unknown) if one.is_optional => {
                let help = unknown
                    .help
                    .map_or(String::new(), |help| format!("; {help}"));
                let ignored = format!("{}: {}{help}", one.from, unknown.message);
                loaded.node.ignored.push(ignored);
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

/// Applies the arguments of nodes, for which the configuration may set names.
fn overrides(
    arguments: &Arguments,
    configuration: &Configuration,
) -> Result<Overrides, StartError> {
    let Some((_, given)) = &arguments.node else {
        return Ok(Overrides::default());
    };
    let configured = configured(configuration);
    let resolved = given.resolve(&arguments.node_name(), &arguments.settings, &configured);
    resolved.map_err(StartError::Configuration)
}

fn untyped(given: &ParameterOverride) -> UntypedValue {
    UntypedValue {
        text: given.text.clone(),
        value: given.value.clone(),
    }
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
    let values = |node: &Overrides| -> BTreeMap<String, UntypedValue> {
        let given = node.parameters.iter();
        given.map(|one| (one.name.clone(), untyped(one))).collect()
    };
    let Some(path) = config_file(description, arguments) else {
        let node = overrides(arguments, &Configuration::default())?;
        let configuration =
            rc_configuration::defaults_with(parameters.as_ref(), &values(&node)).map_err(|missing| {
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
            folders: folders(description, None),
            node,
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
    let node = overrides(arguments, &first)?;
    let (configuration, mut found) =
        rc_configuration::check_with(&sources, source, parameters.as_ref(), &values(&node));
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
        folders: folders(description, Some(&file)),
        file: Some(file),
        node,
    })
}

fn warn(sources: &SourceMap, found: &Diagnostics) {
    if !found.is_empty() {
        print_error(&render(sources, found, Format::Human));
    }
}

/// The folder of an installed component: its program is `FOLDER/bin/NAME`, beside `NAME.cdsl`.
fn installed_folder(program: &Path, name: &str) -> Option<PathBuf> {
    let folder = program.parent().filter(|bin| bin.ends_with("bin"))?;
    let folder = folder.parent()?;
    let description = folder.join(format!("{name}.cdsl"));
    description.is_file().then(|| folder.to_path_buf())
}

/// The folder of an installed component, else that at build time, without the detour over that of
/// generated code.
fn built_folder(description: &Description) -> PathBuf {
    let program = std::env::current_exe().ok();
    let installed = program.and_then(|program| installed_folder(&program, description.name));
    if let Some(folder) = installed {
        return folder;
    }
    let folder = Path::new(description.folder);
    folder.canonicalize().unwrap_or_else(|_| folder.into())
}

/// Where relative paths start, with the configuration in `file`. On a machine where the component
/// was not built, its folder is not known: defaults start where the configuration does.
fn folders(description: &Description, file: Option<&Path>) -> PathFolders {
    let built = built_folder(description);
    let configured = file.map(folder_of_paths);
    let defaults = match configured {
        Some(folder) if !built.is_dir() => folder.to_path_buf(),
        _ => built.clone(),
    };
    PathFolders {
        configuration: configured.map_or(built, Path::to_path_buf),
        defaults,
    }
}

fn config_file(description: &Description, arguments: &Arguments) -> Option<PathBuf> {
    if arguments.config.is_some() {
        return arguments.config.clone();
    }
    let here = PathBuf::from("etc/config.toml");
    let built = built_folder(description).join("etc/config.toml");
    // The current folder may belong to another component.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn an_installed_component_has_its_folder_beside_its_program() {
        let folder = tempfile::tempdir().expect("a folder");
        let place = folder.path().join("components/reader");
        let program = place.join("bin/reader");
        std::fs::create_dir_all(&place).expect("a folder");
        assert_eq!(installed_folder(&program, "reader"), None);
        std::fs::write(place.join("reader.cdsl"), "").expect("a file");
        assert_eq!(installed_folder(&program, "reader"), Some(place.clone()));
        // A program that cargo built.
        assert_eq!(
            installed_folder(&place.join("debug/reader"), "reader"),
            None
        );
    }

    static READER: Description = Description {
        name: "reader",
        model_hash: 1,
        middleware: "none",
        period: Duration::from_millis(10),
        parameters: Some(
            r#"{"name":"reader","parameters":[
            {"name":"map","kind":{"scalar":{"type":"path"}},"default":{"text":"house.map"}},
            {"name":"log","kind":{"scalar":{"type":"path"}},"default":{"text":""}}],"rules":[]}"#,
        ),
        folder: "/built/reader",
        slots: &[],
        backends: &[],
        types: &[],
        simulates_time: false,
        managed: false,
        converter: None,
        note: b"",
    };

    fn values(config: Option<PathBuf>, set: &[(&str, &str)]) -> Values {
        let set = set
            .iter()
            .map(|(path, text)| ((*path).into(), (*text).into()));
        let arguments = Arguments {
            config,
            parameters: set.collect(),
            ..Arguments::new("default", "reader")
        };
        load(&READER, &arguments).expect("a configuration").values()
    }

    #[test]
    fn relative_paths_start_at_the_file_that_names_them_not_at_the_working_directory() {
        let folder = tempfile::tempdir().expect("a folder");
        let component = folder.path().join("reader");
        let config = component.join("etc/config.toml");
        std::fs::create_dir_all(component.join("etc")).expect("a folder");
        std::fs::write(&config, "[parameters]\nlog = \"../run.log\"\n").expect("a file");
        let seen = values(Some(config.clone()), &[]);
        assert_eq!(seen.path("map"), component.join("house.map"), "a default");
        assert_eq!(seen.path("log"), component.join("../run.log"));
        let network = folder.path().join("networks/reader.toml");
        std::fs::create_dir(folder.path().join("networks")).expect("a folder");
        std::fs::write(&network, "[parameters]\nlog = \"run.log\"\n").expect("a file");
        let seen = values(Some(network.clone()), &[]);
        assert_eq!(seen.path("log"), network.with_file_name("run.log"));
        let here = std::env::current_dir().expect("a folder");
        let seen = values(Some(config), &[("map", "own.map")]);
        assert_eq!(seen.path("map"), here.join("own.map"), "a command line");
        let seen = values(None, &[]);
        assert_eq!(seen.path("map"), Path::new("/built/reader/house.map"));
        assert_eq!(seen.path("log"), Path::new(""), "no file");
    }
}
