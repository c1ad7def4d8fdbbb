//! Where frames are: asks the `InnerModel` of a slot (`--frames SLOT=TREE`).

use crate::clock::{Clock, Time};
use rc_conversion::{Needed, QUERY, Transform};
use rc_diagnostics::foreign::clean;
use rc_middleware::CallError;
use rc_middleware::typed::{Operation, Put, TypedClient, expect_result};
use rc_quantity::Axes;
use rc_quantity::rotation::{EulerOrder, product, transposed, turned};
use std::fmt;
use std::sync::Arc;
use std::thread;

/// The hash of the exception of the query.
pub(super) const EXCEPTION: i32 = 291_013_833;

/// The millimetres of the tree in a metre.
const METRE: f64 = 1000.0;

/// Knows where frames are.
pub(crate) struct Frames {
    client: TypedClient,
    query: &'static Operation,
    clock: Arc<dyn Clock>,
    /// Whether the clock goes on while this thread waits.
    waits: bool,
}

/// Why there is no transform.
#[derive(Debug)]
pub(super) enum NoTransform {
    /// The time has not come.
    NotYet(Time),
    /// The tree has none, or did not reply.
    Tree(CallError),
    /// A number of the pose is not finite.
    Pose,
}

impl fmt::Display for NoTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotYet(now) => write!(f, "the clock of the network is at {now}"),
            Self::Tree(error) => error.fmt(f),
            Self::Pose => f.write_str("its numbers are not finite"),
        }
    }
}

impl Frames {
    /// Asks through this client of `RcInnerModel::InnerModel`. `None` if the interface is another
    /// one.
    pub(crate) fn new(
        client: TypedClient,
        operations: &'static [Operation],
        clock: &Arc<dyn Clock>,
        waits: bool,
    ) -> Option<Self> {
        let mut operations = operations.iter();
        let query = operations.find(|own| (own.name, own.type_hash) == QUERY)?;
        Some(Self {
            client,
            query,
            clock: Arc::clone(clock),
            waits,
        })
    }

    /// The transform at a time, with the axes of ROS and in metres. Waits for times to come, and for
    /// the reply, as long as the slot of the tree waits for calls.
    pub(super) fn transform(&mut self, needed: &Needed<'_>) -> Result<Transform, NoTransform> {
        self.await_time(Time::from_nanos(u64::try_from(needed.time).unwrap_or(0)))?;
        let arguments = (needed.to, needed.from.as_str(), &needed.time);
        let pose = self.client.call_with(
            self.query,
            |writer| arguments.put(writer),
            |case, reader| {
                if case == EXCEPTION {
                    let _reason: i32 = reader.get()?;
                    let what: String = reader.get()?;
                    return Err(CallError::Refused(clean(&what)));
                }
                expect_result(case)?;
                Ok(reader.get::<[f64; 6]>()?)
            },
        );
        let [x, y, z, angles @ ..] = pose.map_err(NoTransform::Tree)?;
        let axes = Axes::INNER_MODEL.matrix_to(Axes::ROS);
        let own = EulerOrder::XYZ_MOVING.matrix::<f64>(angles);
        let turn = product(&axes, &product(&own, &transposed(&axes)));
        let by = turned(&axes, [x, y, z]).map(|length| length / METRE);
        let mut numbers = [0.0; 12];
        let (rows, _) = numbers.as_chunks_mut::<4>();
        for (row, ([x, y, z], by)) in rows.iter_mut().zip(turn.iter().zip(by)) {
            *row = [*x, *y, *z, by];
        }
        let is_finite = numbers.iter().all(|number| number.is_finite());
        is_finite.then_some(numbers).ok_or(NoTransform::Pose)
    }

    /// Waits until a time has come: the clocks of two machines differ a little.
    fn await_time(&self, time: Time) -> Result<(), NoTransform> {
        let now = self.clock.now();
        let ahead = time - now;
        if ahead.is_zero() {
            return Ok(());
        }
        if !self.waits || ahead > self.client.timeout() {
            return Err(NoTransform::NotYet(now));
        }
        thread::sleep(ahead);
        Ok(())
    }
}
