//! The environment of one test: network, run directory, logs and files of its own.

use rc_middleware::RunDirectory;
use rustix::process::Pid;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The network of the README, unchanged.
pub const PATROL: &str = include_str!("../../../components/networks/patrol.ddsl");
/// The longest wait of a test. It is only reached by a failure, so it also suits a busy machine.
const LIMIT: Duration = Duration::from_mins(1);

/// The folder of the programs of this test run, `target/debug`.
fn profile() -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    // Programs of tests are in `target/debug/deps`.
    own.ancestors()
        .nth(2)
        .expect("the target folder")
        .to_owned()
}

/// The program `rcdeploy` of this test run.
pub fn rcdeploy() -> PathBuf {
    Site::executable("rcdeploy")
}

/// The exit code and the output of a command.
#[derive(Debug)]
pub struct CommandOutput {
    /// The exit code; -1 after a signal.
    pub code: i32,
    /// Its standard output.
    pub stdout: String,
    /// Its standard error.
    pub stderr: String,
}

/// A component started by hand. Dropping it kills the process.
pub struct Running {
    child: Child,
    log: PathBuf,
}

impl Running {
    /// Output of the process so far.
    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).expect("its log")
    }

    /// Its process.
    pub fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Kills it.
    pub fn kill(&mut self) {
        self.child.kill().expect("to kill");
        self.child.wait().expect("to reap");
    }

    /// Waits for its exit. Returns its exit code.
    pub fn end(mut self) -> Option<i32> {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status.code();
            }
            assert!(start.elapsed() < LIMIT, "it does not end: {}", self.log());
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Network, run directory, logs and files of one test. Dropping it stops the network.
pub struct Site {
    folder: tempfile::TempDir,
    /// The name of the network, which no other test has.
    pub network: String,
    /// The command, with its first arguments, that runs all programs of this environment. Empty for
    /// none.
    pub within: Vec<String>,
}

/// Stops a network that a failed test has left, and removes its files.
impl Drop for Site {
    fn drop(&mut self) {
        if self.directory().path().join("rcdeploy.sock").exists() {
            self.rcdeploy(&["down", &self.network], false);
        }
        let _ = rc_iceoryx2::wipe(&self.directory());
    }
}

impl Site {
    /// An environment with the network of the README. Its network is named after `name`.
    pub fn new(name: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let site = Self {
            folder,
            network: format!("{name}_{}", std::process::id()),
            within: Vec::new(),
        };
        std::fs::create_dir_all(site.path("run")).expect("a folder");
        site.write_ddsl(PATROL);
        site
    }

    /// A path in the folder of this environment.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The components of this repository.
    pub fn components() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../components")
            .canonicalize()
            .expect("the components")
    }

    /// Writes the network's file, with paths into this repository and the network name of this
    /// test.
    pub fn write_ddsl(&self, text: &str) {
        let components = Self::components();
        let text = text
            .replace("Deployment patrol", &format!("Deployment {}", self.network))
            .replace("\"../", &format!("\"{}/", components.display()));
        let networks = self.path("networks");
        std::fs::create_dir_all(&networks).expect("a folder");
        std::fs::write(networks.join("patrol.ddsl"), text).expect("to write");
    }

    /// The network's file.
    pub fn ddsl(&self) -> PathBuf {
        self.path("networks/patrol.ddsl")
    }

    /// Writes a file beside the network's. Returns its path.
    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path("networks").join(name);
        std::fs::write(&path, text).expect("to write");
        path
    }

    /// Copies the files of a component, without its folders, beside the network's file.
    pub fn copy_component(&self, name: &str) {
        let target = self.path("networks").join(name);
        std::fs::create_dir_all(&target).expect("a folder");
        for entry in std::fs::read_dir(Self::components().join(name))
            .expect("the component")
            .flatten()
        {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), target.join(entry.file_name())).expect("to copy");
            }
        }
    }

    /// Changes a file beside the network's.
    pub fn edit(&self, name: &str, change: impl FnOnce(String) -> String) {
        let path = self.path("networks").join(name);
        let text = std::fs::read_to_string(&path).expect("to read");
        let changed = change(text.clone());
        assert_ne!(text, changed, "the edit of {name} changes nothing");
        std::fs::write(path, changed).expect("to write");
    }

    /// A program of this repository.
    pub fn executable(name: &str) -> PathBuf {
        let path = profile().join(name);
        assert!(
            path.exists(),
            "{} is missing: run the tests by `cargo xtask test`",
            path.display()
        );
        path
    }

    /// The target folder of this test run.
    pub fn target() -> PathBuf {
        let folder = profile().parent().map(Path::to_owned);
        folder.expect("the target folder")
    }

    /// Sets the folders of this test for a command.
    pub fn place(&self, command: &mut Command) {
        command
            .current_dir(self.path("networks"))
            .env("XDG_RUNTIME_DIR", self.path("run"))
            .env("XDG_STATE_HOME", self.path("state"))
            .env("CARGO_TARGET_DIR", Self::target())
            .stdin(Stdio::null());
    }

    /// A command that runs a program in this environment.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = match self.within.split_first() {
            Some((first, rest)) => {
                let mut command = Command::new(first);
                command.args(rest).arg(program);
                command
            }
            None => Command::new(program),
        };
        self.place(&mut command);
        command
    }

    /// Runs a program in this environment.
    pub fn run(&self, mut command: Command) -> CommandOutput {
        self.place(&mut command);
        let output = command.output().expect("to run");
        CommandOutput {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }

    /// Runs rcdeploy. With `file`, appends the network's file to the arguments.
    pub fn rcdeploy(&self, args: &[&str], file: bool) -> CommandOutput {
        let mut command = Command::new(rcdeploy());
        command.args(args);
        if file {
            command.arg(self.ddsl());
        }
        self.run(command)
    }

    /// Runs a component of this repository.
    pub fn component(&self, name: &str, args: &[&str]) -> CommandOutput {
        let mut command = self.command(&Self::executable(name));
        command.args(args);
        self.run(command)
    }

    /// Starts a component of this repository by hand, and waits until it is ready.
    pub fn start(&self, name: &str, args: &[&str]) -> Running {
        self.start_with(name, args, &[])
    }

    /// Like `start`, with environment variables.
    pub fn start_with(&self, name: &str, args: &[&str], variables: &[(&str, &str)]) -> Running {
        self.start_program(name, name, args, variables)
    }

    /// Like `start_with`, with a program that has another name than the component.
    pub fn start_program(
        &self,
        program: &str,
        name: &str,
        args: &[&str],
        variables: &[(&str, &str)],
    ) -> Running {
        let log = self.path(&format!("{name}.log"));
        let output = std::fs::File::create(&log).expect("a log");
        let mut command = self.command(&Self::executable(program));
        command.args(["--network", &self.network]).args(args);
        command
            .envs(variables.iter().copied())
            .stdout(output.try_clone().expect("a log"))
            .stderr(output);
        let running = Running {
            child: command.spawn().expect("a component"),
            log,
        };
        Self::until(&format!("{name} is ready"), || {
            // A killed component leaves its socket, on which no process replies.
            UnixStream::connect(self.directory().socket(name)).is_ok()
                && self.ask(name, "status")["state"] == "running"
        });
        running
    }

    /// Starts a pose monitor that writes each pose to the file `trace`. It exits after `samples`
    /// poses, unless that is 0.
    pub fn start_monitor(&self, trace: &str, samples: u32) -> Running {
        let config = self.monitor(trace, samples);
        self.start("pose_monitor", &["--config", &config])
    }

    /// The configuration of such a pose monitor.
    pub fn monitor(&self, trace: &str, samples: u32) -> String {
        let config = format!(
            "[component]\nperiod = \"50ms\"\n[parameters]\nmap = \"{}\"\nsvg = \"\"\ntrace = \"{}\"\nsamples = {samples}\n",
            Self::components().join("maps/house.map").display(),
            self.path(trace).display()
        );
        self.write("monitor.toml", &config).display().to_string()
    }

    /// The status of the network.
    pub fn status(&self) -> Value {
        let ran = self.rcdeploy(&["status", "--format", "json", &self.network], false);
        assert_eq!(ran.code, 0, "{ran:?}");
        serde_json::from_str(&ran.stdout).expect("one JSON document")
    }

    /// Sends one request to the management of a component.
    pub fn ask(&self, name: &str, method: &str) -> Value {
        self.tell(name, method, &Value::Null)
    }

    /// Sends one request with parameters to the management of a component.
    pub fn tell(&self, name: &str, method: &str, params: &Value) -> Value {
        let mut stream = UnixStream::connect(self.directory().socket(name)).expect("its socket");
        stream.set_read_timeout(Some(LIMIT)).expect("a limit");
        let request = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
        stream
            .write_all(format!("{request}\n").as_bytes())
            .expect("to ask");
        let mut line = String::new();
        BufReader::new(stream)
            .read_line(&mut line)
            .expect("an answer");
        serde_json::from_str::<Value>(&line).expect("JSON")["result"].clone()
    }

    /// The run directory of the network.
    pub fn directory(&self) -> RunDirectory {
        RunDirectory::below(&self.path("run/robocomp"), &self.network)
    }

    /// Waits until the log of a component has a text.
    pub fn await_in_log(&self, component: &str, text: &str) {
        Self::until(&format!("`{text}` in the log of {component}"), || {
            self.count_in_log(component, text) > 0
        });
    }

    /// The number of occurrences of a text in the log of a component.
    pub fn count_in_log(&self, component: &str, text: &str) -> usize {
        self.log(component).matches(text).count()
    }

    /// The log of a component.
    pub fn log(&self, component: &str) -> String {
        let logs = self.path("state/robocomp").join(&self.network);
        std::fs::read_to_string(logs.join(format!("{component}.log"))).unwrap_or_default()
    }

    /// The events of a background supervisor about a component: codes and messages.
    pub fn events(&self, component: &str) -> Vec<(String, String)> {
        let log = self.log("rcdeploy");
        let events = log
            .lines()
            .filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let of = events.filter(|event| event["component"] == component);
        let text = |event: &Value, key: &str| event[key].as_str().unwrap_or_default().to_owned();
        of.map(|event| (text(&event, "code"), text(&event, "message")))
            .collect()
    }

    /// Waits until the condition holds for the status of a component.
    pub fn await_component(&self, name: &str, so: impl Fn(&Value) -> bool) {
        Self::until(&format!("the wanted status of {name}"), || {
            let status = self.status();
            let components = status["components"].as_array().cloned().unwrap_or_default();
            components.iter().any(|c| c["name"] == name && so(c))
        });
    }

    /// Waits for the exit of a component.
    pub fn await_end_of(&self, name: &str) {
        self.await_component(name, |c| c["state"] == "done");
    }

    /// Polls until the condition holds, with a limit. The pause is not part of what is tested.
    pub fn until(what: &str, so: impl FnMut() -> bool) {
        Self::until_within(LIMIT, what, so);
    }

    /// As `until`, with a limit for what takes long on a computer that does much else.
    pub fn until_within(limit: Duration, what: &str, mut so: impl FnMut() -> bool) {
        let start = Instant::now();
        while !so() {
            assert!(start.elapsed() < limit, "waited {limit:?} for {what}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn leftovers(&self) -> Vec<PathBuf> {
        let mut left = rc_iceoryx2::leftovers(&self.directory());
        left.extend(Some(self.directory().path().to_path_buf()).filter(|path| path.exists()));
        left
    }

    /// Waits until the network has left no file.
    pub fn await_nothing_left(&self) {
        Self::until("the clean-up", || self.leftovers().is_empty());
    }

    /// Checks that the network has left no file.
    pub fn assert_nothing_left(&self) {
        assert_eq!(self.leftovers(), Vec::<PathBuf>::new());
    }
}
