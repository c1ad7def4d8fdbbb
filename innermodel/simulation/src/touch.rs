//! Sensors that feel contacts.

use crate::error::Error;
use crate::frames::Touch;
use crate::ranges::OwnBodies;
use crate::schedule::Measured;
use crate::sensor_noise::SensorNoise;
use crate::world::World;
use innermodel::{Kind, Transform};

impl World {
    /// The last frame of a `touchsensor`: whether one of its bodies overlaps another body with
    /// `collide` that it may not touch. Bodies of its own robot do not count.
    pub fn touch(&mut self, id: &str) -> Result<Touch, Error> {
        let (node, frame) = match self.frame(id)? {
            (_, _, Some(Measured::Touch(touch))) => return Ok(touch),
            (node, frame, _) => (node, frame),
        };
        let tree = frame.tree;
        let here = tree.node(node)?;
        let Kind::TouchSensor(sensor) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "touchsensor"));
        };
        let random = self.random(id, frame.number);
        let is_lost = SensorNoise::new(&sensor.signal, random, 0.0).is_lost();
        let space = self.space_at(&tree);
        let own = OwnBodies::of(here, space);
        let counts = |_, other| !own.contains(other);
        let touched = space.touching(node, &Transform::identity(), &counts)?;
        let touch = Touch {
            number: frame.number,
            time: frame.time,
            node: touched
                .first()
                .map(|touching| touching.other)
                .filter(|_| !is_lost),
        };
        self.keep(node, Measured::Touch(touch));
        Ok(touch)
    }
}
