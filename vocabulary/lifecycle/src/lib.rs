//! The life cycle of a managed component: the states of ROS 2's managed nodes and the transitions
//! between them, after <https://design.ros2.org/articles/node_lifecycle.html> and the table of
//! `rcl_lifecycle`.
//!
//! This crate holds the table. It runs nothing.
//!
#![doc = include_str!("example.md")]

use serde::{Deserialize, Serialize};
use std::fmt;

/// A state of a managed component. Its number is that of `lifecycle_msgs/msg/State`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum LifecycleState {
    /// It exists and has no configuration.
    Unconfigured = 1,
    /// It is configured and does not work.
    Inactive = 2,
    /// It works.
    Active = 3,
    /// It only waits for its end.
    Finalized = 4,
    /// The hook `configure` runs.
    Configuring = 10,
    /// The hook `cleanup` runs.
    CleaningUp = 11,
    /// The hook `shutdown` runs.
    ShuttingDown = 12,
    /// The hook `activate` runs.
    Activating = 13,
    /// The hook `deactivate` runs.
    Deactivating = 14,
    /// The hook `error` runs.
    ErrorProcessing = 15,
}

/// A transition that a request can begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transition {
    /// From unconfigured to inactive.
    Configure,
    /// From inactive to unconfigured.
    Cleanup,
    /// From inactive to active.
    Activate,
    /// From active to inactive.
    Deactivate,
    /// From unconfigured, inactive or active to finalized.
    Shutdown,
}

/// How a hook ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// It did its work.
    Success,
    /// It could not, and the component is as before.
    Failure,
    /// It could not, and error processing follows.
    Error,
}

impl LifecycleState {
    /// All states, in the order of `rcl_lifecycle`.
    pub const ALL: [Self; 10] = [
        Self::Unconfigured,
        Self::Inactive,
        Self::Active,
        Self::Finalized,
        Self::Configuring,
        Self::CleaningUp,
        Self::ShuttingDown,
        Self::Activating,
        Self::Deactivating,
        Self::ErrorProcessing,
    ];

    /// The word for it in JSON and in ROS 2.
    pub fn word(self) -> &'static str {
        match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
            Self::Configuring => "configuring",
            Self::CleaningUp => "cleaningup",
            Self::ShuttingDown => "shuttingdown",
            Self::Activating => "activating",
            Self::Deactivating => "deactivating",
            Self::ErrorProcessing => "errorprocessing",
        }
    }

    /// Whether the component stays in this state until a request comes. In the others a hook runs.
    pub fn is_primary(self) -> bool {
        matches!(
            self,
            Self::Unconfigured | Self::Inactive | Self::Active | Self::Finalized
        )
    }

    /// Whether the component has done its hook `configure` and not its hook `cleanup`.
    pub fn is_configured(self) -> bool {
        matches!(
            self,
            Self::Inactive | Self::Active | Self::Activating | Self::Deactivating
        )
    }

    /// The state in which the hook of `transition` runs. `None` if the transition is not possible.
    pub fn begin(self, transition: Transition) -> Option<Self> {
        Some(match (self, transition) {
            (Self::Unconfigured, Transition::Configure) => Self::Configuring,
            (Self::Inactive, Transition::Cleanup) => Self::CleaningUp,
            (Self::Inactive, Transition::Activate) => Self::Activating,
            (Self::Active, Transition::Deactivate) => Self::Deactivating,
            (Self::Unconfigured | Self::Inactive | Self::Active, Transition::Shutdown) => {
                Self::ShuttingDown
            }
            _ => return None,
        })
    }

    /// The state after the hook of this state, in which a hook runs. A primary state stays as it
    /// is.
    #[must_use]
    pub fn end(self, outcome: Outcome) -> Self {
        match (self, outcome) {
            (Self::ErrorProcessing, Outcome::Success) => Self::Unconfigured,
            (Self::ErrorProcessing, _) => Self::Finalized,
            (primary, _) if primary.is_primary() => primary,
            (_, Outcome::Error) => Self::ErrorProcessing,
            (Self::Configuring | Self::Deactivating, Outcome::Success)
            | (Self::CleaningUp | Self::Activating, Outcome::Failure) => Self::Inactive,
            (Self::Configuring, Outcome::Failure) | (Self::CleaningUp, Outcome::Success) => {
                Self::Unconfigured
            }
            (Self::Activating, Outcome::Success) | (Self::Deactivating, Outcome::Failure) => {
                Self::Active
            }
            _ => Self::Finalized,
        }
    }

    /// The next transition on the way to `goal`, a primary state. `None` if the component is there,
    /// or cannot get there.
    pub fn towards(self, goal: Self) -> Option<Transition> {
        match (self, goal) {
            (Self::Unconfigured, Self::Inactive | Self::Active) => Some(Transition::Configure),
            (Self::Inactive, Self::Active) => Some(Transition::Activate),
            (Self::Active, Self::Inactive | Self::Unconfigured | Self::Finalized) => {
                Some(Transition::Deactivate)
            }
            (Self::Inactive, Self::Unconfigured | Self::Finalized) => Some(Transition::Cleanup),
            (Self::Unconfigured, Self::Finalized) => Some(Transition::Shutdown),
            _ => None,
        }
    }
}

impl fmt::Display for LifecycleState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

impl Transition {
    /// All transitions.
    pub const ALL: [Self; 5] = [
        Self::Configure,
        Self::Cleanup,
        Self::Activate,
        Self::Deactivate,
        Self::Shutdown,
    ];

    /// The word for it in JSON, on command lines and in ROS 2: the name of its hook.
    pub fn word(self) -> &'static str {
        match self {
            Self::Configure => "configure",
            Self::Cleanup => "cleanup",
            Self::Activate => "activate",
            Self::Deactivate => "deactivate",
            Self::Shutdown => "shutdown",
        }
    }

    /// The state to which a person who asks for it means to bring a component that is in `state`:
    /// `configure` and `deactivate` leave one alone that is further, and `activate` and `cleanup`
    /// take all steps.
    pub fn meant(self, state: LifecycleState) -> LifecycleState {
        match self {
            Self::Configure if state != LifecycleState::Unconfigured => state,
            Self::Deactivate if state != LifecycleState::Active => state,
            Self::Configure
            | Self::Cleanup
            | Self::Activate
            | Self::Deactivate
            | Self::Shutdown => self.goal(),
        }
    }

    /// The state after its success.
    pub fn goal(self) -> LifecycleState {
        match self {
            Self::Configure | Self::Deactivate => LifecycleState::Inactive,
            Self::Cleanup => LifecycleState::Unconfigured,
            Self::Activate => LifecycleState::Active,
            Self::Shutdown => LifecycleState::Finalized,
        }
    }
}

impl fmt::Display for Transition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.word())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use LifecycleState as S;

    /// The table of `rcl_lifecycle/src/default_state_machine.c`.
    #[test]
    fn hooks_lead_to_the_states_of_ros() {
        use Outcome::{Error, Failure, Success};
        for (state, success, failure) in [
            (S::Configuring, S::Inactive, S::Unconfigured),
            (S::CleaningUp, S::Unconfigured, S::Inactive),
            (S::Activating, S::Active, S::Inactive),
            (S::Deactivating, S::Inactive, S::Active),
            (S::ShuttingDown, S::Finalized, S::Finalized),
        ] {
            let ends = [Success, Failure, Error].map(|outcome| state.end(outcome));
            assert_eq!(ends, [success, failure, S::ErrorProcessing]);
        }
        let ends = [Success, Failure, Error].map(|outcome| S::ErrorProcessing.end(outcome));
        assert_eq!(ends, [S::Unconfigured, S::Finalized, S::Finalized]);
    }

    #[test]
    fn the_way_to_a_state_takes_possible_transitions_and_ends() {
        let goals = [S::Unconfigured, S::Inactive, S::Active, S::Finalized];
        for start in goals {
            for goal in goals {
                let mut state = start;
                for _ in 0..3 {
                    let Some(transition) = state.towards(goal) else {
                        break;
                    };
                    let between = state.begin(transition).expect("possible");
                    state = between.end(Outcome::Success);
                    assert_eq!(state, transition.goal());
                }
                let stays = start == S::Finalized;
                assert_eq!(state, if stays { start } else { goal }, "{start} to {goal}");
            }
        }
    }

    #[test]
    fn a_request_that_is_met_changes_nothing() {
        assert_eq!(Transition::Configure.meant(S::Active), S::Active);
        assert_eq!(Transition::Configure.meant(S::Unconfigured), S::Inactive);
        assert_eq!(
            Transition::Deactivate.meant(S::Unconfigured),
            S::Unconfigured
        );
        assert_eq!(Transition::Activate.meant(S::Unconfigured), S::Active);
        assert_eq!(Transition::Cleanup.meant(S::Active), S::Unconfigured);
    }

    #[test]
    fn transitions_begin_in_the_states_of_ros() {
        let possible = |state: S| {
            let all = Transition::ALL.into_iter();
            let all = all.filter(|t| state.begin(*t).is_some());
            all.map(Transition::word).collect::<Vec<_>>()
        };
        assert_eq!(possible(S::Unconfigured), ["configure", "shutdown"]);
        assert_eq!(possible(S::Inactive), ["cleanup", "activate", "shutdown"]);
        assert_eq!(possible(S::Active), ["deactivate", "shutdown"]);
        let others = S::ALL.into_iter().skip(3);
        assert!(others.map(possible).all(|none| none.is_empty()));
    }
}
