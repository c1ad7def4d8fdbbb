//! Where frames are in those of links.

use super::Set;
use super::connectivity::Joint;
use super::yaml::{Kind, Value};
use rc_diagnostics::{Diagnostic, Span};
use rc_quantity::Transform;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Where frames are in links, by the names of both.
pub(super) type Poses = BTreeMap<(String, String), Transform>;

impl Set {
    /// Where the frames of joints, and others, are in the frames of links.
    pub(super) fn poses(
        &mut self,
        geometry: &Value,
        joints: &[Joint],
        links: &[(String, Span)],
    ) -> Option<Poses> {
        let (mode, span) = self.named(geometry, "mode")?;
        let is_current = match mode.as_str() {
            "currentFrame" => true,
            "fixedFrame" => false,
            _ => {
                let message = format!("expected `currentFrame` or `fixedFrame`, found `{mode}`");
                return self.error(span, message);
            }
        };
        let known: HashSet<&str> = links.iter().map(|(name, _)| name.as_str()).collect();
        let of_joints: HashMap<&str, &Joint> = joints
            .iter()
            .map(|joint| (joint.name.text.as_str(), joint))
            .collect();
        let (mut poses, mut frames) = (Poses::new(), HashSet::new());
        let all = self.get(geometry, "poses")?;
        for pose in self.list(all)? {
            let (target, span) = self.named(pose, "target")?;
            let (reference, at) = self.named(pose, "reference")?;
            let connects = |joint: &&Joint| joint.links.iter().any(|(link, _)| *link == reference);
            let joint = of_joints.get(target.as_str()).copied();
            if joint.is_some_and(|joint| !connects(&joint)) || !known.contains(reference.as_str()) {
                let message = format!("`{target}` is no frame of a link `{reference}`");
                let error = Diagnostic::error("unknown-link", at, message);
                self.found
                    .push(error.suggest(&reference, known.iter().copied()));
                return None;
            }
            // A joint may have a frame in each of its links.
            let has_place = match joint {
                Some(_) => poses.contains_key(&(target.clone(), reference.clone())),
                None => frames.contains(&target),
            };
            if known.contains(target.as_str()) || has_place {
                let message = format!("the frame `{target}` has a place already");
                return self.error(span, message);
            }
            let mut place = Transform::IDENTITY;
            let steps = self.get(pose, "steps")?;
            let steps = match steps.kind {
                Kind::Nothing => &[][..],
                _ => self.list(steps)?,
            };
            for step in steps {
                let step = self.step(step)?;
                place = if is_current {
                    place.then(&step)
                } else {
                    step.then(&place)
                };
            }
            frames.insert(target.clone());
            poses.insert((target, reference), place);
        }
        Some(poses)
    }

    fn step(&mut self, step: &Value) -> Option<Transform> {
        let (kind, span) = self.named(step, "kind")?;
        let amount = self.get(step, "amount")?;
        let amount = self.number(amount)?;
        let mut place = Transform::IDENTITY;
        let axis = match kind.as_bytes().last() {
            Some(b'x') => 0,
            Some(b'y') => 1,
            _ => 2,
        };
        match kind.as_str() {
            "trx" | "try" | "trz" => place.translation[axis] = amount,
            "rotx" | "roty" | "rotz" => {
                let (one, two) = ((axis + 1) % 3, (axis + 2) % 3);
                let (sine, cosine) = amount.sin_cos();
                place.rotation[one][one] = cosine;
                place.rotation[two][two] = cosine;
                place.rotation[one][two] = -sine;
                place.rotation[two][one] = sine;
            }
            _ => {
                let message = format!(
                    "expected `trx`, `try`, `trz`, `rotx`, `roty` or `rotz`, found `{kind}`"
                );
                return self.error(span, message);
            }
        }
        Some(place)
    }
}
