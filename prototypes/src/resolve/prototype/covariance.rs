//! Covariances of prototypes: their members, their order, and how many numbers they have.

use super::super::Resolver;
use crate::ast::{Map, OperandKind};
use crate::fields::Fields;
use crate::interface::Interface;
use crate::maps::{Side, pairs};
use crate::model::Covariance;
use rc_diagnostics::Diagnostics;

impl<'f> Resolver<'f> {
    /// `{ member covariance, order = xyz_rpy, rotation = fixed }`
    pub(super) fn covariance(
        &mut self,
        fields: &Fields<'f>,
        meaning: Option<&String>,
        interface: Option<&Interface<'f>>,
    ) -> Option<Covariance> {
        let map = fields.map("covariance", &mut self.found)?;
        let member = map.entries.first().filter(|first| first.right.is_none());
        let Some(OperandKind::Member(member)) = member.map(|first| &first.left.kind) else {
            let at = map.entries.first().map_or(map.span, |first| first.span);
            self.error("wrong-entry", at, "expected `member NAME` first");
            return None;
        };
        let rest = Map {
            span: map.span,
            entries: map.entries.iter().skip(1).cloned().collect(),
        };
        let known = ["order", "rotation"].map(str::to_owned);
        let (left, right) = (Side::some("covariance", &known), Side::free("a convention"));
        let mut covariance = Covariance {
            member: member.clone(),
            order: None,
            rotation: None,
            number: interface.and_then(|of| of.element(member, map.span)),
        };
        for (name, value) in pairs(&rest, &left, &right, &mut self.found) {
            let (wanted, meanings, place) = match name.text().as_str() {
                "order" => (["xyz_rpy", "rpy_xyz"], &["Pose"][..], &mut covariance.order),
                _ => (
                    ["fixed", "moving"],
                    &["Pose", "Orientation"][..],
                    &mut covariance.rotation,
                ),
            };
            if let Some(meaning) = meaning.filter(|own| !meanings.contains(&own.as_str())) {
                let message = format!("the covariance of {meaning} has no `{}`", name.text());
                self.error("conflicting-fields", name.span, message);
            } else if wanted.contains(&value.text().as_str()) {
                *place = Some(value.text());
            } else {
                let [one, other] = wanted;
                let message = format!("expected `{one}` or `{other}`");
                self.error("wrong-entry", value.span, message);
            }
        }
        Some(covariance)
    }

    /// Reports a covariance that has not as many numbers as its meaning needs.
    pub(super) fn covariance_length(
        &mut self,
        fields: &Fields<'f>,
        interface: &Interface<'f>,
        meaning: &str,
        numbers: u32,
    ) {
        let map = fields.map("covariance", &mut Diagnostics::new());
        let Some(first) = map.and_then(|map| map.entries.first()) else {
            return;
        };
        let OperandKind::Member(path) = &first.left.kind else {
            return;
        };
        if let Some(length) = interface.length(path, first.left.span)
            && length != numbers
        {
            let message =
                format!("the covariance of {meaning} has {numbers} numbers, `{path}` has {length}");
            self.error("wrong-count", first.left.span, message);
        }
    }
}

/// The numbers of the covariance of a meaning of `geometry`. `None` for one that has none.
pub(super) fn covariances(meaning: &str) -> Option<u32> {
    match meaning {
        "Pose" | "Twist" | "Wrench" => Some(36),
        "PairPose" | "KinematicState" | "JointState" | "TimeStamp" => None,
        "Range" => Some(1),
        _ => Some(9),
    }
}
