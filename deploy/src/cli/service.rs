//! `rcdeploy install-service`: a unit of systemd that runs a network.

use super::arguments::Input;
use super::description::load;
use super::export;
use super::output::{Failure, print_data, print_line, print_note, system};
use crate::doctor::{Logout, Machine};
use crate::process::machine;
use crate::supervisor::detach::stop_limit;
use rc_deploy_client::connection;
use rc_deploy_export::{Export, INSTALLED, Supervised, supervised, supervisor_unit};
use rc_deploy_network::Network;
use std::ffi::OsString;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Where systemd looks for units of the system that packages do not own.
const SYSTEM: &str = "/etc/systemd/system";

/// The manager that runs a network.
struct Manager {
    /// The folder of its units.
    folder: PathBuf,
    /// The user of a unit of the system: its name and number.
    user: Option<(String, u32)>,
}

impl Manager {
    fn of(input: &Input, is_system: bool) -> Result<Self, Failure> {
        if is_system {
            // The owner of the target of a link: whoever made the link does not choose the user.
            let owner = input
                .file
                .metadata()
                .map_err(|error| system(&format_args!("{}: {error}", input.file.display())))?;
            let variable = |name: &str| std::env::var(name).ok();
            let name = of_user(owner.uid(), &variable).user_name();
            return Ok(Self {
                folder: SYSTEM.into(),
                user: Some((name, owner.uid())),
            });
        }
        let variable = |name| std::env::var_os(name).filter(|value: &OsString| !value.is_empty());
        let home = || Some(PathBuf::from(variable("HOME")?).join(".config"));
        let config = variable("XDG_CONFIG_HOME").map(PathBuf::from);
        let Some(config) = config.filter(|path| path.is_absolute()).or_else(home) else {
            return Err(system(&"HOME is not set, below which units of a user are"));
        };
        Ok(Self {
            folder: config.join("systemd/user"),
            user: None,
        })
    }

    /// Runs `systemctl`.
    fn tell(&self, words: &[&str]) -> Result<(), Failure> {
        let mut all = Vec::new();
        if self.user.is_none() {
            all.push("--user");
        }
        all.extend(words);
        run("systemctl", &all).map_err(|reason| {
            let advice = if self.user.is_some() {
                "; it needs root"
            } else {
                "; a login by `su` or `sudo` has no manager: log in by ssh, or use --system"
            };
            system(&format_args!(
                "`systemctl {}`: {reason}{advice}",
                all.join(" ")
            ))
        })
    }

    /// Lets the user linger, so that the memory of the network stays at a logout, or says how.
    fn linger(&self) {
        let user = self.user.as_ref().map(|(_, number)| *number);
        let Some(logout) = logout(user) else {
            return;
        };
        let Some((found, fix)) = logout.ends_service() else {
            return;
        };
        if run("loginctl", &["enable-linger", logout.user()]).is_ok() {
            print_line(format_args!("{fix}"));
        } else {
            print_note(&format_args!("{found}; prevent it with `sudo {fix}`"));
        }
    }
}

/// What the logout of a user does, or that of this one. `None` if it does nothing.
pub(super) fn logout(user: Option<u32>) -> Option<Logout> {
    let user = user.unwrap_or_else(|| rustix::process::getuid().as_raw());
    let variable = |name: &str| std::env::var(name).ok();
    of_user(user, &variable).logout().ok()
}

/// This machine, as it is for a user.
fn of_user(user: u32, variable: &dyn Fn(&str) -> Option<String>) -> Machine<'_> {
    Machine {
        root: "/".into(),
        variable,
        user,
        folder: PathBuf::new(),
    }
}

/// Runs a program. An error has its last line.
fn run(program: &str, words: &[&str]) -> Result<(), String> {
    let mut command = Command::new(program);
    let output = command.args(words).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program} cannot be started: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty());
    Err(rc_diagnostics::foreign::clean(last.unwrap_or("it failed")))
}

/// The network, and its unit.
fn unit(input: &Input, manager: &Manager) -> Result<(Network, Export), Failure> {
    let network = load(input, rc_diagnostics::Format::Human, |network, found| {
        machine::check(network, true, found);
        network.programs.check_programs(input.profile, found);
    })?;
    let plan = network.plan(input.profile)?;
    let own = std::env::current_exe().map_err(|e| system(&e))?;
    let mut command = vec![own.to_string_lossy().into_owned()];
    command.extend(["up", "--plain"].map(str::to_owned));
    command.extend(input.words().map_err(|e| system(&e))?);
    let path = std::path::absolute(&network.path).map_err(|e| system(&e))?;
    let folder = path.parent().unwrap_or(&path);
    // systemd has no quotes for a folder, and joins a line that ends with a backslash with the next one.
    let is_line = |path: &Path| {
        let text = path.to_str();
        text.is_some_and(|text| !text.contains(char::is_control) && !text.ends_with('\\'))
    };
    if let Some(path) = [folder, &path].into_iter().find(|path| !is_line(path)) {
        let path = rc_diagnostics::foreign::clean(&path.to_string_lossy());
        let message = format!(
            "`{path}`: a unit of systemd only holds paths in UTF-8 without control characters, and without a backslash at the end; rename it"
        );
        return Err(Failure(2, message));
    }
    let priorities = plan.components.iter().map(|component| component.priority);
    let export = supervised(&Supervised {
        network: network.name(),
        file: &network
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy(),
        command: &command,
        directory: folder,
        user: manager.user.as_ref().map(|(name, _)| name.as_str()),
        stop: stop_limit(&plan),
        priority: priorities.max().flatten(),
    });
    Ok((network, export))
}

/// Prints the unit.
pub(super) fn show(input: &Input, is_system: bool) -> Result<u8, Failure> {
    let manager = Manager::of(input, is_system)?;
    let (_, export) = unit(input, &manager)?;
    export
        .files
        .iter()
        .for_each(|(_, _, text)| print_data(text));
    Ok(0)
}

/// Writes the unit, enables it, and starts it.
pub(super) fn install(input: &Input, is_system: bool, starts: bool) -> Result<u8, Failure> {
    let manager = Manager::of(input, is_system)?;
    let (network, export) = unit(input, &manager)?;
    let name = network.name();
    let own = supervisor_unit(name);
    let is_known = manager.folder.join(&own).exists();
    if starts && !is_known && connection::networks().iter().any(|known| known == name) {
        return Err(Failure(
            1,
            format!("network {name} is up already; end it first with `rcdeploy down {name}`"),
        ));
    }
    export::write(&export, &manager.folder, INSTALLED, false)?;
    manager.tell(&["daemon-reload"])?;
    manager.tell(&["enable", &own])?;
    manager.linger();
    if starts {
        // A network that runs may take long to stop.
        manager.tell(&["--no-block", "restart", &own])?;
    }
    let user = if manager.user.is_some() {
        ""
    } else {
        "--user "
    };
    print_line(format_args!(
        "`rcdeploy status {name}` shows the network, `journalctl {user}-u {own}` its log"
    ));
    Ok(0)
}

/// Stops the unit, and removes it.
pub(super) fn remove(input: &Input, is_system: bool) -> Result<u8, Failure> {
    let manager = Manager::of(input, is_system)?;
    let network = load(input, rc_diagnostics::Format::Human, |_, _| {})?;
    let own = supervisor_unit(network.name());
    let path = manager.folder.join(&own);
    let text = rc_files::read(&path)
        .map_err(|error| system(&format_args!("{}: {error}", path.display())))?;
    if !text.starts_with(INSTALLED) {
        let message = format!("{} was not written by this command", path.display());
        return Err(Failure(2, message));
    }
    // The network has ended before the unit goes, which has the limit of its stop.
    manager.tell(&["disable", "--now", &own])?;
    std::fs::remove_file(&path)
        .map_err(|error| system(&format_args!("{}: {error}", path.display())))?;
    manager.tell(&["daemon-reload"])?;
    print_line(format_args!("remove {}", path.display()));
    Ok(0)
}
