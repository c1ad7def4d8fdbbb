//! The slot arrays in which a simulator serves the devices of a scene, and the names of their
//! members.

use crate::{Kind, NodeRef, Snapshot};

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
///
/// ```
/// use innermodel::{Folders, InnerModel, slots};
/// use std::path::Path;
///
/// let text = r#"<innerModel><laser id="front" min="100" max="9000" angle="3" measures="90"/></innerModel>"#;
/// let (scene, _) = innermodel::read_text(text, Path::new("scene.xml"), &Folders::default()).expect("a scene");
/// let scene = InnerModel::from_document(&scene).expect("a tree");
/// let lasers = &slots::of(&scene.snapshot())[0];
/// assert_eq!((lasers.array, lasers.interface), ("lasers", "Laser"));
/// assert_eq!(lasers.members, ["front"]);
/// ```
pub fn of(tree: &Snapshot) -> Vec<Members> {
    let arrays = ARRAYS.iter().map(|(array, interface, tags, is_shared)| {
        let nodes = tree
            .nodes()
            .filter(|node| tags.contains(&node.kind().tag()));
        let mut members: Vec<String> = Vec::new();
        for node in nodes {
            let name = if *is_shared {
                owner(tree, node)
            } else {
                node.id()
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
pub fn owner<'s>(tree: &'s Snapshot, node: NodeRef<'s>) -> &'s str {
    let above = || std::iter::successors(Some(node), NodeRef::parent);
    let robot = above().find(|node| matches!(node.kind(), Kind::Robot(_)));
    let outermost = above().filter(|node| node.parent().is_some()).last();
    robot.or(outermost).unwrap_or_else(|| tree.root()).id()
}
