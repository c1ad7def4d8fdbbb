//! The frames of the robot in the world that the components of a network share.

use crate::specific_worker::Frame;
use graph_language::Schema;
use kinematics_generated::SendError;
use kinematics_generated::interfaces::world::WorldPublisher;
use kinematics_generated::interfaces::world_stream::WorldStreamPublisher;
use kinematics_generated::network_time::Time;
use kinematics_generated::tracing::warn;
use kinematics_generated::world::rights;
use kinematics_generated::{Context, HandlerError};
use property_graph::{Edit, Error, NodeId, Snapshot, Value};
use rc_diagnostics::SourceMap;
use rc_middleware::Reader;
use rc_quantity::Axes;
use rc_quantity::rotation::EulerOrder;
use rc_robot::{Grounding, Robot, State};
use rc_world::Message;
use rc_world_member::{Driver, Interface, place};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// The type of frames, the relation between them, and its attribute, in `geometry.gdsl`.
const FRAME: &str = "Frame";
const RT: &str = "RT";
const POSE: &str = "pose";

/// The longest wait for frames with which the world starts: those of the robot may be among them.
const STARTING: Duration = Duration::from_secs(4);

/// The same, if the world has a file to start with: a busy machine may start its keeper late.
const STARTING_FROM_FILE: Duration = Duration::from_secs(30);

/// A replica of the world, which gets the frames.
pub(crate) struct World {
    driver: Driver,
    /// When no start is expected any more.
    until: Time,
    /// The robot along the axes of the world.
    robot: Robot,
    /// Positions that the world does not have yet.
    wanted: Option<Vec<f64>>,
    /// The last refusal, so that it is said once.
    refused: String,
    written: Written,
}

/// What this component has written.
#[derive(Default)]
struct Written {
    /// The last poses of links.
    poses: HashMap<usize, Value>,
    /// A link that another component has moved since.
    foreign: Option<usize>,
    /// Whether that was said.
    is_said: bool,
}

/// A schema, and its files with their texts.
type Known = (Schema, Vec<(String, String)>);

/// Reads a schema: a file, or a domain that comes with the tools.
fn schema(path: &Path) -> Result<Known, String> {
    let mut sources = SourceMap::new();
    let schema = graph_language::open(&mut sources, path, rc_files::read)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = sources.ids().map(|source| {
        let own = sources.path(source);
        let own = own.strip_prefix(folder).unwrap_or(own);
        (own.display().to_string(), sources.text(source).to_owned())
    });
    let files = files.collect();
    Ok((schema, files))
}

impl World {
    /// The world of the network. `None` if it has none, or one without frames.
    ///
    /// # Errors
    /// Why its schema is not readable.
    pub(crate) fn open(ctx: &Context, robot: &Robot, now: &[f64]) -> Result<Option<Self>, String> {
        let path = &ctx.params.schema;
        if path.as_os_str().is_empty() {
            return Ok(None);
        }
        let (schema, files) = schema(path)?;
        let relation = schema.relation(RT);
        let has_poses = relation.is_some_and(|relation| relation.attribute(POSE).is_some());
        if schema.entity(FRAME).is_none() || !has_poses {
            warn!(
                "the world has no frames of `geometry.gdsl`: those of the robot are not in it ({})",
                path.display()
            );
            return Ok(None);
        }
        // Tools get the schema from a component.
        let files = files.iter();
        let files: Vec<(&str, &str)> = files.map(|(name, text)| (&**name, &**text)).collect();
        ctx.set_world_schema(&files);
        // Poses of `geometry.gdsl` are in metres; those of a tree of InnerModel have its axes.
        let part = schema.entity("Part");
        let axes = if part.is_some_and(|part| part.domain == "innermodel") {
            Axes::INNER_MODEL
        } else {
            Axes::ROS
        };
        let grounding = Grounding { axes, metre: 1.0 };
        // A file that keeps the world is there from its second run on.
        let (start, keep) = (&ctx.params.start, &ctx.params.keep);
        let starting = if !start.as_os_str().is_empty() || keep.is_file() {
            STARTING_FROM_FILE
        } else {
            STARTING
        };
        Ok(Some(Self {
            driver: Driver::new(ctx, Arc::new(schema), rights()),
            until: ctx.now() + starting,
            robot: grounding.of(robot),
            wanted: Some(now.to_vec()),
            refused: String::new(),
            written: Written::default(),
        }))
    }

    /// Writes where the links are, at the latest when it has joined.
    pub(crate) fn tell(&mut self, now: &[f64]) {
        self.wanted = Some(now.to_vec());
    }

    /// Does what is due.
    pub(crate) fn turn(&mut self, ctx: &mut Context, frames: &[Frame]) {
        let now = ctx.now();
        let (state, stream) = (&mut ctx.world, &mut ctx.world_stream);
        let send = &mut |message: &Message| send(state, stream, message);
        self.driver.turn(now, send);
        let has_started = self.driver.has_start() || now >= self.until;
        if !self.driver.has_joined() || !has_started {
            return;
        }
        let Some(positions) = self.wanted.take() else {
            return;
        };
        let state = State::still(positions);
        let (robot, written) = (&self.robot, &mut self.written);
        let changed = self.driver.change(|edit| {
            for frame in frames {
                write(edit, robot, frame, &state, written)?;
            }
            Ok(())
        });
        if changed.is_err() {
            // The world has none of them.
            written.poses.clear();
        }
        if let Some(link) = written.foreign.filter(|_| !written.is_said) {
            written.is_said = true;
            warn!(
                "another component moves the frame `{}`, too: if its robot has the same links, name each robot by \
                `import \"FILE.urdf\" as NAME` in a `.kdsl`",
                robot.bodies[link].name
            );
        }
        let refused = changed
            .err()
            .map_or(String::new(), |error| error.to_string());
        if refused != self.refused {
            if !refused.is_empty() {
                warn!("the world does not take the frames of the robot: {refused}");
            }
            self.refused = refused;
        }
        self.driver.turn(now, send);
    }

    pub(crate) fn receive(
        &mut self,
        of: Interface,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        match of {
            Interface::World => self.driver.receive_state(topic, reader),
            Interface::WorldStream => self.driver.receive_stream(topic, reader),
        }
    }

    pub(crate) fn leave(&mut self, ctx: &mut Context) {
        let (state, stream) = (&mut ctx.world, &mut ctx.world_stream);
        self.driver
            .leave(&mut |message| send(state, stream, message));
    }
}

/// The frame with a name.
fn known(world: &Snapshot, name: &str) -> Option<NodeId> {
    let kind = world.symbol(FRAME)?;
    let mut named = world.named(name);
    named.find(|node| {
        let own = world.type_of((*node).into());
        own.is_some_and(|own| world.is_a(own, kind))
    })
}

/// The frame with a name. One that is not there is added.
fn node(edit: &mut Edit, name: &str) -> Result<NodeId, Error> {
    if let Some(known) = known(edit.snapshot(), name) {
        return Ok(known);
    }
    let node = edit.add_node(FRAME)?;
    edit.set(node, "name", name)?;
    Ok(node)
}

/// Writes where a link is in the one above it. A link that another component has put somewhere else stays there.
fn write(
    edit: &mut Edit,
    robot: &Robot,
    frame: &Frame,
    state: &State<f64>,
    written: &mut Written,
) -> Result<(), Error> {
    let Some(chain) = robot.chain(frame.above, frame.link) else {
        return Ok(());
    };
    let place = chain.moved(state).pose;
    let angles = EulerOrder::XYZ_MOVING.angles(&place.rotation).angles;
    let pose: Value = [place.translation, angles].concat().as_slice().into();
    let above = node(edit, &robot.bodies[frame.above].name)?;
    let own = node(edit, &robot.bodies[frame.link].name)?;
    let world = edit.snapshot();
    let known = world.symbol(RT);
    let known = known.and_then(|relation| world.in_edges(own, Some(relation)).next());
    let known = known.map(|edge| (edge.edge_id(), edge.from()));
    let edge = match known {
        Some((edge, parent)) if parent == above => {
            let shown = world.get(edge, POSE);
            let last = written.poses.insert(frame.link, pose.clone());
            if last.is_some() && last.as_ref() != shown {
                written.foreign.get_or_insert(frame.link);
            }
            if shown == Some(&pose) {
                return Ok(());
            }
            edge
        }
        Some(_) => return Ok(()),
        None => {
            written.poses.insert(frame.link, pose.clone());
            edit.add_edge(RT, above, own)?
        }
    };
    edit.set(edge, POSE, pose)
}

fn send(
    state: &mut WorldPublisher,
    stream: &mut WorldStreamPublisher,
    message: &Message,
) -> Result<(), SendError> {
    let topic = match place(message) {
        (Interface::World, at) => state.rc_topic(at),
        (Interface::WorldStream, at) => stream.rc_topic(at),
    };
    topic.map_or(Ok(()), |topic| {
        topic.publish_with(|writer| message.encode(writer))
    })
}

#[cfg(test)]
mod tests {
    use super::{Frame, Written, write};
    use property_graph::{Graph, Time, Value};
    use rc_robot::State;
    use std::path::Path;

    /// Two components that move one frame are told apart from one that moves it alone.
    #[test]
    fn a_frame_that_another_component_moves_is_noticed() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let robot = crate::robot::read(&here.join("../../kinematics/examples/arm.urdf"));
        let robot = robot.expect("a robot").robot;
        let chain = |link: usize| robot.bodies[link].joint.as_ref();
        let (link, above) = (0..robot.bodies.len())
            .find_map(|link| Some((link, chain(link)?.parent)))
            .expect("a joint");
        let frame = Frame { link, above };
        let schema = graph_language::builtin("geometry.gdsl").expect("a domain");
        let graph = Graph::new(schema.into(), 1);
        let mut written = Written::default();
        let mut put = |position: f64| {
            let state = State::still(vec![position; robot.coordinates.len()]);
            let put = graph.change(Time::ZERO, |edit| {
                write(edit, &robot, &frame, &state, &mut written)
            });
            put.expect("a frame");
            written.foreign
        };
        for position in [0.1, 0.2, 0.2, 0.3] {
            assert_eq!(put(position), None);
        }
        let moved = graph.change(Time::ZERO, |edit| {
            let edge = edit.snapshot().edges().next().expect("an edge").edge_id();
            edit.set(edge, "pose", Value::from([9.0; 6].as_slice()))
        });
        moved.expect("a pose");
        assert_eq!(put(0.4), Some(link));
    }
}
