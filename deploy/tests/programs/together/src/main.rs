//! Runs shipped components and a troublesome one on threads of one process, as the program that
//! `rcdeploy up --build` writes for a process of a network.

use rc_runtime::ComponentType;

static COMPONENTS: &[ComponentType] = &[
    ComponentType::new::<avoider::SpecificWorker, avoider_generated::Context>(),
    ComponentType::new::<neighbour::SpecificWorker, neighbour_generated::Context>(),
    ComponentType::new::<simulator::SpecificWorker, simulator_generated::Context>(),
];

fn main() -> std::process::ExitCode {
    rc_runtime::run_components(COMPONENTS)
}
