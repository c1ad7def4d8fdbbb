//! The order in which managed units are activated and deactivated.

use super::net::{Net, after, with_policy};
use super::{component, exit, managed};
use crate::supervisor::supervise::StopReason;
use rc_deploy_network::plan::Policy;
use rc_management::lifecycle::LifecycleState::{self, Active, Inactive, Unconfigured};
use rc_management::lifecycle::Transition;
use rc_management::link::{ComponentMessage, LifecycleReport};
use rc_management::supervisor::Verb;
use std::time::Duration;

#[test]
fn managed_units_are_activated_when_all_are_configured() {
    let mut net = Net::connected(vec![
        managed("a"),
        after("a", managed("b")),
        after("b", component("c")),
    ]);
    net.turn();
    net.say(0, &ComponentMessage::Ready);
    net.report_state(0, Unconfigured, 0);
    net.turn();
    assert_eq!(net.told(), [("a", Inactive)]);
    net.obey(0);
    net.turn();
    // `a` waits for the configuration of `b`.
    assert_eq!((net.told(), net.alive()), (vec![], vec!["a", "b"]));
    net.say(1, &ComponentMessage::Ready);
    net.report_state(1, Unconfigured, 0);
    net.turn();
    assert_eq!(net.told(), [("b", Inactive)]);
    net.obey(1);
    net.turn();
    assert_eq!(net.told(), [("a", Active)], "`b` needs it");
    net.obey(0);
    net.turn();
    assert_eq!(
        (net.told(), net.alive()),
        (vec![("b", Active)], vec!["a", "b"])
    );
    net.obey(1);
    net.turn();
    assert_eq!(net.alive(), ["a", "b", "c"]);
}

#[test]
fn a_unit_that_is_gone_holds_up_no_activation() {
    let mut net = Net::connected(vec![managed("a"), managed("b")]);
    net.turn();
    net.say(0, &ComponentMessage::Ready);
    net.report_state(0, Unconfigured, 0);
    net.turn();
    net.obey(0);
    net.turn();
    assert_eq!(net.told(), []);
    net.units[1].hold();
    net.turn();
    assert_eq!(net.told(), [("a", Active)]);
}

#[test]
fn managed_units_are_deactivated_after_their_dependents() {
    let deactivate = Verb::Lifecycle(Transition::Deactivate);
    let clean_up = Verb::Lifecycle(Transition::Cleanup);
    let pair = || vec![managed("a"), after("a", managed("b"))];
    let mut net = Net::up(pair());
    net.command(clean_up, &[]);
    assert_eq!(
        net.events(),
        ["- asked: asked to cleanup all managed components"]
    );
    net.turn();
    assert_eq!(net.told(), [("b", Inactive)]);
    net.report_state(1, LifecycleState::Deactivating, 2);
    net.turn();
    assert_eq!(net.told(), [("b", Inactive)]);
    net.obey(1);
    net.turn();
    assert_eq!(net.told(), [("b", Unconfigured)], "it goes on");
    net.obey(1);
    net.turn();
    assert_eq!(net.told(), [("a", Inactive)]);
    net.obey(0);
    net.turn();
    assert_eq!(
        net.told(),
        [("a", Unconfigured)],
        "one that is not active waits for none"
    );

    // A dependent that is to stay active does not delay it.
    let mut net = Net::up(pair());
    net.command(deactivate, &["a"]);
    net.turn();
    assert_eq!(net.told(), [("a", Inactive)]);
    // One that is inactive and stays so does not either.
    let mut net = Net::up(pair());
    net.command(deactivate, &["b"]);
    net.turn();
    net.obey(1);
    net.command(deactivate, &["a"]);
    net.turn();
    assert_eq!(net.told(), [("a", Inactive)]);
    // Nor does one that has ended, or whose hook leads back to its state.
    let mut net = Net::up(pair());
    net.command(deactivate, &[]);
    net.units[1].hold();
    net.end(1, exit(0));
    net.turn();
    assert_eq!(net.told(), [("a", Inactive)]);
}

#[test]
fn a_first_goal_that_is_missed_stops_the_network() {
    let mut net = Net::connected(vec![managed("a")]);
    net.turn();
    net.say(0, &ComponentMessage::Ready);
    net.report_state(0, Unconfigured, 0);
    net.turn();
    let error = Some("configure: no motor".to_owned());
    let report = LifecycleReport {
        state: Unconfigured,
        done: 1,
        error,
    };
    net.say(0, &ComponentMessage::Lifecycle(report.clone()));
    net.turn();
    assert!(
        net.failure()
            .expect("a failure")
            .starts_with("a: configure: no motor")
    );

    // Later, a command or the policy decides.
    let mut net = Net::up(vec![with_policy(Policy::OnFailure, managed("a"))]);
    net.command(Verb::Lifecycle(Transition::Deactivate), &["a"]);
    net.turn();
    net.events();
    let report = LifecycleReport { done: 3, ..report };
    net.say(0, &ComponentMessage::Lifecycle(report.clone()));
    net.turn();
    assert_eq!(net.events(), ["! a not-changed: configure: no motor"]);
    assert_eq!((net.failure(), net.asked()), (None, vec![]));
    assert_eq!(
        net.units[0].lifecycle_goal(),
        Some(Unconfigured),
        "it stays where it is"
    );

    let mut net = Net::up(vec![with_policy(Policy::OnFailure, managed("a"))]);
    net.end(0, exit(1));
    net.units[0].due = None;
    net.turn();
    net.say(0, &ComponentMessage::Ready);
    net.report_state(0, Unconfigured, 0);
    net.turn();
    net.events();
    net.say(0, &ComponentMessage::Lifecycle(report));
    net.turn();
    assert_eq!(net.events(), ["! a not-changed: configure: no motor"]);
    assert_eq!((net.failure(), net.asked()), (None, vec!["a"]));
    // Missed beats on the way to its end are not reported.
    let fails = |number| LifecycleReport {
        state: Unconfigured,
        done: number,
        error: Some("no".to_owned()),
    };
    net.say(0, &ComponentMessage::Lifecycle(fails(3)));
    net.turn();
    assert_eq!(net.events(), [""; 0]);
}

#[test]
fn a_goal_is_given_up_when_its_unit_ends_in_a_command() {
    let mut net = Net::up(vec![with_policy(Policy::OnFailure, managed("a"))]);
    net.command(Verb::Lifecycle(Transition::Deactivate), &["a"]);
    net.turn();
    net.obey(0);
    net.turn();
    assert!(!net.commands.changes_lifecycle(0));
    net.command(Verb::Lifecycle(Transition::Activate), &["a"]);
    net.turn();
    net.end(0, exit(1));
    net.units[0].due = None;
    net.turn();
    assert_eq!(net.units[0].lifecycle_goal(), Some(Inactive));
    // Without a command, it returns to its goal.
    let mut net = Net::up(vec![with_policy(Policy::OnFailure, managed("a"))]);
    net.units[0].set_lifecycle_goal(Inactive);
    net.end(0, exit(1));
    net.units[0].due = None;
    net.turn();
    assert_eq!(net.units[0].lifecycle_goal(), Some(Inactive));
}

#[test]
fn no_goal_is_sent_while_the_network_stops() {
    let mut net = Net::connected(vec![managed("a")]);
    net.turn();
    net.say(0, &ComponentMessage::Ready);
    net.report_state(0, Unconfigured, 0);
    net.units[0].send_goal(Inactive, Duration::ZERO);
    net.stop(StopReason::Asked, "a test");
    net.advance_lifecycles();
    assert_eq!(net.told(), [], "a late goal is forgotten");
    net.advance_lifecycles();
    assert_eq!(net.told(), []);
}

#[test]
fn commands_are_refused_without_an_effect() {
    let mut net = Net::up(vec![component("a"), managed("m")]);
    let activate = Verb::Lifecycle(Transition::Activate);
    net.command(Verb::Stop, &["b"]);
    net.command(activate, &["a"]);
    net.command(activate, &["x"]);
    assert_eq!((net.events(), net.commands.deadline()), (vec![], None));
    net.command(activate, &["m"]);
    assert_eq!(net.events(), ["- asked: asked to activate m"]);
    assert!(net.commands.changes_lifecycle(1) && !net.commands.changes_lifecycle(0));
    net.advance_commands();
    assert_eq!(net.commands.deadline(), None);
    net.command(activate, &[]);
    assert!(net.commands.changes_lifecycle(1) && !net.commands.changes_lifecycle(0));
    net.stop(StopReason::Asked, "a test");
    net.advance_commands();
    assert_eq!(net.commands.deadline(), None);
    net.events();
    net.command(Verb::Stop, &["a"]);
    assert_eq!((net.events(), net.commands.deadline()), (vec![], None));
    let mut net = Net::up(vec![component("a")]);
    net.command(activate, &[]);
    assert_eq!(net.events(), [""; 0]);
}
