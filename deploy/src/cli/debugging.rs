//! Components that `up` starts under a debugger or valgrind, or builds with a sanitizer.

use super::output::{Failure, system};
use crate::process::own_program::own_program;
use clap::Args;
use rc_deploy_network::plan::{Component, Plan};
use rc_deploy_network::{Network, Sanitizer};
use rc_middleware::RunDirectory;
use rc_vocabulary::{Restart, RestartPolicy, shell};
use rustix::io::FdFlags;
use std::ffi::OsString;
use std::io;
use std::os::fd::{AsFd, AsRawFd, OwnedFd};
use std::os::unix::net::UnixListener;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;
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
            let refuse = |reason: &str| Err(Failure(1, format!("--sanitize {name}: {reason}")));
            if self.sanitize.iter().filter(|(one, _)| one == name).count() > 1 {
                return refuse("a program has one sanitizer");
            }
            if self.valgrind.contains(name) {
                return refuse("valgrind cannot run a program with a sanitizer");
            }
            let at = self.alone(network, "--sanitize", name)?;
            let chosen = network.programs.sanitize(at, *sanitizer);
            chosen.or_else(|reason| refuse(&reason))?;
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
        let directory = RunDirectory::of(&plan.network);
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
                component.ready = component.ready.saturating_mul(SLOWER);
                component.stop = component.stop.saturating_mul(SLOWER);
                let hung = &mut component.restart.hung;
                *hung = hung.map(|limit| limit.saturating_mul(SLOWER));
            } else if self.debug.contains(&component.name) {
                let socket = directory.path().join(format!("{}.gdb", component.name));
                notes.push(format!(
                    "{} waits for gdb: `gdb -ex {} {}` in another terminal, then `continue`",
                    component.name,
                    shell::word(&format!("target remote {}", socket.display())),
                    shell::word(&component.executable.to_string_lossy())
                ));
                under(component, "gdbserver", Vec::new());
                behind_socket(component, &socket)?;
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

/// Lets this program start the gdbserver of a component, see [`serve_gdb`].
fn behind_socket(component: &mut Component, socket: &Path) -> Result<(), Failure> {
    let own = own_program().map_err(|e| system(&e))?;
    let gdbserver = std::mem::replace(&mut component.executable, own);
    let words = [Path::new("gdbserver"), socket, &gdbserver];
    let words = words.map(|word| word.to_string_lossy().into_owned());
    component.args.splice(..0, words);
    Ok(())
}

/// Waits for a connection to a new socket, then is the gdbserver of a component: `command` is gdbserver, the
/// program, and its arguments. Listening itself, gdbserver would let the whole network in, and whoever
/// connects may run anything.
pub(super) fn serve_gdb(socket: &Path, command: &[OsString]) -> Result<u8, Failure> {
    let failed = |e: io::Error| Failure(3, format!("gdbserver at {}: {e}", socket.display()));
    let [gdbserver, program @ ..] = command else {
        return Err(Failure(2, "there is no command".to_owned()));
    };
    // gdbserver has the connection as its standard input and output, so the program gets that of this
    // process from another descriptor. A shell takes numbers of one digit.
    let input = io::stdin().as_fd().try_clone_to_owned().map_err(failed)?;
    let number = input.as_raw_fd();
    if number > 9 {
        return Err(failed(io::Error::other("too many open files")));
    }
    rustix::io::fcntl_setfd(&input, FdFlags::empty()).map_err(|e| failed(e.into()))?;
    let accept = || -> io::Result<OwnedFd> {
        match std::fs::remove_file(socket) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let connection = UnixListener::bind(socket)?.accept()?.0;
        // The end of the network removes it, too.
        let _ = std::fs::remove_file(socket);
        Ok(connection.into())
    };
    let connection = accept().map_err(failed)?;
    let copy = connection.try_clone().map_err(failed)?;
    // gdbserver quotes the program and its arguments for the shell, but not the words of the wrapper.
    let restore = format!("'exec 0<&{number} {number}<&- \"$@\"'");
    let error = Command::new(gdbserver)
        .args(["--wrapper", "/bin/sh", "-c", &restore, "sh", "--", "-"])
        .args(program)
        .env("SHELL", "/bin/sh")
        .stdin(connection)
        .stdout(copy)
        .exec();
    Err(failed(error))
}
