//! The supervisor's reaction to late chains.

use super::component;
use super::net::{Net, on};
use rc_deploy_network::planned_chain::{LateAction, PlannedChain};

fn chain(name: &str, late: LateAction) -> PlannedChain {
    PlannedChain {
        name: name.to_owned(),
        from: String::new(),
        to: String::new(),
        within: None,
        age: None,
        late,
        source: None,
        hops: Vec::new(),
    }
}

#[test]
fn a_component_is_stopped_before_the_next_chain_is_reported() {
    let stops = |name: &str| chain(name, LateAction::Stop(name.to_owned()));
    let chains = vec![stops("a"), chain("c", LateAction::Warn), stops("b")];
    let components = ["a", "b"].map(|name| on("h", component(name)));
    let mut net = Net::with_chains(components.into(), chains);
    net.events();
    for number in 0..3 {
        let watch = net.chains.as_ref().expect("chains");
        watch.pretend_late(number);
    }
    net.take_changes_of_chains();
    assert_eq!(
        net.events(),
        [
            "! - chain-late: chain 0 is late",
            "- asked: asked to stop a",
            "! - chain-late: chain 1 is late",
            "! - chain-late: chain 2 is late",
            "- asked: asked to stop b",
        ]
    );
}
