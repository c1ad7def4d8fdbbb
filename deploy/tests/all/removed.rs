//! Networks whose files are removed while they run, or that are looked for in another environment.

use crate::bench::{Bench, Up, await_end, text, well};
use crate::pty::{SETSID, Terminal};
use rc_deploy::process::Identity;
use rc_management::supervisor::abstract_name;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType};
use rustix::net::{bind, connect, listen, socket_with};
use rustix::process::Signal;
use serde_json::Value;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// Runs `up` of another plan of the same network, which must not start.
fn is_refused(mut second: Command, first: Identity) {
    let second = second.output().expect("it runs");
    assert_eq!(second.status.code(), Some(3), "{second:?}");
    let told = text(&second.stdout);
    let process = format!("supervised by process {};", first.pid);
    assert!(told.contains(&process), "{told}");
}

/// Removes something of a network that runs. It is restored, a second `up` is refused before and
/// afterwards, and the network can be stopped.
fn survives(remove: impl FnOnce(&Path), what: &str) {
    let bench = Bench::new();
    let mut up = bench.start_well();
    let plan = bench.write(vec![well("a")]);
    remove(&bench.run_directory());
    is_refused(bench.driver(&["up", &plan, "--json"]), up.identity());
    let told = up.await_event("directory-restored", None);
    assert!(told.contains(what), "{told}");
    assert!(bench.run_directory().join("rcdeploy.sock").exists());
    assert!(bench.run_directory().join("components.json").exists());
    is_refused(bench.driver(&["up", &plan, "--json"]), up.identity());
    assert_eq!(bench.status().pid, up.identity().pid);
    let down = bench.command("down", &[]);
    assert!(down.status.success(), "{down:?}");
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
}

#[test]
fn a_network_survives_the_end_of_its_run_directory() {
    let remove = |directory: &Path| std::fs::remove_dir_all(directory).expect("it is ours");
    survives(remove, "its run directory ");
}

#[test]
fn a_network_survives_the_end_of_its_socket() {
    let remove = |directory: &Path| {
        std::fs::remove_file(directory.join("rcdeploy.sock")).expect("it is ours");
    };
    survives(remove, "its socket ");
}

/// The lock alone: the guard then shares the new one, and cleans up after a supervisor that is
/// killed.
#[test]
fn a_network_survives_the_end_of_its_lock() {
    let bench = Bench::new();
    let mut up = bench.start_well();
    std::fs::remove_file(bench.run_directory().join("rcdeploy.lock")).expect("it is ours");
    up.await_event("directory-restored", None);
    up.await_event("guard-ended", None);
    let components = bench.processes("a start");
    until("a new guard guards", || {
        let guard = bench.status().guard.and_then(Identity::of);
        guard.is_some_and(|guard| holds_nothing_of(guard, "deleted"))
    });
    up.kill();
    await_end(&components);
    until("the guard has cleaned up", || {
        !bench.run_directory().exists()
    });
}

/// Whether no descriptor of a process leads to a file with this in its name.
fn holds_nothing_of(process: Identity, word: &str) -> bool {
    let folder = format!("/proc/{}/fd", process.pid);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut targets = entries.filter_map(|entry| std::fs::read_link(entry.path()).ok());
    targets.all(|target| !target.to_string_lossy().contains(word))
}

fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let limit = Instant::now() + crate::bench::LIMIT;
    while !is_so() {
        assert!(Instant::now() < limit, "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A process that does not accept connections has the abstract socket of the network for a while.
#[test]
fn a_network_takes_its_abstract_socket_when_it_is_free() {
    let bench = Bench::new();
    let stranger = Stranger::at(&bench.network);
    let mut up = bench.start(vec![well("a")]);
    let told = up.await_event("unseen", None);
    assert!(told.contains("abstract socket"), "{told}");
    up.await_event("up", None);
    let held = |code: &str| {
        let troubles = bench.status().troubles;
        troubles.iter().any(|trouble| trouble.code == code)
    };
    assert!(held("unseen"));
    drop(stranger);
    up.await_event("seen", None);
    assert!(!held("unseen"));
    let mut second = bench.driver(&["up", &bench.write(vec![well("a")]), "--json"]);
    second.env("XDG_RUNTIME_DIR", bench.path("elsewhere"));
    std::fs::create_dir(bench.path("elsewhere")).expect("a folder");
    is_refused(second, up.identity());
    stop(&bench, up);
    bench.assert_nothing_left();
}

/// A full queue of connections at the abstract socket of a network.
#[expect(dead_code, reason = "the sockets are open until it is dropped")]
struct Stranger(Vec<OwnedFd>);

impl Stranger {
    fn at(network: &str) -> Self {
        let socket = |flags| {
            let socket = socket_with(AddressFamily::UNIX, SocketType::STREAM, flags, None);
            socket.expect("a socket")
        };
        let address = SocketAddrUnix::new_abstract_name(&abstract_name(network));
        let address = address.expect("an address");
        let listener = socket(SocketFlags::CLOEXEC);
        bind(&listener, &address).expect("a free name");
        listen(&listener, 0).expect("to listen");
        let mut all = vec![listener];
        loop {
            let caller = socket(SocketFlags::CLOEXEC | SocketFlags::NONBLOCK);
            if connect(&caller, &address).is_err() {
                return Self(all);
            }
            all.push(caller);
        }
    }
}

#[test]
fn a_network_is_found_whatever_the_environment_is() {
    let bench = Bench::new();
    let up = bench.start_well();
    let elsewhere = bench.path("elsewhere");
    std::fs::create_dir(&elsewhere).expect("a folder");
    let plan = bench.write(vec![well("a")]);
    let there = |arguments: &[&str]| {
        let mut command = bench.driver(arguments);
        command.env("XDG_RUNTIME_DIR", &elsewhere);
        command
    };
    let run = |arguments: &[&str]| -> Output { there(arguments).output().expect("it runs") };
    is_refused(there(&["up", &plan, "--json"]), up.identity());
    let status = run(&["status", &bench.network]);
    let status: Value = serde_json::from_slice(&status.stdout).expect("a status");
    assert_eq!(status["pid"], up.identity().pid);
    let directory = bench.run_directory();
    assert_eq!(status["directory"].as_str(), directory.to_str());
    let down = run(&["down", &bench.network]);
    assert!(down.status.success(), "{down:?}");
    assert_eq!(up.end().0, Some(0));
    bench.assert_nothing_left();
    let left = std::fs::read_dir(&elsewhere).expect("a folder");
    assert_eq!(left.count(), 0, "nothing was made there");
}

#[test]
fn a_component_restarts_without_the_folder_of_its_logs() {
    let bench = Bench::new();
    let mut up = bench.start_well();
    let logs = bench.log("a");
    let logs = logs.parent().expect("a folder");
    std::fs::remove_dir_all(logs).expect("it is ours");
    let done = bench.command("restart", &["a"]);
    let done: Value = serde_json::from_slice(&done.stdout).expect("a result");
    assert_eq!(done["done"], serde_json::json!(["a"]), "{done}");
    up.await_event("logs-restored", None);
    assert!(bench.log("b").exists() && bench.log("a").exists());
    stop(&bench, up);
}

fn stop(bench: &Bench, up: Up) {
    let down = bench.command("down", &[]);
    assert!(down.status.success(), "{down:?}");
    assert_eq!(up.end().0, Some(0));
}

/// Ctrl-Z does not stop a supervisor, and a hang-up does not end one that `nohup` has started.
#[test]
fn a_supervisor_is_not_stopped_by_its_terminal() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a")]);
    let mut up = bench.start_plan(&plan, &["nohup"], &[]);
    up.await_event("up", None);
    up.signal(Signal::TSTP);
    up.signal(Signal::HUP);
    // It serves, and does not end.
    assert_eq!(bench.status().pid, up.identity().pid);
    assert!(!up.identity().is_stopped());
    let down = bench.command("down", &[]);
    assert!(down.status.success(), "{down:?}");
    let (_, events) = up.end();
    let reasons = events.iter().filter(|event| event["code"] == "stopping");
    let reasons: Vec<&str> = reasons
        .filter_map(|event| event["message"].as_str())
        .collect();
    assert!(
        !reasons.iter().any(|why| why.contains("interrupted")),
        "{reasons:?}"
    );
}

/// Runs a program in the background of a terminal. `stty tostop` stops processes of the background
/// that write.
fn in_background(program: &Command) -> Terminal {
    let [setsid, argument] = SETSID;
    let mut command = Command::new(setsid);
    let script = "set -m; stty tostop; \"$@\" & wait";
    command
        .args([argument, "sh", "-c", script, "sh"])
        .arg(program.get_program())
        .args(program.get_args());
    for (name, value) in program.get_envs() {
        command.env(name, value.unwrap_or_default());
    }
    Terminal::start(command, (100, 30))
}

/// It prints findings before anything starts.
#[test]
fn findings_of_a_network_in_the_background_of_a_terminal_are_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("wrong.ddsl");
    std::fs::write(&file, "Deployment wrong { Component };\n").expect("written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(["up".as_ref(), file.as_os_str()]);
    in_background(&command).until_text("syntax-error");
}

#[test]
fn a_supervisor_in_the_background_of_a_terminal_is_not_stopped() {
    let bench = Bench::new();
    let plan = bench.write(vec![well("a")]);
    let terminal = in_background(&bench.driver(&["up", &plan]));
    until("the network is up", || {
        let status = bench.command("status", &[]);
        let status = serde_json::from_slice::<Value>(&status.stdout).unwrap_or_default();
        status["components"][0]["ready"] == true
    });
    // It has more to print.
    let again = bench.command("restart", &["a"]);
    assert!(again.status.success(), "{again:?}");
    let supervisor = Identity::of(bench.status().pid).expect("it runs");
    assert!(!supervisor.is_stopped());
    let down = bench.command("down", &[]);
    assert!(down.status.success(), "{down:?}");
    await_end(&[supervisor]);
    bench.assert_nothing_left();
    drop(terminal);
}
