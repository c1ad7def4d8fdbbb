//! The components of `bench` on another middleware than theirs, as `rcdeploy up --build --middleware` builds them.

use crate::bench::BUILD;
use crate::programs::{Failure, finish, root};
use rc_cdsl::model::Backend;
use rc_codegen::load::FileLoader;
use rc_deploy::network::{self, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::PathBuf;
use std::process::Command;

/// What components are told that run over DDS: this machine alone, in a domain that nobody else has; who gets no processor
/// for a second, because others build, has not died.
pub(crate) const DDS: [&str; 6] = [
    "--set-middleware",
    "dds.lease=10s",
    "--set-middleware",
    "dds.domain=190",
    "--set-middleware",
    "dds.interfaces=lo",
];

/// The same of ROS 2.
pub(crate) const ROS2: [&str; 6] = [
    "--set-middleware",
    "ros2.lease=10s",
    "--set-middleware",
    "ros2.domain=90",
    "--set-middleware",
    "ros2.interfaces=lo",
];

/// Builds the components of `bench/NAME.ddsl` for another middleware; gives the executables of its two in their order.
pub(crate) fn build(
    name: &str,
    middleware: Backend,
    profile: Profile,
) -> Result<[PathBuf; 2], Failure> {
    let path = root().join("bench").join(name).with_extension("ddsl");
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let (network, found) = network::load(&path, Some(middleware), &mut sources, &loader)?;
    let network = network
        .filter(|_| !found.has_errors())
        .ok_or_else(|| render(&sources, &found, Format::Human))?;
    for build in network.builds(profile) {
        let build = build?;
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.current_dir(&build.root).args(&build.args);
        finish(cargo, BUILD)?;
    }
    let components = network.plan(profile)?.components.into_iter();
    let programs: Vec<PathBuf> = components.map(|component| component.executable).collect();
    programs
        .try_into()
        .map_err(|_| format!("{} has more or less than two components", path.display()).into())
}
