//! The elements and their attributes.

/// An element: its tag, its attributes, and whether it may have children.
pub(crate) struct Element {
    pub(crate) tag: &'static str,
    pub(crate) attributes: &'static [&'static [&'static str]],
    pub(crate) children: bool,
}

const ID: &[&str] = &["id"];
const ALLOWED: &[&str] = &["allowed"];
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

const TX: &[&str] = TRANSLATION[0];
const TY: &[&str] = TRANSLATION[1];
const TZ: &[&str] = TRANSLATION[2];
const RX: &[&str] = ROTATION[0];
const RY: &[&str] = ROTATION[1];
const RZ: &[&str] = ROTATION[2];

macro_rules! attributes {
    ($($name:expr),* $(,)?) => { &[ID, $($name,)* ALLOWED] };
}

/// Outermost in each file.
pub(crate) const ROOT: &str = "innerModel";

pub(crate) const ELEMENTS: [Element; 25] = [
    Element {
        tag: "transform",
        attributes: attributes![TX, TY, TZ, RX, RY, RZ, &["engine"], &["mass"]],
        children: true,
    },
    Element {
        tag: "translation",
        attributes: attributes![TX, TY, TZ, &["engine"], &["mass"]],
        children: true,
    },
    Element {
        tag: "rotation",
        attributes: attributes![ANGLES[0], ANGLES[1], ANGLES[2], &["engine"], &["mass"]],
        children: true,
    },
    Element {
        tag: "joint",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["lx"],
            &["ly"],
            &["lz"],
            &["hx"],
            &["hy"],
            &["hz"],
            &["min"],
            &["max"],
            &["port"],
            &["axis"],
            &["home"],
            &["maxspeed"],
            &["noise"],
            &["quantum"],
        ],
        children: true,
    },
    Element {
        tag: "prismaticJoint",
        attributes: attributes![
            &["min"],
            &["max"],
            &["position"],
            &["offset"],
            &["port"],
            &["axis"],
            &["home"],
            &["maxspeed"],
            &["noise"],
            &["quantum"],
        ],
        children: true,
    },
    Element {
        tag: "touchsensor",
        attributes: attributes![
            &["type"],
            &["nx"],
            &["ny"],
            &["nz"],
            &["min"],
            &["max"],
            &["port"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"],
        ],
        children: true,
    },
    Element {
        tag: "differentialrobot",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["port"],
            &["noise"],
            &["collide"],
            &["maxspeed"],
            &["maxturn"],
            &["slip"]
        ],
        children: true,
    },
    Element {
        tag: "omnirobot",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["port"],
            &["noise"],
            &["collide"],
            &["maxspeed"],
            &["maxturn"],
            &["slip"]
        ],
        children: true,
    },
    Element {
        tag: "camera",
        attributes: attributes![
            &["width"],
            &["height"],
            &["focal"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"]
        ],
        children: false,
    },
    Element {
        tag: "rgbd",
        attributes: attributes![
            &["width"],
            &["height"],
            &["focal"],
            &["noise"],
            &["port"],
            &["ifconfig"],
            &["rate"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"],
        ],
        children: false,
    },
    Element {
        tag: "laser",
        attributes: attributes![
            &["port"],
            &["min"],
            &["max"],
            &["angle"],
            &["measures"],
            &["ifconfig"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"],
        ],
        children: false,
    },
    Element {
        tag: "lidar",
        attributes: attributes![
            &["min"],
            &["max"],
            &["angle"],
            &["measures"],
            &["rings"],
            &["low"],
            &["high"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"],
        ],
        children: false,
    },
    Element {
        tag: "ultrasound",
        attributes: attributes![
            &["min"],
            &["max"],
            &["angle"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"]
        ],
        children: false,
    },
    Element {
        tag: "battery",
        attributes: attributes![&["endurance"], &["charging"], &["level"]],
        children: false,
    },
    Element {
        tag: "human",
        attributes: attributes![TX, TY, TZ, RX, RY, RZ, &["path"], &["speed"], &["height"]],
        children: true,
    },
    Element {
        tag: "imu",
        attributes: attributes![
            &["port"],
            &["gyronoise"],
            &["rate"],
            &["noise"],
            &["quantum"],
            &["dropout"],
            &["drift"],
            &["latency"]
        ],
        children: false,
    },
    Element {
        tag: "plane",
        attributes: attributes![
            &["texture"],
            &["size"],
            &["repeat"],
            &["nx"],
            &["ny"],
            &["nz"],
            &["px"],
            &["py"],
            &["pz"],
            &["collide"],
        ],
        children: false,
    },
    Element {
        tag: "display",
        attributes: attributes![
            &["texture"],
            &["size"],
            &["repeat"],
            &["nx"],
            &["ny"],
            &["nz"],
            &["px"],
            &["py"],
            &["pz"],
            &["port"],
            &["collide"],
        ],
        children: false,
    },
    Element {
        tag: "mesh",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["file"],
            &["scale"],
            &["render"],
            &["collide"],
        ],
        children: false,
    },
    Element {
        tag: "pointcloud",
        attributes: attributes![],
        children: false,
    },
    Element {
        tag: "axes",
        attributes: attributes![
            &["length"],
            &["width"],
            LENGTHS[0],
            LENGTHS[1],
            LENGTHS[2],
            WIDTHS[0],
            WIDTHS[1],
            WIDTHS[2],
        ],
        children: false,
    },
    Element {
        tag: "include",
        attributes: &[&["path"]],
        children: false,
    },
    Element {
        tag: "sphere",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["radius"],
            &["texture"],
            &["collide"]
        ],
        children: false,
    },
    Element {
        tag: "cylinder",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["radius"],
            &["length"],
            &["texture"],
            &["collide"],
        ],
        children: false,
    },
    Element {
        tag: "cone",
        attributes: attributes![
            TX,
            TY,
            TZ,
            RX,
            RY,
            RZ,
            &["radius"],
            &["length"],
            &["texture"],
            &["collide"],
        ],
        children: false,
    },
];

/// The element of a tag, in any case.
pub(crate) fn element(tag: &str) -> Option<&'static Element> {
    ELEMENTS.iter().find(|e| e.tag.eq_ignore_ascii_case(tag))
}
