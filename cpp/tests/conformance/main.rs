//! A generated component in C++ conforms over each middleware.

mod package;

use interfaces::rc_types::pictures::PicturesPublisher;
use interfaces::rc_types::types::{FailError, TypesClient};
use rc_middleware::CallError;
use rc_middleware::in_place::InPlace as _;
use rc_other_end::{Network, OtherEnd, Over};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use std::sync::mpsc::{Sender, channel};
use std::time::{Duration, Instant};

/// Returns whether the component could be built.
fn conforms(over: Over) -> bool {
    let package = package::package("every_type", over);
    let is_built = package.is_some();
    if let Some(mut package) = package {
        let network = Network::new("cpp", over);
        // It calls itself.
        for member in ["first", "second"] {
            let to = format!("every_type/served/{member}");
            let bind = network.bind(&format!("asked.{member}"), &to);
            package.command.args(["--bind", &bind]);
        }
        rc_other_end::conforms(network, package, faults_stay_in_the_worker);
    }
    is_built
}

/// A worker that ends its process says where, and its callers hear of it.
fn an_end_of_the_process_names_its_function(over: Over) {
    const CRASHES: i32 = 12;
    const THROWS_IN_A_DESTRUCTOR: i32 = 13;
    const EXITS: i32 = 14;
    let place = "SpecificWorker::Types_fail(int)";
    for (which, code, parts) in [
        (
            CRASHES,
            None,
            ["the worker crashed: Segmentation fault", place],
        ),
        (
            THROWS_IN_A_DESTRUCTOR,
            None,
            ["std::runtime_error: at the end of an object", place],
        ),
        (
            EXITS,
            Some(7),
            ["the worker called exit, which ends the process", place],
        ),
    ] {
        let package = package::package("every_type", over).expect("it was built before");
        let mut other = OtherEnd::start(Network::new("cpp", over), package);
        let backend = other.network.join("crash");
        let answer = rc_other_end::client(&other, &*backend).fail(which);
        assert!(
            matches!(answer, Err(FailError::Call(CallError::ServerDied(_)))),
            "{answer:?}"
        );
        drop(backend);
        assert_eq!(other.end(), code);
        let said = other.said();
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
}

/// A worker whose views and loans a test watches: its pictures from this number on are kept, and their
/// numbers noted.
const KEPT: i32 = 2000;

/// Publishes a picture.
fn show(publisher: &mut PicturesPublisher, number: i32) {
    let mut loan = publisher.loan_picture().expect("a loan");
    let picture = rc_other_end::picture(number.into(), 100);
    loan.set(&picture).expect("to fit");
    loan.send().expect("to be sent");
}

fn until(what: &str, so: &mut dyn FnMut() -> bool) {
    let end = Instant::now() + Duration::from_secs(30);
    while !so() {
        assert!(Instant::now() < end, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Publishes a picture until the worker keeps it.
fn keep_one(client: &mut TypesClient, publisher: &mut PicturesPublisher) {
    until("a picture arrives", &mut || {
        show(publisher, KEPT);
        client.noted().expect("numbers").contains(&KEPT)
    });
}

/// A pointer into a sample ends with its view or loan: its next use ends the process, which says where.
/// Samples lie in shared memory, or are copies.
fn a_pointer_ends_with_its_sample(over: Over) {
    const OF_A_LOAN: i32 = 15;
    const OF_A_VIEW: i32 = 16;
    for which in [OF_A_LOAN, OF_A_VIEW] {
        let package = package::package("every_type", over).expect("it was built before");
        let mut other = OtherEnd::start(Network::new("cpp", over), package);
        let backend = other.network.join("pointer");
        let mut client = rc_other_end::client(&other, &*backend);
        if which == OF_A_VIEW {
            let mut publisher = rc_other_end::pictures(&other, &*backend);
            keep_one(&mut client, &mut publisher);
        }
        let answer = client.fail(which);
        assert!(matches!(answer, Err(FailError::Call(_))), "{answer:?}");
        drop((client, backend));
        assert_eq!(other.end(), None);
        let said = other.said();
        for part in [
            "the worker crashed: Segmentation fault",
            "it used a pointer or a reference into a sample in place after its view or loan had ended",
            "SpecificWorker::Types_fail(int)",
        ] {
            assert!(said.contains(part), "{which}: {said}");
        }
    }
}

/// A worker that keeps its views gets four samples; the next ones do not reach it until it drops them.
fn kept_views_have_a_limit(over: Over) {
    const DROP: i32 = 1001;
    const MOST: i32 = 4;
    let package = package::package("every_type", over).expect("it was built before");
    let network = Network::new("cpp", over).with_warnings();
    let mut other = OtherEnd::start(network, package);
    let backend = other.network.join("keeper");
    let mut client = rc_other_end::client(&other, &*backend);
    let mut publisher = rc_other_end::pictures(&other, &*backend);
    let mut note = client.make(1).expect("a value");
    note.number = DROP;
    keep_one(&mut client, &mut publisher);
    // Pictures before the command are handled then, and the command before the last reply.
    let drop_all = |client: &mut TypesClient| {
        client.noted().expect("numbers");
        client.note(&note).expect("a command");
        assert!(client.noted().expect("numbers").contains(&DROP));
    };
    drop_all(&mut client);
    for number in KEPT + 1..=KEPT + MOST {
        show(&mut publisher, number);
        until("a picture is kept", &mut || {
            client.noted().expect("numbers").contains(&number)
        });
    }
    show(&mut publisher, KEPT + MOST + 1);
    let refused = "the worker keeps 4 samples of `picture`, the most that it may";
    until("the limit", &mut || other.said().contains(refused));
    drop_all(&mut client);
    let last = KEPT + MOST + 2;
    show(&mut publisher, last);
    until("a picture after the views have ended", &mut || {
        client.noted().expect("numbers").contains(&last)
    });
    let numbers = client.noted().expect("numbers");
    assert!(!numbers.contains(&(KEPT + MOST + 1)), "{numbers:?}");
}

/// An older C++ is refused with what is needed.
#[test]
fn an_older_cpp_is_refused_with_what_is_needed() {
    let test = "an_older_cpp_is_refused_with_what_is_needed";
    let headers = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let compiler = Command::new("c++")
        .args(["-std=c++14", "-fsyntax-only", "-x", "c++"])
        .arg(headers.join("robocomp/errors.h"))
        .arg("-I")
        .arg(&headers)
        .output();
    let Ok(compiler) = compiler else {
        return rc_test_support::python::skipped(test, "there is no compiler of C++ in the path");
    };
    let said = String::from_utf8_lossy(&compiler.stderr);
    assert!(!compiler.status.success(), "{said}");
    let needed = "robocomp needs C++17: g++ 8, clang++ 7 or later";
    assert!(said.contains(needed), "{said}");
}

/// An older compiler is refused with what is needed. This one says so itself.
#[test]
fn an_older_compiler_is_refused_with_what_is_needed() {
    let test = "an_older_compiler_is_refused_with_what_is_needed";
    if !runs("g++") {
        return rc_test_support::python::skipped(test, "there is no g++ in the path");
    }
    let Some(cmake) = rc_test_support::cmake::folder(test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let older = folder.path().join("g++");
    let script = "#!/bin/sh\nexec g++ -U__GNUC__ -D__GNUC__=7 \"$@\"\n";
    std::fs::write(&older, script).expect("to write");
    std::fs::set_permissions(&older, PermissionsExt::from_mode(0o755)).expect("to set");
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let configure = Command::new(cmake.join("cmake"))
        .arg("-S")
        .arg(own.join("../components/avoider_cpp"))
        .arg("-B")
        .arg(folder.path().join("build"))
        .arg(format!("-Drobocomp_DIR={}", own.join("cmake").display()))
        .arg(format!(
            "-DROBOCOMP_LIBRARY={}",
            package::native().display()
        ))
        .env("CXX", &older)
        .output()
        .expect("cmake");
    let said = String::from_utf8_lossy(&configure.stderr);
    assert!(!configure.status.success(), "{said}");
    // cmake wraps lines.
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    let needed = "robocomp needs C++17: g++ 8, clang++ 7 or later";
    assert!(
        said.contains(needed) && said.contains("is GNU 7."),
        "{said}"
    );
}

/// The component calls the members of its own slot array. Those calls end after the handler that starts
/// them.
fn started_calls_end(other: &OtherEnd) {
    const ASK: i32 = 1000;
    let backend = other.network.join("started");
    let mut client = rc_other_end::client(other, &*backend);
    let mut note = client.make(1).expect("a value");
    note.number = ASK;
    let before = client.noted().expect("numbers").len();
    client.note(&note).expect("a command");
    let end = Instant::now() + Duration::from_secs(30);
    let mut noted = Vec::new();
    while noted.len() < 5 && Instant::now() < end {
        std::thread::sleep(Duration::from_millis(5));
        noted = client.noted().expect("numbers").split_off(before);
    }
    noted.sort_unstable();
    assert_eq!(noted, [ASK, ASK + 1, ASK + 2, ASK + 10, ASK + 11]);
}

/// Calls and samples in place leave nothing in the memory of the component: a thousand calls, or
/// `RC_CPP_CALLS`.
fn calls_leave_nothing(other: &OtherEnd) {
    /// Memory that allocators may take in addition, in bytes.
    const MARGIN: u64 = 2 << 20;
    /// Clients that call at once, so that the component never waits.
    const CLIENTS: u32 = 4;
    /// Calls of a client before the memory is measured.
    const FIRST: u32 = 500;
    let calls = std::env::var("RC_CPP_CALLS").ok();
    let calls: u32 = calls.map_or(1000, |calls| calls.parse().expect("a number"));
    let call = &|name: u32, warm: Sender<()>| {
        let backend = other.network.join(&format!("calls{name}"));
        let mut client = rc_other_end::client(other, &*backend);
        let mut pictures = (name == 0).then(|| rc_other_end::pictures(other, &*backend));
        let value = client.make(1).expect("a value");
        for number in 0..FIRST + calls / CLIENTS {
            if number == FIRST {
                warm.send(()).expect("the test");
            }
            // Most calls are short, so that many fit into a test.
            if number % 20 == 0 {
                assert_eq!(client.echo(&value).as_ref(), Ok(&value));
            } else {
                assert_eq!(client.ranged(1), Ok(6));
            }
            if number % 50 == 0
                && let Some(pictures) = &mut pictures
            {
                let picture = rc_other_end::picture(1 + i64::from(number / 50 % 2), 1000);
                pictures.picture(&picture).expect("to be sent");
            }
        }
    };
    let begun = Instant::now();
    let (warm, are_warm) = channel();
    let before = std::thread::scope(|scope| {
        for name in 0..CLIENTS {
            let warm = warm.clone();
            scope.spawn(move || call(name, warm));
        }
        drop(warm);
        for _ in 0..CLIENTS {
            are_warm.recv().expect("a client");
        }
        other.memory()
    });
    let grown = other.memory().saturating_sub(before);
    println!("{calls} calls in {:?}: {grown} bytes", begun.elapsed());
    assert!(
        package::sanitizer().is_some() || grown < MARGIN,
        "{grown} bytes"
    );
}

/// A worker throws what is not an exception, and uses its context on another thread.
fn faults_stay_in_the_worker(other: &OtherEnd) {
    const THROWN: [(i32, &str); 3] = [
        (
            10,
            "Types_fail(): an exception of the type int, which is not a std::exception",
        ),
        (17, "Types_fail(): a text that is a null pointer"),
        (
            18,
            "Types_fail(): the context works on the thread of the worker only",
        ),
    ];
    const ASKS_A_THREAD: i32 = 11;
    started_calls_end(other);
    calls_leave_nothing(other);
    let backend = other.network.join("faults");
    let mut client = rc_other_end::client(other, &*backend);
    for (number, text) in THROWN {
        let thrown = client.fail(number);
        let Err(FailError::Call(CallError::Refused(reason))) = &thrown else {
            panic!("{thrown:?}");
        };
        assert!(reason.contains(text), "{reason}");
    }
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
    let library = package::native();
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

fn runs(compiler: &str) -> bool {
    let output = Command::new(compiler).arg("--version").output();
    output.is_ok_and(|output| output.status.success())
}

/// clang++ builds the component and its test without a warning, and the test passes.
#[test]
fn clang_builds_a_component_and_its_test() {
    let test = "clang_builds_a_component_and_its_test";
    if !runs("clang++") {
        return rc_test_support::python::skipped(test, "there is no clang++ in the path");
    }
    if package::package_by("clang++", "every_type", Over::iceoryx2()).is_some() {
        package::ctest_by("clang++", "every_type");
    }
}

/// Names of an interface that are words of C++ are names of its code all the same, also in a later C++ with the macros of
/// GNU and of Qt. The worker is that of `rcgen new`, which uses no parameter yet.
#[test]
fn words_of_cpp_are_names_of_generated_code() {
    const FLAGS: [&str; 9] = [
        "-std=gnu++20",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Demit=",
        "-Dforeach=for",
        "-Dforever=for (;;)",
        "-Dsignals=public",
        "-Dslots=",
    ];
    let test = "words_of_cpp_are_names_of_generated_code";
    for compiler in ["g++", "clang++"] {
        if runs(compiler) {
            package::check(compiler, &FLAGS, "words");
        } else {
            let missing = format!("there is no {compiler} in the path");
            rc_test_support::python::skipped(test, &missing);
        }
    }
}

/// A project of a user may have strict flags, and a later C++.
#[test]
fn strict_flags_find_nothing_in_headers_and_generated_code() {
    const STRICT: [&str; 9] = [
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Wconversion",
        "-Wsign-conversion",
        "-Wshadow",
        "-Wnon-virtual-dtor",
        "-Wold-style-cast",
        "-Wdouble-promotion",
    ];
    let test = "strict_flags_find_nothing_in_headers_and_generated_code";
    for (compiler, version) in [
        ("g++", "-std=c++20"),
        ("clang++", "-std=c++20"),
        ("clang++", "-std=c++17"),
    ] {
        if runs(compiler) {
            package::check(compiler, &[&[version], &STRICT[..]].concat(), "every_type");
        } else {
            let missing = format!("there is no {compiler} in the path");
            rc_test_support::python::skipped(test, &missing);
        }
    }
}

#[test]
fn a_component_in_cpp_conforms_over_iceoryx2() {
    if conforms(Over::iceoryx2()) {
        package::ctest("every_type");
        kept_views_have_a_limit(Over::iceoryx2());
        // A sanitizer reports crashes itself.
        if package::sanitizer().is_none() {
            an_end_of_the_process_names_its_function(Over::iceoryx2());
            a_pointer_ends_with_its_sample(Over::iceoryx2());
        }
    }
}

#[test]
fn a_component_in_cpp_conforms_over_dds() {
    let over = Over::dds(178);
    if conforms(over) && package::sanitizer().is_none() {
        a_pointer_ends_with_its_sample(over);
    }
}

#[test]
fn a_component_in_cpp_conforms_over_ros2() {
    conforms(Over::ros2(179));
}

fn ages(over: Over, carries_ages: bool) {
    if package::package("aged", over).is_none() {
        return;
    }
    let network = Network::new("cpp-aged", over);
    rc_other_end::ages(&network, carries_ages, &|battery| {
        let mut package = package::package("aged", over).expect("it was built before");
        package.command.env("AGED_BATTERY", battery);
        package
    });
}

#[test]
fn values_in_cpp_know_their_age_over_iceoryx2() {
    ages(Over::iceoryx2(), true);
    if package::package("aged", Over::iceoryx2()).is_some() {
        package::ctest("aged");
    }
}

#[test]
fn values_in_cpp_know_their_age_over_dds() {
    ages(Over::dds(190), false);
}

#[test]
fn values_in_cpp_know_their_age_over_ros2() {
    ages(Over::ros2(185), false);
}
