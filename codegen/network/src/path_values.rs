//! Values of type `path`, and where relative ones start.

use crate::parameters::OverriddenParameters;
use rc_codegen::Project;
use rc_configuration::model::{Kind, Parameter, Type};
use rc_configuration::{PathFolders, Values, folder_of_paths};
use std::path::{Path, PathBuf};

/// The existing files that a component's parameters name: relative values of type `path`. Those of
/// its configuration are found as the component finds them; those that the network sets start at
/// `directory`, and are left out without one.
pub(crate) fn named_files(
    project: &Project,
    config: Option<&Path>,
    parameters: &OverriddenParameters,
    directory: Option<&Path>,
) -> Vec<PathBuf> {
    let (Some(model), Some(values)) = (&project.parameters, &parameters.values) else {
        return Vec::new();
    };
    let folders = path_folders(config, project);
    let mut paths = Vec::new();
    path_values(&model.parameters, values, &folders, "", &mut paths);
    let files = paths.into_iter().filter_map(|value| {
        let from = if parameters.is_set(&value.name) {
            directory?
        } else {
            value.folder
        };
        let path = value.path;
        (path.is_relative() && !path.as_os_str().is_empty()).then(|| from.join(path))
    });
    files.filter(|path| path.is_file()).collect()
}

/// Where the relative paths of a component start, which has this configuration.
pub(crate) fn path_folders(config: Option<&Path>, project: &Project) -> PathFolders {
    PathFolders {
        configuration: config.map_or(project.code(), folder_of_paths).to_path_buf(),
        defaults: project.code().to_path_buf(),
    }
}

/// A value of type `path` as it is written.
pub(crate) struct PathValue<'p> {
    /// The path of its parameter, without the place in an array.
    pub(crate) name: String,
    pub(crate) parameter: &'p Parameter,
    /// Where it starts, unless the network sets it.
    pub(crate) folder: &'p Path,
    pub(crate) path: PathBuf,
}

/// Adds the values of type `path`.
pub(crate) fn path_values<'p>(
    parameters: &'p [Parameter],
    values: &Values,
    folders: &'p PathFolders,
    within: &str,
    out: &mut Vec<PathValue<'p>>,
) {
    for parameter in parameters {
        let name = &parameter.name;
        let path = format!("{within}{name}");
        match &parameter.kind {
            Kind::Scalar {
                ty: Type::Path,
                array,
            } => {
                let paths = match array {
                    Some(_) => values.paths(name),
                    None => vec![values.path(name)],
                };
                let Some(value) = values.value(name) else {
                    continue;
                };
                let folder = folders.of(parameter, value);
                out.extend(paths.into_iter().map(|file| PathValue {
                    name: path.clone(),
                    parameter,
                    folder,
                    path: file,
                }));
            }
            Kind::Scalar { .. } => {}
            Kind::Group(parameters) => {
                let within = format!("{path}.");
                path_values(parameters, values.group(name), folders, &within, out);
            }
            Kind::List { parameters, .. } => {
                for (at, element) in values.list(name).iter().enumerate() {
                    let within = format!("{path}[{at}].");
                    path_values(parameters, element, folders, &within, out);
                }
            }
        }
    }
}
