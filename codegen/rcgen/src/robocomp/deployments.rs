//! Files that start components in RoboComp: those of rcmanager in XML, and `sub.toml`.

use super::settings::{Address, name};
use rc_diagnostics::foreign::clean;
use roxmltree::{Document, Node as Element};
use std::path::{Path, PathBuf};
use toml_edit::DocumentMut;

/// A network of components.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Deployment {
    pub(super) file: PathBuf,
    pub(super) nodes: Vec<Node>,
}

/// A started component.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Node {
    pub(super) alias: String,
    /// The working directory.
    pub(super) folder: String,
    /// The words of the command that starts it.
    pub(super) words: Vec<String>,
    /// The nodes that it depends on.
    pub(super) after: Vec<String>,
    /// Another machine.
    pub(super) host: Option<String>,
}

impl Deployment {
    /// Reads a file. `None` if it is another kind of file.
    pub(super) fn read(file: &Path, text: &str) -> Option<Result<Self, String>> {
        let nodes = match file.extension()?.to_str()? {
            "xml" if text.contains("<rcmanager") => of_rcmanager(text),
            "toml" if text.contains("[[components]]") => of_toml(text),
            _ => return None,
        };
        let wrong = |reason| clean(&format!("{} is left out: {reason}", name(file)));
        Some(nodes.map_err(wrong).map(|nodes| Self {
            file: file.to_owned(),
            nodes,
        }))
    }
}

fn of_toml(text: &str) -> Result<Vec<Node>, String> {
    let document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
        let text = error.to_string();
        text.lines().next().unwrap_or_default().to_owned()
    })?;
    let tables = document
        .get("components")
        .and_then(|item| item.as_array_of_tables());
    let node = |table: &toml_edit::Table| {
        let text = |key: &str| {
            table
                .get(key)
                .and_then(|item| item.as_str())
                .unwrap_or_default()
        };
        Node {
            alias: text("name").to_owned(),
            folder: text("cwd").to_owned(),
            words: words(text("cmd")),
            after: Vec::new(),
            host: host(text("ice_name")),
        }
    };
    Ok(tables.map_or_else(Vec::new, |tables| tables.iter().map(node).collect()))
}

fn of_rcmanager(text: &str) -> Result<Vec<Node>, String> {
    let document = Document::parse(text).map_err(|error| error.to_string())?;
    let root = document.root_element();
    let child = |node: &Element<'_, '_>, tag: &str, attribute: &str| {
        let mut all = node.children();
        let found = all.find(|child| child.has_tag_name(tag));
        let text = found.and_then(|child| child.attribute(attribute).map(str::to_owned));
        text.unwrap_or_default()
    };
    let nodes = root.children().filter(|child| child.has_tag_name("node"));
    let nodes = nodes.map(|node| {
        let dependences = node
            .children()
            .filter(|child| child.has_tag_name("dependence"));
        let mut words = words(&child(&node, "upCommand", "command"));
        words.push(child(&node, "configFile", "path"));
        let ip = child(&node, "ip", "value");
        let endpoint = node.attribute("endpoint").unwrap_or_default();
        let is_here = Address {
            host: ip.clone(),
            port: 0,
        }
        .is_here();
        Node {
            alias: node.attribute("alias").unwrap_or_default().to_owned(),
            folder: child(&node, "workingDir", "path"),
            words,
            after: dependences
                .filter_map(|child| child.attribute("alias").map(str::to_owned))
                .collect(),
            host: if ip.is_empty() {
                host(endpoint)
            } else {
                Some(ip).filter(|_| !is_here)
            },
        }
    });
    Ok(nodes.collect())
}

fn words(command: &str) -> Vec<String> {
    let words = command.split_whitespace();
    words
        .map(|word| word.trim_matches(['"', '\'']).to_owned())
        .collect()
}

/// The machine of an endpoint, if it is another one.
fn host(endpoint: &str) -> Option<String> {
    let address = Address::parse(endpoint).filter(|address| !address.is_here());
    address.map(|address| address.host)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_of_files_name_components() {
        let toml = "[[components]]\nname = \"eye\"\ncwd = \"~/robot/eye\"\ncmd = \"bin/eye etc/config_left\"\n\
             ice_name = \"Eye:tcp -h 10.0.0.2 -p 10003\"\n#[[components]]\n#name = \"ear\"\n";
        let toml = Deployment::read(Path::new("sub.toml"), toml)
            .expect("a network")
            .expect("nodes");
        let xml = "<?xml version=\"1.0\"?><rcmanager><generalInformation/>\
             <node alias=\"eye\" endpoint=\"eye:tcp -p 10003\"><dependence alias=\"base\"/><workingDir path=\"~/robot/eye\"/>\
             <upCommand command=\"bin/eye\"/><configFile path=\"etc/config_left\"/><ip value=\"10.0.0.2\"/></node></rcmanager>";
        let xml = Deployment::read(Path::new("a.xml"), xml)
            .expect("a network")
            .expect("nodes");
        assert_eq!(xml.nodes[0].after, ["base"]);
        let without = Node {
            after: Vec::new(),
            ..xml.nodes[0].clone()
        };
        assert_eq!(toml.nodes, [without]);
        assert_eq!(toml.nodes[0].host.as_deref(), Some("10.0.0.2"));
        assert_eq!(toml.nodes[0].words, ["bin/eye", "etc/config_left"]);
    }

    #[test]
    fn other_files_are_none_and_broken_ones_have_reasons() {
        for (file, text) in [
            ("a.xml", "<innerModel/>"),
            ("a.toml", "[package]\n"),
            ("a.txt", "[[components]]"),
        ] {
            assert_eq!(Deployment::read(Path::new(file), text), None, "{file}");
        }
        for (file, text) in [
            ("a.xml", "<rcmanager><node>"),
            ("a.toml", "[[components]]\nx"),
        ] {
            let wrong = Deployment::read(Path::new(file), text).expect("a network");
            assert!(
                wrong.expect_err("broken").contains("is left out: "),
                "{file}"
            );
        }
        let empty =
            Deployment::read(Path::new("a.toml"), "a = \"[[components]]\"").expect("a network");
        assert_eq!(empty.expect("no nodes").nodes, []);
    }
}
