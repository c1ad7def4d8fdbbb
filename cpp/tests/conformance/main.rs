//! Generated clients, publishers and servers in Rust, with a generated component in C++ at the other
//! end: every pattern, every type and every error, over each middleware.

// The suite is that of components in Python.
#[path = "../../../python/tests/conformance/calls.rs"]
mod calls;
mod other_end;
#[path = "../../../python/tests/conformance/topics.rs"]
mod topics;
#[path = "../../../python/tests/conformance/values.rs"]
mod values;

use interfaces::rc_types::types::FailError;
use other_end::{Network, OtherEnd, Over};
use rc_middleware::CallError;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);
/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(5);

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < end, "waited {LIMIT:?} until {what}");
        std::thread::sleep(LOOK);
    }
}

fn conforms(over: &'static Over) {
    let Some(package) = other_end::package(over) else {
        return;
    };
    let network = Network::new(over);
    let earlier = topics::Earlier::publish(&network, &package);
    let other = OtherEnd::start(network, package);
    topics::earlier_values_arrive(&other);
    drop(earlier);
    calls::values_are_equal_at_both_ends(&other);
    calls::errors_reach_the_caller(&other);
    faults_stay_in_the_worker(&other);
    calls::commands_keep_their_order(&other);
    calls::replies_travel_in_place(&other);
    calls::calls_are_made(&other);
    topics::samples_are_repeated(&other);
    topics::pictures_travel_in_place(&other);
    calls::a_call_ends_with_its_server(other);
    if over.domain == 0 {
        a_crash_names_its_function(over);
    }
}

/// A worker that crashes says where, and its callers hear of it.
fn a_crash_names_its_function(over: &'static Over) {
    const CRASHES: i32 = 12;
    let package = other_end::package(over).expect("it was there before");
    let mut other = OtherEnd::start(Network::new(over), package);
    let backend = other.network.join("crash");
    let answer = calls::client(&other, &*backend).fail(CRASHES);
    assert!(
        matches!(answer, Err(FailError::Call(CallError::ServerDied(_)))),
        "{answer:?}"
    );
    drop(backend);
    other.kill();
    let said = other.said();
    for part in [
        "the worker crashed: Segmentation fault",
        "SpecificWorker::Types_fail(int)",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

/// A worker throws what is no exception, and uses its context on another thread.
fn faults_stay_in_the_worker(other: &OtherEnd) {
    const THROWS_AN_INT: i32 = 10;
    const ASKS_A_THREAD: i32 = 11;
    let backend = other.network.join("faults");
    let mut client = calls::client(other, &*backend);
    let thrown = client.fail(THROWS_AN_INT);
    let Err(FailError::Call(CallError::Refused(reason))) = &thrown else {
        panic!("{thrown:?}");
    };
    let text = "Types_fail(): an exception of the type int, which is no std::exception";
    assert!(reason.contains(text), "{reason}");
    assert_eq!(client.mirrored(ASKS_A_THREAD).as_deref(), Ok("WrongThread"));
    assert_eq!(client.ranged(1), Ok(6), "the worker runs on");
}

/// A program of another version does not start, and names both.
#[test]
fn a_program_of_another_version_does_not_start() {
    let test = "a_program_of_another_version_does_not_start";
    if Command::new("cc").arg("--version").output().is_err() {
        return rc_test_support::python::skipped(test, "there is no compiler of C in the path");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("version");
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let library = other_end::native();
    let built = Command::new("cc")
        .args([
            "-std=c99",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-I",
        ])
        .arg(crate_folder.join("include"))
        .arg(crate_folder.join("tests/conformance/version.c"))
        .arg("-o")
        .arg(&program)
        .arg(&library)
        .output()
        .expect("the compiler");
    assert!(built.status.success(), "{built:?}");
    let mut run = Command::new(&program);
    run.env("LD_LIBRARY_PATH", library.parent().expect("a folder"));
    let run = run.output().expect("the program");
    let said = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(3), "{said}");
    let own = format!("is of robocomp {}", env!("CARGO_PKG_VERSION"));
    assert!(
        said.contains("with the headers of robocomp 9.9.9") && said.contains(&own),
        "{said}"
    );
}

/// The headers are of the release of the library.
#[test]
fn the_headers_name_their_release() {
    let header = include_str!("../../include/robocomp/abi.h");
    let release = format!("#define RC_RELEASE \"{}\"\n", env!("CARGO_PKG_VERSION"));
    assert!(header.contains(&release), "abi.h has another release");
}

#[test]
fn a_component_in_cpp_conforms_over_iceoryx2() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Iceoryx2,
        domain: 0,
        connect: |environment| rc_iceoryx2::connect(environment).expect("the network"),
    });
}

#[test]
fn a_component_in_cpp_conforms_over_dds() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Dds,
        domain: 178,
        connect: |environment| rc_dds::connect(environment).expect("the domain"),
    });
}

#[test]
fn a_component_in_cpp_conforms_over_ros2() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Ros2,
        domain: 179,
        connect: |environment| rc_ros2::connect(environment, &[]).expect("the domain"),
    });
}
