//! Changes that the user of the window makes with the pointer.

use crate::SpecificWorker;
use innermodel_simulation::Error;
use rcis_generated::innermodel_viewer::Action;

impl SpecificWorker {
    /// Makes the changes that wait. The window shows why one is refused, and the log says it once.
    pub(crate) fn obey_window(&mut self) {
        for action in self.actions.take() {
            if let Err(error) = self.act(action) {
                let text = error.to_string();
                self.actions.refuse(&text);
                self.warn_once(format!("in the window: {text}"));
            }
        }
    }

    fn act(&mut self, action: Action) -> Result<(), Error> {
        match action {
            Action::Move { id, place } => {
                let mut pose = self.world.tree().pose("root", &id)?;
                pose.translation = place.into();
                self.world.teleport(&id, "root", pose)
            }
            Action::Push { id, impulse } => self.world.push(&id, impulse),
        }
    }
}
