//! Reads the robot of a YAML set of `robot-model-tools` (github.com/mfrigerio17/robot-model-tools):
//! one file names those of its connectivity, its geometry, its inertia and its limits.
//!
//! A joint turns or slides along the z axis of its frame, which is the frame of the body that it
//! moves. Products of inertia are moments there: the negative ones of a tensor.

mod connectivity;
mod geometry;
mod yaml;

use connectivity::{Closing, Joint};
use rc_diagnostics::xml::escaped;
use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, SourceMap, Span};
use rc_quantity::Transform;
use rc_quantity::rotation::Matrix;
use rc_robot::{LoopJoint, Robot};
use rc_syntax::Loader;
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;
use std::fmt::Write as _;
use yaml::{Kind, Value};

/// The most links and joints of a set.
const MOST: usize = 10_000;

/// How far a joint without limits slides: a URDF has no such joint.
const FAR: f64 = 10_000.0;

/// Reads the robot of a set. Use it only if no diagnostic is an error.
pub(crate) fn read(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Robot, Diagnostics) {
    let mut set = Set {
        found: Diagnostics::new(),
    };
    let read = set.urdf(sources, loader, source);
    let mut found = set.found;
    let Some((text, closings)) = read.filter(|_| !found.has_errors()) else {
        return (Robot::default(), found);
    };
    // The checks of a URDF hold for it.
    let title = format!("{} as URDF", sources.path(source).display());
    let urdf = sources.add(title, text);
    let (mut robot, more) = rc_robot::read(sources, urdf);
    let is_wrong = more.has_errors();
    found.extend(more);
    if is_wrong {
        return (robot, found);
    }
    for closing in closings {
        let [one, other] = &closing.frames;
        let Some(frames) = robot.body(one).zip(robot.body(other)) else {
            continue;
        };
        let chain = robot.chain(frames.0, frames.1);
        if chain.is_none_or(|chain| chain.coordinates().is_empty()) {
            let message = format!("no other joint moves `{other}` in `{one}`");
            found.push(Diagnostic::error("bad-loop", closing.joint.span, message));
        }
        robot.loops.push(LoopJoint {
            name: closing.joint.text,
            frames: frames.into(),
            kept: closing.kept,
        });
    }
    (robot, found)
}

struct Set {
    found: Diagnostics,
}

impl Set {
    fn error<T>(&mut self, span: Span, message: String) -> Option<T> {
        self.found
            .push(Diagnostic::error("bad-value", span, message));
        None
    }

    fn fields<'v>(&mut self, value: &'v Value) -> Option<&'v [(Name, Value)]> {
        match &value.kind {
            Kind::Fields(fields) => Some(fields),
            Kind::Nothing => Some(&[]),
            _ => self.error(value.span, "expected `NAME: VALUE`".to_owned()),
        }
    }

    fn list<'v>(&mut self, value: &'v Value) -> Option<&'v [Value]> {
        match &value.kind {
            Kind::List(items) if items.len() <= MOST => Some(items),
            Kind::List(_) => self.error(value.span, format!("a list has at most {MOST} items")),
            _ => self.error(value.span, "expected a list".to_owned()),
        }
    }

    fn get<'v>(&mut self, value: &'v Value, name: &str) -> Option<&'v Value> {
        let fields = self.fields(value)?;
        let found = fields.iter().find(|(own, _)| own.text == name);
        match found {
            Some((_, value)) => Some(value),
            None => self.error(value.span, format!("`{name}` is missing")),
        }
    }

    fn optional<'v>(&mut self, value: &'v Value, name: &str) -> Option<&'v Value> {
        let mut fields = self.fields(value)?.iter();
        let found = fields.find(|(own, _)| own.text == name);
        found.map(|(_, value)| value)
    }

    fn word(&mut self, value: &Value) -> Option<(String, Span)> {
        match &value.kind {
            Kind::Word(word) => Some((word.clone(), value.span)),
            _ => self.error(value.span, "expected a word".to_owned()),
        }
    }

    fn named(&mut self, value: &Value, name: &str) -> Option<(String, Span)> {
        let value = self.get(value, name)?;
        self.word(value)
    }

    /// A number, or a part of pi: `-3*pi/4`.
    fn number(&mut self, value: &Value) -> Option<f64> {
        let (word, span) = self.word(value)?;
        let number = parsed(&word).filter(|number| number.is_finite() && number.abs() <= 1e9);
        if number.is_none() {
            let message = format!("expected a number up to 1e9, or a part of pi, found `{word}`");
            return self.error(span, message);
        }
        number
    }

    fn number_or(&mut self, value: &Value, name: &str, other: f64) -> Option<f64> {
        match self.optional(value, name) {
            Some(value) => self.number(value),
            None => Some(other),
        }
    }

    /// The file that a set names.
    fn file(
        &mut self,
        (sources, loader): (&mut SourceMap, &dyn Loader),
        source: SourceId,
        value: &Value,
    ) -> Option<Value> {
        let (name, span) = self.word(value)?;
        let path = sources.path(source).to_path_buf();
        match loader.find(&path, &name, "yaml") {
            Ok(file) => {
                let source = sources.add(file.path, file.text);
                let (read, found) = yaml::read(sources.text(source), source);
                self.found.extend(found);
                read
            }
            Err(missing) => {
                self.found.push(missing.diagnostic(&name, "yaml", span));
                None
            }
        }
    }

    /// The robot as a URDF.
    fn urdf(
        &mut self,
        sources: &mut SourceMap,
        loader: &dyn Loader,
        source: SourceId,
    ) -> Option<(String, Vec<Closing>)> {
        let (set, found) = yaml::read(sources.text(source), source);
        self.found.extend(found);
        let set = set?;
        let (name, _) = self.named(&set, "robot")?;
        let mut part = |own: &mut Self, name: &str, is_needed: bool| {
            let value = if is_needed {
                own.get(&set, name)?
            } else {
                own.optional(&set, name)?
            };
            own.file((&mut *sources, loader), source, value)
        };
        let connectivity = part(self, "connectivity", true)?;
        let geometry = part(self, "geometry", true)?;
        let numbering = part(self, "numbering", false);
        let inertia = part(self, "inertia", false);
        let limits = part(self, "joint_limits", false);

        let mut text = format!("<robot name=\"{}\">\n", escaped(&name));
        let links = self.links(&connectivity)?;
        let joints = self.joints(&connectivity, &links)?;
        let base = self.base(&links, numbering.as_ref())?;
        let mut poses = self.poses(&geometry, &joints, &links)?;
        let bodies = match &inertia {
            Some(inertia) => self.bodies(inertia, &links)?,
            None => HashMap::new(),
        };
        let limits = match &limits {
            Some(limits) => self.limits(limits, &joints)?,
            None => HashMap::new(),
        };
        for (link, _) in &links {
            let body = bodies.get(link).map_or("", String::as_str);
            let _ = writeln!(text, "<link name=\"{}\">{body}</link>", escaped(link));
        }
        let tree = self.tree(&joints, &base, numbering.as_ref())?;
        for (joint, parent, child) in tree.joints {
            let of = |link: &String| (joint.name.text.clone(), link.clone());
            let Some(place) = poses.remove(&of(&parent)) else {
                let message = format!(
                    "the geometry has no pose of the joint `{}` in `{parent}`",
                    joint.name.text
                );
                return self.error(joint.name.span, message);
            };
            if poses.contains_key(&of(&child)) {
                let message = format!(
                    "the frame of the joint `{}` is that of `{child}`, which it moves",
                    joint.name.text
                );
                return self.error(joint.name.span, message);
            }
            let limit = limits.get(&joint.name.text).copied();
            text += &joint_of(joint, [&parent, &child], &place, limit);
        }
        let mut closings = Vec::new();
        for (joint, links) in tree.closing {
            closings.push(self.closing(joint, &links, &mut poses)?);
        }
        // Other frames of links.
        for ((frame, reference), place) in poses {
            let name = escaped(&frame);
            let _ = writeln!(
                text,
                "<link name=\"{name}\"/><joint name=\"{name}\" type=\"fixed\"><parent link=\"{}\"/>\
                <child link=\"{name}\"/>{}</joint>",
                escaped(&reference),
                origin(&place)
            );
        }
        Some((text + "</robot>\n", closings))
    }

    /// The masses of links, as elements of a URDF.
    fn bodies(
        &mut self,
        inertia: &Value,
        links: &[(String, Span)],
    ) -> Option<HashMap<String, String>> {
        let known: HashSet<&str> = links.iter().map(|(name, _)| name.as_str()).collect();
        let mut bodies = HashMap::new();
        let all = self.get(inertia, "inertia")?;
        for (link, body) in self.fields(all)? {
            if !known.contains(link.text.as_str()) {
                let message = format!("`links` has no link `{}`", link.text);
                let error = Diagnostic::error("unknown-link", link.span, message);
                self.found
                    .push(error.suggest(&link.text, known.iter().copied()));
                return None;
            }
            let mass = self.get(body, "mass")?;
            let mass = self.number(mass)?;
            let (com, moments) = (self.get(body, "com")?, self.get(body, "moments")?);
            for part in [com, moments] {
                if let Some(frame) = self.optional(part, "frame") {
                    let (frame, span) = self.word(frame)?;
                    if frame != link.text {
                        let message = format!(
                            "masses are read in the frame `{}` of their link, found `{frame}`",
                            link.text
                        );
                        return self.error(span, message);
                    }
                }
            }
            let mut centre = [0.0; 3];
            for (part, name) in centre.iter_mut().zip(["x", "y", "z"]) {
                *part = self.number_or(com, name, 0.0)?;
            }
            let mut of = |name: &str| self.number_or(moments, name, 0.0);
            let (xx, yy, zz) = (of("ixx")?, of("iyy")?, of("izz")?);
            let (xy, xz, yz) = (of("ixy")?, of("ixz")?, of("iyz")?);
            // About the centre of mass, and a tensor: its products are negative moments.
            let [x, y, z] = centre;
            let numbers = [
                xx - mass * (y * y + z * z),
                yy - mass * (x * x + z * z),
                zz - mass * (x * x + y * y),
                -xy + mass * x * y,
                -xz + mass * x * z,
                -yz + mass * y * z,
            ];
            let [xx, yy, zz, xy, xz, yz] = numbers;
            let text = format!(
                "<inertial><origin xyz=\"{x:?} {y:?} {z:?}\"/><mass value=\"{mass:?}\"/><inertia ixx=\"{xx:?}\" \
                iyy=\"{yy:?}\" izz=\"{zz:?}\" ixy=\"{xy:?}\" ixz=\"{xz:?}\" iyz=\"{yz:?}\"/></inertial>"
            );
            bodies.insert(link.text.clone(), text);
        }
        Some(bodies)
    }

    /// The limits of joints: the least and the greatest position, speed and force.
    fn limits(&mut self, limits: &Value, joints: &[Joint]) -> Option<HashMap<String, [f64; 4]>> {
        let known: HashSet<&str> = joints.iter().map(|own| own.name.text.as_str()).collect();
        let mut read = HashMap::new();
        let all = self.get(limits, "limits")?;
        for (joint, own) in self.fields(all)? {
            if !known.contains(joint.text.as_str()) {
                let message = format!("no pair has the joint `{}`", joint.text);
                let error = Diagnostic::error("unknown-joint", joint.span, message);
                self.found
                    .push(error.suggest(&joint.text, known.iter().copied()));
                return None;
            }
            let (lower, upper) = (self.get(own, "lower_pos")?, self.get(own, "upper_pos")?);
            let numbers = [
                self.number(lower)?,
                self.number(upper)?,
                self.number_or(own, "velocity", 0.0)?,
                self.number_or(own, "force", 0.0)?,
            ];
            read.insert(joint.text.clone(), numbers);
        }
        Some(read)
    }
}

/// A joint as an element of a URDF.
fn joint_of(
    joint: &Joint,
    [parent, child]: [&str; 2],
    place: &Transform,
    limit: Option<[f64; 4]>,
) -> String {
    let (kind, limit) = match (joint.slides, limit) {
        (None, _) => ("fixed", None),
        (Some(true), limit) => ("prismatic", Some(limit.unwrap_or([-FAR, FAR, 0.0, 0.0]))),
        (Some(false), None) => ("continuous", None),
        (Some(false), limit) => ("revolute", limit),
    };
    let limit = limit.map(|[lower, upper, velocity, force]| {
        format!(
            "<limit lower=\"{lower:?}\" upper=\"{upper:?}\" velocity=\"{velocity:?}\" effort=\"{force:?}\"/>"
        )
    });
    format!(
        "<joint name=\"{}\" type=\"{kind}\"><parent link=\"{}\"/><child link=\"{}\"/>{}<axis xyz=\"0 0 1\"/>{}</joint>\n",
        escaped(&joint.name.text),
        escaped(parent),
        escaped(child),
        origin(place),
        limit.unwrap_or_default()
    )
}

/// A place as an element of a URDF.
fn origin(place: &Transform) -> String {
    let [x, y, z] = place.translation;
    let [roll, pitch, yaw] = angles(&place.rotation);
    format!("<origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>")
}

/// Roll, pitch and yaw, to the last digits also near a pitch of a quarter turn.
fn angles(r: &Matrix) -> [f64; 3] {
    let level = r[0][0].hypot(r[1][0]);
    let pitch = (-r[2][0]).atan2(level);
    if level < 1e-12 {
        // Roll and yaw turn about one axis.
        return [(-r[1][2]).atan2(r[1][1]), pitch, 0.0];
    }
    [r[2][1].atan2(r[2][2]), pitch, r[1][0].atan2(r[0][0])]
}

/// `0.5`, `pi/2`, `-3*pi/4`
fn parsed(word: &str) -> Option<f64> {
    if let Ok(number) = word.parse() {
        return Some(number);
    }
    let word = word.to_ascii_lowercase().replace(' ', "");
    let (before, after) = word.split_once("pi")?;
    let factor = match before {
        "" | "+" => 1.0,
        "-" => -1.0,
        other => other.strip_suffix('*')?.parse().ok()?,
    };
    let rest = if after.is_empty() {
        1.0
    } else if let Some(number) = after.strip_prefix('/') {
        1.0 / number.parse::<f64>().ok()?
    } else {
        after.strip_prefix('*')?.parse().ok()?
    };
    Some(factor * PI * rest)
}
