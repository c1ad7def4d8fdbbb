//! Overrides of the quality of service that a `.cdsl` declares.
//!
//! A rule is `SLOT.POLICY:=VALUE` or `SLOT/operation.POLICY:=VALUE`, such as
//! `LaserPub/newScan.depth:=1`. Policies and values are those of the `.cdsl`; a duration may also
//! be `none`.

use crate::duration::{self, LONGEST};
use crate::scalar::Scalar;
use crate::target::unknown_target_help;
use rc_diagnostics::nearest;
use std::fmt;
use std::ops::RangeInclusive;
use std::time::Duration;

/// The policies that a rule can set.
pub const POLICIES: [&str; 6] = [
    "reliability",
    "durability",
    "depth",
    "deadline",
    "lifespan",
    "liveliness",
];
/// The policies whose values are durations.
pub const DURATIONS: [&str; 3] = ["deadline", "lifespan", "liveliness"];
/// The depth that a rule can set, in samples.
pub const DEPTH: RangeInclusive<u32> = 1..=1000;

/// One policy with its value. A duration of `None` means that there is no limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// `reliability`: whether lost samples are sent again.
    Reliable(bool),
    /// `durability`: whether late joiners get samples that were sent before.
    TransientLocal(bool),
    /// `depth`: how many samples the history keeps.
    Depth(u32),
    /// `deadline`: the longest time between two samples.
    Deadline(Option<Duration>),
    /// `lifespan`: the time after which a sample expires.
    Lifespan(Option<Duration>),
    /// `liveliness`: the time of silence after which a publisher counts as dead.
    Liveliness(Option<Duration>),
}

/// The allowed values of a policy, for messages. `None` for an unknown policy.
pub fn allowed(policy: &str) -> Option<String> {
    Some(match policy {
        "reliability" => "reliable or best_effort".to_owned(),
        "durability" => "volatile or transient_local".to_owned(),
        "depth" => format!("an integer from {} to {}", DEPTH.start(), DEPTH.end()),
        _ if DURATIONS.contains(&policy) => {
            "a duration such as 500ms, at most a day, or none".to_owned()
        }
        _ => return None,
    })
}

impl Policy {
    /// Converts a scalar into the value of the policy `name`. An integer counts milliseconds
    /// where a duration is expected. The error says what is allowed.
    pub fn convert(name: &str, scalar: Scalar<'_>) -> Result<Self, String> {
        let allowed = allowed(name).ok_or_else(|| unknown_policy(name))?;
        let limit = |nanoseconds: Option<u64>| {
            let limit = nanoseconds.map(Duration::from_nanos);
            let limit = limit.filter(|limit| !limit.is_zero() && *limit <= LONGEST);
            limit.map(Some)
        };
        let limit = match scalar {
            Scalar::Text("none") => Some(None),
            Scalar::Text(text) => limit(duration::parse(text)),
            Scalar::Int(milliseconds) => limit(duration::from_milliseconds(milliseconds)),
            Scalar::Duration(nanoseconds) => limit(Some(nanoseconds)),
            Scalar::Bool(_) | Scalar::Other => None,
        };
        let policy = match (name, scalar) {
            ("reliability", Scalar::Text("reliable")) => Some(Self::Reliable(true)),
            ("reliability", Scalar::Text("best_effort")) => Some(Self::Reliable(false)),
            ("durability", Scalar::Text("transient_local")) => Some(Self::TransientLocal(true)),
            ("durability", Scalar::Text("volatile")) => Some(Self::TransientLocal(false)),
            ("depth", Scalar::Int(depth)) => {
                let depth = u32::try_from(depth).ok();
                let depth = depth.filter(|depth| DEPTH.contains(depth));
                depth.map(Self::Depth)
            }
            ("deadline", _) => limit.map(Self::Deadline),
            ("lifespan", _) => limit.map(Self::Lifespan),
            ("liveliness", _) => limit.map(Self::Liveliness),
            _ => None,
        };
        policy.ok_or_else(|| {
            let written = match scalar {
                Scalar::Int(number) => number.to_string(),
                Scalar::Bool(choice) => choice.to_string(),
                Scalar::Duration(nanoseconds) => duration::text(nanoseconds),
                Scalar::Text(text) => text.to_owned(),
                Scalar::Other => "this".to_owned(),
            };
            format!("`{name}` cannot be `{written}`; allowed is {allowed}")
        })
    }

    /// Parses the text of a value. The error says what is allowed.
    pub fn parse(name: &str, value: &str) -> Result<Self, String> {
        let number = value.parse().ok().filter(|_| name == "depth");
        Self::convert(name, number.map_or(Scalar::Text(value), Scalar::Int))
    }

    /// The name of the policy.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Reliable(_) => "reliability",
            Self::TransientLocal(_) => "durability",
            Self::Depth(_) => "depth",
            Self::Deadline(_) => "deadline",
            Self::Lifespan(_) => "lifespan",
            Self::Liveliness(_) => "liveliness",
        }
    }
}

/// Prints `NAME:=VALUE`.
impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:=", self.name())?;
        match self {
            Self::Reliable(yes) => f.write_str(if *yes { "reliable" } else { "best_effort" }),
            Self::TransientLocal(yes) => {
                f.write_str(if *yes { "transient_local" } else { "volatile" })
            }
            Self::Depth(depth) => depth.fmt(f),
            Self::Deadline(limit) | Self::Lifespan(limit) | Self::Liveliness(limit) => {
                match limit {
                    Some(limit) => f.write_str(&duration::text_of(*limit)),
                    None => f.write_str("none"),
                }
            }
        }
    }
}

fn unknown_policy(name: &str) -> String {
    let hint = match nearest(name, POLICIES.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", POLICIES.join(", ")),
    };
    format!("`{name}` is not a quality of service that can be set; {hint}")
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
            policy: Policy::parse(policy, value)?,
        })
    }

    /// A rule of its parts. The error says what is allowed.
    pub fn new(target: &str, policy: &str, value: Scalar<'_>) -> Result<Self, String> {
        if !is_target(target) {
            return Err(format!("`{target}` is neither SLOT nor SLOT/operation"));
        }
        Ok(Self {
            target: target.to_owned(),
            policy: Policy::convert(policy, value)?,
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

/// Help for a rule whose target is no slot of topics and no topic. `slots` are the slots of
/// topics with their topics. `None` if the target exists.
pub fn unknown_topic_help(target: &str, slots: &[(&str, Vec<&str>)]) -> Option<String> {
    let allowed = "allowed is a slot that publishes or subscribes, or SLOT/operation; calls have no other quality";
    unknown_target_help(target, slots, allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

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
            [Policy::Depth(2), Policy::Reliable(true)]
        );
        assert_eq!(
            policies(&rules, "Laser", "other"),
            [Policy::Depth(1), Policy::Reliable(true)]
        );
        assert_eq!(policies(&rules, "Arm", "newScan"), []);
    }
}
