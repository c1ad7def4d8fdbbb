//! The status of a group with a proxy: one answer for all of its components.

use crate::log::reporter::Reporter;
use crate::supervisor::unit::Unit;
use rc_management::component::GroupStatus;
use rc_management::event::Severity;
use rc_management::supervisor::{ComponentState, ComponentStatus};
use std::collections::BTreeMap;

/// The code of the condition that a component behind a proxy does not run, and of its end.
const INCOMPLETE: &str = "group-incomplete";
const COMPLETE: &str = "group-complete";

/// Begins and ends the condition of each group with a proxy whose components do not all run, and
/// sends the proxies the states of their groups.
pub(super) fn watch(units: &mut [Unit], report: &Reporter) {
    for at in 0..units.len() {
        let proxy = &units[at];
        if proxy.component.behind.is_empty() || !proxy.is_ready() {
            continue;
        }
        let group = group(units, at);
        units[at].tell_group(group);
        let proxy = &units[at];
        let behind = proxy.component.behind.iter();
        let behind = behind.filter_map(|name| units.iter().find(|unit| unit.name() == name));
        let worst = behind.max_by_key(|unit| severity(unit.state()));
        let worst =
            worst.filter(|unit| severity(unit.state()) >= severity(ComponentState::Waiting));
        let text = worst.map(|unit| format!("`{}` is {}", unit.name(), unit.state()));
        let proxy = &mut units[at];
        match text {
            Some(text) => {
                let is_new = !proxy.health.has(INCOMPLETE);
                proxy.health.begun(INCOMPLETE, &text);
                if is_new {
                    proxy.event(report, Severity::Warning, INCOMPLETE, text);
                }
            }
            None if proxy.health.ended(INCOMPLETE) => {
                let text = "all components of the group run again";
                proxy.event(report, Severity::Info, COMPLETE, text);
            }
            None => {}
        }
    }
}

/// The group of a proxy.
fn group(units: &[Unit], at: usize) -> GroupStatus {
    let proxy = &units[at];
    let behind = proxy.component.behind.iter();
    let behind: Vec<&Unit> = behind
        .filter_map(|name| units.iter().find(|unit| unit.name() == name))
        .collect();
    let all = behind.iter().copied().chain([proxy]);
    let worst = all.map(Unit::state).max_by_key(|state| severity(*state));
    GroupStatus {
        state: worst.unwrap_or_else(|| proxy.state()),
        ready: behind.iter().all(|unit| unit.is_ready() && unit.is_alive()),
        components: behind
            .iter()
            .map(|unit| (unit.name().to_owned(), unit.state()))
            .collect(),
    }
}

/// Gives each proxy the worst state of the components behind it.
pub(super) fn take_states(components: &mut [ComponentStatus]) {
    let known: BTreeMap<&str, (ComponentState, bool)> = components
        .iter()
        .map(|component| (component.name.as_str(), (component.state, component.ready)))
        .collect();
    let mut taken = Vec::new();
    for (at, proxy) in components.iter().enumerate() {
        let behind = proxy.behind.iter();
        let behind = behind.filter_map(|name| known.get(name.as_str()).copied());
        let Some((state, _)) = behind.clone().max_by_key(|(state, _)| severity(*state)) else {
            continue;
        };
        let ready = proxy.ready && behind.clone().all(|(_, ready)| ready);
        let worse = severity(state) > severity(proxy.state);
        taken.push((at, ready, worse.then_some(state)));
    }
    for (at, ready, worse) in taken {
        let proxy = &mut components[at];
        proxy.ready = ready;
        proxy.state = worse.unwrap_or(proxy.state);
    }
}

/// Severity of a state for the users of a group, from 0.
fn severity(state: ComponentState) -> u8 {
    match state {
        ComponentState::Running | ComponentState::Done => 0,
        ComponentState::Emergency => 1,
        ComponentState::Starting => 2,
        ComponentState::Waiting => 3,
        ComponentState::Stopping => 4,
        ComponentState::Stopped => 5,
        ComponentState::Hung => 6,
        ComponentState::Failed => 7,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(name: &str, state: &str, behind: &[&str]) -> ComponentStatus {
        let json = serde_json::json!({
            "name": name, "state": state, "pid": 1, "uptime_s": 1.0, "ready": state == "running",
            "middleware": "local", "executable": "/x", "log": "/x.log", "restarts": 0,
            "ready_ms": 1, "stop_ms": 1, "exit": null, "behind": behind,
        });
        serde_json::from_value(json).expect("a status")
    }

    #[test]
    fn a_proxy_is_as_the_worst_component_behind_it() {
        let status = |left: &str, right: &str| {
            let mut all = vec![
                component("arm", "running", &["arm.left", "arm.right"]),
                component("arm.left", left, &[]),
                component("arm.right", right, &[]),
                component("other", "failed", &[]),
            ];
            take_states(&mut all);
            (all[0].state, all[0].ready)
        };
        let running = (ComponentState::Running, true);
        assert_eq!(status("running", "running"), running);
        let failed = (ComponentState::Failed, false);
        assert_eq!(status("stopped", "failed"), failed);
        let emergency = (ComponentState::Emergency, false);
        assert_eq!(status("running", "emergency"), emergency);
    }
}
