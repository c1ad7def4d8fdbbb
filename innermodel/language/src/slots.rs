//! The slot arrays in which a simulator serves the devices of a scene, and the names of their
//! members.

use crate::model::{Document, Kind};
use std::iter::successors;

/// A slot array with the members that a scene gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Members {
    /// The array: `lasers`.
    pub array: &'static str,
    /// Interface of the members: `Laser`.
    pub interface: &'static str,
    /// Members in the order of the tree: ids of nodes.
    pub members: Vec<String>,
}

/// An array, its interface, the tags of the nodes that it serves, and whether one member serves all
/// nodes with the same owner: sensors and motors that a bus joins.
type Array = (&'static str, &'static str, &'static [&'static str], bool);

const BASES: &[&str] = &["differentialrobot", "omnirobot"];
const CAMERAS: &[&str] = &["camera", "rgbd"];

const ARRAYS: [Array; 17] = [
    ("lasers", "Laser", &["laser"], false),
    ("lidars", "Lidar3D", &["lidar"], false),
    ("ultrasounds", "Ultrasound", &["ultrasound"], true),
    ("touch_sensors", "TouchSensor", &["touchsensor"], true),
    ("bumpers", "Bumper", &["touchsensor"], true),
    ("cameras", "Camera", CAMERAS, false),
    ("simple_cameras", "CameraSimple", CAMERAS, false),
    ("rgbd_cameras", "CameraRGBDSimple", &["rgbd"], false),
    ("rgbds", "RGBD", &["rgbd"], false),
    ("imus", "IMU", &["imu"], false),
    ("poses", "FullPoseEstimation", BASES, false),
    ("batteries", "BatteryStatus", &["battery"], false),
    ("bases", "DifferentialRobot", &["differentialrobot"], false),
    ("omni_bases", "OmniRobot", &["omnirobot"], false),
    ("generic_bases", "GenericBase", BASES, false),
    ("motors", "JointMotor", &["joint", "prismaticJoint"], true),
    ("pose_topics", "FullPoseEstimationPub", BASES, false),
];

/// The arrays of a scene that have members.
pub fn of(scene: &Document) -> Vec<Members> {
    let arrays = ARRAYS.iter().map(|(array, interface, tags, is_shared)| {
        let mut members: Vec<String> = Vec::new();
        for (at, node) in scene.nodes.iter().enumerate() {
            if !tags.contains(&node.kind.tag()) {
                continue;
            }
            let name = if *is_shared {
                owner(scene, at)
            } else {
                &node.id
            };
            if members.last().is_none_or(|last| last != name) && !members.iter().any(|m| m == name)
            {
                members.push(name.to_owned());
            }
        }
        Members {
            array,
            interface,
            members,
        }
    });
    arrays.filter(|array| !array.members.is_empty()).collect()
}

/// The owner of a node: the robot above it, else the outermost node above it.
fn owner(scene: &Document, at: usize) -> &str {
    // Parents come before their children.
    let above = || successors(Some(at), |at| scene.nodes[*at].parent);
    let robot = above().find(|at| matches!(scene.nodes[*at].kind, Kind::Robot(_)));
    let outermost = above().last();
    &scene.nodes[robot.or(outermost).unwrap_or(at)].id
}
