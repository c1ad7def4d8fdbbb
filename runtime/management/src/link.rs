//! Notifications between a component and the supervisor that started it.

use crate::component::{
    Changed, ClockStatus, ConvertedStatus, ForwardedStatus, GroupStatus, MachineStatus, State,
    WorldStatus,
};
use crate::rpc::{self, Call};
use rc_lifecycle::LifecycleState;
use rc_vocabulary::foreign;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// How many bytes of invalid lines one side of a link accepts, in one run of the component. With
/// more, a supervisor stops the component, and a component assumes that the other side has ended.
pub const MOST_GARBAGE: usize = 1 << 20;

/// A message of a component to its supervisor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ComponentMessage {
    /// The state has changed.
    State {
        /// The new state.
        state: State,
    },
    /// The component has started, and has restored its parameters.
    Ready,
    /// The state of the life cycle has changed, or a goal is reached or missed.
    Lifecycle(LifecycleReport),
    /// The set of parameters that were changed and not saved is another one.
    Parameters(UnsavedParameters),
    /// The answer to [`SupervisorMessage::Restore`].
    Restored {
        /// Why nothing was restored; none if all was.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[serde(deserialize_with = "foreign::optional_lines")]
        refused: Option<String>,
    },
    /// The answer to [`SupervisorMessage::Propose`]. With a reason, nothing has changed.
    Proposed {
        /// The number of the proposal.
        number: u64,
        /// The accepted changes, and those for the next start.
        #[serde(flatten)]
        changes: Changed,
        /// Why it is refused.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[serde(deserialize_with = "foreign::optional_lines")]
        refused: Option<String>,
    },
    /// The answer to [`SupervisorMessage::Settle`]: the proposal is kept, or taken back.
    Settled {
        /// The number of the proposal.
        number: u64,
    },
    /// A sign of life of the component, twice a second.
    Heartbeat(Heartbeat),
}

/// A message of a supervisor to a component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SupervisorMessage {
    /// Set these parameters before you are ready: an earlier run changed them and did not save
    /// them.
    Restore {
        /// The values by path.
        changes: Map<String, Value>,
        /// The parameters that rules of the network read. Only proposals change them.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        ruled: Vec<String>,
    },
    /// Offer a part of a change of several components to the worker, and hold it, if accepted,
    /// until it is settled.
    Propose {
        /// The number of the proposal, from 1.
        number: u64,
        /// The values by path.
        changes: Map<String, Value>,
    },
    /// Keep the held change, or undo it.
    Settle {
        /// The number of the proposal.
        number: u64,
        /// Whether it is kept: all components have accepted.
        keep: bool,
    },
    /// Bring the life cycle to this state. A later goal takes the place of one that waits.
    Lifecycle {
        /// The number of the goal, from 1.
        number: u64,
        /// A primary state.
        goal: LifecycleState,
    },
    /// To a proxy: the state of its group. It is sent with each change.
    Group(GroupStatus),
}

/// The life cycle of a managed component.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LifecycleReport {
    /// The state.
    pub state: LifecycleState,
    /// The number of the last goal that was reached or missed; 0 if there was none.
    #[serde(default)]
    pub done: u64,
    /// Why that goal was missed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[serde(deserialize_with = "foreign::optional_lines")]
    pub error: Option<String>,
}

/// Parameters that were changed and not saved.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnsavedParameters {
    /// The values by path, except secret ones.
    #[serde(default)]
    pub changed: Map<String, Value>,
    /// The paths of those that a new run cannot get: they are secret, or too long for a line.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::texts")]
    pub unkept: Vec<String>,
}

/// The health of a component. Fields that it does not report are empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Milliseconds since the last turn of the worker's loop.
    pub age_ms: u64,
    /// Samples that each slot has lost since the start; slots without loss are left out.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::keys")]
    pub lost: BTreeMap<String, u64>,
    /// The counts of forwarded messages of each slot, and its added delay.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub forwarded: BTreeMap<String, ForwardedStatus>,
    /// The conversions of each slot since the start; slots that convert nothing are left out.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[serde(deserialize_with = "foreign::keys")]
    pub converted: BTreeMap<String, ConvertedStatus>,
    /// The number of peers of each slot that requires or subscribes.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::keys")]
    pub peers: BTreeMap<String, usize>,
    /// Activities that took longer than the period since the last heartbeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub overruns: Option<Overruns>,
    /// Topics that exceeded their deadline since the last heartbeat, and for how many milliseconds
    /// they were silent.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::keys")]
    pub silent: BTreeMap<String, u64>,
    /// Peers that are there and do not fit.
    #[serde(default)]
    #[serde(deserialize_with = "foreign::texts")]
    pub mismatches: Vec<String>,
    /// The clock, unless it is that of the system.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<Box<ClockStatus>>,
    /// The state machine, if the component has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub machine: Option<Box<MachineStatus>>,
    /// The replica of the shared world, if the component has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<Box<WorldStatus>>,
    /// How time has jumped back since the last heartbeat.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub jumps: Vec<TimeJump>,
}

/// Time was set to an earlier one. Both are in seconds since the clock's zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeJump {
    /// The time before.
    pub from_s: f64,
    /// The time after.
    pub to_s: f64,
}

/// Runs of the worker that took longer than the period.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overruns {
    /// How many.
    #[serde(default)]
    pub count: u64,
    /// Slowest activity: `compute()`, `a handler of laser`.
    #[serde(deserialize_with = "foreign::text")]
    pub what: String,
    /// How long that took, in milliseconds.
    pub ms: f64,
    /// The period, in milliseconds.
    pub period_ms: f64,
}

impl ComponentMessage {
    /// Decodes a line. The error describes the mistake.
    pub fn decode(line: &[u8]) -> Result<Self, String> {
        let Call { method, params, .. } = Call::parse(line).map_err(|error| error.message)?;
        rpc::message(&method, params).map_err(|error| error.to_string())
    }
}

impl SupervisorMessage {
    /// Decodes a line. None for messages of a supervisor of another version.
    pub fn decode(line: &[u8]) -> Option<Self> {
        let Call { method, params, .. } = Call::parse(line).ok()?;
        rpc::message(&method, params).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(line: &str) -> Result<ComponentMessage, String> {
        ComponentMessage::decode(line.as_bytes())
    }

    #[test]
    fn missing_fields_are_empty() {
        let ready = r#"{"jsonrpc":"2.0","method":"ready"}"#;
        assert_eq!(decode(ready), Ok(ComponentMessage::Ready));
        let heartbeat = Heartbeat {
            age_ms: 7,
            ..Heartbeat::default()
        };
        assert_eq!(
            decode(r#"{"jsonrpc":"2.0","method":"heartbeat","params":{"age_ms":7}}"#),
            Ok(ComponentMessage::Heartbeat(heartbeat))
        );
        assert_eq!(
            decode(r#"{"method":"restored","params":{}}"#),
            Ok(ComponentMessage::Restored { refused: None })
        );
        assert_eq!(
            decode(r#"{"method":"parameters"}"#),
            Ok(ComponentMessage::Parameters(UnsavedParameters::default()))
        );
    }

    #[test]
    fn what_a_supervisor_says_is_decoded_as_far_as_it_is_known() {
        let decode = |line: &str| SupervisorMessage::decode(line.as_bytes());
        assert_eq!(
            decode(r#"{"method":"lifecycle","params":{"number":3,"goal":"active"}}"#),
            Some(SupervisorMessage::Lifecycle {
                number: 3,
                goal: LifecycleState::Active,
            })
        );
        for line in ["", "hello", "[]", r#"{"method":"dance"}"#] {
            assert_eq!(decode(line), None, "{line}");
        }
    }

    #[test]
    fn malformed_lines_are_errors() {
        for line in [
            "",
            "hello",
            "[]",
            r#"{"method":"dance"}"#,
            r#"{"method":"heartbeat"}"#,
            r#"{"method":"heartbeat","params":{"age_ms":7,"lost":{"Laser":-3}}}"#,
            r#"{"method":"state","params":{"state":"failed"}}"#,
            r#"{"method":"state","params":{"state":"happy"}}"#,
        ] {
            assert!(decode(line).is_err(), "{line}");
        }
    }
}
