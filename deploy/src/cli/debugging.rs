//! Components that `up` starts under a debugger or valgrind, or builds with a sanitizer.

use super::output::Failure;
use clap::Args;
use rc_deploy_network::plan::{Component, Plan};
use rc_deploy_network::{Network, Sanitizer};
use rc_vocabulary::{Restart, RestartPolicy};
use std::net::{Ipv4Addr, TcpListener};
use std::path::PathBuf;
use std::time::Duration;

/// How long a component may take until it is ready, while a person debugs it.
const UNHURRIED: Duration = Duration::from_hours(24);
/// How many times slower a program is under valgrind, at least for its limits.
const SLOWER: u32 = 30;

#[derive(Args)]
pub(super) struct Debugging {
    /// Starts this component under gdbserver. It waits until the printed gdb command continues it.
    #[arg(long, value_name = "NAME", conflicts_with = "detach")]
    debug: Vec<String>,
    /// Starts this component under valgrind, which reports wrong uses of memory in its log.
    #[arg(long, value_name = "NAME")]
    valgrind: Vec<String>,
    /// Uses a program of this component in C++ with a sanitizer: address, undefined or thread. `--build`
    /// builds it next to the usual one.
    #[arg(long, value_name = "NAME=KIND", value_parser = sanitized)]
    sanitize: Vec<(String, Sanitizer)>,
}

/// A component with its sanitizer.
fn sanitized(text: &str) -> Result<(String, Sanitizer), String> {
    let (name, sanitizer) = text
        .rsplit_once('=')
        .ok_or("expected NAME=KIND, as in avoider=address")?;
    Ok((name.to_owned(), sanitizer.parse()?))
}

impl Debugging {
    /// Whether a person debugs a component in another terminal, and needs to see the command.
    pub(super) fn is_interactive(&self) -> bool {
        !self.debug.is_empty()
    }

    /// Refuses what is not possible before anything is built, and chooses the programs with sanitizers.
    pub(super) fn prepare(&self, network: &Network) -> Result<(), Failure> {
        for (option, names, program, package) in [
            ("--debug", &self.debug, "gdbserver", "gdb gdbserver"),
            ("--valgrind", &self.valgrind, "valgrind", "valgrind"),
        ] {
            for name in names {
                self.alone(network, option, name)?;
            }
            if !names.is_empty() && program_path(program).is_none() {
                return Err(Failure(
                    3,
                    format!(
                        "there is no {program} in the path, which {option} needs; on Debian and Ubuntu: `apt install {package}`"
                    ),
                ));
            }
        }
        for (name, sanitizer) in &self.sanitize {
            let at = self.alone(network, "--sanitize", name)?;
            let chosen = network.programs.sanitize(at, *sanitizer);
            chosen.map_err(|reason| Failure(1, format!("--sanitize {name}: {reason}")))?;
        }
        Ok(())
    }

    /// The instance of this name, which has a process of its own on this machine.
    fn alone(&self, network: &Network, option: &str, name: &str) -> Result<usize, Failure> {
        let instances = &network.deployment.instances;
        let Some(at) = instances.iter().position(|one| one.path == name) else {
            let names: Vec<&str> = instances.iter().map(|one| one.path.as_str()).collect();
            let help = match rc_diagnostics::nearest(name, names.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {}", names.join(", ")),
            };
            return Err(Failure(
                2,
                format!("{option}: the network has no component `{name}`; {help}"),
            ));
        };
        let refuse = |reason: &str| Err(Failure(1, format!("{option} {name}: {reason}")));
        let uses = [&self.debug, &self.valgrind];
        let uses = uses.into_iter().flatten();
        if uses.filter(|one| *one == name).count() > 1 {
            return refuse(
                "gdb and valgrind cannot run one component together, nor one of them twice",
            );
        }
        if let Some(process) = &instances[at].process {
            return refuse(&format!(
                "it is a thread of the process `{}`; give it a process of its own meanwhile",
                process.text
            ));
        }
        if network.deployment.remote_host(&instances[at]).is_some() {
            return refuse(
                "it runs on another machine; attach `gdb -p PID` there, `rcdeploy status` prints the PID",
            );
        }
        Ok(at)
    }

    /// Changes how components are started. Returns notes for the user.
    pub(super) fn wrap(&self, plan: &mut Plan) -> Result<Vec<String>, Failure> {
        let mut notes = Vec::new();
        for (name, sanitizer) in &self.sanitize {
            for component in plan.components.iter_mut().filter(|one| one.name == *name) {
                for (variable, value) in sanitizer.environment() {
                    if std::env::var_os(variable).is_none() {
                        let variables = component.env.entry((*variable).to_owned());
                        variables.or_insert_with(|| (*value).to_owned());
                    }
                }
            }
        }
        for component in &mut plan.components {
            if self.valgrind.contains(&component.name) {
                let options = [
                    "--leak-check=full",
                    "--show-leak-kinds=definite",
                    "--num-callers=30",
                ];
                under(component, "valgrind", options.map(str::to_owned).to_vec());
                component.ready *= SLOWER;
                component.stop *= SLOWER;
            } else if self.debug.contains(&component.name) {
                let address = free_address()?;
                notes.push(format!(
                    "{} waits for gdb: `gdb -ex 'target remote {address}' {}` in another terminal, then `continue`",
                    component.name,
                    component.executable.display()
                ));
                let options = ["--once", "--no-startup-with-shell", &address];
                under(component, "gdbserver", options.map(str::to_owned).to_vec());
                component.ready = UNHURRIED;
                component.restart = Restart {
                    policy: RestartPolicy::Never,
                    hung: None,
                    ..component.restart
                };
            }
        }
        Ok(notes)
    }
}

/// Lets another program start a component.
fn under(component: &mut Component, program: &str, mut args: Vec<String>) {
    let Some(path) = program_path(program) else {
        return; // `prepare` has refused it
    };
    let executable = std::mem::replace(&mut component.executable, path);
    args.push(executable.to_string_lossy().into_owned());
    args.append(&mut component.args);
    component.args = args;
}

/// A program of the search path.
fn program_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let mut all = std::env::split_paths(&path).map(|folder| folder.join(name));
    all.find(|path| path.is_file())
}

/// An address of this machine where nobody listens now.
fn free_address() -> Result<String, Failure> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0));
    let address = listener.and_then(|listener| listener.local_addr());
    let address =
        address.map_err(|e| Failure(3, format!("there is no port for gdbserver: {e}")))?;
    Ok(address.to_string())
}
