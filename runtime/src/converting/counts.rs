//! Counts of a slot that converts.

use super::Refused;
use rc_conversion::RunResult;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Counts the messages of a slot. One thread counts, others read.
#[derive(Clone, Debug, Default)]
pub(crate) struct ConversionCounts(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    numbers: [AtomicU64; 4],
    /// The instance that provides the values, if it is known.
    provider: Option<String>,
    /// Why the last message was refused for a value.
    last: Mutex<Option<String>>,
}

/// The end that made the values of a message.
#[derive(Clone, Copy)]
pub(super) enum ValueSource {
    Own,
    Provider,
}

impl ConversionCounts {
    /// Counts for a slot with this provider.
    pub(crate) fn of(provider: Option<&String>) -> Self {
        Self(Arc::new(Counts {
            provider: provider.cloned(),
            ..Counts::default()
        }))
    }

    /// Messages that were converted.
    pub(crate) fn converted(&self) -> u64 {
        self.number(0)
    }

    fn number(&self, at: usize) -> u64 {
        self.0.numbers[at].load(Ordering::Relaxed)
    }

    /// Why the last message was refused for a value, and whose it is.
    pub(crate) fn last_refused(&self) -> Option<String> {
        let last = self.0.last.lock();
        last.unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Messages that were refused, because a value has no counterpart in the other unit.
    pub(crate) fn refused(&self) -> u64 {
        self.number(1)
    }

    /// Messages that were refused, because no transform between their frames was known.
    pub(crate) fn unplaced(&self) -> u64 {
        self.number(2)
    }

    /// Messages that were converted, and have three turns at a gimbal lock.
    pub(crate) fn locked(&self) -> u64 {
        self.number(3)
    }

    /// Counts a message. The error says whose it is.
    pub(super) fn note(
        &self,
        whose: ValueSource,
        result: Result<RunResult, Refused>,
    ) -> Result<(), String> {
        let count = |at: usize| {
            self.0.numbers[at].fetch_add(1, Ordering::Relaxed);
        };
        let refused = match result {
            Ok(ran) => {
                count(0);
                if ran.is_locked {
                    count(3);
                }
                return Ok(());
            }
            Err(refused) => refused,
        };
        let way = match whose {
            ValueSource::Own => "to",
            ValueSource::Provider => "from",
        };
        let named = match &self.0.provider {
            Some(provider) => format!("{way} `{provider}`: {refused}"),
            None => format!("{way} its provider: {refused}"),
        };
        match refused {
            Refused::Fault(_) => {
                count(1);
                let mut last = self.0.last.lock().unwrap_or_else(PoisonError::into_inner);
                *last = Some(named.clone());
            }
            Refused::Frames { .. } => count(2),
        }
        // The caller knows that the request is its own.
        Err(match (whose, &self.0.provider) {
            (ValueSource::Provider, Some(_)) => named,
            (ValueSource::Own, _) | (ValueSource::Provider, None) => refused.to_string(),
        })
    }
}
