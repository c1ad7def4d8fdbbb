//! The editor without its window: actions of the user become changes of the file.

use super::handles::{self, Drag, Handle, Mode};
use super::prompt::{Ask, CHOICE, Prompt};
use super::source::{OpenError, Source};
use crate::input::{Input, Key, Modifiers, Pixel, ViewerAction};
use crate::navigator::Navigator;
use crate::overlay::{self, Marks};
use crate::steering::Gesture;
use crate::viewpoint::Viewpoint;
use crate::viewport::Viewport;
use innermodel::{Folders, InnerModel, NodeId, NodeRef, Snapshot};
use innermodel_render::{Image, TooLarge};
use rc_diagnostics::foreign::clean;
use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

/// The keys of the editor, as the window lists them.
pub const KEYS: [(&str, &str); 20] = [
    ("drag, right drag, wheel", "turn, move and zoom the view"),
    ("click", "select the node that is seen"),
    ("drag a handle", "move or turn the selected node"),
    ("t", "handles move or turn"),
    ("p", "select the node above"),
    ("Tab, Shift+Tab", "select the next or previous node"),
    ("/", "select by id"),
    ("a", "add an element, in the middle of the view"),
    ("e", "set an attribute: tx=1200, texture=#ff0000"),
    ("d, Delete", "remove the selected node with all below"),
    ("u, Ctrl+Z", "undo"),
    ("y, Ctrl+Y", "redo"),
    ("s, Ctrl+S", "save"),
    ("l, Ctrl+R", "load the file again; u returns"),
    ("f", "frames"),
    ("n", "names"),
    ("r", "first view"),
    ("Escape", "cancel, or select nothing"),
    ("h, F1", "this list"),
    ("q", "end"),
];
/// The colours of handles along and about x, y and z, and of the one that is dragged.
const COLOURS: [[u8; 3]; 3] = [[255, 40, 40], [40, 220, 40], [80, 120, 255]];
const DRAGGED: [u8; 3] = [255, 255, 0];

/// The effect of the next actions.
#[derive(Debug)]
pub(super) enum State {
    /// They select and look around.
    Idle,
    /// A handle follows the pointer.
    Drag(Drag),
    /// The next key chooses the element to add.
    Add,
    /// Keys write a text.
    Prompt(Prompt),
}

/// The editor of an InnerModel file, without its window: it takes the actions of a user and draws
/// pictures.
///
/// Each change is one of the text of the file, and the tree is read from this text. So what the
/// picture shows is what the file says once it is saved, and what is not changed stays as its user
/// wrote it.
pub struct Editor {
    pub(super) source: Source,
    pub(super) viewport: Viewport,
    pub(super) state: State,
    pub(super) mode: Mode,
    /// The id of the selected node.
    pub(super) selected: Option<String>,
    /// The last result.
    pub(super) message: String,
    shows_help: bool,
    /// The user wanted to end with changes that are not saved.
    is_leaving: bool,
}

/// The picture of a tree, at first from a navigator or from where all of it is seen.
fn seen(model: &InnerModel, navigator: Option<Navigator>, marks: Marks) -> Viewport {
    let (tree, clouds) = (model.snapshot(), model.clouds());
    Viewport::new(&tree, &clouds, navigator, Viewpoint::SIZE, marks)
}

impl Editor {
    /// Opens a file.
    pub fn open(path: &Path, folders: Folders) -> Result<Self, OpenError> {
        let source = Source::open(path, folders)?;
        let model = source.model();
        let viewport = seen(model, None, Marks::default());
        Ok(Self {
            viewport,
            state: State::Idle,
            mode: Mode::default(),
            selected: None,
            message: first_message(&source),
            shows_help: false,
            is_leaving: false,
            source,
        })
    }

    /// Sets from where the file is seen at first.
    #[must_use]
    pub fn seen_from(self, navigator: Navigator) -> Self {
        let viewport = seen(self.model(), Some(navigator), self.viewport.marks);
        Self { viewport, ..self }
    }

    /// Sets the lines and names that are seen at first.
    #[must_use]
    pub fn with_marks(mut self, marks: Marks) -> Self {
        self.viewport.marks = marks;
        self
    }

    /// The tree of the text, with the dragged node.
    pub fn model(&self) -> &Arc<InnerModel> {
        self.source.model()
    }

    /// Findings in the file that are not errors, one a line.
    pub fn warnings(&self) -> &str {
        self.source.warnings()
    }

    /// The id of the selected node.
    pub fn selected(&self) -> Option<&str> {
        self.selected.as_deref()
    }

    /// The last result, as a sentence.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Whether there are changes that are not saved.
    pub fn is_changed(&self) -> bool {
        self.source.is_changed()
    }

    /// The handles of the selected node in the picture that was drawn last.
    pub fn handles(&self) -> Vec<Handle> {
        let tree = self.tree();
        let node = self.selected_in(&tree);
        let (Some(node), Some(view)) = (node, self.viewport.view()) else {
            return Vec::new();
        };
        // None for a node that this file cannot change.
        if self.source.tag(node.id()).is_err() {
            return Vec::new();
        }
        handles::handles(&node, self.mode, view)
    }

    /// Draws a picture of this size in pixels. Clicks refer to the last one.
    pub fn draw(&mut self, size: (usize, usize)) -> Result<Image, TooLarge> {
        let tree = self.tree();
        let node = self.selected_in(&tree).map(|node| node.node_id());
        self.viewport.marks.picked = node;
        let problem = RefCell::new(None);
        let say = |line: &str| *problem.borrow_mut() = Some(line.to_owned());
        let clouds = self.model().clouds();
        let mut image = self.viewport.draw(&tree, &clouds, size, &say)?;
        if let Some(problem) = problem.into_inner() {
            self.message = problem;
        }
        let dragged = match &self.state {
            State::Drag(drag) => Some(drag.axis),
            _ => None,
        };
        for handle in self.handles() {
            let is_dragged = dragged == Some(handle.axis);
            let colour = if is_dragged {
                DRAGGED
            } else {
                COLOURS[handle.axis]
            };
            for pair in handle.points.windows(2) {
                overlay::thick_line(&mut image, pair[0], pair[1], colour);
            }
        }
        if self.shows_help {
            for (row, (keys, effect)) in KEYS.iter().enumerate() {
                let top = 4.0 + 10.0 * row as f64;
                overlay::text(&mut image, 4.0, top, &format!("{keys:<24} {effect} "));
            }
        }
        let bottom = image.height as f64;
        overlay::text(&mut image, 4.0, bottom - 24.0, &self.about_selected(&tree));
        let line = match &self.state {
            State::Prompt(prompt) => prompt.line(self.source.units()),
            State::Add => CHOICE.to_owned(),
            State::Idle | State::Drag(_) => self.message.clone(),
        };
        overlay::text(&mut image, 4.0, bottom - 12.0, &line);
        Ok(image)
    }

    /// File and selected node.
    fn about_selected(&self, tree: &Snapshot) -> String {
        let mark = if self.is_changed() { "*" } else { "" };
        let mut text = format!("{}{mark}", self.source.name());
        let Some(node) = self.selected_in(tree) else {
            return text;
        };
        text += &format!(": {} `{}`", node.kind().tag(), clean(node.id()));
        for mode in [Mode::Move, Mode::Turn] {
            if let Some(names) = handles::attributes(node.kind(), mode) {
                let digits = if mode == Mode::Move { 1 } else { 4 };
                for (name, value) in names.iter().zip(handles::values(&node, mode)) {
                    text += &format!(" {name} {value:.digits$}");
                }
                text += mode.unit();
            }
        }
        text
    }

    /// Takes an action of the user.
    pub fn input(&mut self, input: Input) -> ViewerAction {
        match input {
            Input::Redraw => return ViewerAction::Draw,
            Input::Close => return self.leave(),
            Input::Key(key, with) => return self.key(key, with),
            _ => {}
        }
        if !matches!(input, Input::Moved(_)) {
            self.is_leaving = false;
        }
        if self.dragged(input) {
            return ViewerAction::Draw;
        }
        match self.viewport.input(input) {
            Gesture::None => ViewerAction::Nothing,
            Gesture::Camera => ViewerAction::Draw,
            Gesture::Click(at) => {
                self.click(at);
                ViewerAction::Draw
            }
        }
    }

    fn key(&mut self, key: Key, with: Modifiers) -> ViewerAction {
        let was_leaving = std::mem::take(&mut self.is_leaving);
        match std::mem::replace(&mut self.state, State::Idle) {
            State::Idle => {}
            State::Drag(drag) if key == Key::Escape => {
                drop(drag);
                self.source.forget_trial();
                self.tell(Ok(()), "the node stays where it was");
                return ViewerAction::Draw;
            }
            // The other hand is on the pointer.
            State::Drag(drag) => {
                self.state = State::Drag(drag);
                return ViewerAction::Nothing;
            }
            // A letter with Control is a command, no text.
            state @ (State::Add | State::Prompt(_))
                if with.control && matches!(key, Key::Character(_)) =>
            {
                self.state = state;
                return ViewerAction::Nothing;
            }
            State::Add => {
                self.choose(key.lower());
                return ViewerAction::Draw;
            }
            State::Prompt(prompt) => {
                self.write(prompt, key);
                return ViewerAction::Draw;
            }
        }
        match (key.lower(), with.control) {
            (Key::Character('z'), true) | (Key::Character('u'), false) => self.undo(),
            (Key::Character('y'), _) => self.redo(),
            (Key::Character('s'), _) => self.save(),
            (Key::Character('r'), true) | (Key::Character('l'), false) => self.reload(),
            (Key::Character('t'), false) => self.switch_mode(),
            (Key::Character('p'), false) => self.select_above(),
            (Key::Tab, _) => self.select_next(with.shift),
            (Key::Character('/'), false) => self.ask(Ask::Id),
            (Key::Character('a'), false) => self.state = State::Add,
            (Key::Character('e'), false) => self.ask_attribute(),
            (Key::Delete, _) | (Key::Character('d'), false) => self.remove(),
            (Key::Character('h'), false) | (Key::F1, _) => self.shows_help = !self.shows_help,
            (Key::Escape, _) => self.selected = None,
            (Key::Character('q'), false) => {
                self.is_leaving = was_leaving;
                return self.leave();
            }
            (key, false) => return self.viewport.key(key),
            _ => return ViewerAction::Nothing,
        }
        ViewerAction::Draw
    }

    /// Ends, unless changes would be lost and the user does not know it.
    fn leave(&mut self) -> ViewerAction {
        if !self.is_changed() || self.is_leaving {
            return ViewerAction::End;
        }
        self.is_leaving = true;
        // A question would hide the warning.
        self.state = State::Idle;
        let name = self.source.name();
        self.message = format!("{name} has changes: s saves them, q again ends without them");
        ViewerAction::Draw
    }

    /// Lets a handle follow the pointer. Returns whether the action was for a handle.
    fn dragged(&mut self, input: Input) -> bool {
        match (input, &mut self.state) {
            (Input::Pressed(1, at, _), State::Idle) => {
                let Some(drag) = self.taken(at) else {
                    return false;
                };
                self.state = State::Drag(drag);
                true
            }
            (Input::Moved(at), State::Drag(drag)) => {
                if let Some(sight) = self.viewport.sight(at) {
                    drag.follow(&sight);
                    let (id, mode, axis) = (drag.id.clone(), drag.mode, drag.axis);
                    let value = drag.value();
                    let now = self.model().snapshot().time();
                    let tried = self
                        .model()
                        .change(now, |edit| handles::set(edit, &id, mode, axis, value));
                    if let Err(error) = tried {
                        self.message = error.to_string();
                    }
                }
                true
            }
            (Input::Released(1, _), State::Drag(drag)) => {
                let drag = drag.clone();
                self.state = State::Idle;
                self.finish(&drag);
                true
            }
            // Other buttons wait until the handle is free.
            (_, State::Drag(_)) => true,
            _ => false,
        }
    }

    /// The handle at a place of the window.
    fn taken(&self, at: Pixel) -> Option<Drag> {
        let handles = self.handles();
        let place = (f64::from(at.0) + 0.5, f64::from(at.1) + 0.5);
        let handle = handles::at(&handles, place)?;
        let tree = self.tree();
        Drag::new(
            &self.selected_in(&tree)?,
            self.mode,
            handle,
            &self.viewport.sight(at)?,
        )
    }

    fn click(&mut self, at: Pixel) {
        let tree = self.tree();
        let node = self.viewport.node(at);
        self.select(node.and_then(|node| tree.node(node).ok()));
    }

    /// Selects a node, and says whether handles can change it.
    pub(super) fn select(&mut self, node: Option<NodeRef<'_>>) {
        self.selected = node.map(|node| node.id().to_owned());
        self.message.clear();
        let Some(node) = node else {
            return;
        };
        if let Err(reason) = self.source.tag(node.id()) {
            self.message = reason;
        } else if handles::attributes(node.kind(), self.mode).is_none() {
            self.message = handles::without(&clean(node.id()), node.kind(), self.mode);
        }
    }

    pub(super) fn tree(&self) -> Arc<Snapshot> {
        self.model().snapshot()
    }

    pub(super) fn selected_in<'t>(&self, tree: &'t Snapshot) -> Option<NodeRef<'t>> {
        let id = self.selected.as_ref()?;
        tree.node(id).ok()
    }

    /// Keeps the result of a command, and drops a selection that was removed.
    pub(super) fn tell(&mut self, result: Result<(), String>, done: &str) {
        self.message = match result {
            Ok(()) => done.to_owned(),
            Err(reason) => reason,
        };
        let tree = self.tree();
        if self.selected_in(&tree).is_none() {
            self.selected = None;
        }
    }

    /// Writes the text with its changes next to the file, if there are any, and returns the path.
    pub(super) fn rescue(&self) -> Option<std::io::Result<std::path::PathBuf>> {
        self.is_changed().then(|| self.source.rescue())
    }

    /// The node that is seen at a pixel of the picture that was drawn last.
    pub fn node_at(&self, at: Pixel) -> Option<NodeId> {
        self.viewport.node(at)
    }
}

/// The message before anything has happened.
fn first_message(source: &Source) -> String {
    match source.rescued() {
        Some(path) => format!(
            "{} has changes that were not saved; h lists the keys",
            clean(&path.display().to_string())
        ),
        None => "h lists the keys".to_owned(),
    }
}
