//! The tests in Python, which load the extension module of this crate.

use rc_middleware::RunDirectory;
use rc_test_support::python;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages that the package needs in addition to Python.
const NUMPY: &str = "numpy==2.3.4";

/// The requirements of the tests of components. This `OpenCV` accepts the same `NumPy`.
const COMPONENTS: &str = include_str!("../../components/line_camera_detector/tests/packages.txt");

/// An extension module, which cargo built beside this program.
fn native(library: &str) -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    let native = own.with_file_name(library);
    assert!(native.exists(), "{} is not there", native.display());
    native
}

/// A command of the interpreter that finds the package and the files of the tests. `None` where
/// there is no Python 3.11 or no `NumPy`: `test` is listed as skipped.
fn interpreter(test: &str) -> Option<Command> {
    let python = python::packages("python-numpy", NUMPY, test)?;
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(python);
    command
        .current_dir(package.join("tests/python"))
        .env("PYTHONPATH", package)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("ROBOCOMP_NATIVE", native("librobocomp_python.so"))
        .env("ROBOCOMP_GRAPH", native("librobocomp_graph.so"))
        .env("ROBOCOMP_INNERMODEL", native("librobocomp_innermodel.so"));
    Some(command)
}

/// Runs a file of tests, which leaves nothing of its network.
fn check(test: &str, file: &str, middleware: &str, domain: u32) {
    let Some(mut command) = interpreter(test) else {
        return;
    };
    let name = file.trim_start_matches("test_").trim_end_matches(".py");
    let network = format!("py-{name}-{middleware}-{}", std::process::id());
    let output = command
        .args(["-X", "dev", file, "--verbose"])
        .env("TEST_MIDDLEWARE", middleware)
        .env("TEST_DOMAIN", domain.to_string())
        .env("TEST_NETWORK", &network)
        .output()
        .expect("the interpreter runs");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {said}", output.status);
    let ran = said.split("\nRan ").nth(1).unwrap_or("0");
    assert!(!ran.starts_with('0'), "no test ran: {said}");
    let directory = RunDirectory::of(&network);
    assert!(!directory.path().exists(), "{directory:?}");
    let left = rc_iceoryx2::leftovers(&directory);
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn every_type_is_exchanged_between_threads() {
    check(
        "every_type_is_exchanged_between_threads",
        "test_exchange.py",
        "local",
        0,
    );
}

#[test]
fn every_type_is_exchanged_over_iceoryx2() {
    check(
        "every_type_is_exchanged_over_iceoryx2",
        "test_exchange.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn every_type_is_exchanged_over_dds() {
    check(
        "every_type_is_exchanged_over_dds",
        "test_exchange.py",
        "dds",
        141,
    );
}

#[test]
fn every_type_is_exchanged_over_ros2() {
    check(
        "every_type_is_exchanged_over_ros2",
        "test_exchange.py",
        "ros2",
        142,
    );
}

#[test]
fn a_program_starts_checks_its_worker_and_stops() {
    check(
        "a_program_starts_checks_its_worker_and_stops",
        "test_program.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn a_tree_of_innermodel_has_versions_and_frames() {
    check(
        "a_tree_of_innermodel_has_versions_and_frames",
        "test_innermodel.py",
        "local",
        0,
    );
}

#[test]
fn a_graph_is_asked_by_texts_and_by_traversals() {
    check(
        "a_graph_is_asked_by_texts_and_by_traversals",
        "test_graph.py",
        "local",
        0,
    );
}

#[test]
fn samples_are_written_in_shared_memory() {
    check(
        "samples_are_written_in_shared_memory",
        "test_in_place.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn members_of_slot_arrays_are_opened_and_keep_samples() {
    check(
        "members_of_slot_arrays_are_opened_and_keep_samples",
        "test_members.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn a_source_of_time_advances_it_and_waits() {
    check(
        "a_source_of_time_advances_it_and_waits",
        "test_time.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn samples_in_place_are_copied_over_dds() {
    check(
        "samples_in_place_are_copied_over_dds",
        "test_in_place.py",
        "dds",
        143,
    );
}

#[test]
fn a_client_without_a_component_calls_and_listens() {
    check(
        "a_client_without_a_component_calls_and_listens",
        "test_client.py",
        "iceoryx2",
        0,
    );
}

#[test]
fn values_become_those_of_other_prototypes() {
    check(
        "values_become_those_of_other_prototypes",
        "test_convert.py",
        "local",
        0,
    );
}

/// The tests that the components of this repository have themselves.
#[test]
fn the_tests_of_components_pass() {
    let test = "the_tests_of_components_pass";
    let Some(python) = python::packages("python-opencv", COMPONENTS, test) else {
        return;
    };
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    for component in [
        "components/avoider_python",
        "components/lidar",
        "components/line_camera_detector",
        "components/mapper",
        "components/usb_camera",
        "xtask/bench/ping_python",
        "xtask/bench/pong_python",
        "deploy/tests/programs/rack_python",
        "deploy/tests/programs/clock_python",
        "deploy/tests/programs/wanderer",
    ] {
        let output = Command::new(python)
            .args(["-B", "-m", "pytest", "-q", "-p", "no:cacheprovider"])
            .current_dir(package.join("..").join(component))
            .env("PYTHONPATH", package)
            .env("ROBOCOMP_NATIVE", native("librobocomp_python.so"))
            .output()
            .expect("the interpreter runs");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{component}: {said}");
        assert!(said.contains(" passed in "), "{component}: {said}");
    }
}

#[test]
fn a_client_without_a_component_calls_and_listens_over_dds() {
    check(
        "a_client_without_a_component_calls_and_listens_over_dds",
        "test_client.py",
        "dds",
        144,
    );
}

#[test]
fn a_client_without_a_component_calls_and_listens_over_ros2() {
    check(
        "a_client_without_a_component_calls_and_listens_over_ros2",
        "test_client.py",
        "ros2",
        145,
    );
}

#[test]
fn hooks_states_parameters_and_errors_are_those_of_a_component() {
    check(
        "hooks_states_parameters_and_errors_are_those_of_a_component",
        "test_life.py",
        "local",
        0,
    );
}

#[test]
fn fakes_of_values_in_place_refuse_what_a_process_refuses() {
    check(
        "fakes_of_values_in_place_refuse_what_a_process_refuses",
        "test_testing.py",
        "local",
        0,
    );
}
