//! The solvers of a robot, as templates have them.

use crate::view::component::Kinematics as Solvers;
use serde::Serialize;

/// The solvers of a robot in one language.
#[derive(Debug, Serialize)]
pub(crate) struct Kinematics<'a> {
    /// The member of the context, which is also the module.
    pub(crate) field: String,
    robot: &'a str,
    /// The module.
    #[serde(skip)]
    pub(crate) text: &'a str,
}

impl<'a> Kinematics<'a> {
    /// The solvers with their module, and the name of the member, in that language.
    pub(crate) fn of(solvers: &'a Solvers, field: String, text: &'a str) -> Self {
        Self {
            field,
            robot: &solvers.robot,
            text,
        }
    }
}
