//! Reads the description of a network and prints its mistakes.

use super::arguments::Input;
use super::output::{Failure, counted, print_findings, print_line, print_note, system};
use super::transport;
use crate::process::machine;
use rc_codegen::{FileLoader, installed};
use rc_deploy_network::{Network, Overrides};
use rc_diagnostics::{Diagnostics, Severity, SourceMap};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Reads a network and prints nothing.
fn read_silently(
    input: &Input,
    loader: &FileLoader,
) -> Result<(Option<Network>, SourceMap, Diagnostics), Failure> {
    let ending = input.file.extension().and_then(|ending| ending.to_str());
    if let Some("cdsl" | "idsl" | "pdsl" | "smdsl" | "scxml") = ending {
        let file = input.file.display();
        let message = format!("{file} is not a network; `rcgen check {file}` checks it");
        return Err(Failure(2, message));
    }
    let mut sources = SourceMap::new();
    let transports = transport::measured()?;
    let overrides = Overrides {
        transports: &transports,
        middleware: input.middleware,
        parameters: &input.set,
    };
    let (network, found) = rc_deploy_network::load(&input.file, &overrides, &mut sources, loader)
        .map_err(|error| {
        let help = copy_installed(&input.file, &error);
        let help = help.or_else(|| network_at(&input.file, &error));
        let help = help.unwrap_or_default();
        system(&format!("{}: {error}{help}", input.file.display()))
    })?;
    Ok((network, sources, found))
}

/// Advice for a file that is missing here and has the name of an installed network: components write
/// into the folder of their network, which is not that of packages.
fn copy_installed(file: &Path, error: &std::io::Error) -> Option<String> {
    let installed = installed::network(file).filter(|_| error.kind() == ErrorKind::NotFound)?;
    let copy = file.with_extension("ddsl");
    Some(format!(
        "; a network of this name is installed: `cp {} {}` copies it",
        installed.display(),
        copy.display()
    ))
}

/// The network that a folder, or a name without ending, most likely means, after the error of reading it.
fn network_at(path: &Path, error: &std::io::Error) -> Option<String> {
    let is_network = |file: &PathBuf| file.extension().is_some_and(|ending| ending == "ddsl");
    if !path.is_dir() {
        // A file that is there and cannot be read is the one that was meant.
        if error.kind() != ErrorKind::NotFound {
            return None;
        }
        let named = path.with_extension("ddsl");
        return named
            .exists()
            .then(|| format!("; did you mean `{}`?", named.display()));
    }
    let entries = std::fs::read_dir(path).ok()?.flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(is_network)
        .collect();
    files.sort();
    Some(match files.first() {
        Some(file) => format!("; a network is a file, such as `{}`", file.display()),
        None => "; a network is a .ddsl file".to_owned(),
    })
}

/// Reads a network, runs further checks (`more`), and prints the findings.
pub(super) fn read(
    input: &Input,
    format: rc_diagnostics::Format,
    more: impl FnOnce(&Network, &mut Diagnostics),
) -> Result<(Option<Network>, SourceMap, Diagnostics), Failure> {
    let (network, sources, mut found) = read_silently(input, &FileLoader::new(&input.include))?;
    if let Some(network) = &network {
        more(network, &mut found);
    }
    print_findings(&sources, &found, format);
    Ok((network, sources, found))
}

/// Generates the components of a network whose generated code is missing or stale. A network with
/// errors is left alone: they are reported when it is read again.
pub(super) fn generate_stale(input: &Input) -> Result<(), Failure> {
    let loader = FileLoader::new(&input.include);
    let (network, mut sources, found) = read_silently(input, &loader)?;
    let Some(network) = network.filter(|_| !found.has_errors()) else {
        return Ok(());
    };
    let generated = network.programs.generate_stale(&mut sources, &loader)?;
    for component in &generated.components {
        print_note(&format_args!("generated {}", component.display()));
    }
    let human = rc_diagnostics::Format::Human;
    print_findings(&sources, &generated.found, human);
    if generated.found.has_errors() {
        return Err(Failure(1, String::new()));
    }
    Ok(())
}

/// Reads a network that must have no errors.
pub(super) fn load(
    input: &Input,
    format: rc_diagnostics::Format,
    more: impl FnOnce(&Network, &mut Diagnostics),
) -> Result<Network, Failure> {
    let (network, _, found) = read(input, format, more)?;
    network
        .filter(|_| !found.has_errors())
        .ok_or(Failure(1, String::new()))
}

/// The further checks of commands that start nothing.
pub(super) fn examine(input: &Input, unbuilt: bool) -> impl FnOnce(&Network, &mut Diagnostics) {
    move |network, found| {
        if !unbuilt {
            machine::check(network, false, found);
            network.programs.check_generated(found);
            network.programs.check_programs(input.profile, found);
        }
    }
}

pub(super) fn check(input: &Input, format: rc_diagnostics::Format) -> Result<u8, Failure> {
    let (network, _, found) = read(input, format, examine(input, false))?;
    let network = network
        .filter(|_| !found.has_errors())
        .ok_or(Failure(1, String::new()))?;
    if format == rc_diagnostics::Format::Human {
        let (components, connections) = (
            network.projects.len(),
            network.connections.connections.len(),
        );
        let warnings = found.iter().filter(|one| one.severity == Severity::Warning);
        let verdict = match warnings.count() {
            0 => "nothing wrong".to_owned(),
            count => counted(count as u64, "warning"),
        };
        print_line(format_args!(
            "{}: {}, {}, {verdict}",
            network.name(),
            counted(components as u64, "component"),
            counted(connections as u64, "connection")
        ));
    }
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::network_at;
    use std::io::{Error, ErrorKind};

    #[test]
    fn a_folder_and_a_name_lead_to_the_network() {
        let folder = tempfile::tempdir().expect("a folder");
        let missing = Error::from(ErrorKind::NotFound);
        let at = |name: &str| network_at(&folder.path().join(name), &missing);
        let is_folder = Error::from(ErrorKind::IsADirectory);
        let told = network_at(folder.path(), &is_folder);
        assert_eq!(told.as_deref(), Some("; a network is a .ddsl file"));
        let file = folder.path().join("robot.ddsl");
        std::fs::write(&file, "").expect("a file");
        let shown = file.display();
        assert_eq!(at("robot"), Some(format!("; did you mean `{shown}`?")));
        assert_eq!(at("other"), None);
        let refused = Error::from(ErrorKind::PermissionDenied);
        assert_eq!(network_at(&file, &refused), None);
        let told = network_at(folder.path(), &is_folder);
        let wanted = format!("; a network is a file, such as `{shown}`");
        assert_eq!(told, Some(wanted));
    }
}
