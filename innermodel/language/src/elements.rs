//! The elements and their attributes.

/// An element: its tag, its attributes, and whether it may have children.
pub(crate) struct Element {
    pub(crate) tag: &'static str,
    /// Attributes that come first, each with its spellings; the first spelling is that of the model.
    groups: &'static [&'static [&'static [&'static str]]],
    /// Attributes with one spelling.
    words: &'static [&'static str],
    pub(crate) children: bool,
}

impl Element {
    /// The attributes, each with its spellings.
    pub(crate) fn attributes(&self) -> impl Iterator<Item = &'static [&'static str]> {
        let groups = self.groups.iter().copied().flatten().copied();
        groups.chain(self.words.iter().map(std::slice::from_ref))
    }
}

const ID: &[&[&str]] = &[&["id"]];
/// The spellings of a translation and of a rotation.
pub(crate) const TRANSLATION: [&[&str]; 3] = [
    &["tx", "x", "t_x"],
    &["ty", "y", "t_y"],
    &["tz", "z", "t_z"],
];
pub(crate) const ROTATION: [&[&str]; 3] = [&["rx", "r_x"], &["ry", "r_y"], &["rz", "r_z"]];
/// In a `rotation`, `x` is an angle.
pub(crate) const ANGLES: [&[&str]; 3] = [
    &["rx", "x", "r_x"],
    &["ry", "y", "r_y"],
    &["rz", "z", "r_z"],
];
/// RoboComp allows `lengthx` and reads `xlength`.
pub(crate) const LENGTHS: [&[&str]; 3] = [
    &["lengthx", "xlength"],
    &["lengthy", "ylength"],
    &["lengthz", "zlength"],
];
pub(crate) const WIDTHS: [&[&str]; 3] = [
    &["widthx", "xwidth"],
    &["widthy", "ywidth"],
    &["widthz", "zwidth"],
];

/// The tag of the outermost element of each file.
pub const ROOT: &str = "innerModel";

pub(crate) const ELEMENTS: [Element; 25] = [
    Element {
        tag: "transform",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["engine", "mass", "allowed"],
        children: true,
    },
    Element {
        tag: "translation",
        groups: &[ID, &TRANSLATION],
        words: &["engine", "mass", "allowed"],
        children: true,
    },
    Element {
        tag: "rotation",
        groups: &[ID, &ANGLES],
        words: &["engine", "mass", "allowed"],
        children: true,
    },
    Element {
        tag: "joint",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &[
            "lx", "ly", "lz", "hx", "hy", "hz", "min", "max", "port", "axis", "home", "maxspeed",
            "noise", "quantum", "allowed",
        ],
        children: true,
    },
    Element {
        tag: "prismaticJoint",
        groups: &[ID],
        words: &[
            "min", "max", "position", "offset", "port", "axis", "home", "maxspeed", "noise",
            "quantum", "allowed",
        ],
        children: true,
    },
    Element {
        tag: "touchsensor",
        groups: &[ID],
        words: &[
            "type", "nx", "ny", "nz", "min", "max", "port", "rate", "noise", "quantum", "dropout",
            "drift", "latency", "allowed",
        ],
        children: true,
    },
    Element {
        tag: "differentialrobot",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &[
            "port", "noise", "collide", "maxspeed", "maxturn", "slip", "allowed",
        ],
        children: true,
    },
    Element {
        tag: "omnirobot",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &[
            "port", "noise", "collide", "maxspeed", "maxturn", "slip", "allowed",
        ],
        children: true,
    },
    Element {
        tag: "camera",
        groups: &[ID],
        words: &[
            "width", "height", "focal", "rate", "noise", "quantum", "dropout", "drift", "latency",
            "allowed",
        ],
        children: false,
    },
    Element {
        tag: "rgbd",
        groups: &[ID],
        words: &[
            "width", "height", "focal", "noise", "port", "ifconfig", "rate", "quantum", "dropout",
            "drift", "latency", "allowed",
        ],
        children: false,
    },
    Element {
        tag: "laser",
        groups: &[ID],
        words: &[
            "port", "min", "max", "angle", "measures", "ifconfig", "rate", "noise", "quantum",
            "dropout", "drift", "latency", "allowed",
        ],
        children: false,
    },
    Element {
        tag: "lidar",
        groups: &[ID],
        words: &[
            "min", "max", "angle", "measures", "rings", "low", "high", "rate", "noise", "quantum",
            "dropout", "drift", "latency", "allowed",
        ],
        children: false,
    },
    Element {
        tag: "ultrasound",
        groups: &[ID],
        words: &[
            "min", "max", "angle", "rate", "noise", "quantum", "dropout", "drift", "latency",
            "allowed",
        ],
        children: false,
    },
    Element {
        tag: "battery",
        groups: &[ID],
        words: &["endurance", "charging", "level", "allowed"],
        children: false,
    },
    Element {
        tag: "human",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["path", "speed", "height", "allowed"],
        children: true,
    },
    Element {
        tag: "imu",
        groups: &[ID],
        words: &[
            "port",
            "gyronoise",
            "rate",
            "noise",
            "quantum",
            "dropout",
            "drift",
            "latency",
            "allowed",
        ],
        children: false,
    },
    Element {
        tag: "plane",
        groups: &[ID],
        words: &[
            "texture", "size", "repeat", "nx", "ny", "nz", "px", "py", "pz", "collide", "allowed",
        ],
        children: false,
    },
    Element {
        tag: "display",
        groups: &[ID],
        words: &[
            "texture", "size", "repeat", "nx", "ny", "nz", "px", "py", "pz", "port", "collide",
            "allowed",
        ],
        children: false,
    },
    Element {
        tag: "mesh",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["file", "scale", "render", "collide", "allowed"],
        children: false,
    },
    Element {
        tag: "pointcloud",
        groups: &[ID],
        words: &["allowed"],
        children: false,
    },
    Element {
        tag: "axes",
        groups: &[ID, &[&["length"], &["width"]], &LENGTHS, &WIDTHS],
        words: &["allowed"],
        children: false,
    },
    Element {
        tag: "include",
        groups: &[],
        words: &["path"],
        children: false,
    },
    Element {
        tag: "sphere",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["radius", "texture", "collide", "allowed"],
        children: false,
    },
    Element {
        tag: "cylinder",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["radius", "length", "texture", "collide", "allowed"],
        children: false,
    },
    Element {
        tag: "cone",
        groups: &[ID, &TRANSLATION, &ROTATION],
        words: &["radius", "length", "texture", "collide", "allowed"],
        children: false,
    },
];

/// The element of a tag, in any case.
pub(crate) fn element(tag: &str) -> Option<&'static Element> {
    ELEMENTS.iter().find(|e| e.tag.eq_ignore_ascii_case(tag))
}

/// All elements below the outermost one: the tag, the attributes, each by the first of its spellings, and
/// whether it may have children.
pub fn elements() -> impl Iterator<Item = (&'static str, Vec<&'static str>, bool)> + Clone {
    ELEMENTS.iter().map(|element| {
        let attributes = element.attributes().filter_map(|names| names.first());
        (element.tag, attributes.copied().collect(), element.children)
    })
}
