//! Restart policy: decides whether and when a component restarts.

use rc_deploy_network::plan::{Policy, Restart};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// A run of this length ends a series of failures: the pauses start again from the shortest.
const STEADY: Duration = Duration::from_secs(10);

/// The policy of one component, and how often it was used.
#[derive(Debug)]
pub(crate) struct Restarts {
    rules: Restart,
    count: u32,
    pause: Duration,
    /// The last restarts that count for the limit.
    recent: VecDeque<Instant>,
}

/// Consequence of an end.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Next {
    /// Nothing.
    Nothing,
    /// It restarts after this pause.
    Again(Duration),
    /// It has reached its limit. The text says so.
    GiveUp(String),
}

impl Restarts {
    pub(crate) fn new(rules: Restart) -> Self {
        Self {
            rules,
            count: 0,
            pause: rules.backoff,
            recent: VecDeque::new(),
        }
    }

    /// The number of restarts.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Forgets earlier failures: a command starts the component.
    pub(crate) fn reset(&mut self) {
        self.pause = self.rules.backoff;
        self.recent.clear();
    }

    /// Decides what follows the end at `now` of a run of length `ran`.
    pub(crate) fn after(&mut self, failed: bool, ran: Duration, now: Instant) -> Next {
        match self.rules.policy {
            Policy::Always => {}
            Policy::OnFailure if failed => {}
            Policy::OnFailure | Policy::Never => return Next::Nothing,
        }
        if let Some((most, within)) = self.rules.limit {
            self.recent
                .retain(|start| now.duration_since(*start) < within);
            if self.recent.len() >= most as usize {
                let times = if most == 1 {
                    "once"
                } else {
                    &format!("{most} times")
                };
                return Next::GiveUp(format!(
                    "restarted {times} within {within:?} and ended again"
                ));
            }
            self.recent.push_back(now);
        }
        if ran >= STEADY {
            self.pause = self.rules.backoff;
        }
        let pause = self.pause;
        self.pause = (pause * 2).min(Restart::LONGEST_PAUSE.max(self.rules.backoff));
        self.count += 1;
        Next::Again(pause)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(10);

    fn rules(policy: Policy, limit: Option<(u32, Duration)>) -> Restarts {
        Restarts::new(Restart {
            policy,
            hung: None,
            limit,
            backoff: Duration::from_secs(2),
        })
    }

    #[test]
    fn the_policy_determines_which_exits_lead_to_a_restart() {
        let now = Instant::now();
        let again = Next::Again(Duration::from_secs(2));
        for (policy, success, failure) in [
            (Policy::Never, Next::Nothing, &Next::Nothing),
            (Policy::OnFailure, Next::Nothing, &again),
            (Policy::Always, Next::Again(Duration::from_secs(2)), &again),
        ] {
            assert_eq!(rules(policy, None).after(false, SHORT, now), success);
            assert_eq!(&rules(policy, None).after(true, SHORT, now), failure);
        }
    }

    #[test]
    fn pauses_double_until_a_component_stays_up() {
        let now = Instant::now();
        let mut restarts = rules(Policy::Always, None);
        let mut pause = |ran| match restarts.after(true, ran, now) {
            Next::Again(pause) => pause.as_secs(),
            other => panic!("{other:?}"),
        };
        let pauses: Vec<u64> = (0..6).map(|_| pause(SHORT)).collect();
        assert_eq!(pauses, [2, 4, 8, 16, 30, 30]);
        assert_eq!(pause(STEADY), 2);
        assert_eq!(pause(SHORT), 4);
    }

    #[test]
    fn a_limit_counts_the_starts_in_its_period() {
        let start = Instant::now();
        let within = Duration::from_mins(1);
        let mut restarts = rules(Policy::OnFailure, Some((2, within)));
        let mut at = |seconds| {
            let now = start + Duration::from_secs(seconds);
            matches!(restarts.after(true, SHORT, now), Next::Again(_))
        };
        assert!(at(0) && at(10));
        assert!(!at(20));
        assert!(at(60));
        assert!(!at(61));
        assert_eq!(restarts.count(), 3);
    }

    #[test]
    fn a_command_begins_anew() {
        let now = Instant::now();
        let limit = Some((1, Duration::from_mins(1)));
        let mut restarts = rules(Policy::OnFailure, limit);
        let first = Next::Again(Duration::from_secs(2));
        assert_eq!(restarts.after(true, SHORT, now), first);
        let text = "restarted once within 60s and ended again";
        assert_eq!(
            restarts.after(true, SHORT, now),
            Next::GiveUp(text.to_owned())
        );
        restarts.reset();
        assert_eq!(restarts.after(true, SHORT, now), first);
        assert_eq!(restarts.count(), 2);
        let mut restarts = rules(Policy::OnFailure, Some((2, Duration::from_mins(1))));
        let all = [(); 3].map(|()| restarts.after(true, SHORT, now));
        let text = "restarted 2 times within 60s and ended again";
        assert_eq!(all[2], Next::GiveUp(text.to_owned()));
    }
}
