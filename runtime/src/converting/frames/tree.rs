//! Asks the `InnerModel` of a slot where frames are.

use super::NoTransform;
use rc_conversion::{EXCEPTION, Needed, QUERY, Transform};
use rc_diagnostics::foreign::clean;
use rc_middleware::CallError;
use rc_middleware::typed::{Operation, Put, TypedClient, expect_result};
use rc_quantity::Axes;
use rc_quantity::rotation::{EulerOrder, product, transposed, turned};
use std::time::Duration;

/// The millimetres of the tree in a metre.
const METRE: f64 = 1000.0;

/// A client of `RcInnerModel::InnerModel`.
pub(crate) struct Tree {
    client: TypedClient,
    query: &'static Operation,
}

impl Tree {
    /// `None` if the interface is another one.
    pub(crate) fn new(client: TypedClient, operations: &'static [Operation]) -> Option<Self> {
        let mut operations = operations.iter();
        let query = operations.find(|own| (own.name, own.type_hash) == QUERY)?;
        Some(Self { client, query })
    }

    /// The transform at a time, with the axes of ROS and in metres.
    pub(super) fn transform(
        &mut self,
        needed: &Needed<'_>,
        limit: Duration,
    ) -> Result<Transform, NoTransform> {
        self.client.set_timeout(limit);
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
}
