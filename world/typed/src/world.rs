//! Changes and questions of the world that a component holds.

use crate::error::Error;
use crate::view::End;
use property_graph::{Edit, Time, Transform};
use rc_world::{Token, World};
use rc_world_member::Member;

/// Makes several changes, which others see as one. The token names them.
///
/// # Errors
/// The closure fails, the schema does not allow the change, or the component does not write what is
/// changed. Nothing has changed then.
pub fn change(
    member: &mut Member,
    make: impl FnOnce(&mut Edit) -> Result<(), Error>,
) -> Result<Token, Error> {
    let mut refused = None;
    let result = member.change(|edit| {
        make(edit).map_err(|error| match error {
            Error::Graph(error) => (*error).into(),
            Error::World(error) => *error,
            error => {
                refused = Some(error);
                property_graph::Error::Removed.into()
            }
        })
    });
    result.map_err(|error| refused.unwrap_or_else(|| error.into()))
}

/// The transform that takes coordinates in `from` to those in `to`, at `time` of the network's clock.
/// Between two changes of a pose, it is interpolated; it is never that of the nearest change.
///
/// # Errors
/// A name does not denote exactly one node, no edges with poses connect the nodes, the history
/// begins later, or the newest change is older than `time`.
pub fn between(
    world: &World,
    to: impl End,
    from: impl End,
    time: Time,
) -> Result<Transform, Error> {
    let newest = world.snapshot().time();
    if time > newest {
        return Err(Error::TooLate { newest });
    }
    let moment = world.at(time).map_err(|error| match error {
        rc_world::Error::Graph(property_graph::Error::TooEarly) => Error::TooEarly,
        error => error.into(),
    })?;
    let version = moment.version();
    let (to, from) = (to.node(version)?, from.node(version)?);
    let (to, from) = (version.frame(to)?, version.frame(from)?);
    Ok(moment.between(to, from)?)
}
