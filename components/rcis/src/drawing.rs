//! Pictures of a world for those who look at it from outside.

use crate::refusal::Refusal;
use crate::requests::wrong;
use crate::worlds::Worlds;
use innermodel::Point;
use rcis_generated::innermodel_viewer::{Viewpoint as From, ViewpointError};
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{Viewpoint, types};

/// A picture of a world as it is, as the content of a PNG file.
pub(crate) fn drawing(
    worlds: &mut Worlds,
    world: &str,
    view: &Viewpoint,
) -> Result<Vec<u8>, Refusal> {
    let (from, size) = (viewpoint(view)?, size(view)?);
    let world = worlds.named(world)?;
    let extents = world.extents();
    let view = from.view(&world.tree(), &extents, size);
    let view = view.map_err(|error| match error {
        ViewpointError::Tree(error) => error.into(),
        other => Refusal::Other(Reason::WrongKind, other.to_string()),
    })?;
    let image = world.draw(&view)?;
    image.png().map_err(|error| wrong(error.to_string()))
}

fn viewpoint(view: &Viewpoint) -> Result<From, Refusal> {
    if !view.camera.is_empty() {
        return Ok(From::Camera(view.camera.clone()));
    }
    let point = |of: &types::rc_inner_model::Point| {
        let point = Point::new(of.x, of.y, of.z);
        let is_finite = point.iter().all(|n| n.is_finite());
        is_finite
            .then_some(point)
            .ok_or_else(|| wrong("expected finite coordinates"))
    };
    let target = view.target.as_ref().map(point).transpose()?;
    Ok(match &view.eye {
        Some(eye) => From::Point(point(eye)?, target),
        None => From::Whole,
    })
}

fn size(view: &Viewpoint) -> Result<Option<(usize, usize)>, Refusal> {
    let (Ok(width), Ok(height)) = (usize::try_from(view.width), usize::try_from(view.height))
    else {
        return Err(wrong("a size cannot be negative"));
    };
    Ok((width > 0 && height > 0).then_some((width, height)))
}
