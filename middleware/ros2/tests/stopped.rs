//! Processes that are stopped, resumed and killed: this program, started once more as another
//! component.

use rc_conformance::network::{endpoint, until};
use rc_middleware::{Backend, Environment, RunDirectory, Settings, WakeEvent};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// The variable that gives a process of this program its part and its network.
const PART: &str = "RC_ROS2_TEST_PART";

/// The network of a test.
struct Net {
    name: String,
    directory: RunDirectory,
    lease: &'static str,
}

impl Net {
    fn new(lease: &'static str) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self::of(format!("stopped{number}-{}", std::process::id()), lease)
    }

    fn of(name: String, lease: &'static str) -> Self {
        let directory = RunDirectory::open(&name).expect("a run directory");
        Self {
            name,
            directory,
            lease,
        }
    }

    fn join(&self, instance: &str) -> Box<dyn Backend> {
        let mut environment = Environment {
            network: self.name.clone(),
            instance: instance.to_owned(),
            directory: self.directory.clone(),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings: Settings::default(),
        };
        let mut set = |name, text| {
            let key = rc_settings::key("ros2", name).expect("a key");
            let value = key.kind.parse(text).expect("a value");
            environment.settings.set("ros2", name, value);
        };
        set("domain", "14");
        set("lease", self.lease);
        rc_ros2::connect(&environment).expect("the domain")
    }

    /// Starts the process that plays `part`, and waits until it is ready.
    fn process(&self, part: &str) -> Process {
        let program = std::env::current_exe().expect("this program");
        let mut child = Command::new(program)
            .args(["--exact", "another_process", "--ignored", "--nocapture"])
            .env(PART, format!("{part} {} {}", self.name, self.lease))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a process");
        let lines = BufReader::new(child.stdout.take().expect("its output"));
        let mut process = Process { child, lines };
        let is_ready = process.line(|line| line == "ready").is_some();
        assert!(is_ready, "`{part}` ended");
        process
    }

    fn end(self) {
        self.directory.remove().expect("to remove it");
    }
}

/// Killed when the test ends in any way.
struct Process {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Process {
    /// The first line of its output that holds the text.
    fn line(&mut self, is_it: impl Fn(&str) -> bool) -> Option<String> {
        let mut lines = self.lines.by_ref().lines().map_while(Result::ok);
        lines.find(|line| is_it(line))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The other process. Without a part it does nothing.
#[test]
#[ignore = "the other process of the tests in this file"]
fn another_process() {
    let Ok(part) = std::env::var(PART) else {
        return;
    };
    let mut words = part.split(' ');
    let mut word = || words.next().expect("a word").to_owned();
    let (part, network, lease) = (word(), word(), word());
    let network = Net::of(network, lease.leak());
    let backend = network.join(&part);
    let say = |line: &str| {
        // The test harness has printed the beginning of this line.
        println!("\n{line}");
        std::io::stdout().flush().expect("somebody who reads");
    };
    match part.as_str() {
        "watched" => {
            say("ready");
            until("it is lost", || backend.lost().is_some());
            say(&backend.lost().unwrap_or_default());
        }
        other => panic!("`{other}` is no part"),
    }
}

/// The library ends in a process that was stopped and resumed; the backend reports it.
#[test]
fn a_component_that_was_stopped_says_what_it_has_lost() {
    let network = Net::new("1s");
    let mut stopped = network.process("watched");
    // A thread that does not wait at that moment continues; the next attempt meets it.
    let (pid, is_told) = (Pid::from_child(&stopped.child), AtomicBool::new(false));
    let told = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_told.load(Ordering::SeqCst) {
                kill_process(pid, Signal::STOP).expect("a process");
                waitpid(Some(pid), WaitOptions::UNTRACED).expect("one that stops");
                kill_process(pid, Signal::CONT).expect("a process");
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        let told = stopped.line(|line| line.contains("Start this component anew"));
        is_told.store(true, Ordering::SeqCst);
        told
    });
    assert!(told.is_some());
    drop(stopped);
    network.end();
}

/// A component with a long lease does not count as dead for one with a short lease.
#[test]
fn leases_may_differ() {
    let (here, there) = (Net::new("100ms"), Net::new("8s"));
    let (quick, slow) = (here.join("quick"), there.join("slow"));
    let address = format!("default/Slow{}", std::process::id());
    let server = slow.server(&endpoint(&address)).expect("a server");
    let client = quick.client(&endpoint(&address)).expect("a client");
    until("the server is there", || client.peers() == 1);
    // Many leases of this component, and less than the time between two signs of life of the other
    // one.
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(1) {
        assert_eq!(client.peers(), 1, "{:?}", start.elapsed());
        std::thread::sleep(Duration::from_millis(10));
    }
    drop((client, server, quick, slow));
    here.end();
    there.end();
}
