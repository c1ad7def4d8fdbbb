//! The component `every_type` as a process.

use crate::network::Network;
use serde_json::Value;
use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// The longest time until a component ends by itself.
const LONGEST_END: Duration = Duration::from_secs(10);

/// The component, generated for one middleware and built.
#[derive(Debug)]
pub struct Package {
    /// Starts it, without arguments of the network.
    pub command: Command,
    /// Its slots, as it hands them over to the runtime.
    pub slots: Value,
    /// Files that are removed with it.
    pub folder: Option<tempfile::TempDir>,
}

impl Package {
    pub(crate) fn slot(&self, name: &str) -> &Value {
        let mut slots = self.slots.as_array().into_iter().flatten();
        let slot = slots.find(|slot| slot["name"] == name);
        slot.unwrap_or_else(|| panic!("there is no slot {name}"))
    }
}

/// The process at the other end.
#[derive(Debug)]
pub struct OtherEnd {
    process: Child,
    /// Its output, which is shown if a test fails.
    said: File,
    pub(crate) package: Package,
    /// The network in which both ends are.
    pub network: Network,
}

impl Drop for OtherEnd {
    fn drop(&mut self) {
        self.kill();
        if std::thread::panicking() {
            eprintln!("{}", self.said());
        }
    }
}

impl OtherEnd {
    /// Starts the component in a network.
    ///
    /// # Panics
    /// The program cannot be started.
    pub fn start(network: Network, mut package: Package) -> Self {
        let said = tempfile::tempfile().expect("a file");
        package
            .command
            .args(network.arguments())
            .stderr(said.try_clone().expect("a descriptor"));
        Self {
            said,
            process: package.command.spawn().expect("the program"),
            package,
            network,
        }
    }

    /// Kills it.
    pub fn kill(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }

    /// Waits until it ends by itself. Returns its exit code; none after a signal.
    ///
    /// # Panics
    /// It does not end within 10 s.
    pub fn end(&mut self) -> Option<i32> {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("a child") {
                return status.code();
            }
            assert!(begun.elapsed() < LONGEST_END, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// The memory of the component that is in use, in bytes.
    ///
    /// # Panics
    /// It has ended.
    pub fn memory(&self) -> u64 {
        let path = format!("/proc/{}/statm", self.process.id());
        let text = std::fs::read_to_string(path).expect("the process");
        let pages = text.split(' ').nth(1).and_then(|pages| pages.parse().ok());
        let pages: u64 = pages.expect("a number of pages");
        pages * 4096
    }

    /// The output of the component so far.
    pub fn said(&mut self) -> String {
        let mut said = String::new();
        let _ = self.said.rewind();
        let _ = self.said.read_to_string(&mut said);
        said
    }
}
