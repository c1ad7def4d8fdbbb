//! Changes that the user of the window makes with the pointer.

use crate::warnings::Warnings;
use innermodel::Kind;
use innermodel_simulation::World;
use rc_diagnostics::foreign::clean;
use rcis_generated::innermodel_viewer::{Action, Actions};

/// Makes the changes that wait. The window shows why one is refused, and the log says it once.
pub(crate) fn obey(actions: &Actions, world: &mut World, warnings: &mut Warnings) {
    for action in actions.take() {
        if let Err(text) = act(world, action) {
            actions.refuse(&text);
            warnings.log(format!("in the window: {text}"));
        }
    }
}

/// Makes a change. The error is a sentence.
fn act(world: &mut World, action: Action) -> Result<(), String> {
    match action {
        Action::Move { id, place } => {
            let tree = world.tree();
            // The next step would take it back to its path.
            if let Ok(node) = tree.node(&id)
                && let Kind::Human(human) = node.kind()
                && human.path.len() > 1
            {
                return Err(format!(
                    "`{}` walks along its path: remove its attribute `path` to move it",
                    clean(&id)
                ));
            }
            let pose = tree.pose("root", &id);
            let mut pose = pose.map_err(|error| error.to_string())?;
            pose.translation = place.into();
            let moved = world.teleport(&id, "root", pose);
            moved.map_err(|error| error.to_string())
        }
        Action::Push { id, impulse } => {
            let pushed = world.push(&id, impulse);
            pushed.map_err(|error| error.to_string())
        }
    }
}
