//! Networks of real processes. The other processes are the test program again, started for its one test `role`, with
//! the role in an environment variable.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "each test program has a copy, and uses its own part"
)]

use rc_conformance::network::until;
use rc_middleware::{Backend, Environment, Interrupt, RunDirectory};
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader};
use std::mem::ManuallyDrop;
use std::process::{Child, ChildStdout, Command, Stdio};

const ROLE: &str = "RC_TEST_ROLE";
const NETWORK: &str = "RC_TEST_NETWORK";

/// A network of processes; wiped when it goes.
pub struct Network(String);

impl Network {
    pub fn new(name: &str) -> Self {
        Self(format!("{name}-{}", std::process::id()))
    }

    pub fn environment(&self, instance: &str) -> Environment {
        Environment {
            network: self.0.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.0).expect("a run directory"),
            interrupt: Interrupt::new().expect("an interrupt"),
        }
    }

    pub fn join(&self, instance: &str) -> Box<dyn Backend> {
        rc_iceoryx2::connect(&self.environment(instance)).expect("the network")
    }

    /// A process in `role` that says it is ready.
    pub fn start(&self, role: &str) -> Process {
        let mut process = self.begin(role);
        process.says("ready");
        process
    }

    /// A process in `role` that has just begun.
    pub fn begin(&self, role: &str) -> Process {
        let mut child = Command::new(std::env::current_exe().expect("this binary"))
            .args(["role", "--exact", "--nocapture", "--test-threads=1"])
            .env(ROLE, role)
            .env(NETWORK, &self.0)
            .stdout(Stdio::piped())
            .spawn()
            .expect("a process");
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        Process { child, output }
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let directory = RunDirectory::of(&self.0);
        rc_iceoryx2::wipe(&directory).expect("to wipe");
        directory.remove().expect("to remove");
    }
}

/// A process that is killed at the latest when the test ends.
pub struct Process {
    pub child: Child,
    output: BufReader<ChildStdout>,
}

impl Process {
    /// Waits until it has said `word`.
    pub fn says(&mut self, word: &str) {
        let mut lines = (&mut self.output).lines();
        let said = lines.any(|line| line.expect("a line").ends_with(word));
        assert!(said, "it ended before it was {word}");
    }

    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("it is there");
    }

    /// Sends SIGSTOP, and waits until it stands still.
    pub fn stop(&self) {
        self.signal(Signal::STOP);
        let state = format!("/proc/{}/stat", self.child.id());
        until("it stands still", || {
            let state = std::fs::read_to_string(&state).expect("its state");
            let fields = state.rsplit_once(')').expect("its name").1;
            fields.trim_start().starts_with('T')
        });
    }

    pub fn go_on(&self) {
        self.signal(Signal::CONT);
    }

    pub fn kill(&mut self) {
        self.child.kill().expect("to kill");
        self.child.wait().expect("to reap");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// The role of this process and its network, which it leaves as it is; none where it runs the tests.
pub fn role() -> Option<(String, ManuallyDrop<Network>)> {
    let network = Network(std::env::var(NETWORK).ok()?);
    Some((std::env::var(ROLE).ok()?, ManuallyDrop::new(network)))
}
