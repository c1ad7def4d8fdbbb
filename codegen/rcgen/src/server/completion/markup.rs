//! Suggestions in state charts (SCXML), trees of `InnerModel` and robots (URDF).

use super::keywords::{ATTRIBUTES, ELEMENTS, Keyword, URDF};
use super::{Completion, Item, KEYWORD, PROPERTY, STRUCT, Target, VALUE, words};
use crate::server::markup::{Markup, Part, tags};

/// The formats of meshes and pictures that are read.
const MESHES: [&str; 4] = ["obj", "stl", "gltf", "glb"];
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// An element: its tag and its attributes.
type Element = (&'static str, Vec<&'static str>);

impl Completion<'_> {
    /// The start of the word at the cursor, and what is allowed there. `language` is the ending of the file.
    pub(super) fn in_markup(
        &self,
        target: &Target<'_>,
        cursor: usize,
        language: &str,
    ) -> Option<(usize, Vec<Item>)> {
        if language == "xml" && !innermodel_language::is_innermodel(target.text) {
            return None;
        }
        let at = Markup::at(target.text, cursor)?;
        let inner = at.around.last().copied();
        let items = match at.part {
            Part::Closing => inner
                .into_iter()
                .map(|name| Item::new(KEYWORD, name, "Closes the element."))
                .collect(),
            Part::Name => {
                let meanings = of_language(&ELEMENTS, language);
                let all = inside(language, inner);
                all.into_iter()
                    .map(|(tag, _)| Item::new(STRUCT, tag, meaning(meanings, tag)))
                    .collect()
            }
            Part::Attribute => {
                let meanings = of_language(&ATTRIBUTES, language);
                let all = inside(language, inner).into_iter();
                let own = all.filter(|(tag, _)| is_same(language, tag, at.tag.name));
                let has = |name: &str| at.tag.attributes.iter().any(|one| one.name == name);
                let free = own.flat_map(|(_, names)| names);
                // The word at the cursor is an attribute of the tag, too.
                free.filter(|name| !has(name) || target.text[at.start..cursor].len() == name.len())
                    .map(|name| Item::new(PROPERTY, name, meaning(meanings, name)))
                    .collect()
            }
            Part::Value(attribute) => {
                let written = &target.text[at.start..cursor];
                self.values_in(target, language, (at.tag.name, attribute), written)
            }
        };
        let start = match at.part {
            // A list of names: the last one.
            Part::Value("initial" | "target" | "event" | "allowed") => {
                let written = &target.text[at.start..cursor];
                let word = written.rfind([' ', '\t', '\n', ',']);
                at.start + word.map_or(0, |space| space + 1)
            }
            _ => at.start,
        };
        Some((start, items))
    }

    /// The values of an attribute of an element.
    fn values_in(
        &self,
        target: &Target<'_>,
        language: &str,
        (element, attribute): (&str, &str),
        written: &str,
    ) -> Vec<Item> {
        let named = |elements: &[&str], attribute: &str, doc: &str| {
            let all = tags(target.text).filter(|tag| elements.contains(&tag.name));
            let values: Vec<&str> = all.filter_map(|tag| tag.value(attribute)).collect();
            let words = values.iter().flat_map(|value| value.split_whitespace());
            words.map(|word| Item::new(VALUE, word, doc)).collect()
        };
        let element = element.to_ascii_lowercase();
        match (language, element.as_str(), attribute) {
            ("scxml", "scxml" | "state", "initial") | ("scxml", "transition", "target") => {
                named(&["state", "parallel", "final", "history"], "id", "A state.")
            }
            ("scxml", "send", "target") => words(["#_internal"], "The event is raised."),
            ("scxml", "transition" | "raise" | "send", "event") => {
                named(&["transition", "raise", "send"], "event", "An event.")
            }
            ("scxml", "cancel", "sendid") => named(&["send"], "id", "A delayed event."),
            ("scxml", "history", "type") => words(
                ["shallow", "deep"],
                "Which states are entered: the inner ones, or all below.",
            ),
            ("scxml", "transition", "type") => words(
                ["external", "internal"],
                "Whether the state is left before its own transition.",
            ),
            ("xml", "innermodel", "units") => {
                words(["millimetres", "metres"], "The unit of lengths.")
            }
            ("xml", "include", "path") => self.paths(target, written, &["xml"]),
            ("xml", "mesh", "file") | ("urdf", "mesh", "filename") => {
                self.paths(target, written, &MESHES)
            }
            ("xml", _, "texture") => self.paths(target, written, &PICTURES),
            ("xml", _, "axis") => words(["x", "y", "z"], "An axis."),
            ("xml", _, "render") => words(["normal", "wireframe"], "How it is drawn."),
            ("xml", _, "engine") => words(["static", "bullet"], "How it moves in a simulation."),
            ("xml", _, "collide") => words(["0", "1"], "Whether it takes part in collisions."),
            ("xml", _, "allowed") => {
                let all = tags(target.text);
                let ids = all.filter_map(|tag| tag.value("id").map(str::to_owned));
                ids.map(|id| Item::new(VALUE, id, "A node.")).collect()
            }
            ("urdf", "joint", "type") => words(
                rc_urdf::JointType::ALL.map(rc_urdf::JointType::word),
                "How the joint moves.",
            ),
            ("urdf", "parent" | "child", "link") => named(&["link"], "name", "A link."),
            ("urdf", "mimic", "joint") => named(&["joint"], "name", "A joint."),
            ("urdf", "material", "name") => named(&["material"], "name", "A material."),
            _ => Vec::new(),
        }
    }
}

/// The elements that may stand in an element, or outermost, with their attributes.
fn inside(language: &str, around: Option<&str>) -> Vec<Element> {
    match language {
        "scxml" => rc_smdsl::scxml::ELEMENTS
            .iter()
            .filter(|(_, parents, _)| {
                around.map_or(parents.is_empty(), |around| parents.contains(&around))
            })
            .map(|(tag, _, attributes)| (*tag, attributes.to_vec()))
            .collect(),
        "urdf" => URDF
            .iter()
            .filter(|(_, parents, _)| {
                around.map_or(parents.is_empty(), |around| parents.contains(&around))
            })
            .map(|(tag, _, attributes)| (*tag, attributes.to_vec()))
            .collect(),
        _ => {
            let Some(around) = around else {
                return vec![(innermodel_language::ROOT, vec!["units"])];
            };
            let all = innermodel_language::elements();
            let is_closed = all
                .clone()
                .any(|(tag, _, children)| tag.eq_ignore_ascii_case(around) && !children);
            let all = all.filter(|_| !is_closed);
            all.map(|(tag, attributes, _)| (tag, attributes)).collect()
        }
    }
}

/// Whether a tag is the one that a text has. Those of `InnerModel` are not case-sensitive.
fn is_same(language: &str, tag: &str, written: &str) -> bool {
    tag == written || language == "xml" && tag.eq_ignore_ascii_case(written)
}

fn of_language(table: &[(&str, &'static [Keyword])], language: &str) -> &'static [Keyword] {
    let row = table.iter().find(|(known, _)| *known == language);
    row.map_or(&[], |(_, words)| words)
}

fn meaning(table: &[Keyword], word: &str) -> &'static str {
    let row = table.iter().find(|(known, _)| *known == word);
    row.map_or("", |(_, meaning)| meaning)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The elements of a language with their attributes, from the outermost one down.
    fn all(language: &str) -> BTreeSet<Element> {
        let mut known: BTreeSet<Element> = inside(language, None).into_iter().collect();
        loop {
            let inner: Vec<Element> = known
                .iter()
                .flat_map(|(tag, _)| inside(language, Some(tag)))
                .collect();
            let before = known.len();
            known.extend(inner);
            if known.len() == before {
                return known;
            }
        }
    }

    #[test]
    fn each_element_and_each_attribute_has_a_meaning_and_nothing_else() {
        for language in ["scxml", "xml", "urdf"] {
            let known = all(language);
            let tags: BTreeSet<&str> = known.iter().map(|(tag, _)| *tag).collect();
            let attributes = known.iter().flat_map(|(_, all)| all.iter().copied());
            let attributes: BTreeSet<&str> = attributes.collect();
            let described = |table: &[(&str, &'static [Keyword])]| -> BTreeSet<&str> {
                let words = of_language(table, language).iter();
                words.map(|(word, _)| *word).collect()
            };
            assert_eq!(tags, described(&ELEMENTS), "{language}");
            assert_eq!(attributes, described(&ATTRIBUTES), "{language}");
        }
    }
}
