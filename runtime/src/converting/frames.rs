//! Where frames are, for the messages of a slot (`--frames SLOT=TREE`).
//!
//! A message may need several transforms. Equal ones are looked up once, and all of them have
//! one deadline: a message holds up its component for no longer than one call may take.

mod tf;
mod transforms;
mod tree;

pub(crate) use tf::{Fed, Shared, Tf, TfSlot, history};
pub(crate) use tree::Tree;

use crate::clock::{Clock, Time};
use rc_conversion::{Needed, Transform};
use rc_middleware::{CallError, WakeEvent};
use std::cell::RefCell;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use transforms::Missing;

/// The longest sleep: a stop ends all waits, and a backend may lose a wake-up.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);

/// Knows where frames are.
pub(crate) struct Frames {
    source: Source,
    clock: Arc<dyn Clock>,
    /// Ends the waits of this thread. `None` if the clock stands still meanwhile: then nothing
    /// waits.
    stop: Option<WakeEvent>,
    /// The longest time for all transforms of a message.
    limit: Duration,
    idle: IdleFlag,
}

/// Knows where frames are: what the component itself holds of a shared world.
pub trait Places {
    /// The transform from one frame to another one at a time of the network, in nanoseconds: the rows
    /// of `[R | t]`, in metres.
    ///
    /// # Errors
    /// Why it is not known.
    fn transform(&self, to: &str, from: &str, nanoseconds: u64) -> Result<[f64; 12], String>;
}

/// The [`Places`] of a component, once its worker has opened them.
pub(crate) type OwnPlaces = Rc<RefCell<Option<Rc<dyn Places>>>>;

/// The source of transforms.
pub(crate) enum Source {
    /// A tree that is asked.
    Tree(Box<Tree>),
    /// Transforms that were received.
    Tf(Tf),
    /// The world of the component.
    World(OwnPlaces),
}

/// Whether the component is not active. The event loop says it before it takes a sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct IdleFlag(Arc<AtomicBool>);

impl IdleFlag {
    /// Sets whether the component is not active.
    pub(crate) fn set(&self, is_idle: bool) {
        self.0.store(is_idle, Ordering::Relaxed);
    }
}

/// The reason why there is no transform.
#[derive(Debug)]
pub(super) enum NoTransform {
    /// The time has not come.
    NotYet(Time),
    /// The time for this message is over.
    Late(Duration),
    /// The tree has none, or did not reply.
    Tree(CallError),
    /// A number of the pose is not finite.
    Pose,
    /// It has not come, or is too old.
    Tf(Missing),
    /// The world has none.
    World(String),
}

impl fmt::Display for NoTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotYet(now) => write!(f, "the clock of the network is at {now}"),
            Self::Late(limit) => write!(f, "the transforms of the message took {limit:?}"),
            Self::Tree(error) => error.fmt(f),
            Self::Pose => f.write_str("its numbers are not finite"),
            Self::Tf(missing) => missing.fmt(f),
            Self::World(reason) => f.write_str(reason),
        }
    }
}

impl Frames {
    /// Asks the source. `stop` ends waits; without it, nothing waits.
    pub(crate) fn new(
        source: Source,
        limit: Duration,
        (clock, stop): (&Arc<dyn Clock>, Option<WakeEvent>),
        idle: &IdleFlag,
    ) -> Self {
        Self {
            source,
            clock: Arc::clone(clock),
            stop,
            limit,
            idle: idle.clone(),
        }
    }

    /// Whether the component is not active.
    pub(super) fn is_idle(&self) -> bool {
        self.idle.0.load(Ordering::Relaxed)
    }

    /// The transforms that a message needs, in this order. Waits for times to come, and for replies.
    ///
    /// # Errors
    /// The first one that is not known, by its place.
    pub(super) fn transforms(
        &mut self,
        needed: &[Needed<'_>],
    ) -> Result<Vec<Transform>, (usize, NoTransform)> {
        let deadline = Instant::now() + self.limit;
        let mut known: Vec<Transform> = Vec::with_capacity(needed.len());
        for (at, one) in needed.iter().enumerate() {
            let same = needed[..at].iter().position(|other| other == one);
            let transform = match same {
                Some(same) => known[same],
                None => self
                    .transform(one, deadline)
                    .map_err(|reason| (at, reason))?,
            };
            known.push(transform);
        }
        Ok(known)
    }

    fn transform(
        &mut self,
        needed: &Needed<'_>,
        deadline: Instant,
    ) -> Result<Transform, NoTransform> {
        let stop = self.stop.as_ref();
        let time = Time::from_nanos(u64::try_from(needed.time).unwrap_or(0));
        match &mut self.source {
            Source::Tf(tf) => {
                // No source knows where frames are at a time that does not come before the
                // deadline.
                let left = deadline.saturating_duration_since(Instant::now());
                let comes = time - self.clock.now() <= left;
                let stop = stop.filter(|_| comes);
                tf.transform(needed, &*self.clock, stop.map(|stop| (deadline, stop)))
            }
            Source::World(places) => {
                await_time((&*self.clock, stop), time, deadline)?;
                let places = places.borrow();
                let places = places.as_ref().ok_or_else(|| {
                    NoTransform::World("the component has not opened its world".to_owned())
                })?;
                let transform = places.transform(needed.to, &needed.from, time.as_nanos());
                transform.map_err(NoTransform::World)
            }
            Source::Tree(tree) => {
                await_time((&*self.clock, stop), time, deadline)?;
                let left = deadline.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(NoTransform::Late(self.limit));
                }
                tree.transform(needed, left)
            }
        }
    }
}

/// Waits until a time has come, if the clock goes on: the clocks of two machines differ a little.
fn await_time(
    (clock, stop): (&dyn Clock, Option<&WakeEvent>),
    time: Time,
    deadline: Instant,
) -> Result<(), NoTransform> {
    loop {
        let now = clock.now();
        let ahead = time - now;
        if ahead.is_zero() {
            return Ok(());
        }
        let left = deadline.saturating_duration_since(Instant::now());
        if ahead > left || stop.is_none_or(WakeEvent::is_stopping) {
            return Err(NoTransform::NotYet(now));
        }
        thread::sleep(ahead.min(LONGEST_SLEEP));
    }
}
