//! Where the threads of the library find an endpoint, until the component closes it.
//!
//! The library deletes an endpoint only after its threads have left the listener of the endpoint. A
//! thread that deleted an endpoint from within its listener would wait for itself. So the component
//! deletes endpoints, after all other threads have released them.

use crate::lock;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

/// Longest wait for an endpoint that the component is opening.
const OPENING: Duration = Duration::from_secs(10);

/// An endpoint of the library, which several threads use.
pub(crate) struct SharedEntity<E> {
    state: Mutex<State<E>>,
    changed: Condvar,
}

struct State<E> {
    phase: Phase<E>,
    /// The number of threads that use the endpoint.
    users: usize,
}

enum Phase<E> {
    /// The component is opening the endpoint.
    Opening,
    Open(Arc<E>),
    Closed,
}

impl<E> Default for SharedEntity<E> {
    fn default() -> Self {
        Self {
            state: Mutex::new(State {
                phase: Phase::Opening,
                users: 0,
            }),
            changed: Condvar::new(),
        }
    }
}

impl<E> SharedEntity<E> {
    /// Lends `entity` to other threads from now on.
    pub(crate) fn open(&self, entity: &Arc<E>) {
        lock(&self.state).phase = Phase::Open(Arc::clone(entity));
        self.changed.notify_all();
    }

    /// Lends the endpoint no more, and waits until the threads that use it have let go,
    /// at most `limit`. Says whether they have.
    pub(crate) fn close(&self, limit: Duration) -> bool {
        let mut state = lock(&self.state);
        state.phase = Phase::Closed;
        self.changed.notify_all();
        let waited = self
            .changed
            .wait_timeout_while(state, limit, |state| state.users > 0);
        let (state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        state.users == 0
    }

    /// Whether the endpoint is closed, so that its users release it soon.
    pub(crate) fn is_closed(&self) -> bool {
        matches!(lock(&self.state).phase, Phase::Closed)
    }

    /// Uses the endpoint, if it is open.
    pub(crate) fn with<R>(&self, using: impl FnOnce(&E) -> R) -> Option<R> {
        let entity = lock(&self.state).borrow()?;
        Some(self.lend(entity, using))
    }

    /// Uses the endpoint, and waits until it is open.
    pub(crate) fn with_opened<R>(&self, using: impl FnOnce(&E) -> R) -> Option<R> {
        let waited = self
            .changed
            .wait_timeout_while(lock(&self.state), OPENING, |state| {
                matches!(state.phase, Phase::Opening)
            });
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let entity = state.borrow()?;
        drop(state);
        Some(self.lend(entity, using))
    }

    fn lend<R>(&self, entity: Arc<E>, using: impl FnOnce(&E) -> R) -> R {
        let result = using(&entity);
        // Before the count falls: the thread that closes the endpoint has the last reference then.
        drop(entity);
        lock(&self.state).users -= 1;
        self.changed.notify_all();
        result
    }
}

impl<E> State<E> {
    /// Counts one user more.
    fn borrow(&mut self) -> Option<Arc<E>> {
        let Phase::Open(entity) = &self.phase else {
            return None;
        };
        let entity = Arc::clone(entity);
        self.users += 1;
        Some(entity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::time::Instant;

    #[test]
    fn closing_waits_for_users_only_until_its_limit() {
        let shared = SharedEntity::<()>::default();
        let (entity, limit) = (Arc::new(()), Duration::from_millis(30));
        shared.open(&entity);
        let (entered, has_entered) = channel();
        let (leave, may_leave) = channel::<()>();
        std::thread::scope(|scope| {
            let shared = &shared;
            scope.spawn(move || {
                shared.with(|()| {
                    entered.send(()).expect("a test");
                    may_leave.recv().expect("a test");
                })
            });
            has_entered.recv().expect("a user");
            let begin = Instant::now();
            assert!(!shared.close(limit));
            assert!(begin.elapsed() >= limit);
            // No other thread gets it.
            assert!(shared.with(|()| ()).is_none() && shared.with_opened(|()| ()).is_none());
            leave.send(()).expect("a user");
            assert!(shared.close(Duration::from_secs(10)));
        });
        assert_eq!(Arc::strong_count(&entity), 1);
    }
}
