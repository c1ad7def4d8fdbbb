//! The components of `bench` for another middleware, as `rcdeploy up --build --middleware` builds
//! them.

use crate::figure::BUILD;
use crate::programs::{Failure, finish, root, target};
use rc_cdsl::model::Middleware;
use rc_codegen::load::FileLoader;
use rc_deploy_network::{Network, Overrides, Profile, load};
use rc_diagnostics::{Diagnostic, Format, Severity, SourceMap, render};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Settings for DDS: this machine only, a domain of its own, and a lease that outlasts a second
/// without a processor while others compile.
pub(crate) const DDS: [&str; 6] = [
    "--set-middleware",
    "dds.lease=10s",
    "--set-middleware",
    "dds.domain=96",
    "--set-middleware",
    "dds.interfaces=lo",
];

/// The settings for ROS 2.
pub(crate) const ROS2: [&str; 6] = [
    "--set-middleware",
    "ros2.lease=10s",
    "--set-middleware",
    "ros2.domain=90",
    "--set-middleware",
    "ros2.interfaces=lo",
];

/// Builds the components of `xtask/bench/NAME.ddsl` for another middleware. Returns both executables in
/// their order.
pub(crate) fn build(
    name: &str,
    middleware: Middleware,
    profile: Profile,
) -> Result<[PathBuf; 2], Failure> {
    pair(name, middleware, profile, true)
}

/// The executables of [`build`], which an earlier call has built.
pub(crate) fn built(
    name: &str,
    middleware: Middleware,
    profile: Profile,
) -> Result<[PathBuf; 2], Failure> {
    let programs = pair(name, middleware, profile, false)?;
    programs
        .iter()
        .try_for_each(|program| check_built(program))?;
    Ok(programs)
}

/// Refuses a program that an earlier command should have built.
pub(crate) fn check_built(program: &Path) -> Result<(), Failure> {
    if program.exists() {
        return Ok(());
    }
    let missing = program.display();
    Err(format!("{missing} is missing; `cargo xtask test` builds it").into())
}

fn pair(
    name: &str,
    middleware: Middleware,
    profile: Profile,
    builds: bool,
) -> Result<[PathBuf; 2], Failure> {
    let path = root().join("xtask/bench").join(name).with_extension("ddsl");
    let programs = network(&path, Some(middleware), profile, builds, |_| true)?;
    programs
        .try_into()
        .map_err(|_| format!("{} has more or less than two components", path.display()).into())
}

/// The program of the process in `xtask/bench/NAME.ddsl`. `builds` says whether it is built; if not,
/// an earlier call has.
pub(crate) fn program(name: &str, profile: Profile, builds: bool) -> Result<PathBuf, Failure> {
    let path = root().join("xtask/bench").join(name).with_extension("ddsl");
    let programs = network(&path, None, profile, builds, |_| true)?;
    let first = programs.into_iter().next();
    let program = first.ok_or_else(|| format!("{} has no component", path.display()))?;
    check_built(&program)?;
    Ok(program)
}

/// The program of proxies, with the description of the proxy `name` in `xtask/bench/NETWORK.ddsl`.
/// `builds` says whether the program is built; if not, an earlier call has.
pub(crate) fn proxy(
    network: &str,
    name: &str,
    profile: Profile,
    builds: bool,
) -> Result<(PathBuf, String), Failure> {
    if builds {
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo
            .current_dir(root())
            .args(["build", "--quiet", "--package", "rc-forward"])
            .args(["--profile", profile.word()]);
        finish(cargo, BUILD)?;
    }
    // Not the one next to this program, which is not optimised.
    let program = target()?.join(profile.folder()).join("rcforward");
    check_built(&program)?;
    let path = root()
        .join("xtask/bench")
        .join(network)
        .with_extension("ddsl");
    let network = read(&path, &Overrides::default(), |_| true)?;
    let components = network.plan(profile)?.components.into_iter();
    let mut components = components.filter(|component| component.name == name);
    let description = components
        .next()
        .and_then(|proxy| proxy.args.into_iter().next());
    let description =
        description.ok_or_else(|| format!("{} has no proxy `{name}`", path.display()))?;
    Ok((program, description))
}

/// Builds the programs that tests start, before they run.
pub(crate) fn build_for_tests() -> Result<(), Failure> {
    build_interop(Profile::Dev)?;
    for middleware in [Middleware::Dds, Middleware::Ros2] {
        build("soak", middleware, Profile::Dev)?;
    }
    for middleware in [Middleware::Iceoryx2, Middleware::Dds, Middleware::Ros2] {
        build("bench_python", middleware, Profile::Dev)?;
    }
    program("place", Profile::Dev, true)?;
    build("bench", Middleware::Dds, Profile::Dev)?;
    build_of_process("shared.ddsl")?;
    build_in_one()
}

/// Builds the program of the patrol as threads of one process.
pub(crate) fn build_in_one() -> Result<(), Failure> {
    build_of_process("in_one.ddsl")
}

/// Builds the programs of a network of the tests with processes of several components.
fn build_of_process(name: &str) -> Result<(), Failure> {
    let path = root().join("deploy/tests/programs").join(name);
    network(&path, None, Profile::Dev, true, |_| true).map(drop)
}

/// Builds the component of the interoperability tests for ROS 2; its own middleware is DDS.
pub(crate) fn build_interop(profile: Profile) -> Result<PathBuf, Failure> {
    let path = root().join("components/interop/interop.ddsl");
    // Programs of the tests are its providers.
    let is_error = |found: &Diagnostic| found.code != "no-provider";
    let programs = network(&path, Some(Middleware::Ros2), profile, true, is_error)?;
    programs
        .into_iter()
        .next()
        .ok_or_else(|| format!("{} has no component", path.display()).into())
}

/// The executables of a network, for another middleware if one is given, in the order of its
/// components. `builds` says whether they are built. An error of the network is one if `is_error` accepts it.
fn network(
    path: &Path,
    middleware: Option<Middleware>,
    profile: Profile,
    builds: bool,
    is_error: impl Fn(&Diagnostic) -> bool,
) -> Result<Vec<PathBuf>, Failure> {
    let overrides = Overrides {
        middleware,
        ..Overrides::default()
    };
    let network = read(path, &overrides, is_error)?;
    let needed = builds
        .then(|| network.programs.builds(profile))
        .transpose()?;
    for build in needed.into_iter().flatten() {
        let build = build?;
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.current_dir(&build.root).args(&build.args);
        finish(cargo, BUILD)?;
        build.finish().map_err(|error| error.to_string())?;
    }
    let components = network.plan(profile)?.components.into_iter();
    Ok(components.map(|component| component.executable).collect())
}

/// Reads a network. An error of the network is one if `is_error` accepts it.
fn read(
    path: &Path,
    overrides: &Overrides,
    is_error: impl Fn(&Diagnostic) -> bool,
) -> Result<Network, Failure> {
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let (network, found) = load(path, overrides, &mut sources, &loader)?;
    let mut errors = found.iter().filter(|d| d.severity == Severity::Error);
    let network = network.filter(|_| !errors.any(is_error));
    Ok(network.ok_or_else(|| render(&sources, &found, Format::Human))?)
}
