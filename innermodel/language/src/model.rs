//! Contents of a file: a tree of nodes. Lengths are millimetres, angles radians.

mod devices;

pub use devices::{
    Battery, Camera, ColourCamera, Drive, Human, Imu, Laser, Lidar, Rgbd, Robot, Signal,
    TouchSensor, Ultrasound,
};
use rc_diagnostics::{SourceMap, Span};
use std::path::PathBuf;

/// The id of the node above all others. Each document has it.
pub const ROOT: &str = "root";

/// A file with all that it includes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The nodes; a parent comes before its children, and siblings in the order of the file.
    pub nodes: Vec<Node>,
}

impl Document {
    /// The place of a node in `nodes`.
    pub fn find(&self, id: &str) -> Option<usize> {
        self.nodes.iter().position(|node| node.id == id)
    }
}

/// A node of the tree.
#[derive(Clone, Debug)]
pub struct Node {
    /// The name, unique in the document.
    pub id: String,
    /// The place of the parent in [`Document::nodes`]; `None` is the root.
    pub parent: Option<usize>,
    /// Kind of the node.
    pub kind: Kind,
    /// Where the node is in its parent. Kinds without a pose of their own have that of the parent.
    pub pose: Pose,
    /// Ids of nodes that this one, with all below it, may touch.
    pub allowed: Vec<String>,
    /// The tag in the source.
    pub span: Span,
}

impl Node {
    /// A node at the origin of the root, without a place in a source.
    pub fn new(id: &str, kind: Kind) -> Self {
        Self {
            id: id.to_owned(),
            parent: None,
            kind,
            pose: Pose::default(),
            allowed: Vec::new(),
            span: Span::new(SourceMap::new().add("", ""), 0, 0),
        }
    }
}

/// Locations do not count.
impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
            && self.parent == other.parent
            && self.kind == other.kind
            && self.pose == other.pose
            && self.allowed == other.allowed
    }
}

/// A translation in millimetres, and angles about x, y and z in radians: R = Rx·Ry·Rz.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// x, y, z.
    pub translation: [f64; 3],
    /// Angles about x, y, z.
    pub rotation: [f64; 3],
}

impl Pose {
    /// A pose of six numbers: x, y, z in millimetres and the angles in radians.
    pub fn new(x: f64, y: f64, z: f64, rx: f64, ry: f64, rz: f64) -> Self {
        Self {
            translation: [x, y, z],
            rotation: [rx, ry, rz],
        }
    }
}

/// Kind of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// `transform`, `translation` or `rotation`.
    Transform(Transform),
    /// `joint`.
    Joint(Joint),
    /// `prismaticJoint`.
    Prismatic(Prismatic),
    /// `touchsensor`.
    TouchSensor(TouchSensor),
    /// `differentialrobot` or `omnirobot`.
    Robot(Robot),
    /// `camera`.
    Camera(ColourCamera),
    /// `rgbd`.
    Rgbd(Rgbd),
    /// `laser`.
    Laser(Laser),
    /// `lidar`.
    Lidar(Lidar),
    /// `ultrasound`.
    Ultrasound(Ultrasound),
    /// `imu`.
    Imu(Imu),
    /// `battery`.
    Battery(Battery),
    /// `human`.
    Human(Human),
    /// `plane`: a box.
    Plane(Plane),
    /// `display`: a box that shows pictures.
    Display(Display),
    /// `mesh`.
    Mesh(Mesh),
    /// `pointcloud`.
    PointCloud,
    /// `axes`: three bars along x, y and z.
    Axes(Axes),
    /// `sphere`, `cylinder` or `cone`.
    Solid(Solid),
}

impl Kind {
    /// The name of the tag.
    pub fn tag(&self) -> &'static str {
        match self {
            Self::Transform(transform) => match transform.form {
                Form::Transform => "transform",
                Form::Translation => "translation",
                Form::Rotation => "rotation",
            },
            Self::Joint(_) => "joint",
            Self::Prismatic(_) => "prismaticJoint",
            Self::TouchSensor(_) => "touchsensor",
            Self::Robot(robot) => match robot.drive {
                Drive::Differential => "differentialrobot",
                Drive::Omni => "omnirobot",
            },
            Self::Camera(_) => "camera",
            Self::Rgbd(_) => "rgbd",
            Self::Laser(_) => "laser",
            Self::Lidar(_) => "lidar",
            Self::Ultrasound(_) => "ultrasound",
            Self::Imu(_) => "imu",
            Self::Battery(_) => "battery",
            Self::Human(_) => "human",
            Self::Plane(_) => "plane",
            Self::Display(_) => "display",
            Self::Mesh(_) => "mesh",
            Self::PointCloud => "pointcloud",
            Self::Axes(_) => "axes",
            Self::Solid(solid) => match solid.shape {
                Shape::Sphere { .. } => "sphere",
                Shape::Cylinder { .. } => "cylinder",
                Shape::Cone { .. } => "cone",
            },
        }
    }

    /// Whether the node may have children.
    pub fn may_have_children(&self) -> bool {
        matches!(
            self,
            Self::Transform(_)
                | Self::Joint(_)
                | Self::Prismatic(_)
                | Self::TouchSensor(_)
                | Self::Robot(_)
                | Self::Human(_)
        )
    }

    /// Whether the pose of the node can be set.
    pub fn has_pose(&self) -> bool {
        matches!(
            self,
            Self::Transform(_)
                | Self::Joint(_)
                | Self::Robot(_)
                | Self::Human(_)
                | Self::Mesh(_)
                | Self::Solid(_)
        )
    }

    /// The errors of a simulated sensor. `None` for other nodes.
    pub fn signal(&self) -> Option<&Signal> {
        match self {
            Self::TouchSensor(touch) => Some(&touch.signal),
            Self::Camera(camera) => Some(&camera.signal),
            Self::Rgbd(rgbd) => Some(&rgbd.signal),
            Self::Laser(laser) => Some(&laser.signal),
            Self::Lidar(lidar) => Some(&lidar.signal),
            Self::Ultrasound(ultrasound) => Some(&ultrasound.signal),
            Self::Imu(imu) => Some(&imu.signal),
            _ => None,
        }
    }

    /// The signal of the node, to change it.
    pub fn signal_mut(&mut self) -> Option<&mut Signal> {
        match self {
            Self::TouchSensor(touch) => Some(&mut touch.signal),
            Self::Camera(camera) => Some(&mut camera.signal),
            Self::Rgbd(rgbd) => Some(&mut rgbd.signal),
            Self::Laser(laser) => Some(&mut laser.signal),
            Self::Lidar(lidar) => Some(&mut lidar.signal),
            Self::Ultrasound(ultrasound) => Some(&mut ultrasound.signal),
            Self::Imu(imu) => Some(&mut imu.signal),
            _ => None,
        }
    }

    /// Whether the node takes part in collisions: the attribute `collide`.
    pub fn collides(&self) -> bool {
        match self {
            Self::Plane(plane) => plane.collide,
            Self::Display(display) => display.plane.collide,
            Self::Mesh(mesh) => mesh.collide,
            Self::Solid(solid) => solid.collide,
            _ => false,
        }
    }
}

/// How a transform was written, which decides how it is printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// `transform`.
    #[default]
    Transform,
    /// `translation`: angles are 0.
    Translation,
    /// `rotation`: the translation is 0.
    Rotation,
}

/// The physics of a transform.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engine {
    /// It moves only when it is set.
    #[default]
    Static,
    /// A simulator of physics moves it.
    Bullet,
}

impl Engine {
    /// The word in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Bullet => "bullet",
        }
    }
}

/// A fixed or movable frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transform {
    /// How it was written.
    pub form: Form,
    /// Physics of the body.
    pub engine: Engine,
    /// In kilograms.
    pub mass: f64,
}

/// An axis of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    #[default]
    Z,
}

impl Axis {
    /// The word in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// The number of the axis: 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// The errors of the encoder at the motor of a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoder {
    /// The standard deviation of a position that is read, in radians or millimetres.
    pub noise: f64,
    /// A position that is read is a multiple of it, in radians or millimetres; 0: it is not
    /// rounded.
    pub quantum: f64,
}

/// A joint that turns about an axis: M = [Rx·Ry·Rz | t]·Rot(axis, q). q starts at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// The axis.
    pub axis: Axis,
    /// The least angle; −∞ is not a limit.
    pub min: f64,
    /// The greatest angle; ∞ is not a limit.
    pub max: f64,
    /// The angle of rest.
    pub home: f64,
    /// The greatest speed of its motor, in rad/s; 0 is not a limit.
    pub max_speed: f64,
    /// How its position is read.
    pub encoder: Encoder,
    /// The port of its server in RoboComp.
    pub port: u32,
    /// `lx`, `ly`, `lz`: RoboComp reads them and uses them for nothing.
    pub low: [f64; 3],
    /// `hx`, `hy`, `hz` in the same way.
    pub high: [f64; 3],
}

/// A joint that slides along an axis by position + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Prismatic {
    /// The axis.
    pub axis: Axis,
    /// The least position in millimetres; −∞ is not a limit.
    pub min: f64,
    /// The greatest position in millimetres; ∞ is not a limit.
    pub max: f64,
    /// The position of rest in millimetres.
    pub home: f64,
    /// The position at the start, in millimetres.
    pub position: f64,
    /// A length that is added to the position, in millimetres.
    pub offset: f64,
    /// The greatest speed of its motor, in mm/s; 0 is not a limit.
    pub max_speed: f64,
    /// How its position is read.
    pub encoder: Encoder,
    /// The port of its server in RoboComp.
    pub port: u32,
}

/// A box. It is `size` large along x, y and z, then turned by the shortest way from −z to `normal`,
/// then moved to `point`.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// A file, or a colour as `#rrggbb`.
    pub texture: String,
    /// Where the file of the texture was found.
    pub picture: Option<PathBuf>,
    /// Width, height and depth in millimetres, as written: RoboComp mirrors a negative one.
    pub size: [f64; 3],
    /// Read and not used, as in RoboComp: each side shows the whole texture once.
    pub repeat: i64,
    /// Where −z of the box points. (0, 0, −1) if a file gives none.
    pub normal: [f64; 3],
    /// The centre in the parent, in millimetres.
    pub point: [f64; 3],
    /// Whether it takes part in collisions.
    pub collide: bool,
}

/// A box that shows pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    /// The box.
    pub plane: Plane,
    /// The port of its server in RoboComp.
    pub port: u32,
}

/// How a mesh is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Render {
    /// Filled.
    #[default]
    Normal,
    /// Edges only.
    Wireframe,
}

/// A mesh of a file. A vertex (x, y, z) of the file is (x, y, −z) here, times the scale.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The file as written, relative to the loaded file.
    pub file: String,
    /// Where the file is, if it was found.
    pub path: Option<PathBuf>,
    /// Along x, y and z.
    pub scale: [f64; 3],
    /// How it is drawn.
    pub render: Render,
    /// Whether it takes part in collisions.
    pub collide: bool,
}

/// Three bars along x, y and z.
#[derive(Clone, Debug, PartialEq)]
pub struct Axes {
    /// The lengths in millimetres.
    pub lengths: [f64; 3],
    /// The widths in millimetres.
    pub widths: [f64; 3],
}

/// A body of the tags `sphere`, `cylinder` and `cone`.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Shape of the body.
    pub shape: Shape,
    /// A colour as `#rrggbb`.
    pub texture: String,
    /// Whether it takes part in collisions.
    pub collide: bool,
}

/// The shape of a solid. Its centre is its origin, its axis is y; the tip of a cone is at +y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// In millimetres.
        radius: f64,
    },
    /// A cylinder.
    Cylinder {
        /// In millimetres.
        radius: f64,
        /// In millimetres, along y.
        length: f64,
    },
    /// A cone.
    Cone {
        /// Of its base, in millimetres.
        radius: f64,
        /// In millimetres, along y.
        length: f64,
    },
}
