//! The shared world of the network: its frames as transforms, and its nodes as entities of a scene. `rcdeploy`
//! has a replica of it and tells its tree.

use innermodel::language::model::Shape as Solid;
use innermodel::language::{self, model};
use innermodel::shapes::{Body, body};
use innermodel::{InnerModel, NodeRef, Snapshot, Transform, frames};
use rc_diagnostics::foreign::clean;
use rc_middleware::{Writer, cdr};
use rc_record::{ENCAPSULATION, Schema};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// After so long, clients get again what has not changed: some of them have come since.
const AGAIN: Duration = Duration::from_secs(1);
/// Millimetres in a metre.
const METRE: f64 = 1000.0;
/// How high names are written, in metres.
const FONT: f64 = 0.1;

/// What a channel shows of a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    /// Frames.
    Transforms,
    /// Nodes with their names and bodies.
    Entities,
}

impl Part {
    pub(crate) const ALL: [Self; 2] = [Self::Transforms, Self::Entities];

    /// The topic.
    pub(crate) fn topic(self) -> &'static str {
        match self {
            Self::Transforms => "/world/_transforms",
            Self::Entities => "/world/_entities",
        }
    }

    /// The schema of the messages.
    pub(crate) fn schema(self) -> Schema {
        match self {
            Self::Transforms => crate::shapes::Shape::Transforms.schema(),
            Self::Entities => crate::shapes::scene_update(),
        }
    }

    /// A message with its encapsulation. `time` is in nanoseconds. `None` if the tree is too large for one.
    fn encode(self, tree: &Snapshot, time: u64) -> Option<Vec<u8>> {
        let mut writer = Writer::default();
        let nodes = || tree.nodes().filter(|node| node.parent().is_some());
        match self {
            Self::Transforms => {
                writer.length(nodes().count());
                for node in nodes() {
                    stamp(time, &mut writer);
                    cdr::text(node.parent().map_or("", |above| above.id()), &mut writer);
                    cdr::text(node.id(), &mut writer);
                    pose(&node.local(), &mut writer);
                }
            }
            Self::Entities => {
                // All that were there are replaced.
                writer.length(1);
                stamp(time, &mut writer);
                writer.put(&1_u8);
                cdr::text("", &mut writer);
                writer.length(nodes().count());
                for node in nodes() {
                    entity(&node, time, &mut writer);
                }
            }
        }
        writer.finish().ok()?;
        let body = writer.into_bytes();
        Some([&ENCAPSULATION, &*body].concat())
    }
}

fn stamp(time: u64, writer: &mut Writer<'_>) {
    writer.put(&i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX));
    writer.put(&((time % 1_000_000_000) as u32));
}

fn floats(values: &[f64], writer: &mut Writer<'_>) {
    for value in values {
        writer.put(value);
    }
}

/// Translation and rotation between frames with the axes of ROS.
fn pose(of: &Transform, writer: &mut Writer<'_>) {
    let placed = frames::to_ros(of);
    let (by, turn) = (placed.translation.vector, placed.rotation);
    floats(&[by.x, by.y, by.z, turn.i, turn.j, turn.k, turn.w], writer);
}

/// The red, green and blue of a body, and that nothing is seen through it.
fn colour(node: &NodeRef<'_>) -> [f64; 4] {
    let texture = match node.kind() {
        model::Kind::Plane(plane) => plane.texture.as_str(),
        model::Kind::Display(display) => display.plane.texture.as_str(),
        model::Kind::Solid(solid) => solid.texture.as_str(),
        _ => "",
    };
    let digits = texture.strip_prefix('#').filter(|text| text.len() == 6);
    let number = digits.and_then(|text| u32::from_str_radix(text, 16).ok());
    let number = number.unwrap_or(0x80_80_80);
    let part = |shift: u32| f64::from((number >> shift) as u8) / 255.0;
    [part(16), part(8), part(0), 1.0]
}

/// Whether a node is only the body of the one above, whose name is written there.
fn is_body(node: &NodeRef<'_>) -> bool {
    let name = node.id().trim_end_matches('_').strip_suffix("_body");
    let is_frame = matches!(node.kind(), model::Kind::Transform(_));
    let above = node.parent();
    !is_frame && above.is_some_and(|above| name == Some(above.id()))
}

/// A node as an entity in its own frame. Meshes have their names alone: a client has no file of them.
fn entity(node: &NodeRef<'_>, time: u64, writer: &mut Writer<'_>) {
    stamp(time, writer);
    cdr::text(node.id(), writer);
    cdr::text(node.id(), writer);
    // It stays until it is replaced, and moves with its frame.
    writer.put(&0_i32);
    writer.put(&0_u32);
    writer.put(&1_u8);
    // Metadata and arrows.
    writer.length(0);
    writer.length(0);
    let body = body(node.kind());
    let shape = |wanted: fn(&Body<'_>) -> bool| body.filter(|(of, _)| wanted(of));
    let boxed = shape(|of| matches!(of, Body::Box(_)));
    writer.length(usize::from(boxed.is_some()));
    if let Some((Body::Box([x, y, z]), at)) = boxed {
        pose(&at, writer);
        // x is ahead, y left and z up.
        floats(&[z / METRE, x / METRE, y / METRE], writer);
        floats(&colour(node), writer);
    }
    let ball = shape(|of| matches!(of, Body::Solid(Solid::Sphere { .. })));
    writer.length(usize::from(ball.is_some()));
    if let Some((Body::Solid(Solid::Sphere { radius }), at)) = ball {
        pose(&at, writer);
        floats(&[2.0 * radius / METRE; 3], writer);
        floats(&colour(node), writer);
    }
    let round = shape(|of| matches!(of, Body::Solid(Solid::Cylinder { .. } | Solid::Cone { .. })));
    writer.length(usize::from(round.is_some()));
    if let Some((Body::Solid(solid), at)) = round {
        let (radius, length, top) = match solid {
            Solid::Cylinder { radius, length } => (radius, length, 1.0),
            Solid::Cone { radius, length } => (radius, length, 0.0),
            Solid::Sphere { radius } => (radius, 2.0 * radius, 1.0),
        };
        pose(&at, writer);
        let across = 2.0 * radius / METRE;
        floats(&[across, across, length / METRE, 1.0, top], writer);
        floats(&colour(node), writer);
    }
    // Lines and triangles.
    writer.length(0);
    writer.length(0);
    let is_named = !is_body(node);
    writer.length(usize::from(is_named));
    if is_named {
        floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], writer);
        // It faces the viewer.
        writer.put(&1_u8);
        writer.put(&FONT);
        writer.put(&0_u8);
        floats(&[0.2, 0.2, 0.2, 1.0], writer);
        cdr::text(node.id(), writer);
    }
    // Models.
    writer.length(0);
}

/// What the thread that reads leaves: the newest tree, and whether no more comes.
#[derive(Default)]
struct Received {
    newest: Mutex<Option<String>>,
    has_ended: AtomicBool,
}

/// Follows the world of a network while it is there.
pub(crate) struct Teller {
    child: Child,
    told: Arc<Received>,
    tree: Option<Arc<Snapshot>>,
    /// When it was published.
    published: Option<Instant>,
}

impl Drop for Teller {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Teller {
    /// Begins to follow. `wake` becomes readable when something has come.
    ///
    /// # Errors
    /// Why there is nothing to follow.
    pub(crate) fn begin(network: &str, mut wake: UnixStream) -> Result<Self, String> {
        let mut command = Command::new(rcdeploy());
        command.args(["world", "tree", "--follow", "--", network]);
        let spawned = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn();
        let mut child = spawned
            .map_err(|error| format!("cannot run `rcdeploy`, which has the world: {error}"))?;
        let output = child.stdout.take();
        let told = Arc::new(Received::default());
        let own = Arc::clone(&told);
        std::thread::spawn(move || {
            for line in output
                .into_iter()
                .flat_map(|output| BufReader::new(output).lines())
            {
                let Ok(line) = line else {
                    break;
                };
                let text = serde_json::from_str(&line).ok();
                *own.newest.lock().unwrap_or_else(PoisonError::into_inner) = text;
                // If the pipe is full, the bridge is awake anyway.
                let _ = wake.write(&[0]);
            }
            own.has_ended.store(true, Ordering::Release);
            let _ = wake.write(&[0]);
        });
        Ok(Self {
            child,
            told,
            tree: None,
            published: None,
        })
    }

    /// Whether no more comes: the network has ended, for example.
    pub(crate) fn has_ended(&self) -> bool {
        self.told.has_ended.load(Ordering::Acquire)
    }

    /// The messages that are due at a time of the network, in nanoseconds.
    ///
    /// # Errors
    /// Why the newest tree is not shown.
    pub(crate) fn due(&mut self, time: u64) -> Result<Vec<(Part, Vec<u8>)>, String> {
        let newest = self.told.newest.lock();
        let newest = newest.unwrap_or_else(PoisonError::into_inner).take();
        let is_new = newest.is_some();
        if let Some(text) = newest {
            self.tree = Some(parsed(&text)?);
        }
        let is_due = self.published.is_none_or(|last| last.elapsed() >= AGAIN);
        let Some(tree) = self.tree.as_ref().filter(|_| is_new || is_due) else {
            return Ok(Vec::new());
        };
        self.published = Some(Instant::now());
        let part = |part: Part| {
            let data = part.encode(tree, time);
            let data = data.ok_or_else(|| "the world is too large for a message".to_owned());
            Ok((part, data?))
        };
        Part::ALL.into_iter().map(part).collect()
    }
}

fn parsed(text: &str) -> Result<Arc<Snapshot>, String> {
    let wrong = |error: &dyn std::fmt::Display| {
        let error = error.to_string();
        format!("the world is not shown: {}", clean(error.trim_end()))
    };
    let nothing = innermodel::Folders::default();
    let read = innermodel::read_text(text, std::path::Path::new("world.xml"), &nothing);
    let document: language::Document = read.map_err(|error| wrong(&error))?.0;
    let model = InnerModel::from_document(&document);
    Ok(model.map_err(|error| wrong(&error))?.snapshot())
}

/// The program beside this one, else the one in the path.
fn rcdeploy() -> OsString {
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name("rcdeploy"));
    let beside = beside.filter(|path| path.is_file());
    beside.map_or_else(|| "rcdeploy".into(), Into::into)
}
