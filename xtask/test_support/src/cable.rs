//! Two hosts with a cable between them: network namespaces of this machine.

use crate::python::skipped;
use std::os::unix::fs::MetadataExt;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// Runs a command. The error is what the command printed.
pub fn run(program: &str, args: &[&str]) -> Result<(), String> {
    let mut command = Command::new(program);
    let output = command.args(args).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.trim_end().lines().last().unwrap_or("it failed");
    Err(format!("{program} {}: {last}", args.join(" ")))
}

/// Installs packages of Debian. Another test may be installing others.
pub fn install(packages: &[&str]) -> Result<(), String> {
    let options = ["-o", "DPkg::Lock::Timeout=120", "install", "--yes"];
    let args = [&options[..], &["--no-install-recommends"], packages];
    run("apt-get", &args.concat())
}

/// The addresses of the two hosts.
pub const ADDRESSES: [&str; 2] = ["10.77.0.1", "10.77.0.2"];

fn ip(args: &[&str]) -> Result<(), String> {
    run("ip", args)
}

/// Two hosts and the cable between them. Dropping it removes all three. Their addresses are
/// [`ADDRESSES`].
#[derive(Debug)]
pub struct Cable {
    names: [String; 2],
}

impl Cable {
    /// Connects two hosts. The error says why this machine cannot.
    pub fn lay() -> Result<Self, String> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        if std::fs::metadata("/proc/self").is_ok_and(|own| own.uid() != 0) {
            return Err("only root makes network namespaces".to_owned());
        }
        if ip(&["-Version"]).is_err() {
            install(&["iproute2"])?;
        }
        // The name of a network interface has at most 15 bytes.
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = |side| format!("rc{}{side}{number}", std::process::id());
        let cable = Self {
            names: [name('a'), name('b')],
        };
        let [a, b] = [cable.name(0), cable.name(1)];
        for host in [a, b] {
            ip(&["netns", "add", host])?;
        }
        let link = ["type", "veth", "peer", "name", b, "netns", b];
        ip(&[&["link", "add", a, "netns", a][..], &link].concat())?;
        for (host, address) in [a, b].into_iter().zip(ADDRESSES) {
            let address = format!("{address}/24");
            ip(&["-n", host, "address", "add", &address, "dev", host])?;
            ip(&["-n", host, "link", "set", "lo", "up"])?;
            ip(&["-n", host, "link", "set", host, "up"])?;
        }
        Ok(cable)
    }

    /// The name of a host, and of its end of the cable.
    pub fn name(&self, side: usize) -> &str {
        &self.names[side]
    }

    /// Sets the state of an end: `up` or `down`.
    ///
    /// # Panics
    /// The end is gone.
    pub fn set(&self, side: usize, state: &str) {
        let name = self.name(side);
        ip(&["-n", name, "link", "set", name, state]).expect("to set the link");
    }
}

impl Drop for Cable {
    fn drop(&mut self) {
        for host in &self.names {
            let _ = ip(&["netns", "delete", host]);
        }
    }
}

/// A cable; `None` if the test is skipped, after a line with the reason.
pub fn cable(test: &str) -> Option<Cable> {
    let cable = Cable::lay();
    cable.map_err(|reason| skipped(test, &reason)).ok()
}
