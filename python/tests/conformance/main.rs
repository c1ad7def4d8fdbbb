//! Generated components in Python conform over each middleware.

mod package;

use rc_other_end::{Network, Over};

fn conforms(over: Over) {
    if let Some(package) = package::package("every_type", over) {
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

fn ages(over: Over, carries_ages: bool) {
    if package::package("aged", over).is_none() {
        return;
    }
    let network = Network::new("py-aged", over);
    rc_other_end::ages(&network, carries_ages, &|battery| {
        let mut package = package::package("aged", over).expect("it was there before");
        package.command.env("AGED_BATTERY", battery);
        package
    });
}

#[test]
fn values_in_python_know_their_age_over_iceoryx2() {
    ages(Over::iceoryx2(), true);
}

#[test]
fn values_in_python_know_their_age_over_dds() {
    ages(Over::dds(148), false);
}

#[test]
fn values_in_python_know_their_age_over_ros2() {
    ages(Over::ros2(141), false);
}
