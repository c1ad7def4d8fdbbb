//! The components of `bench` for another middleware, as `rcdeploy up --build --middleware` builds
//! them.

use crate::bench::BUILD;
use crate::programs::{Failure, finish, root};
use rc_cdsl::model::Backend;
use rc_codegen::load::FileLoader;
use rc_deploy_network::{self as network, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use std::path::PathBuf;
use std::process::Command;

/// Settings for DDS: this machine only, a domain of its own, and a lease that outlasts a second
/// without a processor while others compile.
pub(crate) const DDS: [&str; 6] = [
    "--set-middleware",
    "dds.lease=10s",
    "--set-middleware",
    "dds.domain=190",
    "--set-middleware",
    "dds.interfaces=lo",
];

/// The same for ROS 2.
pub(crate) const ROS2: [&str; 6] = [
    "--set-middleware",
    "ros2.lease=10s",
    "--set-middleware",
    "ros2.domain=90",
    "--set-middleware",
    "ros2.interfaces=lo",
];

/// Builds the components of `bench/NAME.ddsl` for another middleware. Returns both executables in
/// their order.
pub(crate) fn build(
    name: &str,
    middleware: Backend,
    profile: Profile,
) -> Result<[PathBuf; 2], Failure> {
    let path = root().join("bench").join(name).with_extension("ddsl");
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let overrides = network::Overrides {
        middleware: Some(middleware),
        ..network::Overrides::default()
    };
    let (network, found) = network::load(&path, &overrides, &mut sources, &loader)?;
    let network = network
        .filter(|_| !found.has_errors())
        .ok_or_else(|| render(&sources, &found, Format::Human))?;
    for build in network.builds(profile)? {
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
