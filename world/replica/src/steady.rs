//! The time of the protocol.

use std::time::Duration;

/// A time that only goes forward, made of a clock that may be set back.
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    reading: Duration,
    time: Duration,
}

impl Steady {
    /// Starts with the reading of the clock.
    pub fn new(reading: Duration) -> Self {
        Self {
            reading,
            time: reading,
        }
    }

    /// Goes on by what has passed since the last reading; if the clock was set back, it goes on from
    /// there.
    pub fn follow(&mut self, reading: Duration) {
        let passed = reading.saturating_sub(self.reading);
        self.reading = reading;
        self.time = self.time.saturating_add(passed);
    }

    /// The time, for [`World::turn`](crate::World::turn) and
    /// [`World::receive`](crate::World::receive).
    pub fn time(&self) -> Duration {
        self.time
    }
}
