//! A robot along other axes, and with another unit of length.

use crate::robot::{Inertia, Kept, Motion, Robot};
use rc_quantity::rotation::{Matrix, product, transposed, turned};
use rc_quantity::{Axes, Transform};

/// The axes and the unit of the numbers of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grounding {
    /// The axes of all frames.
    pub axes: Axes,
    /// How many units of length a metre has.
    pub metre: f64,
}

impl Default for Grounding {
    /// Those of a URDF.
    fn default() -> Self {
        Self {
            axes: Axes::ROS,
            metre: 1.0,
        }
    }
}

impl Grounding {
    /// A direction with the axes of a URDF along these ones.
    pub fn direction(&self, vector: [f64; 3]) -> [f64; 3] {
        clean(turned(&Axes::ROS.matrix_to(self.axes), vector))
    }

    /// An axis that bodies turn about, likewise: its sense changes with the hand of the axes.
    pub fn axis(&self, vector: [f64; 3]) -> [f64; 3] {
        clean(turned(&Axes::ROS.axial_matrix_to(self.axes), vector))
    }

    fn point(&self, point: [f64; 3]) -> [f64; 3] {
        self.direction(point).map(|part| part * self.metre)
    }

    /// R is along both axes of it.
    fn rotation(&self, matrix: &Matrix) -> Matrix {
        let turn = Axes::ROS.matrix_to(self.axes);
        product(&product(&turn, matrix), &transposed(&turn)).map(clean)
    }

    fn transform(&self, place: &Transform) -> Transform {
        Transform {
            rotation: self.rotation(&place.rotation),
            translation: self.point(place.translation),
        }
    }

    /// A robot with the axes of a URDF along these ones. Torques and forces of joints stay as they
    /// are if the unit is a metre.
    #[must_use]
    pub fn of(&self, robot: &Robot) -> Robot {
        let mut robot = robot.clone();
        for body in &mut robot.bodies {
            if let Some(Inertia { centre, tensor, .. }) = &mut body.inertia {
                *centre = self.point(*centre);
                let square = self.metre * self.metre;
                *tensor = self
                    .rotation(tensor)
                    .map(|row| row.map(|part| part * square));
            }
            let Some(joint) = &mut body.joint else {
                continue;
            };
            joint.place = self.transform(&joint.place);
            match &mut joint.motion {
                Motion::Slides { offset, .. } => {
                    joint.axis = self.direction(joint.axis);
                    *offset *= self.metre;
                    if let Some(limits) = &mut joint.limits {
                        limits.lower *= self.metre;
                        limits.upper *= self.metre;
                        limits.velocity *= self.metre;
                    }
                }
                Motion::Turns { .. } | Motion::Fixed => joint.axis = self.axis(joint.axis),
            }
        }
        for own in &mut robot.loops {
            match &mut own.kept {
                Kept::Turning(axis) => *axis = self.axis(*axis),
                Kept::Sliding(axis) => *axis = self.direction(*axis),
                Kept::Whole | Kept::Point => {}
            }
        }
        self.ratios(&mut robot);
        robot
    }

    /// A joint that turns by the position of one that slides, or the other way round.
    fn ratios(&self, robot: &mut Robot) {
        let slides: Vec<bool> = (0..robot.coordinates.len())
            .map(|at| robot.slides(at))
            .collect();
        for own in &mut robot.transmissions {
            if slides[own.coordinate] {
                own.reduction /= self.metre;
                own.offset *= self.metre;
            }
        }
        let joints = robot
            .bodies
            .iter_mut()
            .filter_map(|body| body.joint.as_mut());
        for joint in joints {
            match &mut joint.motion {
                Motion::Turns {
                    coordinate, ratio, ..
                } if slides[*coordinate] => *ratio /= self.metre,
                Motion::Slides {
                    coordinate, ratio, ..
                } if !slides[*coordinate] => *ratio *= self.metre,
                _ => {}
            }
        }
    }
}

/// Numbers without the sign of a zero.
fn clean(vector: [f64; 3]) -> [f64; 3] {
    vector.map(|part| part + 0.0)
}
