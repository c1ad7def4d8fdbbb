//! Reads the motors behind joints: elements `transmission` of a URDF, also inside of `ros2_control`.
//!
//! The source of the format: <https://wiki.ros.org/urdf/XML/Transmission>. Of its types, a simple transmission is a ratio
//! and an offset of one joint. Others, and those that name no joint of their own, are left out with a note: the
//! motion of the robot does not depend on them.

use crate::robot::Transmission;
use rc_diagnostics::{Diagnostic, Span};
use rc_urdf::{Reader, child};
use roxmltree::Node as Xml;
use std::collections::{BTreeMap, HashMap};

/// The transmissions among these elements of a robot with these coordinates.
pub(crate) fn read(
    urdf: &mut Reader<'_>,
    elements: &[Xml<'_, '_>],
    coordinates: &BTreeMap<String, usize>,
) -> Vec<Transmission> {
    let mut read: Vec<Transmission> = Vec::new();
    // The places in it by coordinates.
    let mut known: HashMap<usize, usize> = HashMap::new();
    let mut left: Vec<(Span, String)> = Vec::new();
    for element in elements {
        let inside = element.children();
        let inside = inside.filter(|_| element.has_tag_name("ros2_control"));
        for xml in inside.chain([*element]) {
            if !xml.has_tag_name("transmission") {
                continue;
            }
            let found = one(urdf, xml, coordinates).and_then(|own| {
                let (joint, own) = own;
                match known.get(&own.coordinate) {
                    None => Ok(own),
                    Some(other) => Err(format!(
                        "the joint `{joint}` has the transmission `{}` already",
                        read[*other].name
                    )),
                }
            });
            match found {
                Ok(own) => {
                    known.insert(own.coordinate, read.len());
                    read.push(own);
                }
                Err(why) => left.push((urdf.text.tag(xml), why)),
            }
        }
    }
    // A hand may have dozens.
    if let Some((at, why)) = left.first() {
        let others = match left.len() {
            1 => String::new(),
            2 => "; nor is one other".to_owned(),
            count => format!("; nor are {} others", count - 1),
        };
        let message = format!("this transmission is not read: {why}{others}");
        let note = Diagnostic::note("transmission-not-read", *at, message);
        urdf.found
            .push(note.help("a `SimpleTransmission` has one joint, one actuator and a reduction"));
    }
    read
}

/// A transmission with the name of its joint, or why it is none of one joint.
fn one(
    urdf: &Reader<'_>,
    xml: Xml<'_, '_>,
    coordinates: &BTreeMap<String, usize>,
) -> Result<(String, Transmission), String> {
    let words = |xml: Xml<'_, '_>, tag: &str| {
        let text = child(xml, tag).and_then(|inside| inside.text());
        text.map(|text| text.trim().to_owned())
    };
    let name = |xml: Xml<'_, '_>| urdf.text.attribute(xml, "name").map(|name| name.text);
    let kind = words(xml, "type").or_else(|| words(xml, "plugin"));
    let kind = kind.or_else(|| Some(urdf.text.attribute(xml, "type")?.text));
    let kind = kind.ok_or_else(|| "it has no type".to_owned())?;
    if kind.rsplit('/').next() != Some("SimpleTransmission") {
        return Err(format!("its type is `{kind}`, not `SimpleTransmission`"));
    }
    let part = |tag: &str| {
        let mut all = xml.children().filter(|child| child.has_tag_name(tag));
        match (all.next(), all.next()) {
            (Some(one), None) => Ok(one),
            (None, _) => Err(format!("it has no `<{tag}>`")),
            (Some(_), Some(_)) => Err(format!("it has a second `<{tag}>`")),
        }
    };
    let (joint, actuator) = (part("joint")?, part("actuator")?);
    let joint_name = name(joint).unwrap_or_default();
    let coordinate = coordinates.get(&joint_name).copied();
    let coordinate = coordinate.ok_or_else(|| {
        format!("there is no joint `{joint_name}` of one coordinate that moves on its own")
    })?;
    let number = |places: &[(Xml<'_, '_>, &str)], other: f64| {
        let mut texts = places.iter().filter_map(|(place, tag)| words(*place, tag));
        let Some(text) = texts.next() else {
            return Ok(other);
        };
        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
        value.ok_or_else(|| format!("expected a number, found `{text}`"))
    };
    // ros_control has it in the actuator, the PR2 in the transmission, and ros2_control in the joint, whatever the actuator says.
    let places = [
        (actuator, "mechanicalReduction"),
        (joint, "mechanicalReduction"),
        (xml, "mechanicalReduction"),
        (joint, "mechanical_reduction"),
        (actuator, "mechanical_reduction"),
    ];
    let reduction = number(&places, 1.0)?;
    let offset = number(&[(joint, "offset")], 0.0)?;
    let is_usual = |value: f64| (1e-9..=1e9).contains(&value.abs());
    if !is_usual(reduction) || offset.abs() > 1e9 {
        return Err(format!("its reduction is {reduction}, its offset {offset}"));
    }
    let own = Transmission {
        name: name(xml).unwrap_or_else(|| joint_name.clone()),
        actuator: name(actuator).unwrap_or_else(|| joint_name.clone()),
        coordinate,
        reduction,
        offset,
    };
    Ok((joint_name, own))
}
