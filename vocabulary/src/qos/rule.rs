//! Rules that override the quality of service that a `.cdsl` declares.
//!
//! A rule is `SLOT.POLICY:=VALUE` or `SLOT/operation.POLICY:=VALUE`, such as
//! `LaserPub/newScan.depth:=1`. Policies and values are those of topics in a `.cdsl`; a duration
//! may also be `none`.

use super::policy::{Policy, PolicyName, Values};
use crate::duration;
use crate::scalar::Scalar;
use crate::target::unknown_target_help;
use rc_diagnostics::nearest;
use std::fmt;

/// The policy of topics that a word names. The error says what is allowed.
fn named(word: &str) -> Result<PolicyName, String> {
    let mut all = PolicyName::of_topics();
    all.clone().find(|name| name.word() == word).ok_or_else(|| {
        let hint = if let Some(near) = nearest(word, all.clone().map(PolicyName::word)) {
            format!("did you mean `{near}`?")
        } else {
            let all: Vec<&str> = all.by_ref().map(PolicyName::word).collect();
            format!("there are {}", all.join(", "))
        };
        format!("`{word}` is not a quality of service that can be set; {hint}")
    })
}

/// The allowed values of a policy in a rule, for messages. `None` for an unknown policy.
pub fn allowed(policy: &str) -> Option<String> {
    Some(match named(policy).ok()?.values() {
        Values::Words(words) => words.join(" or "),
        Values::Count(range) => format!("an integer from {} to {}", range.start(), range.end()),
        Values::Time | Values::Limit | Values::Within(_) => {
            "a duration such as 500ms, at most a day, or none".to_owned()
        }
    })
}

/// All policies with their values, for messages: those that are durations at the end.
pub(crate) fn all_allowed() -> String {
    let (mut all, mut times) = (Vec::new(), Vec::new());
    for name in PolicyName::of_topics() {
        match name.values() {
            Values::Words(words) => all.push(format!("{name} ({})", words.join(", "))),
            Values::Count(range) => {
                all.push(format!("{name} ({} to {})", range.start(), range.end()));
            }
            Values::Time | Values::Limit | Values::Within(_) => times.push(name.word()),
        }
    }
    let times = crate::listed(times, "and");
    format!("{}, {times} (a duration, or none)", all.join(", "))
}

/// Converts a scalar into the value of the policy `name`. An integer counts milliseconds where a
/// duration is expected. The error says what is allowed.
pub fn convert(name: &str, scalar: Scalar<'_>) -> Result<Policy, String> {
    let policy = named(name)?.read(scalar);
    let policy = policy.filter(|policy| {
        let time = policy.time().flatten();
        time.is_none_or(|time| time <= duration::LONGEST)
    });
    policy.ok_or_else(|| {
        let written = match scalar {
            Scalar::Int(number) => number.to_string(),
            Scalar::Bool(choice) => choice.to_string(),
            Scalar::Duration(nanoseconds) => duration::text(nanoseconds),
            Scalar::Text(text) => text.to_owned(),
            Scalar::Other => "this".to_owned(),
        };
        let allowed = allowed(name).unwrap_or_default();
        format!("`{name}` cannot be `{written}`; allowed is {allowed}")
    })
}

/// Parses the text of a value. The error says what is allowed.
pub fn parse(name: &str, value: &str) -> Result<Policy, String> {
    let counts = named(name)?.counts();
    let number = value.parse().ok().filter(|_| counts);
    convert(name, number.map_or(Scalar::Text(value), Scalar::Int))
}

/// A policy for a slot or one of its operations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rule {
    /// A slot, or `SLOT/operation`.
    pub target: String,
    /// The policy that applies to it.
    pub policy: Policy,
}

impl Rule {
    /// Parses `TARGET.POLICY:=VALUE`. The error says what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let format = || {
            format!(
                "`{text}` is not SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as LaserPub/newScan.depth:=1"
            )
        };
        let (left, value) = text.split_once(":=").ok_or_else(format)?;
        let (target, policy) = left.rsplit_once('.').ok_or_else(format)?;
        if !is_target(target) {
            return Err(format());
        }
        Ok(Self {
            target: target.to_owned(),
            policy: parse(policy, value)?,
        })
    }

    /// Makes a rule of its parts. The error says what is allowed.
    pub fn new(target: &str, policy: &str, value: Scalar<'_>) -> Result<Self, String> {
        if !is_target(target) {
            return Err(format!("`{target}` is neither SLOT nor SLOT/operation"));
        }
        Ok(Self {
            target: target.to_owned(),
            policy: convert(policy, value)?,
        })
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.target, self.policy)
    }
}

fn is_target(text: &str) -> bool {
    let is_name = |part: &str| {
        let first = part.chars().next();
        first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    text.split('/').count() <= 3 && text.split('/').all(is_name)
}

/// The policies that apply to a topic, each at most once. A rule for the operation takes
/// precedence over one for its slot; among equals, the first rule applies.
pub fn policies(rules: &[Rule], slot: &str, operation: &str) -> Vec<Policy> {
    let of_the_operation = rules
        .iter()
        .filter(|rule| rule.target.rsplit_once('/') == Some((slot, operation)));
    let of_the_slot = rules.iter().filter(|rule| rule.target == slot);
    let mut found: Vec<Policy> = Vec::new();
    for Rule { policy, .. } in of_the_operation.chain(of_the_slot) {
        if found.iter().all(|other| other.name() != policy.name()) {
            found.push(*policy);
        }
    }
    found
}

/// Help for a rule whose target is neither a topic nor a slot with topics. `slots` are the slots
/// with their topics. `None` if the target exists.
pub fn unknown_topic_help(target: &str, slots: &[(&str, Vec<&str>)]) -> Option<String> {
    let allowed = "allowed is a slot that publishes or subscribes, or SLOT/operation; calls have no other quality";
    unknown_target_help(target, slots, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qos::Reliability;

    fn read(text: &str) -> Result<String, String> {
        Rule::parse(text).map(|rule| rule.to_string())
    }

    #[test]
    fn valid_rules_are_parsed() {
        for (text, usual) in [
            ("Laser.reliability:=best_effort", None),
            ("Laser/newScan.durability:=transient_local", None),
            ("Laser.depth:=1000", None),
            ("Laser.deadline:=0.5s", Some("Laser.deadline:=500ms")),
            ("Laser.liveliness:=none", None),
            ("_l.lifespan:=1us", None),
        ] {
            assert_eq!(read(text).as_deref(), Ok(usual.unwrap_or(text)));
        }
    }

    #[test]
    fn invalid_rules_are_rejected_with_the_allowed_values() {
        for (text, said) in [
            ("Laser.depth=1", "such as LaserPub/newScan.depth:=1"),
            ("depth:=1", "SLOT.POLICY:=VALUE"),
            ("a/b/c/d.depth:=1", "SLOT.POLICY:=VALUE"),
            ("/scan.depth:=1", "SLOT.POLICY:=VALUE"),
            ("Laser.dept:=1", "did you mean `depth`?"),
            (
                "Laser.history:=keep_all",
                "there are reliability, durability",
            ),
            ("Laser.depth:=0", "from 1 to 1000"),
            ("Laser.depth:=4294967297", "from 1 to 1000"),
            ("Laser.reliability:=best", "reliable or best_effort"),
            ("Laser.deadline:=0s", "a duration such as 500ms"),
            ("Laser.deadline:=2000min", "at most a day, or none"),
            ("Laser.deadline:=10", "a duration such as 500ms"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn the_more_specific_rule_wins() {
        let rules = [
            "Laser.depth:=1",
            "Laser/newScan.depth:=2",
            "Laser/newScan.depth:=3",
            "Laser.reliability:=reliable",
            "Base.depth:=4",
        ]
        .map(|text| Rule::parse(text).expect("a rule"));
        assert_eq!(
            policies(&rules, "Laser", "newScan"),
            [Policy::Depth(2), Policy::Reliability(Reliability::Reliable)]
        );
        assert_eq!(
            policies(&rules, "Laser", "other"),
            [Policy::Depth(1), Policy::Reliability(Reliability::Reliable)]
        );
        assert_eq!(policies(&rules, "Arm", "newScan"), []);
    }
}
