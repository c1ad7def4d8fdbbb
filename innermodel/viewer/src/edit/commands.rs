//! The effects of the keys of the editor.

use super::editor::{Editor, State};
use super::handles::{self, Drag, Mode};
use super::prompt::{Ask, Prompt, Written};
use crate::input::Key;
use innermodel::language::rewrite::{self, Value};
use innermodel::{Kind, NodeRef, Snapshot};
use rc_diagnostics::foreign::clean;

/// The part of the distance to the camera that a new body is large.
const PART: f64 = 0.05;

impl Editor {
    /// Writes the effect of a handle into the text.
    pub(super) fn finish(&mut self, drag: &Drag) {
        let (name, value) = (drag.attribute, drag.value());
        let digits = if drag.mode == Mode::Move { 3 } else { 4 };
        let done = format!(
            "{name} of `{}` is {value:.digits$}{}",
            clean(&drag.id),
            drag.mode.unit()
        );
        let mut result = Ok(());
        if value != drag.old_value() {
            let value = handles::written(drag.mode, value);
            result = self.source.set(&drag.id, name, &value);
        }
        if value == drag.old_value() || result.is_err() {
            // Attempts of the pointer are not in the text.
            self.source.forget_trial();
        }
        self.tell(result, &done);
    }

    pub(super) fn undo(&mut self) {
        match self.source.undo() {
            Ok(false) => "nothing to undo".clone_into(&mut self.message),
            undone => self.tell(undone.map(drop), "undone"),
        }
    }

    pub(super) fn redo(&mut self) {
        match self.source.redo() {
            Ok(false) => "nothing to redo".clone_into(&mut self.message),
            redone => self.tell(redone.map(drop), "redone"),
        }
    }

    pub(super) fn save(&mut self) {
        let saved = self.source.save();
        let done = format!("{} is saved", self.source.name());
        self.tell(saved, &done);
    }

    pub(super) fn reload(&mut self) {
        let loaded = self.source.reload();
        // A mesh or a texture may have changed, too.
        self.viewport.forget_files();
        let done = format!("{} is loaded again; u returns", self.source.name());
        self.tell(loaded, &done);
    }

    pub(super) fn switch_mode(&mut self) {
        self.mode = match self.mode {
            Mode::Move => Mode::Turn,
            Mode::Turn => Mode::Move,
        };
        // The other handles may not be there.
        let tree = self.tree();
        self.select(self.selected_in(&tree));
    }

    pub(super) fn select_above(&mut self) {
        let tree = self.tree();
        let node = self.selected_in(&tree);
        if let Some(above) = node.and_then(|node| node.parent()) {
            // The root has no place in the file.
            let above = Some(above).filter(|above| above.parent().is_some());
            self.select(above);
        }
    }

    /// Selects the next node of the file, or the previous one.
    pub(super) fn select_next(&mut self, back: bool) {
        let tree = self.tree();
        let all: Vec<NodeRef<'_>> = tree.nodes().skip(1).collect();
        if all.is_empty() {
            return;
        }
        let selected = self.selected.as_deref();
        let now = all.iter().position(|node| Some(node.id()) == selected);
        let next = match (now, back) {
            (None, false) => 0,
            (None, true) => all.len() - 1,
            (Some(at), false) => (at + 1) % all.len(),
            (Some(at), true) => (at + all.len() - 1) % all.len(),
        };
        self.select(Some(all[next]));
    }

    pub(super) fn ask(&mut self, ask: Ask) {
        self.state = State::Prompt(Prompt::new(ask));
    }

    pub(super) fn ask_attribute(&mut self) {
        match self.selected.as_deref().map(|id| self.source.tag(id)) {
            Some(Ok(_)) => self.ask(Ask::Attribute),
            Some(Err(reason)) => self.message = reason,
            None => select_first(&mut self.message),
        }
    }

    /// Takes a key of a text.
    pub(super) fn write(&mut self, prompt: Prompt, key: Key) {
        match prompt.key(key) {
            Written::More(prompt) => self.state = State::Prompt(prompt),
            Written::Cancelled => self.message.clear(),
            Written::Done(Prompt { ask, text }) => match ask {
                Ask::Id => {
                    let tree = self.tree();
                    match tree.node(text.trim()) {
                        Ok(node) => self.select(Some(node)),
                        Err(error) => self.message = error.to_string(),
                    }
                }
                Ask::Attribute => self.set_attribute(&text),
                Ask::Mesh => self.add_mesh(&text),
            },
        }
    }

    fn set_attribute(&mut self, text: &str) {
        let Some(id) = self.selected.clone() else {
            return select_first(&mut self.message);
        };
        let Some((name, value)) = text.split_once('=') else {
            "expected an attribute and its value, as in tx=1200".clone_into(&mut self.message);
            return;
        };
        let (name, value) = (name.trim(), value.trim());
        let set = self.source.set(&id, name, &Value::Text(value.to_owned()));
        if name == "id" && set.is_ok() {
            self.selected = Some(value.to_owned());
        }
        self.tell(set, &format!("{} is {}", clean(name), clean(value)));
    }

    pub(super) fn remove(&mut self) {
        let Some(id) = self.selected.clone() else {
            return select_first(&mut self.message);
        };
        let removed = self.source.remove(&id);
        if removed.is_ok() {
            // Another node without an id of its own may have this name now.
            self.selected = None;
        }
        self.tell(
            removed,
            &format!("`{}` is removed; u returns it", clean(&id)),
        );
    }

    /// Adds the element of a key.
    pub(super) fn choose(&mut self, key: Key) {
        let length = |part: f64| Value::length(self.size() * part);
        let solid = |tag| Some((tag, vec![("radius", length(0.5)), ("length", length(1.0))]));
        let chosen = match key {
            Key::Character('b') => {
                let size = Value::Lengths(vec![self.size(); 3]);
                Some(("plane", vec![("size", size)]))
            }
            Key::Character('s') => Some(("sphere", vec![("radius", length(0.5))])),
            Key::Character('c') => solid("cylinder"),
            Key::Character('k') => solid("cone"),
            Key::Character('t') => Some(("transform", Vec::new())),
            Key::Character('m') => return self.ask(Ask::Mesh),
            _ => None,
        };
        match chosen {
            Some((tag, more)) => self.add(tag, more, |_| Ok(())),
            None => self.message.clear(),
        }
    }

    fn add_mesh(&mut self, file: &str) {
        let file = file.trim();
        let name = self.source.name();
        let is_found = |node: &NodeRef<'_>| match node.kind() {
            Kind::Mesh(mesh) if mesh.path.is_some() => Ok(()),
            _ => Err(format!(
                "cannot find the mesh `{}`: write its path from the folder of {name}",
                clean(file)
            )),
        };
        self.add(
            "mesh",
            vec![("file", Value::Text(file.to_owned()))],
            is_found,
        );
    }

    /// A length that is well seen at the middle of the view: 1, 2 or 5 times a power of 10.
    fn size(&self) -> f64 {
        let wanted = self.viewport.steering.navigator.distance * PART;
        let power = 10_f64.powf(wanted.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        steps
            .into_iter()
            .rfind(|step| *step <= wanted)
            .unwrap_or(power)
    }

    /// Adds an element in the middle of the view, below the selected node or the nearest one above
    /// that may have children, if `check` accepts the new node.
    fn add(
        &mut self,
        tag: &'static str,
        more: Vec<(&'static str, Value)>,
        check: impl FnOnce(&NodeRef<'_>) -> Result<(), String>,
    ) {
        let tree = self.tree();
        let parent = self.parent_of_new(&tree);
        let pose = handles::pose_at(&parent, &self.viewport.steering.navigator.centre);
        let id = new_id(&tree, tag);
        let mut attributes = vec![("id", Value::Text(id.clone()))];
        let names = if tag == "plane" {
            ["px", "py", "pz"]
        } else {
            ["tx", "ty", "tz"]
        };
        let places = names.into_iter().zip(pose.translation);
        let places = places.filter(|(_, place)| *place != 0.0);
        attributes.extend(places.map(|(name, place)| (name, Value::length(place))));
        attributes.extend(more);
        if rewrite::has_attribute(tag, "collide") {
            attributes.push(("collide", Value::Text("1".to_owned())));
        }
        let below = parent.parent().map(|_| parent.id());
        let check = |tree: &Snapshot| {
            let node = tree.node(&id).map_err(|error| error.to_string())?;
            check(&node)
        };
        let added = self.source.add(below, tag, &attributes, check);
        if added.is_ok() {
            self.selected = Some(id.clone());
        }
        let where_ = below.map_or_else(String::new, |id| format!(" below `{}`", clean(id)));
        self.tell(added, &format!("`{id}` is added{where_}"));
    }

    /// The selected node or the nearest one above it, below which this file can add; else the root.
    fn parent_of_new<'t>(&self, tree: &'t Snapshot) -> NodeRef<'t> {
        let selected = self.selected_in(tree);
        let above = std::iter::successors(selected, NodeRef::parent);
        let is_here = |node: &NodeRef<'_>| {
            let has_children = rewrite::has_children(node.kind().tag());
            has_children && self.source.tag(node.id()).is_ok()
        };
        let mut above = above.filter(is_here);
        above.next().unwrap_or_else(|| tree.root())
    }
}

fn select_first(message: &mut String) {
    "select a node first: click it, or write its id after /".clone_into(message);
}

/// An id that no node has: the tag and a number.
fn new_id(tree: &Snapshot, tag: &str) -> String {
    let ids = (1..=tree.len() + 1).map(|number| format!("{tag}_{number}"));
    let free = ids.into_iter().find(|id| tree.node(id).is_err());
    free.unwrap_or_else(|| tag.to_owned())
}
