//! Reads a robot from a URDF.

use crate::mount::Held;
use crate::robot::{Body, Inertia, Joint, Limits, Motion, Robot};
use crate::transmission;
use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, SourceMap};
use rc_quantity::Transform;
use rc_quantity::rotation::{EulerOrder, Matrix, determinant, product, transposed};
use rc_urdf::{Edge, JointType, Reader, Structure, child};
use roxmltree::Node as Xml;
use std::collections::{BTreeMap, BTreeSet};

/// The most links of a robot.
const MOST_LINKS: usize = 10_000;

/// The longest chain of joints that follow each other.
const LONGEST_FOLLOWING: usize = 100;

/// How far the tensor of a body may break the triangle inequality: files round their numbers.
const ROUNDED: f64 = 1e-3;

/// Reads a robot with all that moves it. Use it only if no diagnostic is an error.
///
/// Shapes, colours and what simulators add are no matter here. The frames of bodies are those of
/// links. Coordinates are in the order of the file.
pub fn read(sources: &SourceMap, source: SourceId) -> (Robot, Diagnostics) {
    let mut urdf = Reader::new(sources, source);
    let mut robot = Robot::default();
    if let Some(text) = urdf.parse()
        && let Some(top) = urdf.robot(&text)
    {
        robot.name = top.attribute("name").unwrap_or_default().to_owned();
        let structure = urdf.structure(top);
        if !urdf.found.has_errors() {
            bodies(&mut urdf, top, &structure, &mut robot);
        }
    }
    (robot, urdf.found)
}

/// A joint that moves on its own or follows another one, as it is read.
struct Read {
    form: JointType,
    place: Transform,
    axis: [f64; 3],
    limits: Option<Limits>,
    /// The leader, the ratio and the offset.
    follows: Option<(Name, f64, f64)>,
}

fn bodies(urdf: &mut Reader<'_>, top: Xml<'_, '_>, structure: &Structure<'_>, robot: &mut Robot) {
    let tag = urdf.text.tag(top);
    if structure.links.len() > MOST_LINKS {
        let message = format!("a robot has at most {MOST_LINKS} links");
        urdf.error("too-many-links", tag, message);
        return;
    }
    let mut above: BTreeSet<&str> = BTreeSet::new();
    let mut below: BTreeMap<&str, Vec<&Edge<'_>>> = BTreeMap::new();
    for edge in &structure.joints {
        above.insert(&edge.child.text);
        below.entry(&edge.parent.text).or_default().push(edge);
    }
    let links = structure.links.iter();
    let mut roots = links.filter(|(name, _)| !above.contains(name.as_str()));
    // Without a cycle, there is one.
    let Some((root, _)) = roots.next() else {
        return;
    };
    if let Some((other, xml)) = roots.next() {
        let message = format!("no joint connects the links `{root}` and `{other}`");
        let at = urdf.text.tag(*xml);
        let error = Diagnostic::error("unconnected-link", at, message);
        urdf.found.push(error.help(
            "a robot is one tree: connect them by a joint of type `fixed`, or write two files",
        ));
        return;
    }
    let joints: BTreeMap<&str, Read> = structure
        .joints
        .iter()
        .filter_map(|edge| Some((edge.name.text.as_str(), joint(urdf, edge)?)))
        .collect();
    let mut coordinates: BTreeMap<String, usize> = BTreeMap::new();
    for edge in &structure.joints {
        let Some(joint) = joints.get(edge.name.text.as_str()) else {
            continue;
        };
        for name in own_coordinates(&edge.name.text, joint) {
            if coordinates
                .insert(name.clone(), robot.coordinates.len())
                .is_some()
            {
                let message = format!("a joint of several coordinates has `{name}`, too");
                urdf.error("duplicate-id", edge.name.span, message);
            }
            robot.coordinates.push(name);
        }
    }
    robot.transmissions = transmission::read(urdf, &structure.others, &coordinates);
    let mut rest: Vec<(&str, Option<(usize, &Edge<'_>)>)> = vec![(root, None)];
    while let Some((name, edge)) = rest.pop() {
        let Some(xml) = structure.links.get(name) else {
            continue;
        };
        let mut body = Body {
            name: name.to_owned(),
            inertia: inertia(urdf, *xml),
            joint: None,
        };
        let read = edge
            .and_then(|(parent, edge)| Some((parent, edge, joints.get(edge.name.text.as_str())?)));
        if let Some((parent, edge, read)) = read {
            let joint = &edge.name.text;
            body.joint = Some(match several(read.form) {
                Some(held) => {
                    let names = held.coordinates(joint);
                    let first = names
                        .first()
                        .and_then(|name| coordinates.get(name))
                        .copied();
                    robot.hold(
                        held,
                        joint,
                        parent,
                        (read.place, read.axis),
                        first.unwrap_or(0),
                    )
                }
                None => Joint {
                    name: joint.clone(),
                    parent,
                    place: read.place,
                    motion: motion(urdf, edge, &joints, &coordinates),
                    axis: read.axis,
                    limits: read.limits,
                },
            });
        }
        let at = robot.bodies.len();
        robot.bodies.push(body);
        for edge in below.get(name).into_iter().flatten().rev() {
            rest.push((&edge.child.text, Some((at, edge))));
        }
    }
}

/// The motion of a joint of several coordinates.
fn several(form: JointType) -> Option<Held> {
    match form {
        JointType::Planar => Some(Held::Planar),
        JointType::Floating => Some(Held::Floating),
        JointType::Spherical => Some(Held::Spherical),
        _ => None,
    }
}

/// The coordinates of a joint that moves on its own.
fn own_coordinates(name: &str, joint: &Read) -> Vec<String> {
    match several(joint.form) {
        Some(held) => held.coordinates(name),
        None if joint.form == JointType::Fixed || joint.follows.is_some() => Vec::new(),
        None => vec![name.to_owned()],
    }
}

/// How a joint moves, through all leaders that it follows.
fn motion(
    urdf: &mut Reader<'_>,
    edge: &Edge<'_>,
    joints: &BTreeMap<&str, Read>,
    coordinates: &BTreeMap<String, usize>,
) -> Motion {
    let Some(own) = joints.get(edge.name.text.as_str()) else {
        return Motion::Fixed;
    };
    let (mut ratio, mut offset) = (1.0, 0.0);
    let (mut name, mut joint) = (edge.name.text.as_str(), own);
    // The leaders form no cycle.
    let mut followed = 0;
    while let Some((leader, by, plus)) = &joint.follows {
        followed += 1;
        if followed > LONGEST_FOLLOWING {
            let message = format!("more than {LONGEST_FOLLOWING} joints follow each other");
            urdf.error("bad-value", leader.span, message);
            return Motion::Fixed;
        }
        (ratio, offset) = (ratio * by, offset + ratio * plus);
        let Some((next, read)) = joints.get_key_value(leader.text.as_str()) else {
            let message = format!("there is no joint `{}`", leader.text);
            let error = Diagnostic::error("unknown-joint", leader.span, message);
            let known = joints.keys().copied();
            urdf.found.push(error.suggest(&leader.text, known));
            return Motion::Fixed;
        };
        (name, joint) = (next, read);
    }
    let coordinate = coordinates.get(name).copied();
    match (own.form, coordinate) {
        (JointType::Revolute | JointType::Continuous, Some(coordinate)) => Motion::Turns {
            coordinate,
            ratio,
            offset,
        },
        (JointType::Prismatic, Some(coordinate)) => Motion::Slides {
            coordinate,
            ratio,
            offset,
        },
        (JointType::Fixed | JointType::Floating | JointType::Planar | JointType::Spherical, _) => {
            Motion::Fixed
        }
        (_, None) => {
            let message = format!("the joint `{name}`, which leads, does not move");
            urdf.error("bad-value", edge.name.span, message);
            Motion::Fixed
        }
    }
}

fn origin(urdf: &mut Reader<'_>, xml: Xml<'_, '_>) -> Transform {
    let Some(origin) = child(xml, "origin") else {
        return Transform::IDENTITY;
    };
    Transform {
        translation: urdf.numbers(origin, "xyz", [0.0; 3]),
        rotation: EulerOrder::RPY.matrix(urdf.numbers(origin, "rpy", [0.0; 3])),
    }
}

fn joint(urdf: &mut Reader<'_>, edge: &Edge<'_>) -> Option<Read> {
    let xml = edge.xml;
    let form = urdf.joint_type(xml)?;
    let mut read = Read {
        form,
        place: origin(urdf, xml),
        axis: [1.0, 0.0, 0.0],
        limits: None,
        follows: None,
    };
    if matches!(
        form,
        JointType::Fixed | JointType::Floating | JointType::Spherical
    ) {
        return Some(read);
    }
    if let Some(axis) = child(xml, "axis") {
        let given = urdf.numbers(axis, "xyz", read.axis);
        // By the greatest part first, so that no square is too great or too small.
        let greatest = given
            .iter()
            .fold(0.0, |most: f64, part| most.max(part.abs()));
        let near = given.map(|part| part / greatest);
        let length = near.iter().map(|part| part * part).sum::<f64>().sqrt();
        if greatest > 0.0 {
            read.axis = near.map(|part| part / length);
        } else {
            let message = "the axis of the joint is 0".to_owned();
            urdf.error("bad-value", urdf.text.tag(axis), message);
        }
    }
    if form == JointType::Planar {
        return Some(read);
    }
    if let Some(limit) = child(xml, "limit") {
        read.limits = limits(urdf, limit, form);
    }
    if let Some(mimic) = child(xml, "mimic") {
        let leader = urdf.attribute(mimic, "joint")?;
        let ratio = urdf.number(mimic, "multiplier", 1.0);
        read.follows = Some((leader, ratio, urdf.number(mimic, "offset", 0.0)));
    }
    Some(read)
}

fn limits(urdf: &mut Reader<'_>, limit: Xml<'_, '_>, form: JointType) -> Option<Limits> {
    let mut limits = Limits {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        velocity: urdf.number(limit, "velocity", 0.0),
        effort: urdf.number(limit, "effort", 0.0),
    };
    if form != JointType::Continuous {
        limits.lower = urdf.number(limit, "lower", 0.0);
        limits.upper = urdf.number(limit, "upper", 0.0);
    }
    let tag = urdf.text.tag(limit);
    for (word, value) in [("velocity", limits.velocity), ("effort", limits.effort)] {
        if value < 0.0 {
            urdf.error(
                "bad-value",
                tag,
                format!("`{word}` cannot be negative, found `{value}`"),
            );
        }
    }
    if limits.lower > limits.upper {
        let message = "`lower` is greater than `upper`".to_owned();
        urdf.error("bad-value", tag, message);
        return None;
    }
    Some(limits)
}

/// The mass of a link. A physically impossible one is an error.
fn inertia(urdf: &mut Reader<'_>, link: Xml<'_, '_>) -> Option<Inertia> {
    let xml = child(link, "inertial")?;
    let place = origin(urdf, xml);
    let mass = match child(xml, "mass") {
        Some(mass) => urdf.number(mass, "value", 0.0),
        None => 0.0,
    };
    let mut tensor = [[0.0; 3]; 3];
    if let Some(given) = child(xml, "inertia") {
        let words = [
            ("ixx", 0, 0),
            ("ixy", 0, 1),
            ("ixz", 0, 2),
            ("iyy", 1, 1),
            ("iyz", 1, 2),
            ("izz", 2, 2),
        ];
        for (word, row, column) in words {
            let value = urdf.number(given, word, 0.0);
            tensor[row][column] = value;
            tensor[column][row] = value;
        }
    }
    let tag = urdf.text.tag(xml);
    if mass < 0.0 {
        urdf.error("bad-value", tag, format!("the mass is negative: {mass} kg"));
        return None;
    }
    if let Some(why) = impossible(&tensor) {
        let warning = Diagnostic::warning("impossible-inertia", tag, why);
        urdf.found
            .push(warning.help("efforts computed from it are wrong: no body has it"));
    }
    let turn = place.rotation;
    let tensor = product(&product(&turn, &tensor), &transposed(&turn));
    let numbers = tensor.iter().flatten().chain(&place.translation);
    if !numbers.chain([&mass]).all(|number| number.abs() < 1e150) {
        urdf.error("bad-value", tag, "the inertia is too great".to_owned());
        return None;
    }
    Some(Inertia {
        mass,
        centre: place.translation,
        tensor,
    })
}

/// Why no body has this tensor about its centre of mass.
///
/// With `p = tr(I) / 2`, the matrix `p 1 - I` is the second moment of the mass: it has no negative
/// eigenvalue, which is the triangle inequality of the main moments.
fn impossible(tensor: &Matrix) -> Option<String> {
    let trace = tensor[0][0] + tensor[1][1] + tensor[2][2];
    let mut moment = tensor.map(|row| row.map(|part| -part));
    for (at, row) in moment.iter_mut().enumerate() {
        row[at] += trace / 2.0 + ROUNDED * trace;
    }
    // Sylvester's criterion, over all main minors, since the determinants may be 0.
    let minor = |a: usize, b: usize| moment[a][a] * moment[b][b] - moment[a][b] * moment[b][a];
    let is_possible = (0..3).all(|at| moment[at][at] >= 0.0)
        && [(0, 1), (0, 2), (1, 2)]
            .into_iter()
            .all(|(a, b)| minor(a, b) >= 0.0)
        && determinant(&moment) >= 0.0;
    if is_possible {
        return None;
    }
    let diagonal = [tensor[0][0], tensor[1][1], tensor[2][2]];
    Some(format!(
        "the moments of inertia {diagonal:?} kg m² with their products break the triangle inequality: \
        each main moment is at most the sum of the two others"
    ))
}
