//! The links and joints of a set: a tree from the base on, and joints that close loops.

use super::Set;
use super::geometry::Poses;
use super::yaml::Value;
use rc_diagnostics::{Diagnostic, Name, Span};
use rc_robot::Kept;
use std::collections::{HashMap, HashSet, VecDeque};

/// A joint, with the links that it connects.
pub(super) struct Joint {
    pub(super) name: Name,
    /// A fixed joint does neither.
    pub(super) slides: Option<bool>,
    pub(super) links: [(String, Span); 2],
}

impl Set {
    pub(super) fn links(&mut self, connectivity: &Value) -> Option<Vec<(String, Span)>> {
        let links = self.get(connectivity, "links")?;
        let links = self.list(links)?;
        let mut known = HashSet::new();
        let mut all = Vec::new();
        for link in links {
            let (name, span) = self.word(link)?;
            if !known.insert(name.clone()) {
                return self.error(span, format!("the link `{name}` occurs twice"));
            }
            all.push((name, span));
        }
        Some(all)
    }

    pub(super) fn joints(
        &mut self,
        connectivity: &Value,
        links: &[(String, Span)],
    ) -> Option<Vec<Joint>> {
        let mut kinds: HashMap<String, Option<bool>> = HashMap::new();
        let declared = self.get(connectivity, "joints")?;
        for joint in self.list(declared)? {
            let (name, span) = self.named(joint, "name")?;
            let (kind, at) = self.named(joint, "kind")?;
            let slides = match kind.as_str() {
                "revolute" => Some(false),
                "prismatic" => Some(true),
                "fixed" => None,
                _ => {
                    let message =
                        format!("expected `revolute`, `prismatic` or `fixed`, found `{kind}`");
                    return self.error(at, message);
                }
            };
            if kinds.insert(name.clone(), slides).is_some() {
                return self.error(span, format!("the joint `{name}` occurs twice"));
            }
        }
        let known: HashSet<&str> = links.iter().map(|(name, _)| name.as_str()).collect();
        let (mut all, mut paired) = (Vec::new(), HashSet::new());
        let pairs = self.get(connectivity, "pairs")?;
        for pair in self.list(pairs)? {
            let (name, span) = self.named(pair, "joint")?;
            let Some(slides) = kinds.get(&name).copied() else {
                let error =
                    Diagnostic::error("bad-value", span, format!("`joints` has no joint `{name}`"));
                let names = kinds.keys().map(String::as_str);
                self.found.push(error.suggest(&name, names));
                return None;
            };
            if !paired.insert(name.clone()) {
                return self.error(span, format!("the joint `{name}` connects two pairs"));
            }
            let ends = [self.named(pair, "link1")?, self.named(pair, "link2")?];
            for (link, span) in &ends {
                if !known.contains(link.as_str()) {
                    let message = format!("`links` has no link `{link}`");
                    let error = Diagnostic::error("unknown-link", *span, message);
                    self.found.push(error.suggest(link, known.iter().copied()));
                    return None;
                }
            }
            all.push(Joint {
                name: Name::new(name, span),
                slides,
                links: ends,
            });
        }
        Some(all)
    }

    /// The link with the number 0, or the first one.
    pub(super) fn base(
        &mut self,
        links: &[(String, Span)],
        numbering: Option<&Value>,
    ) -> Option<String> {
        let Some(numbering) = numbering else {
            return links.first().map(|(name, _)| name.clone());
        };
        let numbers = self.get(numbering, "nums")?;
        for (link, number) in self.fields(numbers)? {
            if self.number(number)? == 0.0 {
                return Some(link.text.clone());
            }
        }
        self.error(numbers.span, "no link has the number 0".to_owned())
    }

    /// The joints in order of their distance from the base, in the order of the file at each link: one that ends where another
    /// one has led closes a loop. The numbering may choose these joints: it has numbers of them.
    pub(super) fn tree<'j>(
        &mut self,
        joints: &'j [Joint],
        base: &str,
        numbering: Option<&Value>,
    ) -> Option<Tree<'j>> {
        let mut chosen: HashSet<&str> = HashSet::new();
        if let Some(numbering) = numbering {
            let numbers = self.get(numbering, "nums")?;
            let names = self.fields(numbers)?.iter();
            chosen.extend(names.map(|(name, _)| name.text.as_str()));
        }
        let mut of_links: HashMap<&str, Vec<usize>> = HashMap::new();
        for (at, joint) in joints.iter().enumerate() {
            let [(one, _), (other, span)] = &joint.links;
            if one == other {
                let message = format!(
                    "the joint `{}` connects `{one}` with itself",
                    joint.name.text
                );
                return self.error(*span, message);
            }
            for link in [one, other] {
                of_links.entry(link).or_default().push(at);
            }
        }
        let mut reached: HashSet<&str> = HashSet::from([base]);
        let mut used = vec![false; joints.len()];
        let mut next = VecDeque::from([base.to_owned()]);
        let mut parents: HashMap<usize, [String; 2]> = HashMap::new();
        let mut closing = Vec::new();
        while let Some(link) = next.pop_front() {
            for at in of_links.get(link.as_str()).into_iter().flatten() {
                if std::mem::replace(&mut used[*at], true) {
                    continue;
                }
                let joint = &joints[*at];
                let name = &joint.name;
                let [one, other] = &joint.links;
                let other = if one.0 == link { &other.0 } else { &one.0 };
                let links = [link.clone(), other.clone()];
                if chosen.contains(name.text.as_str()) {
                    closing.push((joint, links));
                } else if reached.insert(other) {
                    parents.insert(*at, links);
                    next.push_back(other.clone());
                } else {
                    let message = format!(
                        "the joint `{}` closes a loop: it has no position of its own",
                        name.text
                    );
                    let note = Diagnostic::note("loop-joint", name.span, message);
                    self.found.push(note.help(
                        "to choose another joint of the loop, give that one a number in the file of the numbering",
                    ));
                    closing.push((joint, links));
                }
            }
        }
        // In the order of the file. Links that nothing connects are told of the URDF.
        let all = joints.iter().enumerate().filter_map(|(at, joint)| {
            let [parent, child] = parents.remove(&at)?;
            Some((joint, parent, child))
        });
        Some(Tree {
            joints: all.collect(),
            closing,
        })
    }

    /// The frames that a joint keeps together. Poses of the joint in its links become frames of these links; in a link
    /// without one, its frame is that of the link.
    pub(super) fn closing(
        &mut self,
        joint: &Joint,
        links: &[String; 2],
        poses: &mut Poses,
    ) -> Option<Closing> {
        let name = &joint.name;
        let own: Vec<&String> = links
            .iter()
            .filter(|link| poses.contains_key(&(name.text.clone(), (*link).clone())))
            .collect();
        if own.is_empty() {
            let [one, other] = links;
            let message = format!(
                "the geometry has no pose of the joint `{}` in `{one}` or `{other}`",
                name.text
            );
            return self.error(name.span, message);
        }
        let mut frames = links.clone();
        for (at, link) in links.iter().enumerate() {
            let key = (name.text.clone(), link.clone());
            let Some(place) = poses.remove(&key) else {
                continue;
            };
            let frame = if own.len() == 2 && at == 1 {
                format!("{}.{link}", name.text)
            } else {
                name.text.clone()
            };
            poses.insert((frame.clone(), link.clone()), place);
            frames[at] = frame;
        }
        let axis = [0.0, 0.0, 1.0];
        Some(Closing {
            joint: name.clone(),
            frames,
            kept: match joint.slides {
                Some(true) => Kept::Sliding(axis),
                Some(false) => Kept::Turning(axis),
                None => Kept::Whole,
            },
        })
    }
}

/// The joints of a set.
pub(super) struct Tree<'j> {
    /// Each with its predecessor and its successor.
    pub(super) joints: Vec<(&'j Joint, String, String)>,
    /// Those that close loops, each with the link that is nearer to the base and the other one.
    pub(super) closing: Vec<(&'j Joint, [String; 2])>,
}

/// A joint that closes a loop, with the names of the frames that it keeps together.
pub(super) struct Closing {
    pub(super) joint: Name,
    pub(super) frames: [String; 2],
    pub(super) kept: Kept,
}
