//! Queries of a world: its devices, and the measurements of its sensors.

use crate::bases;
use crate::bases::BaseState;
use crate::batteries::BatteryState;
use crate::devices::{self, Device};
use crate::error::Error;
use crate::frames::{Cloud, ImuSample, Picture, Scan, Touch};
use crate::motors::MotorState;
use crate::people;
use crate::pictures;
use crate::pose2d::Pose2D;
use crate::random::Random;
use crate::schedule::Measured;
use crate::sensor_noise::SensorNoise;
use crate::world::World;
use crate::{imu, ranges, touch};
use innermodel::kinds::{Robot, Signal};
use innermodel::slots::owner;
use innermodel::{Kind, NodeId, Point};
use innermodel_render::{Extent, Image, View};
use std::sync::Arc;

impl World {
    /// The sensors, bases, joints, batteries and people of the scene, in the order of the tree.
    pub fn devices(&self) -> Vec<Device> {
        devices::all(&self.tree())
    }

    /// The nodes of some kinds by their owners: see [`World::owner`]. In the order of the tree.
    pub fn groups(&self, tags: &[&str]) -> Vec<(String, Vec<String>)> {
        devices::groups(&self.tree(), tags)
    }

    /// The owner of a node: the robot above it, else the outermost node above it.
    pub fn owner(&self, id: &str) -> Result<String, Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        Ok(owner(&tree, node).to_owned())
    }

    /// How a sensor measures.
    pub fn signal(&self, id: &str) -> Result<Signal, Error> {
        devices::signal(&self.tree(), id)
    }

    /// The node of a robot, and how it is built.
    pub fn robot(&self, id: &str) -> Result<(NodeId, Robot), Error> {
        bases::robot(&self.tree(), id)
    }

    /// State of a base.
    pub fn base(&self, id: &str) -> Result<&BaseState, Error> {
        self.state.bases.get(&self.tree(), id)
    }

    /// Where a base is, whatever its odometry says.
    pub fn place(&self, id: &str) -> Result<Pose2D, Error> {
        let tree = self.tree();
        let (node, _) = bases::robot(&tree, id)?;
        Ok(Pose2D::of(&tree.between(NodeId::ROOT, node)?))
    }

    /// State of the motor of a joint. The position is that of the encoder, the same as long as no
    /// step is made. The tree has the exact one.
    pub fn motor(&self, id: &str) -> Result<MotorState, Error> {
        let random = self.random(id, self.state.steps);
        self.state.motors.get(&self.tree(), id, random)
    }

    /// The state of a battery.
    pub fn battery(&self, id: &str) -> Result<BatteryState, Error> {
        self.state.batteries.get(&self.tree(), id)
    }

    /// The joints of a person by their names, such as `head` and `left_knee`, in the root: the
    /// ground truth for those who track people.
    pub fn skeleton(&self, id: &str) -> Result<Vec<(&'static str, Point)>, Error> {
        people::skeleton(&self.tree(), id)
    }

    /// Whether a body below one node touches one below another node.
    pub fn collide(&mut self, a: &str, b: &str) -> Result<bool, Error> {
        self.follow();
        Ok(self.bodies.space().collide(a, b)?)
    }

    /// The last frame of a `laser` or an `ultrasound`.
    pub fn scan(&mut self, id: &str) -> Result<Arc<Scan>, Error> {
        let (node, frame) = match self.sensors.frame(&self.tree(), id)? {
            (_, _, Some(Measured::Scan(scan))) => return Ok(scan),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let random = self.random(here.id(), frame.number);
        let space = self.bodies.at(&frame.tree, &mut self.problems);
        let ranges = match here.kind() {
            Kind::Laser(laser) => ranges::laser(space, here, laser, &frame, random)?,
            Kind::Ultrasound(sonar) => ranges::ultrasound(space, here, sonar, &frame, random)?,
            kind => return Err(Error::other_kind(id, kind, "laser or ultrasound sensor")),
        };
        let scan = Arc::new(Scan {
            number: frame.number,
            time: frame.time,
            ranges,
        });
        self.sensors.keep(node, Measured::Scan(Arc::clone(&scan)));
        Ok(scan)
    }

    /// The last frame of a `lidar`.
    pub fn cloud(&mut self, id: &str) -> Result<Arc<Cloud>, Error> {
        let (node, frame) = match self.sensors.frame(&self.tree(), id)? {
            (_, _, Some(Measured::Cloud(cloud))) => return Ok(cloud),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let Kind::Lidar(lidar) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "lidar"));
        };
        let random = self.random(here.id(), frame.number);
        let space = self.bodies.at(&frame.tree, &mut self.problems);
        let cloud = Arc::new(Cloud {
            number: frame.number,
            time: frame.time,
            points: ranges::lidar(space, here, lidar, &frame, random)?,
        });
        self.sensors.keep(node, Measured::Cloud(Arc::clone(&cloud)));
        Ok(cloud)
    }

    /// The last frame of a `touchsensor`: whether one of its bodies overlaps another body with
    /// `collide` that it may not touch. Bodies of its own robot do not count.
    pub fn touch(&mut self, id: &str) -> Result<Touch, Error> {
        let (node, frame) = match self.sensors.frame(&self.tree(), id)? {
            (_, _, Some(Measured::Touch(touch))) => return Ok(touch),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let Kind::TouchSensor(sensor) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "touchsensor"));
        };
        let random = self.random(id, frame.number);
        let is_lost = SensorNoise::new(&sensor.signal, random, 0.0).is_lost();
        let space = self.bodies.at(&frame.tree, &mut self.problems);
        let touch = Touch {
            number: frame.number,
            time: frame.time,
            node: touch::touched(space, here)?.filter(|_| !is_lost),
        };
        self.sensors.keep(node, Measured::Touch(touch));
        Ok(touch)
    }

    /// The last frame of an `imu`.
    pub fn imu(&mut self, id: &str) -> Result<ImuSample, Error> {
        let (node, frame) = match self.sensors.frame(&self.tree(), id)? {
            (_, _, Some(Measured::ImuSample(sample))) => return Ok(sample),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let Kind::Imu(imu) = here.kind() else {
            return Err(Error::other_kind(id, here.kind(), "imu"));
        };
        let sample = imu::sample(here, imu, &frame, self.random(id, frame.number));
        self.sensors.keep(node, Measured::ImuSample(sample));
        Ok(sample)
    }

    /// The last frame of a `camera` or an `rgbd`.
    pub fn picture(&mut self, id: &str) -> Result<Arc<Picture>, Error> {
        let (node, frame) = match self.sensors.frame(&self.tree(), id)? {
            (_, _, Some(Measured::Picture(picture))) => return Ok(picture),
            (node, frame, _) => (node, frame),
        };
        let here = frame.tree.node(node)?;
        let drawn = self
            .pictures
            .by_camera((&frame.tree, here), &mut self.problems);
        let (view, mut image) = drawn?;
        let random = self.random(id, frame.number);
        pictures::add_errors(&mut image, here.kind(), random, frame.bias[0]);
        let picture = Arc::new(Picture {
            number: frame.number,
            time: frame.time,
            camera: view.camera,
            image,
            tree: Arc::clone(&frame.tree),
        });
        let measured = Measured::Picture(Arc::clone(&picture));
        self.sensors.keep(node, measured);
        Ok(picture)
    }

    /// The world as it is, from anywhere, without the errors of its cameras.
    pub fn draw(&mut self, view: &View) -> Result<Image, Error> {
        let tree = self.tree();
        self.pictures.by_view(&tree, view, &mut self.problems)
    }

    /// The boxes around the bodies of the world as it is.
    pub fn extents(&mut self) -> Vec<Extent> {
        let tree = self.tree();
        self.pictures.extents(&tree)
    }

    /// The numbers by chance of a frame.
    fn random(&self, id: &str, frame: u64) -> Random {
        Random::new(self.seed, id, frame)
    }
}
