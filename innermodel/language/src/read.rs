//! Reads a file with all that it includes.

mod bodies;
mod devices;
mod files;

use crate::attributes::Attributes;
use crate::check;
use crate::elements::{self, Element, element};
use crate::include::{self, Loader};
use crate::model::{
    Display, Document, Encoder, Engine, Form, Joint, Kind, Mesh, Node, Pose, Prismatic, ROOT,
    Render, Transform,
};
use crate::units::Units;
use rc_diagnostics::{Diagnostic, Diagnostics, Name, SourceId, SourceMap, Span, nearest};
use rc_xml::XmlSource;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// How deep elements may be nested, over all included files.
const MAX_DEPTH: usize = 512;
/// How deep files may include each other.
const MAX_FILES: usize = 64;
/// How many files one document may include, each time counted.
const MAX_INCLUDES: usize = 1000;

pub(crate) fn xml(source: SourceId, text: &str) -> XmlSource<'_> {
    XmlSource {
        source,
        text,
        root: elements::ROOT,
        not_supported: "xml-not-supported",
    }
}

/// Whether a text is well-formed and is an InnerModel file whose elements are not nested too deep.
/// Reads no other file.
pub fn parse(sources: &SourceMap, source: SourceId) -> Diagnostics {
    let mut found = Diagnostics::new();
    let text = xml(source, sources.text(source));
    match text.parse() {
        Ok(document) => {
            root(text, document.root_element(), &mut found);
            // Each line of the layout is indented, so the depth bounds its length.
            let mut rest = vec![(document.root_element(), 0)];
            while let Some((node, depth)) = rest.pop() {
                if depth > MAX_DEPTH {
                    found.push(too_deep(text.tag(node)));
                    break;
                }
                let elements = node.children().filter(roxmltree::Node::is_element);
                rest.extend(elements.map(|child| (child, depth + 1)));
            }
        }
        Err(problem) => found.push(problem),
    }
    found
}

fn too_deep(tag: Span) -> Diagnostic {
    let message = format!("elements are nested more than {MAX_DEPTH} deep");
    Diagnostic::error("nested-too-deep", tag, message)
}

fn root(text: XmlSource<'_>, root: roxmltree::Node<'_, '_>, found: &mut Diagnostics) {
    let name = root.tag_name().name();
    if !name.eq_ignore_ascii_case(elements::ROOT) {
        let message = format!("expected `<{}>`, found `<{name}>`", elements::ROOT);
        let error = Diagnostic::error("not-an-innermodel", text.tag(root), message);
        found.push(if name == "robot" {
            error.help(
                "this is a URDF: `rcgen import FILE --out FILE.xml` makes an InnerModel file of it",
            )
        } else {
            error
        });
    }
}

/// Reads the text `source` with all that it includes. The document is complete unless an error was
/// found; then it holds what was understood.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    source: SourceId,
) -> (Document, Diagnostics) {
    let home = include::folder(sources.path(source));
    let mut reader = Reader {
        sources,
        loader,
        home,
        document: Document::default(),
        found: Diagnostics::new(),
        ids: HashMap::new(),
        open: Vec::new(),
        includes: 0,
        unnamed: 0,
        allowed: Vec::new(),
    };
    reader.file(source, None, Units::Millimetres, 0);
    check::allowed(&reader.allowed, &reader.ids, &mut reader.found);
    (reader.document, reader.found)
}

struct Reader<'s> {
    sources: &'s mut SourceMap,
    loader: &'s dyn Loader,
    /// The folder of the loaded file.
    home: PathBuf,
    document: Document,
    found: Diagnostics,
    ids: HashMap<String, Span>,
    /// The files that are being read, the outermost first.
    open: Vec<PathBuf>,
    includes: usize,
    /// How many nodes have no id of their own.
    unnamed: usize,
    /// The words of all attributes `allowed`.
    allowed: Vec<Name>,
}

impl Reader<'_> {
    fn file(&mut self, source: SourceId, parent: Option<usize>, units: Units, depth: usize) {
        let path = normal(self.sources.path(source));
        let owned = self.sources.text(source).to_owned();
        let text = xml(source, &owned);
        let document = match text.parse() {
            Ok(document) => document,
            Err(problem) => return self.found.push(problem),
        };
        let top = document.root_element();
        root(text, top, &mut self.found);
        let units = self.units(text, top, units);
        self.open.push(path);
        self.children(text, top, parent, units, depth);
        self.open.pop();
    }

    /// The unit of a file. Other attributes of its root have never meant anything.
    fn units(&mut self, text: XmlSource<'_>, top: roxmltree::Node<'_, '_>, outer: Units) -> Units {
        for attribute in top.attributes() {
            let span = text.attribute_name(&attribute);
            if attribute.name() != "units" {
                let message = format!("the attribute `{}` has no effect here", text.slice(span));
                let near = nearest(attribute.name(), ["units"]);
                let finding = Diagnostic::warning("unused-attribute", span, message);
                self.found
                    .push(finding.did_you_mean(attribute.name(), near));
            }
        }
        Units::of(text, top).map_or_else(
            |value| {
                let message = format!("unknown value `{}` of `units`", value.text);
                let words = Units::WORDS.iter().map(|(word, _)| *word);
                self.found.push(
                    Diagnostic::error("bad-value", value.span, message).suggest(&value.text, words),
                );
                outer
            },
            |units| units.unwrap_or(outer),
        )
    }

    fn children(
        &mut self,
        text: XmlSource<'_>,
        above: roxmltree::Node<'_, '_>,
        parent: Option<usize>,
        units: Units,
        depth: usize,
    ) {
        for child in above.children() {
            if child.is_text()
                && let Some(span) = text.words(child)
            {
                let message = format!("the text `{}` has no effect", text.slice(span));
                let finding = Diagnostic::warning("stray-text", span, message);
                self.found
                    .push(finding.help("remove it, or write it as a comment"));
            }
            if child.is_element() {
                self.element(text, child, parent, units, depth);
            }
        }
    }

    fn element(
        &mut self,
        text: XmlSource<'_>,
        node: roxmltree::Node<'_, '_>,
        parent: Option<usize>,
        units: Units,
        depth: usize,
    ) {
        let tag = text.tag(node);
        let Some(element) = element(node.tag_name().name()) else {
            self.unknown_tag(text, tag, node.tag_name().name());
            return;
        };
        if depth == MAX_DEPTH {
            self.found.push(too_deep(tag));
            return;
        }
        if element.tag == "include" {
            self.include(text, node, element, parent, units, depth);
            self.no_children(text, node, element);
            return;
        }
        let folder = self
            .open
            .last()
            .map(|path| include::folder(path))
            .unwrap_or_default();
        let mut attributes = Attributes::read(text, node, element, units, &mut self.found);
        let (kind, pose) = kind(element, &mut attributes, units);
        let allowed = attributes.words("allowed");
        let id = attributes.value("id").cloned();
        let mut kind = kind;
        let names = if matches!(kind, Kind::Mesh(_)) {
            "file"
        } else {
            "texture"
        };
        let named = attributes.value(names).cloned();
        self.find_file(&mut kind, named, tag, &folder);
        let id = self.id(id, element, tag);
        self.document.nodes.push(Node {
            id,
            parent,
            kind,
            pose,
            allowed: allowed.iter().map(|word| word.text.clone()).collect(),
            span: tag,
        });
        self.allowed.extend(allowed);
        let own = self.document.nodes.len() - 1;
        if element.children {
            self.children(text, node, Some(own), units, depth + 1);
        } else {
            self.no_children(text, node, element);
        }
    }

    fn unknown_tag(&mut self, text: XmlSource<'_>, tag: Span, name: &str) {
        let written = text.slice(tag);
        let finding = if name.eq_ignore_ascii_case(elements::ROOT) {
            let message = format!("`{written}` can only be the outermost element");
            Diagnostic::error("misplaced-tag", tag, message)
                .help("write `<include path=\"…\"/>` to insert another file")
        } else {
            let message = format!("unknown tag `{written}`");
            Diagnostic::error("unknown-tag", tag, message)
                .suggest(name, elements::ELEMENTS.iter().map(|e| e.tag))
        };
        self.found.push(finding);
    }

    fn no_children(&mut self, text: XmlSource<'_>, node: roxmltree::Node<'_, '_>, of: &Element) {
        if let Some(child) = node.children().find(roxmltree::Node::is_element) {
            let inner = text.slice(text.tag(child));
            let message = format!("`{}` cannot contain `{inner}`", of.tag);
            self.found.push(
                Diagnostic::error("misplaced-tag", text.tag(child), message)
                    .label(text.tag(node), "this element has no children")
                    .help("put both into one `transform`"),
            );
        }
    }

    /// The id of a node. A second node with the same id is reported and gets none of its own.
    fn id(&mut self, written: Option<Name>, element: &Element, tag: Span) -> String {
        let Some(id) = written.filter(|id| !id.text.is_empty()) else {
            self.unnamed += 1;
            let id = format!("{}#{}", element.tag, self.unnamed);
            let message = format!("`{}` has no `id`; it is called `{id}`", element.tag);
            self.found
                .push(Diagnostic::warning("missing-id", tag, message));
            self.ids.insert(id.clone(), tag);
            return id;
        };
        if id.text == ROOT {
            let message = format!("the id `{ROOT}` belongs to the node above all others");
            self.found
                .push(Diagnostic::error("duplicate-id", id.span, message));
        } else if let Some(first) = self.ids.get(&id.text) {
            let message = format!("the id `{}` is used twice", id.text);
            self.found.push(
                Diagnostic::error("duplicate-id", id.span, message)
                    .label(*first, "first used here"),
            );
        } else {
            self.ids.insert(id.text.clone(), id.span);
        }
        id.text
    }

    fn include(
        &mut self,
        text: XmlSource<'_>,
        node: roxmltree::Node<'_, '_>,
        element: &Element,
        parent: Option<usize>,
        units: Units,
        depth: usize,
    ) {
        let attributes = Attributes::read(text, node, element, units, &mut self.found);
        let Some(path) = attributes.value("path").cloned() else {
            let message = "the attribute `path` is missing";
            let finding = Diagnostic::error("missing-attribute", text.tag(node), message);
            self.found.push(finding);
            return;
        };
        let folder = self
            .open
            .last()
            .map(|path| include::folder(path))
            .unwrap_or_default();
        let Some(found) = include::find(self.loader, &folder, &path.text) else {
            let message = format!("cannot find the included file `{}`", path.text);
            let finding = Diagnostic::error("include-not-found", path.span, message);
            self.found.push(finding.help(
                "a file is looked for next to this one, then by its base \
                name along the search path: `-I FOLDER`",
            ));
            return;
        };
        self.moved(&found, &path);
        let file = normal(&found.path());
        if let Some(at) = self.open.iter().position(|open| *open == file) {
            let cycle: Vec<_> = self.open[at..]
                .iter()
                .map(|p| p.to_string_lossy())
                .collect();
            let message = format!("files include each other: {}", cycle.join(" → "));
            self.found
                .push(Diagnostic::error("include-cycle", path.span, message));
            return;
        }
        if self.open.len() > MAX_FILES {
            let message = format!("files include each other more than {MAX_FILES} deep");
            self.found
                .push(Diagnostic::error("nested-too-deep", path.span, message));
            return;
        }
        self.includes += 1;
        if self.includes > MAX_INCLUDES {
            let message = format!("more than {MAX_INCLUDES} files are included");
            self.found
                .push(Diagnostic::error("too-many-includes", path.span, message));
            return;
        }
        match self.loader.read(&file) {
            Ok(content) => {
                let source = self.sources.add(&file, content);
                self.file(source, parent, units, depth);
            }
            Err(error) => {
                let message = format!("cannot read `{}`: {error}", file.display());
                let finding = Diagnostic::error("include-not-found", path.span, message);
                self.found.push(finding);
            }
        }
    }
}

/// `a/./b/../c` as `a/c`, so that one file has one path.
fn normal(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

const T: [&str; 3] = ["tx", "ty", "tz"];
const R: [&str; 3] = ["rx", "ry", "rz"];

/// The kind of an element, and its pose.
fn kind(element: &Element, from: &mut Attributes<'_, '_>, units: Units) -> (Kind, Pose) {
    let posed = element.attributes().any(|names| names[0] == "tx");
    let turned = element.attributes().any(|names| names[0] == "rx");
    let pose = Pose {
        translation: if posed { from.lengths(T) } else { [0.0; 3] },
        rotation: if turned { from.numbers(R) } else { [0.0; 3] },
    };
    let kind = match element.tag {
        "translation" => transform(Form::Translation, from),
        "rotation" => transform(Form::Rotation, from),
        "joint" => {
            let (min, max) = from.limits(false);
            Kind::Joint(Joint {
                axis: from.axis(),
                min,
                max,
                home: from.number("home", 0.0),
                max_speed: from.at_least_0("maxspeed", 0.0),
                encoder: Encoder {
                    noise: from.at_least_0("noise", 0.0),
                    quantum: from.at_least_0("quantum", 0.0),
                },
                port: from.count("port", 0),
                low: from.numbers(["lx", "ly", "lz"]),
                high: from.numbers(["hx", "hy", "hz"]),
            })
        }
        "prismaticJoint" => {
            let (min, max) = from.limits(true);
            Kind::Prismatic(Prismatic {
                axis: from.axis(),
                min,
                max,
                home: from.length("home", 0.0),
                position: from.length("position", 0.0),
                offset: from.length("offset", 0.0),
                max_speed: from.length_at_least_0("maxspeed", 0.0),
                encoder: Encoder {
                    noise: from.length_at_least_0("noise", 0.0),
                    quantum: from.length_at_least_0("quantum", 0.0),
                },
                port: from.count("port", 0),
            })
        }
        "plane" => Kind::Plane(bodies::plane(from)),
        "display" => Kind::Display(Display {
            plane: bodies::plane(from),
            port: from.count("port", 0),
        }),
        "mesh" => Kind::Mesh(Mesh {
            file: from.text("file"),
            path: None,
            scale: bodies::scale(from, units),
            render: from.word(
                "render",
                &[("normal", Render::Normal), ("wireframe", Render::Wireframe)],
                Render::Normal,
            ),
            collide: from.flag("collide"),
        }),
        "pointcloud" => Kind::PointCloud,
        "axes" => bodies::axes(from),
        "sphere" | "cylinder" | "cone" => bodies::solid(element.tag, from),
        tag => devices::kind(tag, from).unwrap_or_else(|| transform(Form::Transform, from)),
    };
    (kind, pose)
}

fn transform(form: Form, from: &mut Attributes<'_, '_>) -> Kind {
    let words = [Engine::Static, Engine::Bullet].map(|e| (e.name(), e));
    Kind::Transform(Transform {
        form,
        engine: from.word("engine", &words, Engine::Static),
        mass: from.number("mass", 0.0),
    })
}
