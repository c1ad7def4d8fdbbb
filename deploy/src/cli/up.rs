//! `rcdeploy up`, with the processes that it starts: the guard, and the agents of other machines.

use super::TOOL;
use super::again::in_background;
use super::arguments::Input;
use super::command::Cli;
use super::debugging::Debugging;
use super::description::{generate_stale, load};
use super::output::{Failure, print_line, print_note, system};
use super::service::logout;
use crate::doctor::{Logout, processor};
use crate::guard::services;
use crate::process::identity::{Identity, Mark};
use crate::process::machine;
use crate::process::own_program::{own_program, own_program_of_this_process};
use crate::{Options, Service, remote};
use rc_ddsl::model::Processor;
use rc_deploy_client::error::print_error;
use rc_deploy_client::{logs, status};
use rc_deploy_network::{Build, Network, NetworkRules, Next, Profile, Site};
use rc_diagnostics::Diagnostics;
use rc_middleware::RunDirectory;
use std::process::Command as Process;

/// Step of `up --build` before cargo builds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Prepare {
    /// Generates missing or stale code.
    Generated,
    /// Nothing: stale code is an error.
    AsIs,
}

pub(super) fn up(
    input: &Input,
    build: Option<Prepare>,
    detach: bool,
    debugging: &Debugging,
    options: &Options,
) -> Result<u8, Failure> {
    let human = rc_diagnostics::Format::Human;
    if build == Some(Prepare::Generated) {
        generate_stale(input)?;
    }
    let network = if build.is_some() {
        let mut said = Vec::new();
        let network = load(input, human, |network, found| {
            machine::check(network, true, found);
            said = ask_hosts(network);
            network.programs.check_hosts(found);
            network.programs.check_generated(found);
            network.programs.check_interpreters(Next::IsBuilt, found);
        })?;
        debugging.prepare(&network)?;
        declare(&network, &said, detach)?;
        cargo_build(&network, input.profile)?;
        let mut found = Diagnostics::new();
        network.programs.check_programs(input.profile, &mut found);
        if found.is_empty() {
            network
        } else {
            load(input, human, |n, f| {
                // It is prepared as above.
                let _ = debugging.prepare(n);
                let said = said.into_iter();
                said.for_each(|(host, processor)| n.programs.host_says(host, processor));
                n.programs.check_programs(input.profile, f);
            })?
        }
    } else {
        let mut refused = Ok(());
        let network = load(input, human, |network, found| {
            refused = debugging.prepare(network);
            machine::check(network, true, found);
            network.programs.check_programs(input.profile, found);
        });
        refused?;
        network?
    };
    if network.projects.is_empty() {
        print_note(&format_args!(
            "{} has no components yet: add `Component NAME {{ cdsl \"…\"; }};`",
            input.file.display()
        ));
    }
    let mut plan = network.plan(input.profile)?;
    for note in debugging.wrap(&mut plan)? {
        print_note(&note);
    }
    let directory = RunDirectory::of(&plan.network);
    let names = plan
        .components
        .iter()
        .map(|component| component.name.as_str());
    check_sockets(&directory, names.chain(["rcdeploy"]))?;
    if detach {
        let logout = logout(None);
        let mut command = if logout.as_ref().is_some_and(Logout::needs_scope) {
            let own = own_program_of_this_process().map_err(|e| system(&e))?;
            // It becomes the supervisor, in a scope of the user's manager.
            let mut command = Process::new("systemd-run");
            command.args(["--user", "--scope", "--quiet", "--collect", "--"]);
            command.arg(own);
            command
        } else {
            Process::new(own_program().map_err(|e| system(&e))?)
        };
        let words = in_background(TOOL.command::<Cli>(), std::env::args_os());
        command.args(words.map_err(|e| system(&e))?);
        let outcome = crate::detach(&plan, command);
        if let Some(message) = outcome.message() {
            return Err(Failure(outcome.exit_code(), message));
        }
        print_line(format_args!(
            "{}",
            status::table(&crate::status(&plan.network)?).trim_end()
        ));
        // sshd sets this variable.
        if std::env::var_os("SSH_CONNECTION").is_some()
            && let Some((found, advice)) = logout.and_then(|logout| logout.ends())
        {
            print_note(&format_args!("{found}; {advice}"));
        }
        return Ok(outcome.exit_code());
    }
    let options = Options {
        hold: Service::all(&network, None),
        services: Service::elsewhere(&network),
        rules: NetworkRules::of(&network),
        ..options.clone()
    };
    let name = plan.network.clone();
    Ok(crate::up(&plan, &options, &|| wipe(&name)).exit_code())
}

/// The longest path of a socket in bytes, see unix(7).
const MAX_SOCKET_PATH: usize = 107;

/// Refuses a run directory in which a component could not open its socket.
fn check_sockets<'n>(
    directory: &RunDirectory,
    names: impl Iterator<Item = &'n str>,
) -> Result<(), Failure> {
    let paths = names.map(|name| directory.socket(&name.replace('.', "-")));
    let Some(longest) = paths.max_by_key(|path| path.as_os_str().len()) else {
        return Ok(());
    };
    let length = longest.as_os_str().len();
    if length <= MAX_SOCKET_PATH {
        return Ok(());
    }
    Err(Failure(
        3,
        format!(
            "the path of a socket has at most {MAX_SOCKET_PATH} bytes, and {} has {length}; set XDG_RUNTIME_DIR to a folder with a shorter path, or shorten the names of network and component",
            longest.display()
        ),
    ))
}

/// Asks the hosts whose processor the file does not name. One that does not answer counts as one like
/// this machine: its connection explains the failure.
fn ask_hosts(network: &Network) -> Vec<(usize, Processor)> {
    let Some(mark) = mark(network) else {
        return Vec::new();
    };
    let unknown = network.programs.unknown_hosts().into_iter();
    let said = unknown.filter_map(|host| {
        let processor = processor(&network.programs.host(host), &mark)?;
        network.programs.host_says(host, processor);
        Some((host, processor))
    });
    said.collect()
}

/// Tells of hosts that have said that they have another processor. The file has to name it for a network
/// in the background, whose supervisor reads it again.
fn declare(network: &Network, said: &[(usize, Processor)], detach: bool) -> Result<(), Failure> {
    for (host, processor) in said {
        if network.programs.site_of_host(*host) == Site::Own {
            continue;
        }
        let name = &network.deployment.hosts[*host].name.text;
        let told = format!(
            "host {name} says that it is {processor}; write `arch {processor};` in its `Host`"
        );
        if detach {
            return Err(Failure(1, told));
        }
        print_note(&format_args!(
            "{told}, so that commands without `--build` know it"
        ));
    }
    Ok(())
}

/// The mark of the processes that this one starts for a network.
fn mark(network: &Network) -> Option<Mark> {
    Identity::own().map(|own| Mark::new(network.name(), own))
}

/// Lets a host build.
fn build_there(network: &Network, build: &Build, host: usize) -> Result<(), Failure> {
    let planned = network.programs.host(host);
    let declared = &network.deployment.hosts[host].build;
    let mark = mark(network).ok_or_else(|| system(&"/proc cannot be read"))?;
    let own = remote::own_hash().map_err(|e| system(&e))?;
    let logs = logs::open_directory(network.name()).map_err(|e| system(&e))?;
    let order = remote::there::Order {
        host: &planned,
        build,
        network: network.name(),
        jobs: declared.jobs,
        nice: declared.nice,
        own: &own,
        hashes: logs.join(format!(".{}.sources.json", planned.name)),
    };
    let built = remote::there::build(&order, &mark);
    built.map_err(|why| Failure(3, format!("host {} did not build: {why}", planned.name)))
}

fn cargo_build(network: &Network, profile: Profile) -> Result<(), Failure> {
    for build in network.programs.builds(profile)? {
        let build = build?;
        if let Site::There(host) = build.site
            && !build.args.is_empty()
        {
            build_there(network, &build, host)?;
            build.finish()?;
            continue;
        }
        if build.args.is_empty() {
            build.finish()?;
            continue;
        }
        let mut cargo = Process::new(rc_deploy_network::cargo());
        if let Some(target) = rc_deploy_network::target_variable() {
            cargo.env("CARGO_TARGET_DIR", target);
        }
        let status = cargo
            .current_dir(&build.root)
            .args(&build.args)
            .status()
            .map_err(|e| system(&format!("cargo cannot be started: {e}")))?;
        if !status.success() {
            return Err(Failure(
                3,
                format!("cargo could not build {}", build.packages.join(", ")),
            ));
        }
        build.finish()?;
    }
    Ok(())
}

/// Runs the process that cleans up when its supervisor has ended.
pub(super) fn guard(network: &str) {
    // Its exit code has no reader: its supervisor has ended.
    let _ = crate::guard(network, services::hold, &|| wipe(network));
}

/// Runs the agent of a supervisor on another machine.
pub(super) fn agent() {
    // Its exit code has no reader: it sends errors to its supervisor.
    let _ = crate::agent(&wipe);
}

/// Removes the memory of the default middleware for a network.
fn wipe(network: &str) {
    if let Err(error) = rc_iceoryx2::wipe(&RunDirectory::of(network)) {
        print_error(format_args!(
            "rcdeploy: the shared memory of {network} was not removed: {error}"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_long_a_path_of_a_socket_is_refused_before_anything_starts() {
        let directory = RunDirectory::of("patrol");
        assert!(check_sockets(&directory, ["avoider", "rcdeploy"].into_iter()).is_ok());
        let long = "a".repeat(MAX_SOCKET_PATH);
        let refused = check_sockets(&directory, ["avoider", &long].into_iter());
        let Err(Failure(3, message)) = refused else {
            panic!("it is accepted");
        };
        assert!(message.contains("set XDG_RUNTIME_DIR"), "{message}");
        assert!(message.contains(&long), "{message}");
    }
}
