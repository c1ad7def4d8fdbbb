//! The bodies of a world, at present or where they were when a sensor measured.

use crate::problems::Problems;
use innermodel::Snapshot;
use innermodel_collision::Space;
use rc_diagnostics::foreign::clean;
use std::sync::Arc;

/// The bodies of one world. Clones share them until one of them moves.
#[derive(Clone, Debug)]
pub(crate) struct Bodies {
    space: Arc<Space>,
    /// Whether they are where they are at present.
    is_present: bool,
}

impl Bodies {
    pub(crate) fn new(tree: &Snapshot, problems: &mut Problems) -> Self {
        let mut bodies = Self {
            space: Arc::new(Space::new(tree)),
            is_present: true,
        };
        bodies.report(problems);
        bodies
    }

    /// The bodies where they were last put.
    pub(crate) fn space(&self) -> &Space {
        &self.space
    }

    /// Notes that another tree, or an older version, is the present one.
    pub(crate) fn forget_place(&mut self) {
        self.is_present = false;
    }

    /// Moves them to where the present version has them.
    pub(crate) fn follow(&mut self, present: &Snapshot, problems: &mut Problems) {
        if !self.is_present || self.space.tree().version() != present.version() {
            self.put(present, problems);
            self.is_present = true;
        }
    }

    /// The bodies where they were in another version.
    pub(crate) fn at(&mut self, tree: &Snapshot, problems: &mut Problems) -> &Space {
        self.put(tree, problems);
        self.is_present = false;
        &self.space
    }

    fn put(&mut self, tree: &Snapshot, problems: &mut Problems) {
        Arc::make_mut(&mut self.space).update(tree);
        self.report(problems);
    }

    /// Reports which meshes have given no body.
    fn report(&mut self, problems: &mut Problems) {
        for problem in Arc::make_mut(&mut self.space).problems() {
            let (id, error) = (clean(&problem.id), clean(&problem.error.to_string()));
            problems.add(format!("`{id}` has no body: {error}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::{InnerModel, Pose};
    use std::time::Duration;

    const SCENE: &str = r#"<innerModel>
        <transform id="cart"><plane id="a" size="100,100,100" collide="1"/></transform>
        <plane id="b" px="500" size="100,100,100" collide="1"/>
        </innerModel>"#;

    #[test]
    fn bodies_return_from_the_past_to_the_present() {
        let model = InnerModel::parse(SCENE).expect("a scene");
        let mut problems = Problems::default();
        let (apart, clone) = (model.snapshot(), model.fork());
        let mut bodies = Bodies::new(&apart, &mut problems);
        let there = Pose::new(450.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let moved = model.change(Duration::ZERO, |edit| edit.set_pose("cart", there));
        moved.expect("a place");
        let touch = |bodies: &Bodies| bodies.space().collide("a", "b").expect("bodies");
        assert!(!touch(&bodies));
        bodies.follow(&model.snapshot(), &mut problems);
        assert!(touch(&bodies));
        assert!(
            !bodies
                .at(&apart, &mut problems)
                .collide("a", "b")
                .expect("bodies")
        );
        bodies.follow(&model.snapshot(), &mut problems);
        assert!(touch(&bodies));
        // The clone's versions have numbers of their own.
        bodies.forget_place();
        bodies.follow(&clone.snapshot(), &mut problems);
        assert!(!touch(&bodies));
        assert!(problems.take().is_empty());
    }
}
