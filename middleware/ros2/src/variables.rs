//! Variables of ROS 2 that choose settings.

use std::collections::BTreeMap;

/// Adds what variables of ROS 2 choose and no setting does: a tool may have other variables.
pub(crate) fn add(
    settings: &mut BTreeMap<String, String>,
    variable: &dyn Fn(&str) -> Option<String>,
) {
    if let Some(domain) = variable("ROS_DOMAIN_ID") {
        settings.entry("domain".to_owned()).or_insert(domain);
    }
    let is_local = variable("ROS_LOCALHOST_ONLY").is_some_and(|value| value != "0")
        || variable("ROS_AUTOMATIC_DISCOVERY_RANGE").is_some_and(|range| range == "LOCALHOST");
    if is_local {
        let interfaces = settings.entry("interfaces".to_owned());
        interfaces.or_insert_with(|| "127.0.0.1".to_owned());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_are_settings_unless_a_setting_is_there() {
        let variable = |name: &str| match name {
            "ROS_DOMAIN_ID" => Some("7".to_owned()),
            "ROS_LOCALHOST_ONLY" => Some("1".to_owned()),
            _ => None,
        };
        let mut settings = BTreeMap::from([("domain".to_owned(), "3".to_owned())]);
        add(&mut settings, &variable);
        assert_eq!(settings["domain"], "3");
        assert_eq!(settings["interfaces"], "127.0.0.1");
        let mut settings = BTreeMap::new();
        add(&mut settings, &|_| None);
        assert!(settings.is_empty());
        add(&mut settings, &variable);
        assert_eq!(settings["domain"], "7");
    }
}
