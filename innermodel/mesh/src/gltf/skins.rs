//! Skins of glTF: vertices that follow the joints of a skeleton, in the pose of the file.

use super::{MAX_DEPTH, Matrix, Primitive, Reader, applied, local, product, wrong};
use crate::MeshError;
use serde::Deserialize;
use std::rc::Rc;

/// How many joints a vertex may follow: sets of four.
const MOST_SETS: usize = 8;
/// How many joints all skins may have.
const MOST_JOINTS: usize = 100_000;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    joints: Vec<usize>,
    inverse_bind_matrices: Option<usize>,
}

impl Reader<'_> {
    /// The matrices that take vertices to the scene, one for each joint of a skin.
    pub(super) fn skin(&mut self, at: usize) -> Result<Rc<[Matrix]>, MeshError> {
        if let Some(known) = self.skins.get(&at) {
            return Ok(known.clone());
        }
        let skin = self.root.skins.get(at);
        let skin = skin.ok_or_else(|| wrong("a skin is missing"))?;
        let known: usize = self.skins.values().map(|joints| joints.len()).sum();
        if known + skin.joints.len() > MOST_JOINTS {
            return Err(wrong("the skins have more than 100,000 joints"));
        }
        if self.parents.is_empty() {
            self.parents = vec![None; self.root.nodes.len()];
            for (parent, node) in self.root.nodes.iter().enumerate() {
                for child in &node.children {
                    if let Some(of) = self.parents.get_mut(*child) {
                        *of = Some(parent);
                    }
                }
            }
        }
        let bound = skin.inverse_bind_matrices;
        let bound = bound.map(|at| self.numbers(at, 16)).transpose()?;
        let mut joints = Vec::new();
        for (number, joint) in skin.joints.iter().enumerate() {
            let here = self.whole_transform(*joint)?;
            joints.push(match &bound {
                None => here,
                Some(numbers) => {
                    let inverse = numbers.get(number * 16..number * 16 + 16);
                    let inverse =
                        inverse.ok_or_else(|| wrong("a joint of a skin has no matrix"))?;
                    let rows = [0, 1, 2]
                        .map(|row| [0, 1, 2, 3].map(|column: usize| inverse[column * 4 + row]));
                    product(&here, &rows)
                }
            });
        }
        let joints: Rc<[Matrix]> = joints.into();
        self.skins.insert(at, joints.clone());
        Ok(joints)
    }

    /// The transform of a node in the scene.
    fn whole_transform(&self, node: usize) -> Result<Matrix, MeshError> {
        let missing = || wrong("a joint of a skin is missing");
        let mut whole = local(self.root.nodes.get(node).ok_or_else(missing)?);
        let mut above = self.parents.get(node).copied().flatten();
        for _ in 0..MAX_DEPTH {
            let Some(parent) = above else {
                return Ok(whole);
            };
            whole = product(&local(&self.root.nodes[parent]), &whole);
            above = self.parents[parent];
        }
        Err(wrong("nodes are nested more than 64 deep"))
    }

    /// The places of vertices where their joints take them, each with its weight.
    pub(super) fn placed(
        &self,
        primitive: &Primitive,
        places: &[[f64; 3]],
        bones: &[Matrix],
    ) -> Result<Vec<[f64; 3]>, MeshError> {
        let mut placed = vec![[0.0; 3]; places.len()];
        let mut sums = vec![0.0; places.len()];
        for set in 0..MOST_SETS {
            let named = |name: &str| primitive.attributes.get(&format!("{name}_{set}"));
            let (Some(joints), Some(weights)) = (named("JOINTS"), named("WEIGHTS")) else {
                break;
            };
            let (joints, weights) = (self.numbers(*joints, 4)?, self.numbers(*weights, 4)?);
            if joints.len() != 4 * places.len() || weights.len() != joints.len() {
                return Err(wrong("a skin has not one weight for each vertex"));
            }
            for (at, (joint, weight)) in joints.into_iter().zip(weights).enumerate() {
                if weight == 0.0 {
                    continue;
                }
                let bone = bones.get(joint as usize);
                let bone = bone.ok_or_else(|| wrong("a vertex follows a joint that is missing"))?;
                let there = applied(bone, &places[at / 4]);
                sums[at / 4] += weight;
                for (sum, part) in placed[at / 4].iter_mut().zip(there) {
                    *sum += weight * part;
                }
            }
        }
        for (place, sum) in placed.iter_mut().zip(sums) {
            if sum == 0.0 {
                return Err(wrong("a vertex of a skin follows no joint"));
            }
            *place = place.map(|part| part / sum);
        }
        Ok(placed)
    }
}
