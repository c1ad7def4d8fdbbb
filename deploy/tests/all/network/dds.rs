//! Shared by tests of DDS and of ROS 2: the component `interop` in a domain, and programs beside
//! it.

use rc_test_site::site::{Running, Site};
use rc_test_support::python;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// The component under test.
pub(crate) const COMPONENT: &str = "interop";
const PACKAGE: &str = "cyclonedds==11.0.1";
/// Longest wait for a line.
const LIMIT: Duration = Duration::from_secs(30);
/// The configuration of Cyclone DDS in the Python programs.
const LOOPBACK: &str =
    "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>";

/// The domain of one test. The ports of domains 102 to 214 are among the ephemeral ports of the
/// system.
pub(crate) struct Domain {
    pub(crate) site: Site,
    pub(crate) id: u32,
    pub(crate) over: Over,
}

/// The middleware of a domain.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Over {
    Dds,
    Ros2,
}

impl Over {
    /// The name of the middleware.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Dds => rc_dds::NAME,
            Self::Ros2 => rc_ros2::NAME,
        }
    }

    /// The folder of external programs.
    pub(crate) fn external_programs(self) -> PathBuf {
        let middleware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../middleware");
        middleware.join(self.name()).join("tests/stranger")
    }

    /// The program of [`COMPONENT`]; that of ROS 2 is a variant.
    pub(crate) fn program(self) -> &'static str {
        match self {
            Self::Dds => "interop",
            Self::Ros2 => "interop-ros2",
        }
    }
}

impl Domain {
    pub(crate) fn new(name: &str, id: u32) -> Self {
        Self::over(Over::Dds, name, id)
    }

    pub(crate) fn over(over: Over, name: &str, id: u32) -> Self {
        let site = Site::new(name);
        Self { site, id, over }
    }

    /// The arguments with which a component joins this domain.
    fn args<'a>(&self, more: &[&'a str]) -> Vec<std::borrow::Cow<'a, str>> {
        let middleware = self.over.name();
        let mut args = vec![
            "--set-middleware".into(),
            format!("{middleware}.domain={}", self.id).into(),
            "--set-middleware".into(),
            format!("{middleware}.interfaces=lo").into(),
        ];
        for setting in more {
            args.push("--set-middleware".into());
            args.push((*setting).into());
        }
        args
    }

    /// Starts the component, with further settings of the middleware.
    pub(crate) fn start(&self, settings: &[&str]) -> Running {
        self.start_with(settings, &[])
    }

    /// Starts the component where [`Domain::rclpy`] starts programs: on this machine alone, by the
    /// variable of ROS 2. Then both use the known ports of the domain instead of multicast.
    pub(crate) fn start_local(&self, more: &[&str]) -> Running {
        let domain = format!("{}.domain={}", self.over.name(), self.id);
        let args = [&["--set-middleware", &*domain], more].concat();
        let local = [("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")];
        self.site
            .start_program(self.over.program(), COMPONENT, &args, &local)
    }

    /// `start` with environment variables.
    pub(crate) fn start_with(&self, settings: &[&str], variables: &[(&str, &str)]) -> Running {
        let args = self.args(settings);
        let args: Vec<&str> = args.iter().map(|arg| &**arg).collect();
        self.site
            .start_program(self.over.program(), COMPONENT, &args, variables)
    }

    /// Starts one of the programs in `middleware/MIDDLEWARE/tests/stranger`, in this network.
    pub(crate) fn external(&self, python: &Path, program: &str, args: &[&str]) -> ExternalProgram {
        self.external_with(python, program, args, "")
    }

    /// `external` with further configuration of Cyclone DDS.
    pub(crate) fn external_with(
        &self,
        python: &Path,
        program: &str,
        args: &[&str],
        config: &str,
    ) -> ExternalProgram {
        let mut command = Command::new(python);
        command
            // Without compiled files in the repository.
            .arg("-B")
            .arg(self.over.external_programs().join(program))
            .env("CYCLONEDDS_URI", format!("{LOOPBACK}{config}"));
        self.beside(command, args)
    }

    /// Starts one of the programs in `middleware/ros2/tests/rclpy`, with the default settings of
    /// ROS 2 but for the domain and the loopback.
    pub(crate) fn rclpy(&self, python: &Path, program: &str, args: &[&str]) -> ExternalProgram {
        let mut command = Command::new(python);
        let folder = self.over.external_programs().join("../rclpy");
        command
            .arg("-B")
            .arg(folder.join(program))
            .env("ROS_DOMAIN_ID", self.id.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
            .env("ROS_LOG_DIR", self.site.path("ros"));
        self.beside(command, args)
    }

    /// Starts a program with the arguments NETWORK, DOMAIN and `args`.
    pub(crate) fn beside(&self, mut command: Command, args: &[&str]) -> ExternalProgram {
        self.site.place(&mut command);
        let mut child = command
            .args([&self.site.network, &self.id.to_string()])
            .args(args)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a program");
        let input = child.stdin.take();
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let (line, lines) = channel();
        std::thread::spawn(move || {
            for read in output.lines().map_while(Result::ok) {
                if line.send(read).is_err() {
                    return;
                }
            }
        });
        ExternalProgram {
            child,
            input,
            lines,
        }
    }

    /// The status of a slot of the component.
    pub(crate) fn slot(&self, name: &str) -> Value {
        let status = self.site.ask(COMPONENT, "status");
        let slots = status["slots"].as_array().expect("slots");
        let slot = slots.iter().find(|slot| slot["name"] == name);
        slot.expect("the slot").clone()
    }
}

/// An interpreter with the package of Cyclone DDS.
pub(crate) fn python(test: &str) -> Option<&'static Path> {
    python::interpreter(PACKAGE, test)
}

/// A program that runs beside a component. It is killed at the latest when the test ends.
pub(crate) struct ExternalProgram {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
}

impl ExternalProgram {
    /// The next line of its output.
    pub(crate) fn line(&self) -> String {
        self.lines.recv_timeout(LIMIT).expect("a line in time")
    }

    /// Waits for this line.
    pub(crate) fn says(&self, text: &str) {
        while self.line() != text {}
    }

    /// Waits for these lines, in any order: those of two topics or services have none.
    pub(crate) fn says_all(&self, texts: &[&str]) {
        let mut missing = texts.to_vec();
        while !missing.is_empty() {
            let line = self.line();
            missing.retain(|text| *text != line);
        }
    }

    /// Whether the next line is this one.
    pub(crate) fn has_said(&self, text: &str) -> bool {
        let line = self.lines.recv_timeout(Duration::from_millis(20));
        line.is_ok_and(|line| line == text)
    }

    /// Writes to its standard input.
    pub(crate) fn write(&mut self, text: &str) {
        let input = self.input.as_mut().expect("its input");
        input.write_all(text.as_bytes()).expect("to write");
    }

    /// Kills it.
    pub(crate) fn kill(&mut self) {
        self.child.kill().expect("to kill");
        self.child.wait().expect("to reap");
    }

    /// Closes its input, and waits until it ends successfully. Returns the remaining lines.
    pub(crate) fn end(mut self) -> Vec<String> {
        drop(self.input.take());
        let mut said = Vec::new();
        while let Ok(line) = self.lines.recv_timeout(LIMIT) {
            said.push(line);
        }
        let status = self.child.wait().expect("to reap");
        assert!(status.success(), "{status}: {said:?}");
        said
    }
}

impl Drop for ExternalProgram {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
