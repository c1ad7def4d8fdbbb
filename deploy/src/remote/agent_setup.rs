//! `rcdeploy agent` until it is ready: it receives files and takes the network of its machine.

use super::SupervisorMessage;
use super::agent::Agent;
use super::copied_list;
use super::copies;
use super::known_hashes::KnownHashes;
use super::timed_stream::{Beat, TimedStream, read_line};
use crate::guard::lock::Lock;
use crate::guard::process_registry::{Recovered, recover_locked};
use rc_deploy_client::error::{Error, ErrorContext, print_error};
use rc_deploy_client::names::check_name;
use rc_deploy_network::plan::Environment;
use rc_management::agent::{AgentMessage, File};
use rc_management::lines;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::io::{self, BufReader, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// How long it waits for an earlier agent of the network to end.
const PATIENCE: Duration = Duration::from_secs(15);

/// Runs the agent: `rcdeploy agent`, which people never type.
///
/// `cleanup` removes the memory of the middleware for a network. It is also called if there is
/// nothing to remove.
pub fn agent(cleanup: &dyn Fn(&str)) -> ExitCode {
    match serve(cleanup) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let said = std::io::stdout()
                .write_all(&lines::encode(&AgentMessage::Refused(error.to_string())));
            if said.is_err() {
                print_error(format_args!("rcdeploy agent: {error}"));
            }
            ExitCode::from(error.exit_code())
        }
    }
}

fn serve(cleanup: &dyn Fn(&str)) -> Result<(), Error> {
    let _ = rustix::process::setsid();
    let nonblocking = |fd: &OwnedFd| {
        let flags = fcntl_getfl(fd)?;
        fcntl_setfl(fd, flags | OFlags::NONBLOCK)
    };
    let [stdin, stdout] = [
        io::stdin().as_fd().try_clone_to_owned(),
        io::stdout().as_fd().try_clone_to_owned(),
    ];
    let stdin = stdin.context("use its standard input")?;
    let stdout = stdout.context("use its standard output")?;
    nonblocking(&stdin).context("use its standard input")?;
    nonblocking(&stdout).context("use its standard output")?;
    let mut input = BufReader::new(TimedStream(stdin));
    let mut output = TimedStream(stdout);
    let SupervisorMessage::Network {
        name,
        files,
        environments,
        services,
        memory_pause_ms,
    } = first(&mut input)?
    else {
        return Err(not_a_supervisor());
    };
    check_name("network", &name)?;
    let cleanup = || cleanup(&name);
    // The copies may be those of a running network.
    let lock = acquire(&name, &mut output)?;
    let recovered = match recover_locked(&lock, &cleanup)? {
        Recovered::Killed(count) => Some(count),
        Recovered::Nothing => None,
    };
    let directory = lock.directory().clone();
    let copied = copy(&name, &files, &environments, &mut input, &mut output);
    // Nothing was started yet. The first error is reported.
    let root = copied.inspect_err(|_| drop(directory.remove()))?;
    let pause = Duration::from_millis(memory_pause_ms);
    let agent = Agent::new(&name, root.clone(), lock, &services, pause, input, output);
    let mut agent = agent.inspect_err(|_| drop(directory.remove()))?;
    agent.send(&AgentMessage::Ready { root, recovered });
    agent.run(&cleanup);
    Ok(())
}

/// The first message that says something.
fn first(input: &mut BufReader<TimedStream>) -> Result<SupervisorMessage, Error> {
    loop {
        let line = read_line(input).map_err(|(_, error)| error);
        let line = line.context("hear its supervisor")?;
        match serde_json::from_str(&line) {
            // It reads the files that it describes.
            Ok(SupervisorMessage::Heartbeat) => {}
            message => return message.map_err(|_| not_a_supervisor()),
        }
    }
}

fn not_a_supervisor() -> Error {
    let message = "only `rcdeploy up` of this very version starts `agent`, over ssh";
    Error::Plan(message.to_owned())
}

/// Makes the copies of the network those of its supervisor, and gives copied packages an
/// interpreter. Returns the folder of the copies.
fn copy(
    network: &str,
    files: &[File],
    environments: &[Environment],
    input: &mut BufReader<TimedStream>,
    output: &mut TimedStream,
) -> Result<PathBuf, Error> {
    let program = std::env::current_exe().context("find out which program this is")?;
    copies::remove_unused(&program);
    let root = copies::root(&program, network);
    let root = root.context(format!(
        "make the folder of the copies beside {}",
        program.display()
    ))?;
    let mut beat = Beat::new();
    // Old files may be in the way of received ones.
    copied_list::renew(files, &root, &mut || {
        beat.send_due(&AgentMessage::Heartbeat, output)
    })?;
    receive(files, &root, &mut beat, input, output)?;
    for environment in environments {
        let there = Environment {
            folder: copies::mirrored(&root, &environment.folder),
            ..environment.clone()
        };
        let mut step = || output.write_all(&lines::encode(&AgentMessage::Heartbeat));
        there
            .complete(&mut step)
            .map_err(|error| Error::Plan(error.to_string()))?;
    }
    Ok(root)
}

/// Receives the files that are missing here.
fn receive(
    files: &[File],
    root: &Path,
    beat: &mut Beat,
    input: &mut BufReader<TimedStream>,
    output: &mut TimedStream,
) -> Result<(), Error> {
    let mut step = |output: &mut TimedStream| beat.send_due(&AgentMessage::Heartbeat, output);
    let mut known = KnownHashes::read(copies::beside(root, "hashes"));
    let mut wanted = Vec::new();
    for (at, file) in files.iter().enumerate() {
        let is_below = copies::is_below(file, root, &mut known, &mut || step(output));
        if !is_below.context("answer its supervisor")? {
            wanted.push(at);
        }
    }
    output
        .write_all(&lines::encode(&AgentMessage::Missing(wanted.clone())))
        .context("answer its supervisor")?;
    for at in wanted {
        let file = &files[at];
        let received = copies::receive(file, root, input, &mut || step(output));
        received.context(format!("copy {}", file.path.display()))?;
        known.keep_own(&copies::mirrored(root, &file.path), &file.hash);
    }
    known.finish();
    Ok(())
}

/// Takes the network. An earlier agent whose connection has ended may still hold it for a moment.
fn acquire(network: &str, output: &mut TimedStream) -> Result<Lock, Error> {
    let deadline = Instant::now() + PATIENCE;
    loop {
        match Lock::acquire_for_agent(network) {
            Err(Error::AlreadyUp { .. } | Error::CleaningUp { .. })
                if Instant::now() < deadline =>
            {
                output
                    .write_all(&lines::encode(&AgentMessage::Heartbeat))
                    .context("answer its supervisor")?;
                std::thread::sleep(Duration::from_millis(200));
            }
            result => return result,
        }
    }
}
