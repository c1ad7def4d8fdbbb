//! The world as a component holds it.

use crate::answers::MOST_ANSWER;
use crate::core::Core;
use crate::error::Error;
use crate::health::Health;
use crate::local::START;
use crate::message::Message;
use crate::news::{News, Reader};
use crate::overruled::Overruled;
use crate::rights::Rights;
use crate::status::Status;
use crate::token::Token;
use graph_merge::{Conflict, Delta, unique_writer};
use graph_schema::Schema;
use property_graph::{Edit, Graph, Keep, Moment, Snapshot, Time};
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The time at which changes are made, by the clock of the network.
type Clock = Arc<dyn Fn() -> Time + Send + Sync>;

/// The settings of a replica at its start.
pub struct Setup {
    /// Name of the instance in its network.
    pub name: String,
    /// The schema. Replicas of one world have equal ones.
    pub schema: Arc<Schema>,
    /// Its rights to write.
    pub rights: Rights,
    /// The clock of changes.
    pub clock: Clock,
    /// The writer. No two replicas have the same one, and no two runs of one component.
    pub writer: u64,
    /// How many bytes it sends in an answer at most. A larger world is sent in several.
    pub most_answer: usize,
    /// Whether it removes edges of which others have removed an end. A tool that listens does not.
    pub tidies: bool,
}

impl Setup {
    /// A replica of this instance that may write everything, with a writer of its own and a clock
    /// that stands at zero.
    pub fn new(name: &str, schema: Arc<Schema>) -> Self {
        Self {
            name: name.to_owned(),
            schema,
            rights: Rights::everything(),
            clock: Arc::new(|| Time::ZERO),
            writer: unique_writer(),
            most_answer: MOST_ANSWER,
            tidies: true,
        }
    }

    /// Sets the clock.
    #[must_use]
    pub fn with_clock(mut self, clock: impl Fn() -> Time + Send + Sync + 'static) -> Self {
        self.clock = Arc::new(clock);
        self
    }

    /// Sets the rights.
    #[must_use]
    pub fn with_rights(mut self, rights: Rights) -> Self {
        self.rights = rights;
        self
    }

    /// Sets how many bytes an answer has at most; 64 MiB if this is more.
    #[must_use]
    pub fn with_most_answer(mut self, bytes: usize) -> Self {
        self.most_answer = bytes.min(MOST_ANSWER);
        self
    }

    /// Leaves it to others to remove edges of which an end was removed.
    #[must_use]
    pub fn without_tidying(mut self) -> Self {
        self.tidies = false;
        self
    }

    /// Sets the writer.
    #[must_use]
    pub fn with_writer(mut self, writer: u64) -> Self {
        self.writer = writer;
        self
    }
}

/// A replica of the world. Several threads may share it.
pub struct World {
    graph: Graph,
    core: Mutex<Core>,
    /// Wakes the threads that wait for a change.
    changed: Condvar,
    waiting: AtomicUsize,
    clock: Clock,
}

impl fmt::Debug for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("World")
            .field("graph", &self.graph)
            .finish_non_exhaustive()
    }
}

impl World {
    /// A replica that is empty so far.
    pub fn new(setup: Setup) -> Self {
        Self {
            graph: Graph::new(Arc::clone(&setup.schema), setup.writer),
            clock: Arc::clone(&setup.clock),
            core: Mutex::new(Core::new(setup)),
            changed: Condvar::new(),
            waiting: AtomicUsize::new(0),
        }
    }

    fn core(&self) -> MutexGuard<'_, Core> {
        // The state of a thread that panicked is consistent: a change is noted in one step.
        self.core.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The present version. It never changes, and no reader waits.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        self.graph.snapshot()
    }

    /// The graph, to ask it for histories. It is changed by [`World::change`] alone.
    pub fn history(&self) -> &Graph {
        &self.graph
    }

    /// The world as it was at `time`. Between two changes of a pose, it is interpolated.
    ///
    /// # Errors
    /// The history starts after `time`.
    pub fn at(&self, time: Time) -> Result<Moment, Error> {
        Ok(self.graph.at(time)?)
    }

    /// How much of the past is kept.
    pub fn keep(&self, keep: Keep) {
        self.graph.keep(keep);
    }

    /// An independent graph that starts with the present version, to try something. Changes there
    /// stay there.
    pub fn fork(&self) -> Graph {
        self.graph.fork(unique_writer())
    }

    /// Makes several changes. All readers get them in one version, here and in other replicas.
    ///
    /// # Errors
    /// The closure fails, the schema does not allow the change, or the component may not write an
    /// element. Nothing has changed then.
    pub fn change(
        &self,
        make: impl FnOnce(&mut Edit) -> Result<(), Error>,
    ) -> Result<Token, Error> {
        self.change_with(make).map(|((), token)| token)
    }

    /// As [`Self::change`], with a result.
    ///
    /// # Errors
    /// Those of [`World::change`].
    pub fn change_with<T>(
        &self,
        make: impl FnOnce(&mut Edit) -> Result<T, Error>,
    ) -> Result<(T, Token), Error> {
        let mut core = self.core();
        let changed = core.change(&self.graph, (self.clock)(), make);
        self.wake(core);
        changed
    }

    /// Whether this replica has a change.
    pub fn has(&self, token: Token) -> bool {
        self.core().has(token)
    }

    /// Waits until this replica has a change, at most for `limit`. Returns whether it has it.
    /// Another thread passes messages in: a thread that does so itself would wait without effect. A
    /// worker uses the function of its context.
    pub fn wait_for(&self, token: Token, limit: Duration) -> bool {
        let core = self.core();
        // Others read the number while holding the lock, so none of them misses this thread.
        self.waiting.fetch_add(1, Ordering::Relaxed);
        let waited = self
            .changed
            .wait_timeout_while(core, limit, |core| !core.has(token));
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        let (core, _) = waited.unwrap_or_else(PoisonError::into_inner);
        core.has(token)
    }

    /// Wakes the threads that wait, once the lock is free.
    fn wake(&self, core: MutexGuard<'_, Core>) {
        let is_awaited = self.waiting.load(Ordering::Relaxed) > 0;
        drop(core);
        if is_awaited {
            self.changed.notify_all();
        }
    }

    /// Whether all other replicas had a change at their last announcement.
    pub fn all_have(&self, token: Token) -> bool {
        self.core().all_have(token)
    }

    /// A reader of what changes from now on.
    pub fn reader(&self) -> Reader {
        Reader {
            seen: self.snapshot(),
        }
    }

    /// The changes since the reader last asked. `None` if there are none.
    pub fn news(&self, reader: &mut Reader) -> Option<News> {
        reader.until(self.snapshot())
    }

    /// The hidden elements, which contradict elements of other replicas.
    pub fn conflicts(&self) -> Vec<Conflict> {
        self.core().conflicts.clone()
    }

    /// The next value that another replica gave an attribute at the same time as this one, whose value
    /// is shown. Of more than 256 that nobody takes, the oldest are forgotten, and so are those of which a
    /// third value is shown meanwhile.
    pub fn overruled(&self) -> Option<Overruled> {
        let mut core = self.core();
        while let Some(one) = core.overruled.pop_front() {
            if core.replica.get(one.of, &one.attribute) == one.shown.as_ref() {
                return Some(one);
            }
        }
        None
    }

    /// The problems of the replica.
    pub fn health(&self) -> Health {
        let now = self.snapshot();
        Health::of(&self.core(), &now)
    }

    /// Why the newest changes are not shown: they break a rule of the schema together. It ends when
    /// a replica changes that.
    pub fn fault(&self) -> Option<String> {
        self.core().fault.clone()
    }

    /// Adds the contents of a graph as the start of this world. Each replica that starts with an
    /// equal graph has the same elements, so they exist once.
    ///
    /// # Errors
    /// The graph breaks the schema.
    pub fn start_with(&self, start: &Snapshot) -> Result<(), Error> {
        self.core().start_with(&self.graph, (self.clock)(), start)
    }

    /// Whether this replica, or one that it has heard of, has started the world.
    pub fn has_start(&self) -> bool {
        self.core().seen(START) > 0
    }

    /// Takes a message of another replica, at this time of a clock that only goes forward. Errors
    /// of the message are counted in [`Status`]; nothing is changed then. While there are
    /// conflicts, its changes are shown at the next [`World::turn`].
    pub fn receive(&self, now: Duration, message: Message) {
        let mut core = self.core();
        core.receive(&self.graph, (self.clock)(), now, message);
        self.wake(core);
    }

    /// Synchronizes two replicas of one schema at once and without messages: for tests.
    ///
    /// # Errors
    /// The replicas have different schemas.
    pub fn meet(&self, other: &Self) -> Result<(), Error> {
        for (from, to) in [(other, self), (self, other)] {
            let schemas = (from.core().protocol.schema, to.core().protocol.schema);
            if schemas.0 != schemas.1 {
                return Err(Error::OtherSchema);
            }
            let seen = to.core().replica.seen().clone();
            let (delta, samples) = from.core().told(&seen);
            let mut core = to.core();
            core.be_told(&to.graph, (to.clock)(), &delta, &samples);
            to.wake(core);
        }
        Ok(())
    }

    /// Takes an answer to another replica.
    pub(crate) fn overhear(&self, answer: Vec<Delta>) {
        let mut core = self.core();
        core.take_deltas(&self.graph, (self.clock)(), answer);
        self.wake(core);
    }

    /// Counts an answer to another replica that cannot be read.
    pub(crate) fn refuse(&self, reason: &str) {
        self.core().protocol.refuse(reason);
    }

    /// Does the work that is due, and returns when more is due, by the same clock.
    pub fn turn(&self, now: Duration) -> Duration {
        let mut core = self.core();
        let next = core.turn(&self.graph, (self.clock)(), now);
        self.wake(core);
        next
    }

    /// A message to publish.
    pub fn take(&self) -> Option<Message> {
        self.core().take()
    }

    /// Says goodbye: others do not wait for this replica. Publish what [`World::take`] returns.
    pub fn leave(&self) {
        self.core().leave();
    }

    /// Whether the replica has the changes that the others had when it joined, or is alone. It
    /// takes at least 2.5 s to know that.
    pub fn has_joined(&self) -> bool {
        self.core().has_joined()
    }

    /// How many messages were refused. It takes no time in proportion to the world.
    pub fn refused(&self) -> u64 {
        self.core().protocol.counts.refused
    }

    /// Why the last refused message was; empty if none was.
    pub fn last_refusal(&self) -> String {
        self.core().protocol.counts.last_refusal.clone()
    }

    /// State of the replica.
    pub fn status(&self, now: Duration) -> Status {
        Status::of(&mut self.core(), now)
    }
}
