//! Conditions of the replica of the shared world in a component.

use super::{CALM, HealthEvent, HealthMonitor, end_of};
use rc_management::component::WorldStatus;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// A replica that lacks changes asks for them after 30 ms: no answer is overdue before.
const BEHIND_MS: u64 = 2000;

impl HealthMonitor {
    /// The conditions of the replica of the shared world, but for silent ones.
    pub(super) fn world(
        &mut self,
        world: Option<Box<WorldStatus>>,
        happened: &mut Vec<HealthEvent>,
    ) {
        let Some(world) = world else { return };
        self.world_since.get_or_insert_with(Instant::now);
        let behind = (world.behind > 0 && world.behind_ms >= BEHIND_MS).then(|| {
            let (count, ms) = (world.behind, world.behind_ms);
            format!("its world has lacked changes of others for {ms} ms, {count} of them now")
        });
        let conflict = world
            .fault
            .clone()
            .map(|fault| format!("the newest changes of its world are not shown: {fault}"));
        let conflict = conflict.or_else(|| {
            let (count, first) = (world.conflicts, world.first_conflicts.join("; "));
            let elements = match count {
                1 => "an element of its world is".to_owned(),
                count => format!("{count} elements of its world are"),
            };
            (count > 0).then(|| format!("{elements} not shown: {first}"))
        });
        let before = self.world.as_ref().map_or(0, |before| before.refused);
        let new = world.refused.saturating_sub(before);
        let refused = (new > 0).then(|| {
            let reason = &world.last_refusal;
            let messages = match new {
                1 => "a message of another one".to_owned(),
                new => format!("{new} messages of others, the last one"),
            };
            format!("its world refused {messages} because {reason}")
        });
        for (code, over, text, ended) in [
            (
                "world-behind",
                "world-current",
                behind,
                "its world lacks no changes any more",
            ),
            (
                "world-conflict",
                "world-agreed",
                conflict,
                "all elements of its world are shown",
            ),
        ] {
            self.change(code, over, text, ended, happened);
        }
        match refused {
            Some(text) => {
                self.refused = CALM;
                self.change("world-refused", "", Some(text), "", happened);
            }
            None if end_of(&mut self.refused) => {
                let ended = "its world refuses no messages any more";
                self.change("world-refused", "world-accepted", None, ended, happened);
            }
            None => {}
        }
        self.world = Some(world);
    }

    /// Whether the component has had a replica for so long.
    pub(crate) fn has_world_for(&self, least: Duration) -> bool {
        self.world_since
            .is_some_and(|since| since.elapsed() >= least)
    }

    /// Compares the replicas that are silent for its world with the components that run, of which
    /// one that has ended is not a part of a split.
    pub(crate) fn look_for_split(&mut self, running: &BTreeSet<&str>) -> Vec<HealthEvent> {
        let mut happened = Vec::new();
        let Some(world) = self.world.as_ref().filter(|_| !self.quiet) else {
            return happened;
        };
        let silent = world.silent.iter().map(String::as_str);
        let silent: Vec<&str> = silent.filter(|name| running.contains(name)).collect();
        let text = (!silent.is_empty()).then(|| {
            let names = silent.join(", ");
            let others = match world.more_silent {
                0 => String::new(),
                more => format!(", nor from {more} that are not listed"),
            };
            format!(
                "its world hears nothing from {names}, still running{others}; each side goes on with what it has"
            )
        });
        let ended = "its world hears all that run again";
        self.change("world-split", "world-whole", text, ended, &mut happened);
        happened
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::link::Heartbeat;

    fn codes(happened: &[HealthEvent]) -> Vec<&'static str> {
        happened.iter().map(|(_, code, _)| *code).collect()
    }

    fn told(world: WorldStatus) -> Heartbeat {
        Heartbeat {
            world: Some(Box::new(world)),
            ..Heartbeat::default()
        }
    }

    #[test]
    fn a_replica_is_behind_from_two_seconds_on() {
        let mut watch = HealthMonitor::default();
        let behind = |behind_ms| {
            told(WorldStatus {
                behind: 3,
                behind_ms,
                ..WorldStatus::default()
            })
        };
        assert_eq!(codes(&watch.heartbeat(behind(1999))), [""; 0]);
        let happened = watch.heartbeat(behind(2500));
        let text = "its world has lacked changes of others for 2500 ms, 3 of them now";
        assert_eq!(happened[0].1, "world-behind");
        assert_eq!(happened[0].2, text);
        assert_eq!(codes(&watch.heartbeat(behind(3000))), [""; 0]);
        assert_eq!(watch.troubles()[0].code, "world-behind");
        let current = watch.heartbeat(told(WorldStatus::default()));
        assert_eq!(codes(&current), ["world-current"]);
        assert_eq!(watch.troubles(), []);
    }

    #[test]
    fn conflicts_are_named_and_end() {
        let mut watch = HealthMonitor::default();
        let conflicts = told(WorldStatus {
            conflicts: 2,
            first_conflicts: vec![
                "RT from `hall` to `front`: the later one is from `room`".to_owned(),
            ],
            ..WorldStatus::default()
        });
        let happened = watch.heartbeat(conflicts.clone());
        assert_eq!(codes(&happened), ["world-conflict"]);
        assert!(
            happened[0].2.contains("from `hall` to `front`"),
            "{happened:?}"
        );
        assert_eq!(codes(&watch.heartbeat(conflicts)), [""; 0]);
        let agreed = watch.heartbeat(told(WorldStatus::default()));
        assert_eq!(codes(&agreed), ["world-agreed"]);
    }

    #[test]
    fn refused_messages_are_one_event_until_none_comes() {
        let mut watch = HealthMonitor::default();
        let refused = |refused| {
            told(WorldStatus {
                refused,
                last_refusal: "a replica has another schema".to_owned(),
                ..WorldStatus::default()
            })
        };
        assert_eq!(codes(&watch.heartbeat(refused(1))), ["world-refused"]);
        for count in 2..20 {
            assert_eq!(codes(&watch.heartbeat(refused(count))), [""; 0]);
        }
        let good: Vec<HealthEvent> = (0..CALM)
            .flat_map(|_| watch.heartbeat(refused(19)))
            .collect();
        assert_eq!(codes(&good), ["world-accepted"]);
    }

    /// A component that has ended is not a part of a split: its end is another event.
    #[test]
    fn only_those_that_run_are_split_off() {
        let mut watch = HealthMonitor::default();
        watch.heartbeat(told(WorldStatus {
            silent: vec!["finder".to_owned(), "gone".to_owned()],
            more_silent: 7,
            ..WorldStatus::default()
        }));
        assert!(watch.has_world_for(Duration::ZERO));
        assert!(!watch.has_world_for(Duration::from_hours(1)));
        assert!(!HealthMonitor::default().has_world_for(Duration::ZERO));
        assert_eq!(watch.look_for_split(&["keeper"].into()), []);
        let split = watch.look_for_split(&["finder", "keeper"].into());
        assert_eq!(codes(&split), ["world-split"]);
        assert!(
            split[0]
                .2
                .contains("hears nothing from finder, still running"),
            "{split:?}"
        );
        assert_eq!(watch.look_for_split(&["finder", "keeper"].into()), []);
        let whole = watch.look_for_split(&["keeper"].into());
        assert_eq!(codes(&whole), ["world-whole"]);
    }
}
