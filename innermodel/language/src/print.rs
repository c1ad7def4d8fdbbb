//! Writes a document that loads as an equal one.

use crate::model::{
    Battery, Document, Encoder, Engine, Form, Human, Kind, Lidar, Node, Plane, Render, Robot,
    Shape, Signal, Transform,
};
use rc_diagnostics::xml::unchecked;

/// The text of a document: in millimetres, with all that was included. Attributes that have their
/// default are left out.
pub fn print(document: &Document) -> String {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); document.nodes.len() + 1];
    let top = document.nodes.len();
    for (at, node) in document.nodes.iter().enumerate() {
        children[node.parent.unwrap_or(top)].push(at);
    }
    let mut out = String::from("<innerModel>\n");
    // The next item to print: a node, or the end of one.
    let mut rest: Vec<(usize, usize, bool)> = Vec::new();
    let add = |rest: &mut Vec<_>, of: usize, depth: usize| {
        rest.extend(
            children[of]
                .iter()
                .rev()
                .map(|child| (*child, depth, false)),
        );
    };
    add(&mut rest, top, 1);
    while let Some((at, depth, end)) = rest.pop() {
        let node = &document.nodes[at];
        for _ in 0..depth {
            out.push_str("    ");
        }
        if end {
            out.push_str(&format!("</{}>\n", tag(node)));
            continue;
        }
        open(node, &mut out);
        if children[at].is_empty() {
            out.push_str("/>\n");
        } else {
            out.push_str(">\n");
            rest.push((at, depth, true));
            add(&mut rest, at, depth + 1);
        }
    }
    out.push_str("</innerModel>\n");
    out
}

/// The element of a node without its children, such as `<translation id="hand" tx="500"/>`.
pub fn element(node: &Node) -> String {
    let mut out = String::new();
    open(node, &mut out);
    out.push_str("/>");
    out
}

/// The begin of an element, without its end.
fn open(node: &Node, out: &mut String) {
    out.push('<');
    out.push_str(tag(node));
    attributes(node, out);
}

/// A `translation` that was turned since, or a `rotation` that was moved, is a `transform`.
fn tag(node: &Node) -> &'static str {
    let moved = node.pose.translation != [0.0; 3];
    let turned = node.pose.rotation != [0.0; 3];
    match &node.kind {
        Kind::Transform(t) if t.form == Form::Translation && turned => "transform",
        Kind::Transform(t) if t.form == Form::Rotation && moved => "transform",
        kind => kind.tag(),
    }
}

struct Writer<'o>(&'o mut String);

impl Writer<'_> {
    fn text(&mut self, name: &str, value: &str) {
        self.0
            .push_str(&format!(" {name}=\"{}\"", unchecked(value)));
    }

    fn text_or(&mut self, name: &str, value: &str, default: &str) {
        if value != default {
            self.text(name, value);
        }
    }

    fn number(&mut self, name: &str, value: f64, default: f64) {
        if value != default {
            self.text(name, &value.to_string());
        }
    }

    fn numbers(&mut self, names: [&str; 3], values: [f64; 3]) {
        for (name, value) in names.into_iter().zip(values) {
            self.number(name, value, 0.0);
        }
    }

    fn list(&mut self, name: &str, values: [f64; 3]) {
        self.text(name, &values.map(|v| v.to_string()).join(","));
    }

    fn count(&mut self, name: &str, value: u32) {
        self.number(name, f64::from(value), 0.0);
    }

    fn flag(&mut self, name: &str, value: bool) {
        if value {
            self.text(name, "1");
        }
    }

    fn limits(&mut self, min: f64, max: f64) {
        self.number("min", min, f64::NEG_INFINITY);
        self.number("max", max, f64::INFINITY);
    }

    fn signal(&mut self, signal: &Signal) {
        self.number("rate", signal.rate, 0.0);
        self.number("noise", signal.noise, 0.0);
        self.number("quantum", signal.quantum, 0.0);
        self.number("dropout", signal.dropout, 0.0);
        self.number("drift", signal.drift, 0.0);
        self.number("latency", signal.latency, 0.0);
    }

    fn lidar(&mut self, lidar: &Lidar) {
        self.number("min", lidar.min, 0.0);
        self.number("max", lidar.max, 0.0);
        self.number("angle", lidar.angle, std::f64::consts::TAU);
        self.count("measures", lidar.measures);
        self.number("rings", f64::from(lidar.rings), 1.0);
        self.number("low", lidar.low, 0.0);
        self.number("high", lidar.high, 0.0);
        self.signal(&lidar.signal);
    }

    fn robot(&mut self, robot: &Robot) {
        self.count("port", robot.port);
        self.number("noise", robot.noise, 0.0);
        self.flag("collide", robot.collide);
        self.number("maxspeed", robot.max_speed, Robot::MAX_SPEED);
        self.number("maxturn", robot.max_turn, Robot::MAX_TURN);
        self.number("slip", robot.slip, 0.0);
    }

    fn encoder(&mut self, encoder: Encoder) {
        self.number("noise", encoder.noise, 0.0);
        self.number("quantum", encoder.quantum, 0.0);
    }

    fn human(&mut self, human: &Human) {
        let points = human.path.iter().map(|[x, z]| format!("{x},{z}"));
        self.text_or("path", &points.collect::<Vec<_>>().join(" "), "");
        self.number("speed", human.speed, Human::SPEED);
        self.number("height", human.height, Human::HEIGHT);
    }

    fn plane(&mut self, plane: &Plane) {
        self.list("size", plane.size);
        self.text_or("texture", &plane.texture, "");
        if plane.repeat != 1000 {
            self.text("repeat", &plane.repeat.to_string());
        }
        self.numbers(["nx", "ny", "nz"], plane.normal);
        self.numbers(["px", "py", "pz"], plane.point);
        self.flag("collide", plane.collide);
    }
}

fn attributes(node: &Node, out: &mut String) {
    let mut to = Writer(out);
    to.text("id", &node.id);
    to.numbers(["tx", "ty", "tz"], node.pose.translation);
    to.numbers(["rx", "ry", "rz"], node.pose.rotation);
    match &node.kind {
        Kind::Transform(Transform { engine, mass, .. }) => {
            to.text_or("engine", engine.name(), Engine::Static.name());
            to.number("mass", *mass, 0.0);
        }
        Kind::Joint(joint) => {
            to.text_or("axis", joint.axis.name(), "z");
            to.limits(joint.min, joint.max);
            to.number("home", joint.home, 0.0);
            to.number("maxspeed", joint.max_speed, 0.0);
            to.encoder(joint.encoder);
            to.count("port", joint.port);
            to.numbers(["lx", "ly", "lz"], joint.low);
            to.numbers(["hx", "hy", "hz"], joint.high);
        }
        Kind::Prismatic(joint) => {
            to.text_or("axis", joint.axis.name(), "z");
            to.limits(joint.min, joint.max);
            to.number("home", joint.home, 0.0);
            to.number("position", joint.position, 0.0);
            to.number("offset", joint.offset, 0.0);
            to.number("maxspeed", joint.max_speed, 0.0);
            to.encoder(joint.encoder);
            to.count("port", joint.port);
        }
        Kind::TouchSensor(sensor) => {
            to.text_or("type", &sensor.form, "");
            to.numbers(["nx", "ny", "nz"], sensor.normal);
            to.limits(sensor.min, sensor.max);
            to.count("port", sensor.port);
            to.signal(&sensor.signal);
        }
        Kind::Robot(robot) => to.robot(robot),
        Kind::Camera(camera) => {
            to.number("width", camera.camera.width, 0.0);
            to.number("height", camera.camera.height, 0.0);
            to.number("focal", camera.camera.focal, 0.0);
            to.signal(&camera.signal);
        }
        Kind::Rgbd(rgbd) => {
            to.number("width", rgbd.camera.width, 0.0);
            to.number("height", rgbd.camera.height, 0.0);
            to.number("focal", rgbd.camera.focal, 0.0);
            to.signal(&rgbd.signal);
            to.count("port", rgbd.port);
            to.text_or("ifconfig", &rgbd.ifconfig, "");
        }
        Kind::Laser(laser) => {
            to.count("port", laser.port);
            to.number("min", laser.min, 0.0);
            to.number("max", laser.max, 0.0);
            to.number("angle", laser.angle, 0.0);
            to.count("measures", laser.measures);
            to.text_or("ifconfig", &laser.ifconfig, "");
            to.signal(&laser.signal);
        }
        Kind::Lidar(lidar) => to.lidar(lidar),
        Kind::Ultrasound(ultrasound) => {
            to.number("min", ultrasound.min, 0.0);
            to.number("max", ultrasound.max, 0.0);
            to.number("angle", ultrasound.angle, 0.0);
            to.signal(&ultrasound.signal);
        }
        Kind::Imu(imu) => {
            to.count("port", imu.port);
            to.number("gyronoise", imu.gyro_noise, 0.0);
            to.signal(&imu.signal);
        }
        Kind::Battery(battery) => {
            to.number("endurance", battery.endurance, Battery::ENDURANCE);
            to.number("charging", battery.charging, Battery::CHARGING);
            to.number("level", battery.level, 1.0);
        }
        Kind::Human(human) => to.human(human),
        Kind::Plane(plane) => to.plane(plane),
        Kind::Display(display) => {
            to.plane(&display.plane);
            to.count("port", display.port);
        }
        Kind::Mesh(mesh) => {
            to.text("file", &mesh.file);
            to.list("scale", mesh.scale);
            if mesh.render == Render::Wireframe {
                to.text("render", "wireframe");
            }
            to.flag("collide", mesh.collide);
        }
        Kind::PointCloud => {}
        Kind::Axes(axes) => {
            for (name, value) in ["lengthx", "lengthy", "lengthz"]
                .into_iter()
                .zip(axes.lengths)
            {
                to.number(name, value, 200.0);
            }
            for (name, value) in ["widthx", "widthy", "widthz"].into_iter().zip(axes.widths) {
                to.number(name, value, 15.0);
            }
        }
        Kind::Solid(solid) => {
            let (radius, length) = match solid.shape {
                Shape::Sphere { radius } => (radius, None),
                Shape::Cylinder { radius, length } | Shape::Cone { radius, length } => {
                    (radius, Some(length))
                }
            };
            to.text("radius", &radius.to_string());
            if let Some(length) = length {
                to.text("length", &length.to_string());
            }
            to.text_or("texture", &solid.texture, "");
            to.flag("collide", solid.collide);
        }
    }
    if !node.allowed.is_empty() {
        to.text("allowed", &node.allowed.join(" "));
    }
}
