//! Makes a managed component a managed node of ROS 2, by the services and the topic of
//! `lifecycle_msgs`. They work in every state.

use crate::graph::Listed;
use crate::node::Node;
use crate::rcl::text;
use crate::services::{NodeRequest, NodeService, Services};
use rc_ddsc::Writer as TopicWriter;
use rc_lifecycle::{LifecycleState, Outcome, Transition};
use rc_middleware::lifecycle::{LifecycleChange, LifecycleService};
use rc_middleware::{DecodeError, OpenError, Qos, Reader, TypeIdentity, Writer};
use rc_network::{EndpointSpec, RateLimit, Role, TopicPublisher, lock, signal, stamp};
use std::sync::{Arc, Mutex};

/// The service that changes the state. It has a thread of its own, so that the others reply while a
/// hook runs.
const CHANGE_STATE: NodeService = NodeService {
    name: "change_state",
    type_name: "lifecycle_msgs/srv/ChangeState",
};

/// The services that only ask, in the order of [`answer`].
const QUERIES: [NodeService; 4] = [
    NodeService {
        name: "get_state",
        type_name: "lifecycle_msgs/srv/GetState",
    },
    NodeService {
        name: "get_available_states",
        type_name: "lifecycle_msgs/srv/GetAvailableStates",
    },
    NodeService {
        name: "get_available_transitions",
        type_name: "lifecycle_msgs/srv/GetAvailableTransitions",
    },
    NodeService {
        name: "get_transition_graph",
        type_name: "lifecycle_msgs/srv/GetAvailableTransitions",
    },
];

/// The type of the topic `transition_event`.
const EVENT: &str = "lifecycle_msgs/msg/TransitionEvent";

/// The services and the topic. Dropping it closes them.
pub(crate) struct ManagedNode {
    _services: [Services; 2],
    _events: Arc<Events>,
    _topic: TopicPublisher,
    _listed: Listed,
}

/// A step of the table of `rcl_lifecycle`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Step {
    id: u8,
    label: &'static str,
    start: LifecycleState,
    goal: LifecycleState,
}

/// All steps, in the order of `rcl_lifecycle`.
fn steps() -> Vec<Step> {
    use LifecycleState as S;
    let mut steps = Vec::new();
    let ends = |first: u8, start: S, steps: &mut Vec<Step>| {
        for (offset, label, outcome) in [
            (0, "transition_success", Outcome::Success),
            (1, "transition_failure", Outcome::Failure),
            (2, "transition_error", Outcome::Error),
        ] {
            let (id, goal) = (first + offset, start.end(outcome));
            steps.push(Step {
                id,
                label,
                start,
                goal,
            });
        }
    };
    for (transition, starts, first) in [
        (Transition::Configure, &[(1, S::Unconfigured)][..], 10),
        (Transition::Cleanup, &[(2, S::Inactive)], 20),
        (Transition::Activate, &[(3, S::Inactive)], 30),
        (Transition::Deactivate, &[(4, S::Active)], 40),
        (
            Transition::Shutdown,
            &[(5, S::Unconfigured), (6, S::Inactive), (7, S::Active)],
            50,
        ),
    ] {
        let mut between = S::ErrorProcessing;
        for (id, start) in starts {
            between = start.begin(transition).unwrap_or(between);
            steps.push(Step {
                id: *id,
                label: transition.word(),
                start: *start,
                goal: between,
            });
        }
        ends(first, between, &mut steps);
    }
    ends(60, S::ErrorProcessing, &mut steps);
    steps
}

/// The transition of a request: its label precedes its number, because tools omit one of them. None
/// if it is unknown, or not possible in this state.
fn meant(id: u8, label: &str, state: LifecycleState) -> Option<Transition> {
    let possible = Transition::ALL.into_iter();
    let mut possible = possible.filter(|transition| state.begin(*transition).is_some());
    if !label.is_empty() {
        return possible.find(|transition| transition.word() == label);
    }
    let step = steps().into_iter().find(|step| step.id == id)?;
    possible.find(|transition| step.start == state && transition.word() == step.label)
}

impl ManagedNode {
    pub(crate) fn open(
        node: &Node,
        lifecycle: &Arc<dyn LifecycleService>,
    ) -> Result<Self, OpenError> {
        let service = Arc::clone(lifecycle);
        let change = move |asked: &NodeRequest<'_>| change(asked, &*service);
        let change = Services::open(node, "rc-ros2-change", &[CHANGE_STATE], Box::new(change))?;
        let service = Arc::clone(lifecycle);
        let answer = move |asked: &NodeRequest<'_>| answer(asked.place, service.state());
        let queries = Services::open(node, "rc-ros2-states", &QUERIES, Box::new(answer))?;
        let address = format!("{}/transition_event", node.name.full());
        let types = TypeIdentity {
            name: EVENT.to_owned(),
            hash: 0,
        };
        let spec = EndpointSpec {
            names: (
                format!("rt{address}"),
                "lifecycle_msgs::msg::dds_::TransitionEvent_".to_owned(),
            ),
            role: Role::Publisher,
            types: &types,
            qos: Some(Qos::PUBLISHER),
            signal: signal(&address)?,
            labels: node.types.labels(&types.name),
        };
        let topic = TopicPublisher::open(&node.session, &address, spec)?;
        let events = Arc::new(Events {
            writer: Arc::clone(&topic.port().writer),
            sent: Mutex::new(0),
            rate_limit: RateLimit::default(),
        });
        // The life cycle outlives the ports.
        let listener = Arc::downgrade(&events);
        lifecycle.watch(Arc::new(move |change| {
            if let Some(events) = listener.upgrade() {
                events.publish(change);
            }
        }));
        Ok(Self {
            _services: [change, queries],
            _events: events,
            _listed: node.graph.list(&[], &[topic.port().guid]),
            _topic: topic,
        })
    }
}

/// Publishes changes of the state.
struct Events {
    writer: Arc<TopicWriter>,
    /// Number of events that were sent.
    sent: Mutex<u64>,
    rate_limit: RateLimit,
}

impl Events {
    fn publish(&self, LifecycleChange { from, to }: LifecycleChange) {
        let mut steps = steps().into_iter();
        let Some(step) = steps.find(|step| step.start == from && step.goal == to) else {
            return;
        };
        let now = stamp(0);
        let mut sent = lock(&self.sent);
        *sent += 1;
        let body = event(now, step);
        let done = body.and_then(|body| {
            let written = self.writer.write(*sent, now, &body);
            written.map_err(|error| error.to_string())
        });
        if let Err(reason) = done
            && let Some(passed) = self.rate_limit.allow()
        {
            let count = passed + 1;
            tracing::warn!("a change of the life cycle is not published ({count} times): {reason}");
        }
    }
}

/// `lifecycle_msgs/msg/TransitionEvent`
fn event(now: i64, step: Step) -> Result<Vec<u8>, String> {
    let mut writer = Writer::default();
    writer.put(&u64::try_from(now).unwrap_or_default());
    describe(step, &mut writer);
    finish(&mut writer)
}

/// `lifecycle_msgs/msg/TransitionDescription`
fn describe(step: Step, writer: &mut Writer) {
    writer.put(&step.id);
    text(step.label, writer);
    state(step.start, writer);
    state(step.goal, writer);
}

/// `lifecycle_msgs/msg/State`
fn state(state: LifecycleState, writer: &mut Writer) {
    writer.put(&(state as u8));
    text(state.word(), writer);
}

fn finish(writer: &mut Writer) -> Result<Vec<u8>, String> {
    let body = writer.finish().map_err(|error| error.to_string())?;
    Ok(body.to_vec())
}

/// Takes the transition of a request, and returns the body of the reply. A request that has waited
/// for others until its client left takes none.
fn change(asked: &NodeRequest<'_>, lifecycle: &dyn LifecycleService) -> Result<Vec<u8>, String> {
    let wrong = |error: DecodeError| error.to_string();
    let mut reader = Reader::new(asked.body);
    let id: u8 = reader.get().map_err(wrong)?;
    let label: String = reader.get().map_err(wrong)?;
    if asked.is_orphan {
        return Err("its client has left before its turn".to_owned());
    }
    let now = lifecycle.state();
    let result = match meant(id, &label, now) {
        Some(transition) => lifecycle.change(transition, asked.received).map(drop),
        None => Err(format!("no transition {id} `{label}` leads from {now}")),
    };
    if let Err(reason) = &result {
        let reason = rc_diagnostics::foreign::clean(reason);
        tracing::warn!("change_state: {reason}");
    }
    let mut writer = Writer::default();
    writer.put(&result.is_ok());
    finish(&mut writer)
}

/// The body of the reply to a query.
fn answer(place: usize, now: LifecycleState) -> Result<Vec<u8>, String> {
    let mut writer = Writer::default();
    match place {
        0 => state(now, &mut writer),
        1 => {
            writer.length(LifecycleState::ALL.len() + 1);
            writer.put(&0_u8);
            text("unknown", &mut writer);
            for one in LifecycleState::ALL {
                state(one, &mut writer);
            }
        }
        _ => {
            let mut steps = steps();
            // The graph has all of them.
            steps.retain(|step| place == 3 || step.start == now);
            writer.length(steps.len());
            for step in steps {
                describe(step, &mut writer);
            }
        }
    }
    finish(&mut writer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use LifecycleState as S;
    use std::time::Instant;

    #[test]
    fn a_request_means_a_transition_of_the_present_state() {
        assert_eq!(meant(1, "", S::Unconfigured), Some(Transition::Configure));
        assert_eq!(
            meant(0, "activate", S::Inactive),
            Some(Transition::Activate)
        );
        assert_eq!(meant(9, "shutdown", S::Active), Some(Transition::Shutdown));
        assert_eq!(meant(6, "", S::Inactive), Some(Transition::Shutdown));
        for (id, label, state) in [
            (1, "", S::Inactive),
            (6, "", S::Active),
            (0, "configure", S::Active),
            (0, "dance", S::Unconfigured),
            (10, "", S::Configuring),
            (99, "", S::Unconfigured),
        ] {
            assert_eq!(meant(id, label, state), None, "{id} {label} {state}");
        }
    }

    /// An invalid request is an error, never a panic.
    #[test]
    fn requests_that_are_cut_off_are_refused() {
        struct Idle;
        impl LifecycleService for Idle {
            fn state(&self) -> LifecycleState {
                S::Unconfigured
            }
            fn change(&self, _: Transition, _: Instant) -> Result<LifecycleState, String> {
                Err("no".to_owned())
            }
            fn watch(&self, _: rc_middleware::lifecycle::LifecycleListener) {}
        }
        let change = |body: &[u8], is_orphan| {
            let asked = NodeRequest {
                place: 0,
                body,
                received: Instant::now(),
                is_orphan,
            };
            super::change(&asked, &Idle)
        };
        for length in 0..8 {
            assert!(change(&[0xff; 8][..length], false).is_err());
        }
        let mut writer = Writer::default();
        writer.put(&1_u8);
        text("", &mut writer);
        let request = writer.into_bytes();
        assert_eq!(change(&request, false), Ok(vec![0]));
        assert!(change(&request, true).is_err());
        for place in 0..QUERIES.len() {
            assert!(S::ALL.iter().all(|state| answer(place, *state).is_ok()));
        }
    }
}
