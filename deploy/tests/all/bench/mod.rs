//! A test environment: folders of its own, misbehaving programs, a supervisor and its events.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program has a copy, and uses its own part"
)]

use rc_deploy::process::Identity;
use rc_deploy::{Component, NetworkStatus, Plan};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// The longest wait of a test.
pub const LIMIT: Duration = Duration::from_mins(1);

static NETWORKS: AtomicU32 = AtomicU32::new(0);

pub struct Bench {
    folder: TempDir,
    pub network: String,
}

/// A supervisor in the foreground. It is killed if the test fails.
pub struct Up {
    child: Child,
    events: Receiver<Value>,
    seen: Vec<Value>,
}

/// A component that runs `rc-test-misbehave NAME BEHAVIOUR`.
pub fn component(name: &str, behaviour: &str, after: &[&str]) -> Component {
    let mut args = vec![name.to_owned()];
    args.extend(behaviour.split(' ').map(str::to_owned));
    Component {
        args,
        after: after.iter().map(|&a| a.to_owned()).collect(),
        middleware: "iceoryx2".to_owned(),
        ..Component::new(name, env!("CARGO_BIN_EXE_rc-test-misbehave"), "/")
    }
}

pub fn well(name: &str) -> Component {
    component(name, "well", &[])
}

impl Bench {
    pub fn new() -> Self {
        let number = NETWORKS.fetch_add(1, Ordering::Relaxed);
        Self {
            folder: tempfile::tempdir().expect("a folder"),
            network: format!("test-{}-{number}", std::process::id()),
        }
    }

    pub fn plan(&self, components: Vec<Component>) -> Plan {
        Plan::new(self.network.clone(), "test.ddsl", components)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn run_directory(&self) -> PathBuf {
        self.path("run").join("robocomp").join(&self.network)
    }

    pub fn log(&self, name: &str) -> PathBuf {
        let logs = self.path("state").join("robocomp").join(&self.network);
        logs.join(format!("{name}.log"))
    }

    /// The driver with the folders of this test.
    pub fn driver(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rc-test-driver"));
        let run = self.path("run");
        std::fs::create_dir_all(&run).expect("a folder");
        command
            .args(arguments)
            .env("XDG_RUNTIME_DIR", run)
            .env("XDG_STATE_HOME", self.path("state"))
            .env("RC_TEST_JOURNAL", self.path("journal"))
            .env("RC_TEST_CLEANED", self.path("cleaned"))
            .stdin(Stdio::null());
        command
    }

    pub fn command(&self, name: &str, arguments: &[&str]) -> Output {
        let arguments: Vec<&str> = [name, &self.network]
            .into_iter()
            .chain(arguments.iter().copied())
            .collect();
        self.driver(&arguments).output().expect("it runs")
    }

    pub fn write(&self, components: Vec<Component>) -> String {
        let path = self.path("plan.json");
        let text = serde_json::to_vec(&self.plan(components)).expect("json");
        std::fs::write(&path, text).expect("written");
        path.to_string_lossy().into_owned()
    }

    pub fn start(&self, components: Vec<Component>) -> Up {
        self.start_with(components, &[])
    }

    pub fn start_with(&self, components: Vec<Component>, flags: &[&str]) -> Up {
        self.start_in(components, flags, &[])
    }

    /// Like `start`, with environment variables.
    pub fn start_in(
        &self,
        components: Vec<Component>,
        flags: &[&str],
        variables: &[(&str, &str)],
    ) -> Up {
        self.start_by(&[], &self.write(components), flags, variables)
    }

    /// Starts a written plan. If `way` is not empty, it is the program, with its first arguments,
    /// that runs the driver.
    pub fn start_plan(&self, plan: &str, way: &[&str], flags: &[&str]) -> Up {
        self.start_by(way, plan, flags, &[])
    }

    fn start_by(&self, way: &[&str], plan: &str, flags: &[&str], variables: &[(&str, &str)]) -> Up {
        let own = self.driver(&["up", plan, "--json"]);
        let mut command = own;
        if let [program, arguments @ ..] = way {
            let own = std::mem::replace(&mut command, Command::new(program));
            command
                .args(arguments)
                .arg(own.get_program())
                .args(own.get_args())
                .envs(
                    own.get_envs()
                        .filter_map(|(name, value)| Some((name, value?))),
                )
                .stdin(Stdio::null());
        }
        let mut child = command
            .args(flags)
            .envs(variables.iter().copied())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let out = BufReader::new(child.stdout.take().expect("a pipe"));
        let (sender, events) = mpsc::channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                let event = serde_json::from_str(&line).expect("JSON lines");
                if sender.send(event).is_err() {
                    return;
                }
            }
        });
        Up {
            child,
            events,
            seen: Vec::new(),
        }
    }

    pub fn start_well(&self) -> Up {
        let mut up = self.start(vec![well("a"), component("b", "well", &["a"])]);
        up.await_event("up", None);
        up
    }

    pub fn status(&self) -> NetworkStatus {
        let output = self.command("status", &[]);
        assert!(output.status.success(), "{output:?}");
        serde_json::from_slice(&output.stdout).expect("a status")
    }

    /// The journal of the components in order, as lines `NAME WHAT`.
    pub fn journal(&self) -> Vec<String> {
        let lines = self.entries();
        lines
            .iter()
            .map(|line| line.rsplit_once(' ').expect("a pid").0.to_owned())
            .collect()
    }

    /// The processes of these entries. They must be alive.
    pub fn processes(&self, entry: &str) -> Vec<Identity> {
        self.entries()
            .iter()
            .filter_map(|line| line.strip_prefix(entry)?.trim().parse().ok())
            .map(|pid| Identity::of(pid).expect("it runs"))
            .collect()
    }

    pub fn position(&self, entry: &str) -> usize {
        let journal = self.journal();
        let found = journal.iter().position(|e| e == entry);
        found.unwrap_or_else(|| panic!("no `{entry}` in {journal:?}"))
    }

    pub fn entries(&self) -> Vec<String> {
        let text = std::fs::read_to_string(self.path("journal")).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    pub fn cleanups(&self) -> usize {
        let text = std::fs::read_to_string(self.path("cleaned")).unwrap_or_default();
        text.lines().count()
    }

    /// Checks that no process that ever wrote to the journal is alive, and that the run directory
    /// is removed.
    pub fn assert_nothing_left(&self) {
        self.assert_no_process_left();
        assert!(!self.run_directory().exists(), "the run directory is left");
        assert!(self.cleanups() > 0, "no clean-up ran");
    }

    pub fn assert_no_process_left(&self) {
        for line in self.entries() {
            let pid = line.rsplit_once(' ').expect("a pid").1;
            let pid = pid.parse().expect("a pid");
            assert!(Identity::of(pid).is_none(), "`{line}` still runs");
        }
    }
}

impl Up {
    pub fn identity(&self) -> Identity {
        Identity::of(self.child.id().try_into().expect("a pid")).expect("it runs")
    }

    /// Waits for an event with one of the codes. Returns its code and message.
    pub fn await_either(&mut self, either: [&str; 2]) -> (String, String) {
        loop {
            let event = self.events.recv_timeout(LIMIT);
            let event = event.unwrap_or_else(|_| panic!("none of {either:?} in {:#?}", self.seen));
            let [code, message] = ["code", "message"].map(|key| event[key].as_str());
            let found = code.zip(message).filter(|(code, _)| either.contains(code));
            let found = found.map(|(code, message)| (code.to_owned(), message.to_owned()));
            self.seen.push(event);
            if let Some(found) = found {
                return found;
            }
        }
    }

    /// Waits for an event. Returns its message.
    pub fn await_event(&mut self, code: &str, component: Option<&str>) -> String {
        let deadline = Instant::now() + LIMIT;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(event) = self.events.recv_timeout(left) else {
                panic!("no {code} of {component:?} in {:#?}", self.seen);
            };
            let found = event["code"] == code && event["component"].as_str() == component;
            let message = event["message"].as_str().expect("a message").to_owned();
            self.seen.push(event);
            if found {
                return message;
            }
        }
    }

    pub fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(&self.child);
        kill_process(pid, signal).expect("it runs");
    }

    /// Waits for the exit of the supervisor. Returns its exit code and all its events.
    pub fn end(mut self) -> (Option<i32>, Vec<Value>) {
        await_end(&[self.identity_or_ended()]);
        let status = self.child.wait().expect("it has ended");
        let mut seen = std::mem::take(&mut self.seen);
        seen.extend(self.events.iter());
        (status.code(), seen)
    }

    fn identity_or_ended(&self) -> Identity {
        let pid = self.child.id().try_into().expect("a pid");
        Identity::of(pid).unwrap_or(Identity { pid, starttime: 0 })
    }

    /// Kills the supervisor by SIGKILL.
    pub fn kill(mut self) {
        self.child.kill().expect("it runs");
        self.child.wait().expect("it has ended");
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits for the exit of processes.
pub fn await_end(processes: &[Identity]) {
    let timeout = Timespec::try_from(LIMIT).expect("a short time");
    for process in processes {
        if let Some(descriptor) = process.open() {
            let mut polled = [PollFd::from_borrowed_fd(descriptor.as_fd(), PollFlags::IN)];
            let count = poll(&mut polled, Some(&timeout)).expect("it can be waited for");
            assert!(count == 1, "{process:?} does not end");
        }
    }
}

pub fn kill(process: Identity) {
    let pid = Pid::from_raw(process.pid).expect("a pid");
    assert!(process.is_alive());
    kill_process(pid, Signal::KILL).expect("it runs");
}

pub fn codes(events: &[Value], component: &str) -> Vec<String> {
    let of = events.iter().filter(|e| e["component"] == component);
    of.map(|e| e["code"].as_str().expect("a code").to_owned())
        .collect()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Reports a skipped test. `cargo xtask test` repeats the line at its end.
pub fn skipped(test: &str, reason: &str) {
    let line = format!("skipped: {test}: {reason}\n");
    // Written directly, because the test harness captures the output of successful tests.
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(list) = std::env::var_os("RC_TEST_SKIPPED") {
        let list = std::fs::File::options()
            .append(true)
            .create(true)
            .open(list);
        list.and_then(|mut list| list.write_all(line.as_bytes()))
            .expect("the list of skipped tests");
    }
}
