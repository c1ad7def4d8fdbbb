//! Quality of service that is set at run time, in the place of what a component was made with.
//!
//! A rule is `SLOT.POLICY:=VALUE` or `SLOT/operation.POLICY:=VALUE`, such as `LaserPub/newScan.depth:=1`. Policies and
//! values are those of the `.cdsl`; a time may also be `none`.

use rc_diagnostics::{duration_nanoseconds, duration_text, nearest};
use std::ops::RangeInclusive;

/// What may be set.
pub const POLICIES: [&str; 6] = [
    "reliability",
    "durability",
    "depth",
    "deadline",
    "lifespan",
    "liveliness",
];
/// Those that are times.
pub const TIMES: [&str; 3] = ["deadline", "lifespan", "liveliness"];
/// How many values may be kept.
pub const DEPTH: RangeInclusive<u32> = 1..=1000;

/// One policy with its value; times are in nanoseconds, none where nothing is promised or asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Policy {
    /// Whether what was sent arrives.
    Reliable(bool),
    /// Whether those who come late get what was sent before.
    TransientLocal(bool),
    /// How many values are kept.
    Depth(u32),
    /// The longest time between two values.
    Deadline(Option<u64>),
    /// How long a value is worth anything.
    Lifespan(Option<u64>),
    /// After how long of silence a publisher counts as dead.
    Liveliness(Option<u64>),
}

/// What a policy may be, for messages; none where there is no such policy.
pub fn allowed(policy: &str) -> Option<String> {
    Some(match policy {
        "reliability" => "reliable or best_effort".to_owned(),
        "durability" => "volatile or transient_local".to_owned(),
        "depth" => format!("a whole number from {} to {}", DEPTH.start(), DEPTH.end()),
        _ if TIMES.contains(&policy) => "a time such as 500ms, at most a day, or none".to_owned(),
        _ => return None,
    })
}

impl Policy {
    /// Reads a value of a policy; an error says what is allowed.
    pub fn parse(name: &str, value: &str) -> Result<Self, String> {
        let allowed = allowed(name).ok_or_else(|| unknown(name))?;
        let time = match duration_nanoseconds(value) {
            _ if value == "none" => Some(None),
            time => time
                .filter(|time| (1..=crate::DAY).contains(time))
                .map(Some),
        };
        let read = match (name, value) {
            ("reliability", "reliable" | "best_effort") => {
                Some(Self::Reliable(value == "reliable"))
            }
            ("durability", "volatile" | "transient_local") => {
                Some(Self::TransientLocal(value == "transient_local"))
            }
            ("depth", _) => {
                let depth = value.parse().ok().filter(|depth| DEPTH.contains(depth));
                depth.map(Self::Depth)
            }
            ("deadline", _) => time.map(Self::Deadline),
            ("lifespan", _) => time.map(Self::Lifespan),
            ("liveliness", _) => time.map(Self::Liveliness),
            _ => None,
        };
        read.ok_or_else(|| format!("`{name}` cannot be `{value}`; allowed is {allowed}"))
    }

    /// Its name and its value, as they are written.
    pub fn words(&self) -> (&'static str, String) {
        let time = |time: &Option<u64>| time.map_or("none".to_owned(), duration_text);
        let word = |choice: bool, no: &str, yes: &str| if choice { yes } else { no }.to_owned();
        match self {
            Self::Reliable(yes) => ("reliability", word(*yes, "best_effort", "reliable")),
            Self::TransientLocal(yes) => ("durability", word(*yes, "volatile", "transient_local")),
            Self::Depth(depth) => ("depth", depth.to_string()),
            Self::Deadline(limit) => ("deadline", time(limit)),
            Self::Lifespan(limit) => ("lifespan", time(limit)),
            Self::Liveliness(limit) => ("liveliness", time(limit)),
        }
    }
}

/// What to say of a policy that there is not.
fn unknown(name: &str) -> String {
    let hint = match nearest(name, POLICIES.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are {}", POLICIES.join(", ")),
    };
    format!("`{name}` is not a quality of service that can be set; {hint}")
}

/// One rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rule<'a> {
    /// A slot, or `SLOT/operation`.
    pub of: &'a str,
    /// What holds there.
    pub policy: Policy,
}

impl<'a> Rule<'a> {
    /// Reads a rule; an error says what is allowed.
    pub fn parse(text: &'a str) -> Result<Self, String> {
        let form = || {
            format!(
                "`{text}` is not SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as LaserPub/newScan.depth:=1"
            )
        };
        let (left, value) = text.split_once(":=").ok_or_else(form)?;
        let (of, policy) = left.rsplit_once('.').ok_or_else(form)?;
        let is_name = |part: &str| {
            let first = part.chars().next();
            first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
                && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        if of.split('/').count() > 2 || !of.split('/').all(is_name) {
            return Err(form());
        }
        Ok(Self {
            of,
            policy: Policy::parse(policy, value)?,
        })
    }

    /// The rule in its usual form.
    pub fn text(&self) -> String {
        let (name, value) = self.policy.words();
        format!("{}.{name}:={value}", self.of)
    }
}

/// What rules say of a topic, for each policy that they name: a rule for the operation counts before one for its slot, else the
/// first one does. Texts that are no rules are passed over.
pub fn policies(rules: &[String], slot: &str, operation: &str) -> Vec<Policy> {
    let rules: Vec<Rule<'_>> = rules
        .iter()
        .filter_map(|text| Rule::parse(text).ok())
        .collect();
    let of_the_operation = rules
        .iter()
        .filter(|rule| rule.of.split_once('/') == Some((slot, operation)));
    let of_the_slot = rules.iter().filter(|rule| rule.of == slot);
    let mut found: Vec<Policy> = Vec::new();
    for Rule { policy, .. } in of_the_operation.chain(of_the_slot) {
        let name = policy.words().0;
        if found.iter().all(|other| other.words().0 != name) {
            found.push(*policy);
        }
    }
    found
}

/// What to say where that which a rule is of is no slot of topics, and no topic of one; `slots` are these, and what each of
/// them has.
pub fn misses(of: &str, slots: &[(&str, Vec<&str>)]) -> Option<String> {
    let may = "a slot that publishes or subscribes, or SLOT/operation, may stand there; calls have no other quality";
    crate::misses(of, slots, may)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<String, String> {
        Rule::parse(text).map(|rule| rule.text())
    }

    #[test]
    fn rules_have_one_form() {
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
    fn what_is_none_says_what_is_allowed() {
        for (text, said) in [
            ("Laser.depth=1", "such as LaserPub/newScan.depth:=1"),
            ("depth:=1", "SLOT.POLICY:=VALUE"),
            ("a/b/c.depth:=1", "SLOT.POLICY:=VALUE"),
            ("/scan.depth:=1", "SLOT.POLICY:=VALUE"),
            ("Laser.dept:=1", "did you mean `depth`?"),
            (
                "Laser.history:=keep_all",
                "there are reliability, durability",
            ),
            ("Laser.depth:=0", "from 1 to 1000"),
            ("Laser.depth:=4294967297", "from 1 to 1000"),
            ("Laser.reliability:=best", "reliable or best_effort"),
            ("Laser.deadline:=0s", "a time such as 500ms"),
            ("Laser.deadline:=2000min", "at most a day, or none"),
            ("Laser.deadline:=10", "a time such as 500ms"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn the_nearer_rule_counts() {
        let rules = [
            "Laser.depth:=1",
            "Laser/newScan.depth:=2",
            "Laser/newScan.depth:=3",
            "Laser.reliability:=reliable",
            "Base.depth:=4",
        ]
        .map(str::to_owned);
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
