//! Suggestions in schemas of graphs, data prototypes, and solvers of robots.

use super::keywords::{DATA, of as keywords};
use super::languages::{imports_in, units};
use super::{Completion, Item, PROPERTY, STRUCT, Target, VALUE, of, words};
use crate::server::context::Context;
use rc_diagnostics::SourceMap;
use rc_prototypes::{COORDINATES, GEOMETRY};
use rc_syntax::{Loader, tokens};

/// The most imported files that are read for names.
const MOST_READ: usize = 64;

impl Completion<'_> {
    pub(super) fn in_schema(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let (word, last) = (context.word(), context.last());
        if let Some(string) = context.string {
            return match last {
                "unit" => units(),
                _ if word == "import" => {
                    let mut items = self.importable(target, string, "gdsl");
                    items.extend(self.importable(target, string, "dproto"));
                    items
                }
                _ => Vec::new(),
            };
        }
        let table = |place: &str| of(keywords(&DATA, "gdsl", place));
        let entities = || self.declared(target, "gdsl", &["entity"], "An entity.");
        let relations = || self.declared(target, "gdsl", &["relation"], "A relation.");
        let around = context.around();
        let around: Vec<&str> = around.iter().map(String::as_str).collect();
        match (around.as_slice(), word.as_str(), context.statement.len()) {
            ([], _, 0) => table(""),
            ([], "domain", 2) => table("Domain"),
            (["domain"], _, 0) => table("domain"),
            (["domain"], "entity", 3) | (["domain", "entity"], "composed_by", _) => entities(),
            (["domain"], "require", 4..) if last == "of" => entities(),
            (["domain"], "require", 4..) => table("rule"),
            (["domain"], "query", 2..) if matches!(last, "(" | ",") => entities(),
            (["domain", block @ ("entity" | "relation")], _, 0) => table(block),
            (["domain", "relation"], "promotes", _) => relations(),
            (["domain", "relation"], "tree", _) if last == "of" => entities(),
            (["domain", "relation"], "tree", _) => table("tree"),
            (["domain", _], _, 1) => {
                let mut items = words(graph_language::TYPES, "A type of attributes.");
                items.extend(table("type"));
                items.extend(entities());
                items
            }
            (["domain", _], _, _) if last == "dproto" => {
                self.declared(target, "dproto", &["dproto"], "A data prototype.")
            }
            (["domain", _], _, 2..) => table("flags"),
            _ => Vec::new(),
        }
    }

    pub(super) fn in_prototypes(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let last = context.last();
        if let Some(string) = context.string {
            let import = last == "import";
            let mut items = Vec::new();
            if import {
                items.extend(self.importable(target, string, "dproto"));
                items.extend(self.importable(target, string, "idsl"));
            }
            return items;
        }
        let table = |place: &str| of(keywords(&DATA, "dproto", place));
        let declared = |kind: &str| self.declared(target, "dproto", &[kind], "");
        // No `;` ends a declaration: the last keyword begins the one of the cursor.
        let begins = |words: &[&str]| {
            let all = keywords(&DATA, "dproto", "").iter();
            let all: Vec<&str> = all.map(|(word, _)| *word).collect();
            let found = words.iter().rev().find(|word| all.contains(*word));
            found.map_or_else(String::new, |word| (*word).to_owned())
        };
        match context.blocks.as_slice() {
            [_] => match (begins(&context.statement).as_str(), last) {
                ("dproto", "::") => {
                    let mut items = words(["geometry"], "The meanings of geometry.");
                    items.extend(declared("domain"));
                    items
                }
                (kind @ ("algebraic" | "units"), "::") => table(kind),
                (_, "::" | "=" | "," | "->" | "<->" | ".") => Vec::new(),
                _ => table(""),
            },
            [_, block] if begins(&block.head) == "dproto" => {
                let field = match context.statement.as_slice() {
                    [.., field, "="] => *field,
                    _ => "",
                };
                match field {
                    "" => words(rc_prototypes::FIELDS, "A field of a prototype."),
                    "semantic" => words(GEOMETRY.iter().map(|one| one.name), "A meaning."),
                    "coord" => {
                        let all = COORDINATES.iter();
                        all.map(|one| Item::new(VALUE, one.name, one.convention))
                            .collect()
                    }
                    "axes" | "units" | "algebraic" | "ddr" => declared(field),
                    _ => Vec::new(),
                }
            }
            [.., block] if block.inside.last() == Some(&"=") => table("value"),
            _ => Vec::new(),
        }
    }

    pub(super) fn in_solvers(&self, target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
        let (word, last) = (context.word(), context.last());
        if let Some(string) = context.string {
            return match word.as_str() {
                "import" => self.paths(target, string, &["urdf", "xml", "yaml"]),
                _ => Vec::new(),
            };
        }
        let table = |place: &str| of(keywords(&DATA, "kdsl", place));
        let only = |word: &str| {
            let all = keywords(&DATA, "kdsl", "word").iter();
            let all: Vec<_> = all.filter(|(known, _)| *known == word).copied().collect();
            of(&all)
        };
        let postures = || self.declared(target, "kdsl", &["posture"], "A posture.");
        let around = context.around();
        let around: Vec<&str> = around.iter().map(String::as_str).collect();
        match (around.as_slice(), word.as_str()) {
            ([], "") => table(""),
            (["kinematics"], "") => table("kinematics"),
            (["kinematics"], "math" | "scalars" | "lengths" | "matrices" | "frames") => {
                table(&word)
            }
            (["kinematics"], "fixed" | "planar" | "floating" | "spherical") => {
                match context.statement.len() {
                    1 | 3 => self.of_robot(target, false),
                    4 => only("at"),
                    7.. if word == "fixed" => only("rpy"),
                    _ => Vec::new(),
                }
            }
            (["kinematics", "loop"], "") => table("loop"),
            (["kinematics", "posture"], "") => self.of_robot(target, true),
            (["kinematics", "solver"], "") => table("solver"),
            (["kinematics", "solver"], "inverse") if context.statement.len() == 1 => {
                table("inverse")
            }
            (["kinematics", "solver"], "payload") if context.statement.len() == 2 => only("at"),
            (["kinematics", "solver"], "joint" | "actuator") if context.statement.len() == 1 => {
                table("driven")
            }
            (["kinematics", "solver"], "within") => only("limits"),
            (["kinematics", "solver"], "null") => match context.statement.len() {
                1 => only("posture"),
                2 => postures(),
                _ => only("gain"),
            },
            (["kinematics", "solver"], "seed") => postures(),
            (
                ["kinematics", "solver"],
                "pose" | "jacobian" | "velocity" | "acceleration" | "inverse" | "payload",
            ) => match last.to_ascii_lowercase().as_str() {
                "pose" | "jacobian" | "velocity" | "acceleration" | "in" | "at" => {
                    self.of_robot(target, false)
                }
                "as" => only("quaternion"),
                _ if word == "payload" => Vec::new(),
                _ => table("motion"),
            },
            _ => Vec::new(),
        }
    }

    /// The names that a text and its imports of a language declare behind one of `words`.
    fn declared(
        &self,
        target: &Target<'_>,
        language: &str,
        kinds: &[&str],
        doc: &str,
    ) -> Vec<Item> {
        let loader = self.files.loader();
        let imported = imports_in(target.text).into_iter().take(MOST_READ);
        let imported = imported.filter(|file| file.ends_with(&format!(".{language}")));
        let imported =
            imported.filter_map(|file| Some(loader.find(target.path, file, language).ok()?.text));
        let own = target.text.to_owned();
        let mut items = Vec::new();
        for text in std::iter::once(own).chain(imported) {
            for two in tokens(&text).windows(2) {
                let is_declared = kinds
                    .iter()
                    .any(|kind| two[0].text.eq_ignore_ascii_case(kind));
                let name = two[1].text;
                if is_declared && name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
                    items.push(Item::new(STRUCT, name, doc));
                }
            }
        }
        items
    }

    /// The coordinates of the imported robot, or its bodies.
    fn of_robot(&self, target: &Target<'_>, coordinates: bool) -> Vec<Item> {
        let loader = self.files.loader();
        let mut imports = imports_in(target.text).into_iter();
        let found = imports.find_map(|file| loader.find(target.path, file, "urdf").ok());
        let Some(found) = found else {
            return Vec::new();
        };
        let mut sources = SourceMap::new();
        let source = sources.add(found.path, found.text);
        let (robot, _) = rc_robot::read(&sources, source);
        let names = |names: Vec<String>, doc: &str| -> Vec<Item> {
            let names = names.into_iter();
            names.map(|name| Item::new(PROPERTY, name, doc)).collect()
        };
        if coordinates {
            return names(robot.coordinates, "A joint that moves.");
        }
        let bodies = robot.bodies.into_iter().map(|body| body.name);
        names(bodies.collect(), "A body of the robot.")
    }
}
