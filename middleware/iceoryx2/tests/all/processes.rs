//! Networks of real processes. A process is this test program, started with its test `role` only.
//! An environment variable contains the role.

use rc_conformance::network::{
    LIMIT, endpoint, header, raise_descriptor_limit, receive, serve_until, until,
};
use rc_middleware::qos::Durability;
use rc_middleware::{
    Backend, CallError, Client, Encoding, Endpoint, Environment, Header, Reply, RunDirectory,
    Settings, WakeEvent, wait,
};
use rustix::process::{
    Pid, Resource, Rlimit, Signal, WaitId, WaitIdOptions, kill_process, setrlimit, waitid,
};
use std::io::{BufRead, BufReader};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::Duration;

const ROLE: &str = "RC_TEST_ROLE";
const NETWORK: &str = "RC_TEST_NETWORK";
const FILES: &str = "RC_TEST_FILES";
const FOLDER: &str = "RC_TEST_FOLDER";
const WHEN: &str = "RC_TEST_WHEN";
/// A waiting endpoint polls its queue after this time even without a notification.
const CYCLE: Duration = Duration::from_millis(50);

/// When the limit on the size of files takes effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum From {
    /// At the start of the process.
    Start,
    /// After joining the network, before opening an endpoint.
    Joined,
}

/// A network of processes. Dropping it removes its files.
pub(crate) struct Network(pub(crate) String);

impl Network {
    pub(crate) fn new(name: &str) -> Self {
        raise_descriptor_limit();
        Self(format!("{name}-{}", std::process::id()))
    }

    pub(crate) fn environment(&self, instance: &str) -> Environment {
        Environment {
            network: self.0.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.0).expect("a run directory"),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings: Settings::default(),
        }
    }

    pub(crate) fn join(&self, instance: &str) -> Box<dyn Backend> {
        rc_iceoryx2::connect(&self.environment(instance)).expect("the network")
    }

    /// Starts a process in `role` and waits until it is ready.
    pub(crate) fn start(&self, role: &str) -> Process {
        let mut process = self.begin(role);
        process.says("ready");
        process
    }

    /// Starts a process in `role` without waiting.
    pub(crate) fn begin(&self, role: &str) -> Process {
        self.spawn(role, &[])
    }

    /// Starts a process in `role` that the kernel kills when it first makes a file larger than
    /// `bytes`. The file then exists without size or content.
    pub(crate) fn doomed(&self, role: &str, from: From, bytes: u64) -> Process {
        let variables = [(FILES, bytes.to_string()), (WHEN, format!("{from:?}"))];
        self.spawn(role, &variables)
    }

    /// Starts a process in `role` in the working directory `folder` and waits until it is ready.
    pub(crate) fn start_in(&self, folder: &Path, role: &str) -> Process {
        let mut process = self.spawn(role, &[(FOLDER, folder.display().to_string())]);
        process.says("ready");
        process
    }

    fn spawn(&self, role: &str, more: &[(&str, String)]) -> Process {
        let mut child = Command::new(std::env::current_exe().expect("this binary"))
            .args(["role", "--exact", "--nocapture", "--test-threads=1"])
            .env(ROLE, role)
            .env(NETWORK, &self.0)
            .envs(more.iter().map(|(name, value)| (name, value)))
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
        let wiped = rc_iceoryx2::wipe(&directory);
        let removed = directory.remove();
        // A second panic would end the program, and all tests with it.
        if !std::thread::panicking() {
            wiped.expect("to wipe");
            removed.expect("to remove");
        }
    }
}

/// A child process. Dropping it kills the process.
pub(crate) struct Process {
    pub(crate) child: Child,
    output: BufReader<ChildStdout>,
}

impl Process {
    /// Waits for a line that ends with `word`.
    pub(crate) fn says(&mut self, word: &str) {
        let mut lines = (&mut self.output).lines();
        let said = lines.any(|line| line.expect("a line").ends_with(word));
        assert!(said, "it ended before it was {word}");
    }

    /// Waits until the process is ready. If it exits before, returns its status.
    pub(crate) fn outcome(&mut self) -> Option<ExitStatus> {
        let mut lines = (&mut self.output).lines();
        if lines.any(|line| line.expect("a line").ends_with("ready")) {
            return None;
        }
        Some(self.child.wait().expect("to reap"))
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("it runs");
    }

    /// Sends SIGSTOP and waits until all threads of the process have stopped.
    pub(crate) fn stop(&self) {
        self.signal(Signal::STOP);
        let options = WaitIdOptions::STOPPED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
        until("it stands still", || {
            let of = WaitId::Pid(Pid::from_child(&self.child));
            waitid(of, options).expect("a child").is_some()
        });
    }

    pub(crate) fn go_on(&self) {
        self.signal(Signal::CONT);
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("to kill");
        self.child.wait().expect("to reap");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

pub(crate) fn map() -> Endpoint {
    let mut map = endpoint("default/Map/map");
    map.qos.durability = Durability::TransientLocal;
    map
}

/// Limits the size of files if the parent requested that for `now`.
fn limit_files(now: From) {
    let (Ok(bytes), Ok(when)) = (std::env::var(FILES), std::env::var(WHEN)) else {
        return;
    };
    if when == format!("{now:?}") {
        let limit = Rlimit {
            current: Some(bytes.parse().expect("a number of bytes")),
            maximum: None,
        };
        setrlimit(Resource::Fsize, limit).expect("to limit files");
    }
}

/// The role and the network of this process; `None` in the process that runs the tests. Never
/// removes the network's files.
pub(crate) fn role() -> Option<(String, ManuallyDrop<Network>)> {
    let network = Network(std::env::var(NETWORK).ok()?);
    Some((std::env::var(ROLE).ok()?, ManuallyDrop::new(network)))
}

/// Runs a role that several test files use.
pub(crate) fn play(role: &str, network: &Network) {
    if let Ok(folder) = std::env::var(FOLDER) {
        std::env::set_current_dir(folder).expect("a working directory");
    }
    limit_files(From::Start);
    let backend = network.join(role);
    limit_files(From::Joined);
    let motor = endpoint("default/Motor");
    let stop = WakeEvent::new().expect("a wake event");
    match role {
        "server" => {
            let mut server = backend.server(&motor).expect("a server");
            println!("ready");
            serve_until(&mut *server, &stop, &|_, request, reply| {
                if request == b"hold" {
                    println!("holding");
                    wait(&[], LIMIT);
                }
                reply.extend_from_slice(request);
            });
        }
        "lending server" => {
            let mut server = backend.server(&motor).expect("a server");
            println!("ready");
            loop {
                let woken = wait(&[server.descriptor()], CYCLE) != 0;
                server.acknowledge(woken);
                let mut answer = |_: Header, request: &[u8], reply: &mut dyn Reply| {
                    let loan = reply.loan(500, Encoding::Image).expect("a loan");
                    loan.fill(request[0]);
                    if request == b"hold" {
                        println!("holding");
                        wait(&[], LIMIT);
                    }
                    reply.send_loan();
                };
                while server.serve(&mut answer).expect("requests") {}
            }
        }
        "lending publisher" => {
            let mut scan = backend
                .publisher(&endpoint("default/Laser/scan"))
                .expect("a publisher");
            for sequence in 1..=3 {
                let mut loan = scan.loan(500).expect("a loan");
                loan.memory_mut().fill(1);
                loan.send(header(sequence)).expect("to be sent");
            }
            let mut loan = scan.loan(500).expect("a loan");
            loan.memory_mut().fill(2);
            println!("ready");
            wait(&[], LIMIT);
        }
        "idle" => {
            let _scan = backend
                .subscriber(&endpoint("default/Laser/scan"))
                .expect("a subscriber");
            let _client = backend.client(&motor).expect("a client");
            println!("ready");
            wait(&[], LIMIT);
        }
        "publisher" => {
            let mut scan = backend
                .publisher(&endpoint("default/Laser/scan"))
                .expect("a publisher");
            let mut map = backend.publisher(&map()).expect("a publisher");
            println!("ready");
            for sequence in 1.. {
                scan.publish(header(sequence), &[1; 500])
                    .expect("to publish");
                map.publish(header(sequence), &[2; 500])
                    .expect("to publish");
                wait(&[], Duration::from_millis(1));
            }
        }
        "subscriber" => {
            let mut scan = backend
                .subscriber(&endpoint("default/Laser/scan"))
                .expect("a subscriber");
            println!("ready");
            loop {
                receive(&mut *scan, 1);
            }
        }
        "client" => {
            let mut client = backend.client(&motor).expect("a client");
            println!("ready");
            loop {
                let _ = client.call(header(1), b"again", LIMIT, &mut |_, _| {});
            }
        }
        "leaving" => {
            let mut scan = backend
                .publisher(&endpoint("default/Laser/scan"))
                .expect("a publisher");
            let mut client = backend.client(&motor).expect("a client");
            until("both are heard", || scan.peers() + client.peers() == 2);
            scan.publish(header(1), b"last words").expect("to publish");
            client
                .send(header(1), b"last order")
                .expect("the room of one");
            backend.linger(LIMIT);
        }
        other => panic!("no role `{other}`"),
    }
}

pub(crate) fn ask(client: &mut dyn Client, request: &[u8]) -> Result<Vec<u8>, CallError> {
    let mut reply = Vec::new();
    client
        .call(header(1), &request, LIMIT, &mut |_, body| {
            body.clone_into(&mut reply);
        })
        .map(|()| reply)
}
