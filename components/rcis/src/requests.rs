//! Values of requests of `Simulation`.

use crate::elements;
use crate::refusal::Refusal;
use innermodel::language::Document;
use innermodel_simulation::{Speed, World};
use rcis_generated::types::rc_simulation::Reason;
use rcis_generated::{Clock, Pose};
use std::path::Path;

pub(crate) fn wrong(what: impl Into<String>) -> Refusal {
    Refusal::Other(Reason::WrongValue, what.into())
}

pub(crate) fn pose_in(pose: &Pose) -> innermodel::Pose {
    innermodel::Pose::new(pose.x, pose.y, pose.z, pose.rx, pose.ry, pose.rz)
}

pub(crate) fn pose_out(pose: &innermodel::Pose) -> Pose {
    let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
    Pose {
        x,
        y,
        z,
        rx,
        ry,
        rz,
    }
}

/// Reads a text with one outermost element.
pub(crate) fn one_element(scene: &Path, text: &str) -> Result<Document, Refusal> {
    let read = elements::read(scene, text);
    let document = read.map_err(|refused| {
        let reason = match refused {
            inner_model_manager::Refusal::Path(_) => Reason::WrongValue,
            _ => Reason::WrongText,
        };
        Refusal::Other(reason, refused.text())
    })?;
    let tops = document.nodes.iter().filter(|node| node.parent.is_none());
    let tops = tops.count();
    if tops != 1 {
        let text = format!("expected one element, found {tops}");
        return Err(Refusal::Other(Reason::WrongText, text));
    }
    Ok(document)
}

pub(crate) fn clock(world: &World, pending: u64) -> Clock {
    let count = |number: u128| i64::try_from(number).unwrap_or(i64::MAX);
    Clock {
        time: count(world.time().as_nanos()),
        steps: count(u128::from(world.steps())),
        step: count(world.step_time().as_nanos()),
        pending: count(u128::from(pending)),
    }
}

pub(crate) fn speed(side: f64, advance: f64, turn: f64) -> Speed {
    Speed {
        side,
        advance,
        turn,
    }
}
