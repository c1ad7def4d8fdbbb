//! A generated component in Python conforms over each middleware.

mod package;

use rc_other_end::{Network, Over};

fn conforms(over: Over) {
    if let Some(package) = package::package(over) {
        rc_other_end::conforms(Network::new("py", over), package, |_| ());
    }
}

#[test]
fn a_component_in_python_conforms_over_iceoryx2() {
    conforms(Over::iceoryx2());
}

#[test]
fn a_component_in_python_conforms_over_dds() {
    conforms(Over::dds(146));
}

#[test]
fn a_component_in_python_conforms_over_ros2() {
    conforms(Over::ros2(147));
}
