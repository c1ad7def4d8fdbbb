//! Checks a plan before the supervisor relies on it.

use rc_deploy_client::error::Error;
use rc_deploy_client::names::check_name;
use rc_deploy_network::Plan;
use std::collections::BTreeSet;
use std::time::Duration;

/// The longest limit of a component. A longer one is a mistake, and might overflow a time.
const LONGEST: Duration = Duration::from_hours(24);

/// Checks the supervisor's assumptions: names that can be file names, no duplicate names, `after`
/// names components.
pub(crate) fn check(plan: &Plan) -> Result<(), Error> {
    check_name("network", &plan.network)?;
    let mut names = BTreeSet::new();
    for component in &plan.components {
        check_name("component", &component.name)?;
        if !names.insert(component.name.as_str()) {
            let message = format!(
                "two components of {} are called {}",
                plan.network, component.name
            );
            return Err(Error::Plan(message));
        }
    }
    for component in &plan.components {
        let times = [component.ready, component.stop, component.restart.backoff];
        if times.into_iter().any(|time| time > LONGEST) {
            let message = format!(
                "a limit of {} is longer than a day; shorten its `ready`, `stop` or `backoff`",
                component.name
            );
            return Err(Error::Plan(message));
        }
        let unknown = component
            .after
            .iter()
            .find(|name| !names.contains(name.as_str()));
        if let Some(unknown) = unknown {
            let message = format!(
                "{} starts after {unknown}, which is not a component of {}",
                component.name, plan.network
            );
            return Err(Error::Plan(message));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_deploy_network::plan::Component;

    fn plan(names: &[&str]) -> Plan {
        let components = names
            .iter()
            .map(|name| Component::new(*name, "/bin/true", "/"));
        Plan::new("net", "net.ddsl", components)
    }

    #[test]
    fn errors_of_a_plan_name_the_component() {
        let message = |plan: &Plan| check(plan).unwrap_err().to_string();
        let mut late = plan(&["a"]);
        late.components[0].after.push("b".to_owned());
        assert!(message(&late).contains("a starts after b"));
        assert!(message(&plan(&["a", "a"])).contains("called a"));
        assert!(message(&plan(&["../a"])).contains("`../a`"));
        assert!(message(&plan(&["rcdeploy"])).contains("reserved"));
        let mut endless = plan(&["a"]);
        endless.components[0].stop = LONGEST;
        assert!(check(&endless).is_ok());
        endless.components[0].stop = Duration::MAX;
        assert!(
            check(&endless)
                .unwrap_err()
                .to_string()
                .contains("longer than a day")
        );
    }
}
