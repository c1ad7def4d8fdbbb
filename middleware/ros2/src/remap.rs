//! The rules of the setting `remap`, which give topics and services other names.

use crate::NAME;
use rc_middleware::Settings;
use rc_middleware::linked::UnmatchedRule;
use rc_vocabulary::Value;
use rc_vocabulary::ros::{self, Remapping};

/// The setting's key.
pub(crate) const KEY: &str = "remap";

/// The rules, in order.
pub(crate) fn rules(settings: &Settings) -> &[Remapping] {
    match settings.value(NAME, KEY) {
        Some(Value::Remappings(rules)) => rules,
        _ => &[],
    }
}

/// The rules that neither begin with an absolute name nor name one of `slots` or an operation of it.
pub(crate) fn unmatched(settings: &Settings, slots: &[(&str, Vec<&str>)]) -> Vec<UnmatchedRule> {
    let all = rules(settings).iter().filter_map(|rule| {
        Some(UnmatchedRule {
            help: ros::unknown_target_help(&rule.from, slots)?,
            rule: format!("{KEY} `{rule}`"),
            target: rule.from.clone(),
        })
    });
    all.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_for_no_slot_is_found_with_the_nearest_name() {
        let mut settings = Settings::default();
        let given = ["/a:=/b", "Laser:=/c", "Laser/scan:=/d", "Lasr:=/e"];
        let given = given.iter().filter_map(|rule| Remapping::parse(rule));
        settings.set(NAME, KEY, Value::Remappings(given.collect()));
        let found = unmatched(&settings, &[("Laser", vec!["scan"])]);
        let wanted = UnmatchedRule {
            rule: "remap `Lasr:=/e`".to_owned(),
            target: "Lasr".to_owned(),
            help: "did you mean `Laser`?".to_owned(),
        };
        assert_eq!(found, [wanted]);
        assert_eq!(unmatched(&Settings::default(), &[]), []);
    }
}
