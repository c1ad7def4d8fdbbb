//! Where the programs of each host are built, and for which processor.

use crate::programs::processor;
use crate::workspaces::{self, Target};
use rc_ddsl::model::{BuildPlace, Deployment, Host, Instance, Processor};
use rc_diagnostics::{Diagnostic, Diagnostics};
use serde::Serialize;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What builds a program, and for what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Site {
    /// This machine, for its own processor.
    Own,
    /// This machine, for another processor.
    Cross(Processor),
    /// A host: an index into the hosts of the deployment.
    There(usize),
}

impl Site {
    /// The target folder of programs that are built here: cargo has a folder for each platform. A host
    /// that builds has no platform but its own.
    pub(crate) fn of(self, target: Target) -> Target {
        let platform = match self {
            Self::Own => target.platform,
            Self::Cross(processor) => Some(processor.platform().to_owned()),
            Self::There(_) => None,
        };
        Target { platform, ..target }
    }
}

/// How this machine builds for another processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CrossTool {
    /// With the linker that a configuration of cargo names.
    Configured,
    /// With the cross compiler of the system.
    Gcc,
    /// With zig, by `cargo zigbuild`.
    Zig,
}

/// For people.
impl fmt::Display for CrossTool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Configured => "the configured linker",
            Self::Gcc => "gcc",
            Self::Zig => "zig",
        })
    }
}

/// What is known about the hosts of a network.
#[derive(Debug, Default)]
pub(crate) struct Sites {
    /// The processors of hosts that have been asked.
    said: RefCell<BTreeMap<usize, Processor>>,
    /// How this machine builds for a processor, or what it lacks, with the command that installs it.
    tools: RefCell<BTreeMap<Processor, Result<CrossTool, Vec<String>>>>,
}

impl Sites {
    /// Takes what a host says of itself.
    pub(crate) fn hear(&self, host: usize, processor: Processor) {
        self.said.borrow_mut().insert(host, processor);
    }

    /// The processor of a host, if the file or the host names one.
    pub(crate) fn processor(&self, deployment: &Deployment, host: usize) -> Option<Processor> {
        let declared = deployment.hosts[host].arch.map(|(processor, _)| processor);
        declared.or_else(|| self.said.borrow().get(&host).copied())
    }

    /// Where the programs of a host are built.
    pub(crate) fn of_host(&self, deployment: &Deployment, host: usize, root: &Path) -> Site {
        if deployment.hosts[host].is_local() {
            return Site::Own;
        }
        let processor = self.processor(deployment, host);
        let other = processor.filter(|processor| processor::own() != Some(*processor));
        match (deployment.hosts[host].build.place, other) {
            (Some(BuildPlace::There), _) => Site::There(host),
            (_, None) => Site::Own,
            (Some(BuildPlace::Here), Some(other)) => Site::Cross(other),
            (None, Some(other)) => match self.tool(other, root) {
                Ok(_) => Site::Cross(other),
                Err(_) => Site::There(host),
            },
        }
    }

    /// Where the program of an instance is built, in the workspace `root`.
    pub(crate) fn of(&self, deployment: &Deployment, instance: &Instance, root: &Path) -> Site {
        let host = instance.host.map(|(host, _)| host);
        host.map_or(Site::Own, |host| self.of_host(deployment, host, root))
    }

    /// How this machine builds the workspace `root` for a processor.
    pub(crate) fn tool(&self, processor: Processor, root: &Path) -> Result<CrossTool, Vec<String>> {
        let mut tools = self.tools.borrow_mut();
        let tool = tools.entry(processor);
        tool.or_insert_with(|| find(processor, root)).clone()
    }

    /// Reports hosts for which this machine shall build, and cannot.
    pub(crate) fn check(&self, deployment: &Deployment, root: &Path, found: &mut Diagnostics) {
        let used = |at: usize| {
            let mut hosts = deployment.instances.iter().filter_map(|one| one.host);
            hosts.any(|(host, _)| host == at)
        };
        for at in (0..deployment.hosts.len()).filter(|at| used(*at)) {
            let host: &Host = &deployment.hosts[at];
            if host.build.place != Some(BuildPlace::Here) {
                continue;
            }
            let Site::Cross(processor) = self.of_host(deployment, at, root) else {
                continue;
            };
            if let Err(missing) = self.tool(processor, root) {
                let name = &host.name;
                let message = format!(
                    "this machine cannot build for {processor}, the processor of `{}`",
                    name.text
                );
                let place = host.arch.map_or(name.span, |(_, span)| span);
                let error = Diagnostic::error("missing-cross-compiler", place, message);
                let missing = missing.join(", and ");
                found.push(error.help(format!("{missing}; or write `build there;`")));
            }
        }
    }
}

fn find(processor: Processor, root: &Path) -> Result<CrossTool, Vec<String>> {
    let platform = processor.platform();
    let mut missing = Vec::new();
    if !has_standard_library(platform, root) {
        missing.push(if in_path("rustup") {
            format!("`rustup target add {platform}`")
        } else {
            let name = processor.to_string();
            format!(
                "`rustup target add {platform}` (with the Rust of Debian: `dpkg --add-architecture {name} && apt update && apt install libstd-rust-dev:{name}`)"
            )
        });
    }
    let tool = if workspaces::linker(root, platform) {
        Some(CrossTool::Configured)
    } else if in_path(&format!("{}-gcc", processor.toolchain())) {
        Some(CrossTool::Gcc)
    } else if in_path("cargo-zigbuild") {
        Some(CrossTool::Zig)
    } else {
        let name = processor.toolchain();
        missing.push(format!(
            "`apt install gcc-{name} g++-{name}` (or `pip install cargo-zigbuild`, which links with zig)"
        ));
        None
    };
    tool.filter(|_| missing.is_empty()).ok_or(missing)
}

/// Whether rustc has the standard library for a platform.
fn has_standard_library(platform: &str, root: &Path) -> bool {
    let cargo = workspaces::cargo();
    let beside = cargo.with_file_name("rustc");
    let rustc = match std::env::var_os("RUSTC").filter(|set| !set.is_empty()) {
        Some(set) => PathBuf::from(set),
        None if beside.is_file() => beside,
        None => PathBuf::from("rustc"),
    };
    let said = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", platform])
        // Its files choose the toolchain.
        .current_dir(root)
        .stdin(Stdio::null())
        .output();
    said.is_ok_and(|said| {
        let folder = String::from_utf8_lossy(&said.stdout).trim().to_owned();
        said.status.success() && Path::new(&folder).is_dir()
    })
}

fn in_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}
