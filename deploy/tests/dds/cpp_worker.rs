//! Components in C++, built and started as a user does it. The avoider in C++ does what the one in
//! Rust does, over every middleware.

use crate::python_worker::{RUST, trace};
use rc_test_site::site::{PATROL, Site};
use rc_test_support::cmake;
use std::path::Path;
use std::process::Command;

const CPP: &str = "cdsl \"../avoider_cpp/avoider_cpp.cdsl\";";

/// `rcdeploy` with cmake in its path.
fn tool(site: &Site, cmake: &Path) -> Command {
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

/// `ctest` in the folder of the build.
fn its_own_test_passes(site: &Site, cmake: &Path) {
    let folder = Site::components().join("avoider_cpp");
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
    its_own_test_passes(&site, &cmake);

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

/// Without cmake, `up --build` says what is needed before anything is built or started.
#[test]
fn without_cmake_up_says_what_is_needed() {
    crate::built();
    let site = Site::new("cpp_without");
    site.write_ddsl(&PATROL.replace(RUST, CPP));
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--build", "--profile", "dev"])
        .arg(site.ddsl());
    up.env("PATH", site.path("no_programs"));
    let up = site.run(up);
    assert_ne!(up.code, 0, "{up:?}");
    let needed = "there is no cmake in the path; a component in C++ needs cmake 3.16 and a compiler of C++17";
    assert!(up.stderr.contains(needed), "{up:?}");
}
