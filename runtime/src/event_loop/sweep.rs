//! When the loop looks at every port, whatever has woken it.

use super::LONGEST_WAIT;
use std::time::Instant;

/// Every so many looks, the loop also clears wake-ups that the descriptor of a port does not show,
/// which costs kernel calls: announcements without a message can be among them.
const LOOKS_UNTIL_CLEARED: u32 = 20;

/// The state of regular looks at all ports.
pub(super) struct Sweep {
    last: Instant,
    /// Looks since wake-ups were cleared.
    looks: u32,
}

/// A look at all ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// For messages that nothing has announced.
    Messages,
    /// For these, and for wake-ups to clear.
    WakeUps,
}

impl Sweep {
    /// The first look comes after the longest wait.
    pub(super) fn new(now: Instant) -> Self {
        Self {
            last: now,
            looks: 0,
        }
    }

    /// The look that is due, once in the time of the longest wait.
    pub(super) fn due(&mut self, now: Instant) -> Option<Look> {
        if now.saturating_duration_since(self.last) < LONGEST_WAIT {
            return None;
        }
        self.last = now;
        self.looks = (self.looks + 1) % LOOKS_UNTIL_CLEARED;
        Some(if self.looks == 0 {
            Look::WakeUps
        } else {
            Look::Messages
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_twentieth_look_clears_wake_ups() {
        let begin = Instant::now();
        let mut sweep = Sweep::new(begin);
        assert_eq!(sweep.due(begin + LONGEST_WAIT / 2), None);
        let looks: Vec<Option<Look>> = (1..=LOOKS_UNTIL_CLEARED * 2)
            .map(|number| sweep.due(begin + LONGEST_WAIT * number))
            .collect();
        let clears = |look: &Option<Look>| *look == Some(Look::WakeUps);
        let at: Vec<usize> = (0..looks.len()).filter(|at| clears(&looks[*at])).collect();
        assert_eq!(at, [19, 39]);
        assert!(looks.iter().all(Option::is_some));
    }
}
