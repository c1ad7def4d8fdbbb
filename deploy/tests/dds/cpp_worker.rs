//! Components in C++, built and started as a user does it. The avoider in C++ does what the one in
//! Rust does, over every middleware.

use crate::debugging::{Debugged, gdb, has_gdb};
use crate::python_programs::{AVOIDER, CLOCK, assert_equal, patrol};
use crate::python_worker::{RUST, trace};
use rc_test_site::site::{PATROL, Site};
use rc_test_support::cmake;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

const CLOCK_CPP: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/programs/clock_cpp/clock_cpp.cdsl"
);

const CPP: &str = "cdsl \"../avoider_cpp/avoider_cpp.cdsl\";";

/// `rcdeploy` with cmake in its path.
pub(crate) fn tool(site: &Site, cmake: &Path) -> Command {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = [cmake.to_path_buf()]
        .into_iter()
        .chain(std::env::split_paths(&path));
    let all = all.filter(|folder| !folder.as_os_str().is_empty());
    command.env("PATH", std::env::join_paths(all).expect("a path"));
    command.env("CARGO_NET_OFFLINE", "true");
    command.env("ROS_LOCALHOST_ONLY", "1");
    command
}

/// `rcgen WORDS…` in a folder. Returns what it says.
pub(crate) fn rcgen(site: &Site, folder: &Path, words: &[&str]) -> String {
    let mut rcgen = site.command(&Site::executable("rcgen"));
    rcgen.args(words);
    site.place(&mut rcgen);
    let output = rcgen.current_dir(folder).output().expect("rcgen");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    said
}

/// The workspace `robot` of a user, made by `rcgen init`.
pub(crate) fn workspace(site: &Site) -> PathBuf {
    let framework = Site::components().join("..");
    let framework = framework.canonicalize().expect("the framework");
    let framework = framework.to_string_lossy();
    let words = ["init", "robot", "--framework", &framework];
    rcgen(site, &site.path(""), &words);
    site.path("robot")
}

/// The test of a component of this repository.
pub(crate) fn its_own_test_passes(site: &Site, cmake: &Path, component: &str) {
    ctest(site, cmake, &Site::components().join(component));
}

/// `ctest` in `build` of the folder of a component, where `up --build` has built it.
pub(crate) fn ctest(site: &Site, cmake: &Path, folder: &Path) {
    let (source, build) = (folder.to_string_lossy(), folder.join("build"));
    let build = build.to_string_lossy();
    for words in [
        vec!["cmake", "-S", &source, "-B", &build, "-DROBOCOMP_TESTS=ON"],
        vec!["cmake", "--build", &build],
        vec!["ctest", "--test-dir", &build],
    ] {
        let mut command = Command::new(cmake.join(words[0]));
        command.args(&words[1..]);
        let run = site.run(command);
        assert_eq!(run.code, 0, "{run:?}");
    }
}

/// Below another prefix it takes the library that is installed there, and runs without cmake.
fn it_runs_where_it_is_installed(site: &Site) {
    let prefix = site.path("rc");
    let file = Site::components().join("avoider_cpp/avoider_cpp.cdsl");
    let mut rcgen = Command::new(Site::executable("rcgen"));
    rcgen.args(["install", "--profile", "dev", "--prefix"]);
    rcgen.arg(&prefix).arg(file);
    let installed = site.run(rcgen);
    assert_eq!(installed.code, 0, "{installed:?}");
    let program = prefix.join("components/avoider_cpp/bin/avoider_cpp");
    // As cargo sets it: its target folder has the library, too, and perhaps of another profile.
    let built = Path::new(env!("CARGO_BIN_EXE_rcdeploy")).parent();
    let mut ldd = Command::new("ldd");
    ldd.arg(&program)
        .env("LD_LIBRARY_PATH", built.expect("a folder"));
    let linked = site.run(ldd).stdout;
    let library = linked.lines().find(|line| line.contains("librobocomp_cpp"));
    let library = library
        .and_then(|line| line.split("=> ").nth(1))
        .expect("a library");
    let library = library.split(' ').next().unwrap_or_default();
    let library = Path::new(library).canonicalize().expect("a file");
    assert_eq!(
        library,
        prefix
            .join("lib/librobocomp_cpp.so")
            .canonicalize()
            .expect("a file")
    );
    // A path that leads to no file names the installed component.
    site.write_ddsl(&PATROL.replace(RUST, "cdsl \"avoider_cpp.cdsl\";"));
    let tool = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(args).env("ROBOCOMP_PREFIX", &prefix);
        let run = site.run(command);
        assert_eq!(run.code, 0, "{args:?} {run:?}");
        run.stdout
    };
    let file = site.ddsl().to_string_lossy().into_owned();
    let plan = tool(&["plan", "--profile", "dev", "--format", "json", &file]);
    assert!(plan.contains(&*program.to_string_lossy()), "{plan}");
    tool(&["up", "--detach", "--profile", "dev", &file]);
    tool(&["down", &site.network]);
    site.assert_nothing_left();
}

/// gdb stops the component in a function of its worker, shows how it got there, and lets it go on.
fn gdb_stops_it_in_its_worker(site: &Site, cmake: &Path) {
    if !has_gdb("a component in C++ under gdb") {
        return;
    }
    let mut up = tool(site, cmake);
    up.args(["up", "--profile", "dev", "--debug", "avoider"]);
    up.arg(site.ddsl());
    let debugged = Debugged::up(site, up);
    let program = Site::executable("avoider_cpp");
    let commands = [
        "break SpecificWorker::during_driving",
        "continue",
        "backtrace",
        "delete",
        "detach",
    ];
    let said = gdb(&debugged.address, &program, &commands);
    for part in [
        "#0  SpecificWorker::during_driving",
        "rc::Program<SpecificWorker>::dispatch",
    ] {
        assert!(said.contains(part), "{said}");
    }
    site.await_component("avoider", |of| of["state"] == "running");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    assert_eq!(debugged.end(), Some(0));
    site.assert_nothing_left();
}

/// The sanitizer is in a program of its own.
fn a_sanitizer_builds_another_program(site: &Site, cmake: &Path) {
    let mut up = tool(site, cmake);
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.args(["--sanitize", "avoider=address"]).arg(site.ddsl());
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let program = std::fs::read(Site::executable("avoider_cpp-address")).expect("a program");
    let usual = std::fs::read(Site::executable("avoider_cpp")).expect("a program");
    let is_checked = |program: &[u8]| memchr::memmem::find(program, b"__asan_init").is_some();
    assert!(is_checked(&program) && !is_checked(&usual));
    site.await_component("avoider", |of| of["state"] == "running");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The toolchain file of the user chooses compiler and flags, also for a build folder that had others.
fn a_toolchain_file_chooses_the_compiler(cmake: &Path) {
    let programs = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs");
    let site = Site::new("cpp_toolchain");
    let network = format!(
        "Deployment {}\n{{\n    middleware iceoryx2;\n    time simulated by clock;\n    Component clock {{ cdsl \"{CLOCK_CPP}\"; }};\n}};\n",
        site.network
    );
    site.write_ddsl(&network);
    let mut up = tool(&site, cmake);
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl());
    up.env("CMAKE_TOOLCHAIN_FILE", programs.join("toolchain.cmake"));
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let commands = programs.join("clock_cpp/build/compile_commands.json");
    let commands = std::fs::read_to_string(commands).expect("flags");
    assert!(commands.contains("-DFLAG_OF_THE_TOOLCHAIN"), "{commands}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// A source of time in C++ drives an avoider in C++ in lockstep: the run is the same as with both in Rust,
/// and exact recordings repeat both.
#[test]
fn a_source_of_time_in_cpp_drives_a_network_in_lockstep() {
    let Some(cmake) = cmake::folder("a_source_of_time_in_cpp_drives_a_network_in_lockstep") else {
        return;
    };
    crate::built();
    a_toolchain_file_chooses_the_compiler(&cmake);
    let mut traces = Vec::new();
    for (name, clock, avoider) in [
        ("time_rust", CLOCK, AVOIDER),
        ("time_cpp", CLOCK_CPP, "../avoider_cpp/avoider_cpp.cdsl"),
    ] {
        let site = Site::new(name);
        let rcdeploy = |args: &[&str]| {
            let mut command = tool(&site, &cmake);
            command.args(args);
            site.run(command)
        };
        traces.push(patrol(&site, &rcdeploy, clock, avoider));
    }
    assert_equal(&traces);
}

/// A worker without a window that blocks for ever: the supervisor says that it hangs, kills it after the time of
/// its network, and starts it again. Its caller gets an error.
#[test]
fn a_worker_in_cpp_that_blocks_for_ever_is_restarted() {
    const IDSL: &str = "module Gates\n{\n    interface Gate\n    {\n        void wait();\n        int passed();\n    };\n};\n";
    const CDSL: &str = "import \"Gates.idsl\";\n\nComponent gate\n{\n    Communications\n    {\n        implements Gate;\n    };\n    \
                        language cpp;\n    period 20ms;\n};\n";
    const WAITS: &str = "\n#include <condition_variable>\n#include <mutex>\n\nvoid SpecificWorker::Gate_wait() {\n  std::mutex mutex;\n  \
                         std::condition_variable nobody;\n  std::unique_lock<std::mutex> lock(mutex);\n  for (;;) nobody.wait(lock);\n}\n";
    let test = "a_worker_in_cpp_that_blocks_for_ever_is_restarted";
    let Some(cmake) = cmake::folder(test) else {
        return;
    };
    crate::built();
    let site = Site::new("cpp_blocks");
    let robot = workspace(&site);
    let folder = robot.join("components/gate");
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(robot.join("interfaces/Gates.idsl"), IDSL).expect("to write");
    std::fs::write(folder.join("gate.cdsl"), CDSL).expect("to write");
    rcgen(&site, &robot, &["generate", "components/gate/gate.cdsl"]);
    let path = folder.join("src/specificworker.cpp");
    let worker = std::fs::read_to_string(&path).expect("the new worker");
    let (before, rest) = worker
        .split_once("void SpecificWorker::Gate_wait() {")
        .expect("the handler");
    let (_, after) = rest.split_once("\n}\n").expect("its end");
    std::fs::write(&path, format!("{before}{WAITS}{after}")).expect("to write");
    let cdsl = folder.join("gate.cdsl");
    site.write_ddsl(&format!(
        "Deployment {}\n{{\n    middleware iceoryx2;\n    \
         Component gate {{ cdsl \"{}\"; restart on_failure hung 3s; stop 1s; }};\n}};\n",
        site.network,
        cdsl.display()
    ));
    let mut up = tool(&site, &cmake);
    up.args(["up", "--build", "--detach", "--profile", "dev"]);
    up.arg(site.ddsl());
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let call = |operation: &str| {
        let operation = format!("gate.Gate.{operation}");
        site.rcdeploy(&["call", &site.network, &operation], false)
    };
    assert_eq!(call("passed").code, 0);
    let before = site.ask("gate", "status")["pid"].as_u64();
    assert!(before.is_some());
    assert_ne!(call("wait").code, 0, "it blocks");
    for code in ["hung", "hung-too-long", "killed", "restarting"] {
        Site::until(&format!("the event {code}"), || {
            site.events("gate").iter().any(|(of, _)| of == code)
        });
    }
    site.await_component("gate", |gate| {
        gate["state"] == "running" && gate["pid"].as_u64() != before
    });
    assert_eq!(call("passed").code, 0);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// Both avoiders compute with 32 bits in the same order, so their traces have no tolerance.
#[test]
fn the_avoider_in_cpp_does_what_that_in_rust_does() {
    let Some(cmake) = cmake::folder("the_avoider_in_cpp_does_what_that_in_rust_does") else {
        return;
    };
    crate::built();
    let rcdeploy = |site: &Site| tool(site, &cmake);
    // No wait of a trace is for the compiler.
    let site = Site::new("cpp_build");
    site.write_ddsl(&PATROL.replace(RUST, CPP));
    let mut up = rcdeploy(&site);
    up.args(["up", "--build", "--detach", "--profile", "dev"])
        .arg(site.ddsl());
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let commands = Site::components().join("avoider_cpp/build/compile_commands.json");
    assert!(commands.exists(), "an editor finds no flags");
    its_own_test_passes(&site, &cmake, "avoider_cpp");
    it_runs_where_it_is_installed(&site);
    site.write_ddsl(&PATROL.replace(RUST, CPP));
    gdb_stops_it_in_its_worker(&site, &cmake);
    a_sanitizer_builds_another_program(&site, &cmake);

    let iceoryx2 = "middleware iceoryx2;";
    let rust = trace("cpp_trace_rust", &rcdeploy, RUST, 500, iceoryx2);
    let cpp = trace("cpp_trace", &rcdeploy, CPP, 500, iceoryx2);
    let parted = rust.lines().zip(cpp.lines()).find(|(a, b)| a != b);
    assert_eq!(parted, None, "the first pose that differs");
    for middleware in ["dds", "ros2"] {
        let in_domain = format!("middleware {middleware} {{ domain 177; }};");
        let over = trace(
            &format!("cpp_trace_{middleware}"),
            &rcdeploy,
            CPP,
            100,
            &in_domain,
        );
        let parted = rust.lines().zip(over.lines()).find(|(a, b)| a != b);
        assert_eq!(
            parted, None,
            "the first pose that differs over {middleware}"
        );
    }
}

/// Without cmake, a compiler or the toolchain file, `up --build` says what is needed before anything is built or started.
#[test]
fn without_cmake_up_says_what_is_needed() {
    crate::built();
    let site = Site::new("cpp_without");
    site.write_ddsl(&PATROL.replace(RUST, CPP));
    let programs = site.path("programs");
    std::fs::create_dir(&programs).expect("a folder");
    for missing in ["cmake", "compiler of C++"] {
        let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
        up.args(["up", "--build", "--profile", "dev"])
            .arg(site.ddsl());
        up.env("PATH", &programs).env_remove("CXX");
        let up = site.run(up);
        assert_ne!(up.code, 0, "{up:?}");
        let needed = format!(
            "there is no {missing} in the path; a component in C++ needs cmake 3.16 and a compiler of C++17"
        );
        assert!(up.stderr.contains(&needed), "{up:?}");
        let cmake = programs.join("cmake");
        std::fs::write(&cmake, "#!/bin/sh\n").expect("to write");
        std::fs::set_permissions(&cmake, PermissionsExt::from_mode(0o755)).expect("to set");
    }
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--profile", "dev"])
        .arg(site.ddsl());
    up.env("PATH", &programs)
        .env("CMAKE_TOOLCHAIN_FILE", "nowhere.cmake");
    let up = site.run(up);
    assert_ne!(up.code, 0, "{up:?}");
    let missing = "CMAKE_TOOLCHAIN_FILE names nowhere.cmake: No such file";
    assert!(up.stderr.contains(missing), "{up:?}");
}
